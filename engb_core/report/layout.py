# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A self-contained HTML page: headings, prose, tables, figures, folded details, one style.

Plain text given to any method is escaped; markup must be `Html`. The finished page loads nothing:
plotly.js, style and script are inside it, and a content security policy with their digests keeps
everything else from running.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
import hashlib
import math
import os
from pathlib import Path
import tempfile

from engb_core.report.figures import Figure, POINTS
from engb_core.report.render.backends import BACKENDS, best_backend, render
from engb_core.report.style import SCRIPT, style_sheet
from engb_core.report.text import escape, Html, join

__all__ = ['Column', 'MAIN_POINTS', 'Page', 'bar', 'folded_points', 'paragraph', 'write_text']


# Points of each curve of a page's main figures, and of all curves of its folded ones together:
# the page without plotly.js stays well under 1.5 MB.
MAIN_POINTS, FOLDED_POINTS = 1600, 60000

_NO_FIGURES = Html(
    '<p class="call">Figures need plotly (to zoom) or matplotlib (still pictures): '
    '<code>pip install plotly</code>, then run the command again. Until then this page gives '
    'their numbers as tables.</p>')


class Column:
    """A table's column: its heading; `number` sets it flush right, `kind` is a CSS class."""

    def __init__(self, heading: str, *, number: bool = False, kind: str = '') -> None:
        self.heading = heading
        self.kind = kind or ('n' if number else '')


