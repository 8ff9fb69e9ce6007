# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How every page of engb looks: colours in light and dark, typography, print; and its script."""

from __future__ import annotations

__all__ = ['DARK', 'LIGHT', 'SCRIPT', 'style_sheet']

# Roles and their colours. The data colours are neighbours of Okabe and Ito's set, which stays
# apart in all common kinds of colour blindness, darkened or lightened to be read as text too.
LIGHT = {
    'paper': '#fdfdfc', 'panel': '#f4f5f3', 'ink': '#1c2126', 'muted': '#5a646e',
    'rule': '#cdd2d6', 'grid': '#e8eaeb', 'recorded': '#343b42', 'before': '#c4500b',
    'after': '#0a68ad', 'noise': '#7f8992', 'mark': '#e3a008', 'good': '#0b7a5c',
    'third': '#a2437c',
}
DARK = {
    'paper': '#15181b', 'panel': '#1e2226', 'ink': '#e5e8ea', 'muted': '#9ca6ae',
    'rule': '#3c444b', 'grid': '#292e33', 'recorded': '#d3d8dc', 'before': '#f28c4c',
    'after': '#5cb2f2', 'noise': '#87919a', 'mark': '#d7a31c', 'good': '#41c19c',
    'third': '#dd93bf',
}


def style_sheet() -> str:
    """Return the page's CSS."""
    light = ''.join(f'--{role}:{colour};' for role, colour in LIGHT.items())
    dark = ''.join(f'--{role}:{colour};' for role, colour in DARK.items())
    return (f':root{{color-scheme:light;{light}}}\n'
            '@media (prefers-color-scheme:dark){:root:not([data-print]){'
            f'color-scheme:dark;{dark}}}}}\n{_CSS}')


_CSS = '''
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%;font-size:16.5px}
body{margin:0;background:var(--paper);color:var(--ink);line-height:1.55;
  font-family:system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue","Liberation Sans",
  Arial,sans-serif;font-variant-numeric:tabular-nums;overflow-wrap:break-word}
main{max-width:58rem;margin:0 auto;padding:2.6rem 1.5rem 4rem}
h1,h2,h3{line-height:1.2;text-wrap:balance;font-weight:650;letter-spacing:-.012em}
h1{font-size:2.05rem;margin:.35rem 0 .9rem;max-width:30ch;overflow-wrap:anywhere}
h2{font-size:1.32rem;margin:3.1rem 0 .7rem;padding-top:.95rem;border-top:1px solid var(--rule)}
h3{font-size:1.06rem;margin:2rem 0 .35rem}
p,ul.notes{margin:.55rem 0;max-width:43rem}
p.lead{font-size:1.12rem;line-height:1.5}
.eyebrow{color:var(--muted);font-size:.86rem;margin:0;overflow-wrap:anywhere;max-width:none}
.eyebrow b{font-weight:650;color:var(--tone,var(--ink))}
.muted,.caption,.alt{color:var(--muted)}
.caption{font-size:.88rem;margin:.4rem 0 0}
.tone-good{--tone:var(--good)}.tone-warn{--tone:var(--before)}.tone-info{--tone:var(--after)}
header.verdict{border-left:5px solid var(--tone);padding-left:1.3rem}
dl.key{display:grid;grid-template-columns:repeat(auto-fit,minmax(10.5rem,1fr));gap:1.1rem 1.6rem;
  margin:1.7rem 0 0}
dl.key div{border-top:1px solid var(--rule);padding-top:.45rem}
dl.key dt{font-size:.82rem;color:var(--muted);line-height:1.3}
dl.key dd{margin:.1rem 0 0;font-size:1.22rem;font-weight:600;line-height:1.25}
dl.key dd small{display:block;font-size:.8rem;font-weight:400;color:var(--muted);line-height:1.35}
figure.plot{margin:1.6rem 0 2rem;break-inside:avoid}
figcaption{display:flex;flex-wrap:wrap;gap:.2rem 1.2rem;align-items:baseline;
  justify-content:space-between;margin-bottom:.15rem}
.figure-title{font-weight:600;font-size:.98rem;overflow-wrap:anywhere}
.legend{display:flex;flex-wrap:wrap;gap:.1rem .95rem;font-size:.84rem}
.legend span,.legend button{display:inline-flex;align-items:center;gap:.35rem;color:var(--ink)}
.legend button{font:inherit;border:0;background:none;padding:.15rem 0;cursor:pointer}
.legend button[aria-pressed=false]{opacity:.4;text-decoration:line-through}
.legend svg{flex:none}
.drawing{width:100%}
.static{overflow-x:auto}
.static svg{display:block;width:100%;min-width:36rem;height:auto}
.static svg text{font-family:inherit!important}
.scroll{overflow-x:auto;margin:.8rem 0 1.1rem}
table{border-collapse:collapse;font-size:.9rem;line-height:1.4;width:100%}
caption{text-align:left;color:var(--muted);font-size:.84rem;padding:.2rem 0}
th,td{text-align:left;padding:.4rem .9rem .4rem 0;border-bottom:1px solid var(--grid);
  vertical-align:top}
thead th{font-weight:500;color:var(--muted);font-size:.82rem;border-color:var(--rule);
  vertical-align:bottom;line-height:1.25}
th:last-child,td:last-child{padding-right:0}
tbody th{font-weight:500;overflow-wrap:anywhere;min-width:10.5rem}
table.compact{width:auto}
table.compact th,table.compact td{padding-right:2.2rem}
td.n,th.n{text-align:right;white-space:nowrap}
td.wrap{overflow-wrap:anywhere;min-width:11rem}
tr.chosen th,tr.chosen td{font-weight:650}
table.numbers td{text-align:right;font-size:.78rem;padding-right:.6rem;color:var(--muted)}
table.numbers b{color:var(--ink);font-weight:500}
.bar{display:block;position:relative;height:.62rem;min-width:6rem;background:var(--grid);
  border-radius:2px}
.bar+.bar{margin-top:.2rem}
.bar i{position:absolute;left:0;top:0;bottom:0;border-radius:2px;min-width:2px;
  background:var(--fill,var(--after))}
.bar u{position:absolute;top:-.16rem;bottom:-.16rem;width:0;border-left:2px solid var(--ink)}
td.bars{width:24%;min-width:7rem;padding-top:.62rem}
.shares{display:grid;grid-template-columns:minmax(9rem,max-content) 1fr 3.4rem;gap:.42rem 1rem;
  align-items:center;margin:.9rem 0 1.2rem;padding:0;list-style:none;font-size:.92rem;
  max-width:46rem}
.shares li{display:contents}
.shares .bar{height:.8rem}
.shares .n{text-align:right}
.call{background:var(--panel);border-radius:6px;padding:.9rem 1.15rem;margin:1rem 0;
  break-inside:avoid}
.call p{margin:.3rem 0}
.facts{font-size:.92rem;color:var(--muted);margin:.2rem 0 .5rem}
.facts b{color:var(--ink);font-weight:600}
details{border-top:1px solid var(--grid);padding:.15rem 0}
details.minor{border:0}
details:last-of-type{border-bottom:1px solid var(--grid)}
details.minor:last-of-type{border:0}
summary{cursor:pointer;padding:.5rem 0;font-weight:550}
details.minor summary{font-weight:400;font-size:.88rem;color:var(--muted)}
details[open]>summary{margin-bottom:.3rem}
.code{position:relative;margin:.6rem 0 1rem}
pre{margin:0;background:var(--panel);border-radius:6px;padding:.85rem 1rem;overflow:auto;
  max-height:32rem;white-space:pre-wrap;overflow-wrap:anywhere;
  font:.82rem/1.5 ui-monospace,"Cascadia Mono",Menlo,Consolas,"Liberation Mono",monospace}
button.copy{position:absolute;top:.5rem;right:.5rem;font:inherit;font-size:.78rem;
  color:var(--ink);background:var(--paper);border:1px solid var(--rule);border-radius:4px;
  padding:.15rem .6rem;cursor:pointer}
:focus-visible{outline:2px solid var(--after);outline-offset:2px}
footer{margin-top:3rem;color:var(--muted);font-size:.84rem}
@media (max-width:38rem){
  html{font-size:16px}
  main{padding:1.3rem 1rem 3rem}
  h1{font-size:1.6rem}
  header.verdict{padding-left:.9rem;border-left-width:4px}
  dl.key{grid-template-columns:1fr 1fr;gap:.9rem 1rem}
  dl.key dd{font-size:1.16rem}
  .shares{grid-template-columns:1fr 3.2rem;gap:.15rem .7rem}
  .shares .what{grid-column:1/-1;margin-top:.35rem}
  th,td{padding-right:.7rem}
  table.stack,table.stack tbody{display:block}
  table.stack thead{position:absolute;clip-path:inset(50%);width:1px;height:1px;overflow:hidden}
  table.stack tr{display:block;padding:.45rem 0;border-bottom:1px solid var(--grid)}
  table.stack th,table.stack td{display:flex;justify-content:space-between;gap:1.2rem;border:0;
    padding:.12rem 0;width:auto;min-width:0;white-space:normal;text-align:right}
  table.stack th{text-align:left;font-weight:600}
  table.stack td::before{content:attr(data-label);color:var(--muted);text-align:left;flex:none}
  table.stack td:empty{display:none}
  table.stack td.bars{display:block;padding:.3rem 0}
}
/* The width of A4 within its margins: figures are drawn anew for it just before printing. */
html[data-print] main{width:650px;max-width:none;margin:0;padding:0}
@media print{
  html{font-size:9.4pt}
  body{background:none}
  main{max-width:none;padding:0}
  h1{font-size:1.6rem;max-width:none}
  h2{margin-top:1.4rem;break-after:avoid}
  figure.plot{margin:.8rem 0 .9rem}
  h3,figcaption,h2+p,.code:has(+figure){break-after:avoid}
  p,li{orphans:3;widows:3}
  ul.notes,footer{break-before:avoid}
  tr,.shares,dl.key{break-inside:avoid}
  button.copy,.modebar,details:not([open]),h2.folded:not(:has(~details[open])){
    display:none!important}
  .scroll,.static{overflow:visible}
  .static svg{min-width:0}
  th,td{padding:.25rem .6rem .25rem 0}
  tbody th{min-width:7rem}
  td.bars{min-width:5rem;width:18%}
  dl.key{grid-template-columns:repeat(4,1fr);gap:1rem}
  dl.key dd{font-size:1.05rem}
  pre{max-height:none}
  .bar,.bar i,.call,pre{-webkit-print-color-adjust:exact;print-color-adjust:exact}
  @page{margin:13mm 16mm}
}
'''