class Page:
    """Collects a page's content in reading order; `html` and `write` finish it.

    Args:
        title: what the browser shows.
        backend: 'plotly', 'matplotlib' or 'table'; None takes the best that is installed, and the
            page says what a better one would need.
    """

    def __init__(self, title: str, *, backend: str | None = None) -> None:
        self.title = title
        self.backend = best_backend() if backend is None else backend
        self._chosen = backend is not None
        if self.backend not in BACKENDS:
            raise ValueError(f'backend is {backend!r}; it must be one of {", ".join(BACKENDS)}')
        self._parts: list[Html] = []
        self._figures = 0
        self._open = 0

    def add(self, content: Html | str) -> None:
        """Add markup, or text (which is escaped)."""
        self._parts.append(escape(content))

    def header(self, eyebrow: Html | str, headline: str, lead: Iterable[Html | str] = (),
               *, tone: str = 'info', key: Iterable[tuple[str, str, str]] = ()) -> None:
        """Add the top of the page: the message as <h1>, the lead, and the key figures.

        Args:
            eyebrow: a small line above the headline.
            headline: the page's message, a sentence.
            lead: paragraphs that follow it.
            tone: 'good', 'warn' or 'info'; the colour of the rule beside it.
            key: (name, figure, remark) of each key figure.
        """
        paragraphs = [paragraph(text, 'lead') for text in lead]
        figures = join(Html(f'<div><dt>{escape(name)}</dt><dd>{escape(figure)}'
                            f'<small>{escape(remark)}</small></dd></div>')
                       for name, figure, remark in key)
        self.add(Html(f'<header class="verdict tone-{escape(tone)}">'
                      f'<p class="eyebrow">{escape(eyebrow)}</p><h1>{escape(headline)}</h1>'
                      f'{join(paragraphs)}</header>'
                      + (f'<dl class="key">{figures}</dl>' if figures else '')))

    def section(self, heading: str, *, kind: str = '') -> None:
        """Begin a section; it lasts until the next one.

        `kind` is a CSS class; 'folded' leaves the heading out on paper where all is folded.
        """
        self.add(Html(f'<h2{_class(kind)}>{escape(heading)}</h2>'))

    def subsection(self, heading: str) -> None:
        """Begin a part of a section."""
        self.add(Html(f'<h3>{escape(heading)}</h3>'))

    def text(self, *content: Html | str, kind: str = '') -> None:
        """Add paragraphs; `kind` is a CSS class ('muted', 'facts', 'caption')."""
        for item in content:
            self.add(paragraph(item, kind))

    def call(self, *content: Html | str) -> None:
        """Add paragraphs in a quiet box that asks for attention."""
        self.add(Html(f'<div class="call">{join(paragraph(item) for item in content)}</div>'))

    def notes(self, items: Iterable[Html | str]) -> None:
        """Add a list."""
        self.add(Html('<ul class="notes">' + join(Html(f'<li>{escape(item)}</li>')
                                                  for item in items) + '</ul>'))

    def table(self, columns: Sequence[Column], rows: Iterable[Sequence[Html | str]], *,
              caption: str = '', chosen: Iterable[int] = (), kind: str = 'stack') -> None:
        """Add a table; each row's first cell is its heading, rows in `chosen` are set in bold.

        `kind` is a CSS class: 'stack' turns rows into blocks where the screen is narrow,
        'compact' keeps columns together instead of over the full width.
        """
        marked = set(chosen)
        head = join(Html(f'<th scope="col"{_class(column.kind)}>{escape(column.heading)}</th>')
                    for column in columns)
        body = []
        for index, row in enumerate(rows):
            cells = [Html(f'<th scope="row">{escape(row[0])}</th>')]
            cells += [Html(f'<td{_class(column.kind)} data-label="{escape(column.heading)}">'
                           f'{escape(value)}</td>')
                      for column, value in zip(columns[1:], row[1:], strict=True)]
            row_kind = ' class="chosen"' if index in marked else ''
            body.append(Html(f'<tr{row_kind}>{join(cells)}</tr>'))
        note = paragraph(caption, 'caption') if caption else ''
        self.add(Html(f'<div class="scroll"><table{_class(kind)}><thead><tr>{head}</tr></thead>'
                      f'<tbody>{join(body)}</tbody></table>{note}</div>'))

    def shares(self, items: Iterable[tuple[str, float, str]], *, colour: str = 'after') -> None:
        """Add a bar chart made of text and boxes: (label, share 0…1, what stands at its end)."""
        rows = join(Html(f'<li><span class="what">{escape(label)}</span>{bar(share, colour)}'
                         f'<span class="n">{escape(end)}</span></li>')
                    for label, share, end in items)
        self.add(Html(f'<ul class="shares">{rows}</ul>'))

    def figure(self, figure: Figure, *, points: int = POINTS) -> None:
        """Add a figure, each of its curves thinned to `points`."""
        if not self._figures and self.backend == 'table':
            self.add(_NO_FIGURES)
        self._figures += 1
        self.add(render(figure, self.backend, f'figure-{self._figures}', points))

    def code(self, text: str, *, copy: bool = True) -> None:
        """Add preformatted text, with a button that copies it."""
        button = '<button type="button" class="copy">Copy</button>' if copy else ''
        self.add(Html(f'<div class="code"><pre tabindex="0">{escape(text)}</pre>{button}</div>'))

    def begin_details(self, summary: str, *, opened: bool = False) -> None:
        """Begin a part that is folded until the reader opens it."""
        self._open += 1
        self.add(Html(f'<details{" open" if opened else ""}><summary>{escape(summary)}</summary>'))

    def end_details(self) -> None:
        """End the folded part that was begun last."""
        if not self._open:
            raise ValueError('no details are open')
        self._open -= 1
        self.add(Html('</details>'))

    def footer(self, content: Html | str) -> None:
        """Add the last line."""
        self.add(Html(f'<footer>{escape(content)}</footer>'))

    def html(self) -> str:
        """Return the whole page."""
        if self._open:
            raise ValueError('details are still open')
        scripts = []
        if self.backend == 'plotly' and self._figures:
            from engb_core.report.render.plotly_figure import plotly_script
            scripts.append(plotly_script())
        scripts.append(SCRIPT)
        digests = ' '.join(f"'sha256-{_digest(script)}'" for script in scripts)
        policy = (f"default-src 'none'; script-src {digests}; style-src 'unsafe-inline'; "
                  "img-src data: blob:; base-uri 'none'; form-action 'none'")
        body = '\n'.join(self._parts)
        missing = self._missing()
        return (
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            '<meta name="color-scheme" content="light dark">\n'
            f'<title>{escape(self.title)}</title>\n<style>{style_sheet()}</style>\n</head>\n'
            f'<body>\n<main>\n{body}\n{missing}</main>\n'
            + ''.join(f'<script>{script}</script>\n' for script in scripts)
            + '</body>\n</html>\n')

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the page, whole or not at all."""
        write_text(path, self.html())

    def _missing(self) -> str:
        if not self._figures:
            return ''
        if self.backend == 'plotly':
            return ('<noscript><p class="call">The figures of this page need JavaScript, which is '
                    'switched off here. Nothing is loaded from the network.</p></noscript>\n')
        if self.backend == 'matplotlib' and not self._chosen:
            return ('<p class="caption">Figures that can be zoomed need plotly: '
                    '<code>pip install plotly</code>, then run the command again.</p>\n')
        return ''


def folded_points(curves: int) -> int:
    """Return the points for each of `curves` curves in folded figures."""
    return int(min(max(FOLDED_POINTS / max(curves, 1), 60), 700))


def paragraph(content: Html | str, kind: str = '') -> Html:
    """Return a paragraph; `kind` is a CSS class."""
    return Html(f'<p{_class(kind)}>{escape(content)}</p>')


def bar(share: float, colour: str = 'after', *, mark: float | None = None) -> Html:
    """Return a horizontal bar of `share` (0…1) of its box, with an optional mark across it.

    It is hidden from screen readers: the number must stand beside it as text.
    """
    width = _per_cent(share)
    tick = '' if mark is None else f'<u style="left:{_per_cent(mark):.1f}%"></u>'
    return Html(f'<span class="bar" aria-hidden="true"><i style="width:{width:.1f}%;'
                f'--fill:var(--{escape(colour)})"></i>{tick}</span>')


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file, whole or not at all."""
    path = Path(path)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f'.{path.name}.')
    try:
        with os.fdopen(handle, 'w', encoding='utf-8', newline='\n') as file:
            file.write(text)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _per_cent(share: float) -> float:
    return 100 * min(max(share, 0.0), 1.0) if math.isfinite(share) else 0.0


def _class(kind: str) -> str:
    return f' class="{escape(kind)}"' if kind else ''


def _digest(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode('utf-8')).digest()).decode()