# Draws the figures (again when the colour scheme changes, or for paper), toggles series, copies.
SCRIPT = r'''(() => {
'use strict';
const root = document.documentElement;
const plots = new Map();

function colour(token) {
  const [role, alpha] = token.slice(1).split('@');
  const hex = getComputedStyle(root).getPropertyValue('--' + role).trim();
  if (!alpha) return hex;
  const part = i => parseInt(hex.slice(i, i + 2), 16);
  return `rgba(${part(1)},${part(3)},${part(5)},${alpha})`;
}
function dye(value) {
  if (typeof value === 'string') return value[0] === '\x01' ? colour(value) : value;
  if (Array.isArray(value))
    return value.length && value[0] && typeof value[0] === 'object' ? value.map(dye) : value;
  if (value && typeof value === 'object')
    return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, dye(item)]));
  return value;
}
// Newer plotly offers to upload a chart to its cloud: a recording is nobody else's business.
const config = {displaylogo: false, displayModeBar: 'hover',
  showSendToCloud: false, plotlyServerURL: '', typesetMath: false,
  modeBarButtonsToRemove: ['select2d', 'lasso2d', 'autoScale2d', 'sendChartToCloud',
    'sendDataToCloud'],
  toImageButtonOptions: {format: 'svg', filename: 'engb'}};

function draw(id) {
  const plot = plots.get(id);
  if (!plot.box.offsetWidth || plot.box.closest('details:not([open])')) return;
  const layout = dye(plot.spec.layout);
  layout.font.family = getComputedStyle(document.body).fontFamily;
  layout.width = plot.box.clientWidth;
  if (layout.width < 520) {
    layout.margin.l = 44;
    layout.xaxis.nticks = 6;
    layout.margin.t += 24;   // else the toolbar would lie on the first panel's title
    layout.height += 24;
  }
  if (root.hasAttribute('data-print')) layout.height = Math.round(layout.height * 0.8);
  plot.box.style.height = `${layout.height}px`;
  // On a touch screen a drag scrolls the page; zooming stays in the toolbar.
  layout.dragmode = matchMedia('(pointer: coarse)').matches ? false : 'zoom';
  if (plot.drawn) Plotly.react(plot.box, dye(plot.spec.data), layout, config);
  else Plotly.newPlot(plot.box, dye(plot.spec.data), layout, config);
  plot.drawn = true;
}
const drawAll = () => { for (const id of plots.keys()) draw(id); };

for (const block of document.querySelectorAll('script[data-plot]')) {
  const box = block.previousElementSibling;
  plots.set(block.dataset.plot, {box, spec: JSON.parse(block.textContent), drawn: false});
}
if (plots.size && window.Plotly) {
  drawAll();
  document.addEventListener('toggle', drawAll, true);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', drawAll);
  const paper = on => {
    root.toggleAttribute('data-print', on);
    drawAll();
  };
  let waiting = 0;
  addEventListener('resize', () => {
    clearTimeout(waiting);
    waiting = setTimeout(drawAll, 120);
  });
  addEventListener('beforeprint', () => paper(true));
  addEventListener('afterprint', () => paper(false));
}
document.addEventListener('click', event => {
  const button = event.target.closest('button');
  if (!button) return;
  if (button.dataset.series !== undefined) {
    const plot = plots.get(button.dataset.figure);
    const show = button.getAttribute('aria-pressed') !== 'true';
    button.setAttribute('aria-pressed', String(show));
    for (const trace of plot.spec.data)
      if (trace.group === button.dataset.series) trace.visible = show;
    draw(button.dataset.figure);
  } else if (button.classList.contains('copy')) {
    const source = button.parentElement.querySelector('pre');
    const say = text => {
      button.textContent = text;
      setTimeout(() => { button.textContent = 'Copy'; }, 1600);
    };
    const select = () => {
      getSelection().selectAllChildren(source);
      say(document.execCommand('copy') ? 'Copied' : 'Selected: press Ctrl+C');
    };
    if (navigator.clipboard)
      navigator.clipboard.writeText(source.textContent).then(() => say('Copied'), select);
    else select();
  }
});
})();
'''
