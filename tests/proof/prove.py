# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One proof from the draw to the page; `engb prove` calls this.

DIR holds cases/, truth/, results/ (one folder per case), proof.json (what was drawn, its digest),
and in the end scores.json, cases.jsonl, column.md (its column of the README's table) and
index.html. Cases of another hand stay where they are.
"""
from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import as_completed, Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from datetime import datetime, UTC
import json
from pathlib import Path
import re
import secrets
import shutil
import time

from engb_core.errors import InputError

from .baselines import BASELINES, NAMING, ORACLE, run_baseline, run_oracle
from .catalogue import known
from .frozen import FROZEN, frozen_rates
from .generate import DEFAULT_STRATA, generate, parse_strata
from .other_hand import cases_in, on_other_motion, other_truth
from .own_truth import truth_of
from .page import proof_page
from .readme_table import as_markdown, column_of
from .run import commits_in, run_tool, score_all
from .score import CaseScore, CaseTruth
from .sealing import digest_of
from .sparse import thresholding_by
from .summary import as_text
from .symbolic import symbolic_by
from .totals import summarise

__all__ = ['chosen', 'Proof', 'prove', 'prove_other', 'strict_failures']

_STRATA = tuple(DEFAULT_STRATA)
# A run that was stopped (Ctrl-C reaches it, too) is done again by the next start.
_STOPPED = re.compile(r'exit (130|143|-2|-15)\b')


@dataclass(frozen=True)
class Proof:
    """What to prove, and where; None where an earlier start in `out`, or chance, decides."""

    out: Path
    cases: int | None = None
    seed: int | None = None
    strata: str | None = None
    effects: str | None = None
    jobs: int = 1
    reuse: Path | None = None
    again: bool = False
    baselines: bool = False
    command: str = ''
    only: str | None = None
    frozen: bool = False
    brief: bool = False
    run: bool = True
    other_motion: bool = False


def prove(proof: Proof, progress: Callable[[str], None], say: Callable[[str], None]) -> dict:
    """Draw, seal, run, open, score, write; returns the summary.

    Raises:
        InputError: the folder holds another proof, or a truth that was changed.
    """
    begin = time.monotonic()
    home = proof.reuse or proof.out
    plan = _planned(proof, home)
    truth, results = home / 'truth', proof.out / 'results'
    folders, sealed = _drawn(plan, home, proof.jobs, progress)
    say(f'{len(folders)} cases, seed {plan["seed"]}')
    say(f'truth sealed: sha256 {sealed}')
    if proof.again:
        shutil.rmtree(results, ignore_errors=True)
        shutil.rmtree(proof.out / 'baselines', ignore_errors=True)
    names = list(BASELINES) if proof.baselines else []
    work = [(lambda c=c: run_tool(c, results / c.name), results / c.name) for c in folders]
    for case in folders:
        for name in names:
            at = proof.out / 'baselines' / name / case.name
            work.append((lambda n=name, c=case, at=at: run_baseline(n, c, at), at))
    if proof.run:
        _run_all(work, proof.jobs, progress)
    if digest_of(truth) != sealed:
        raise InputError(f'{truth}: the truth was changed while the tool ran; no score')
    if names:
        at = proof.out / 'baselines' / ORACLE[0]
        _run_all([(lambda c=c: run_oracle(c, truth / f'{c.name}.npz', at / c.name), at / c.name)
                  for c in folders], proof.jobs, progress)
    truths = [truth_of(c.name, truth / f'{c.name}.npz') for c in folders]
    scores = score_all(truths, results)
    summary = {
        'source': 'own', 'digest': sealed, 'seed': plan['seed'], 'strata': plan['strata'],
        **_told(proof, plan, begin), **summarise(scores)}
    if names:
        summary['baselines'] = _baselines(names, truths, proof.out)
        summary['thresholding'] = thresholding_by()
        summary['symbolic'] = symbolic_by()
    if plan.get('frozen'):
        summary['frozen'] = frozen_rates(scores)
    _write(proof.out, summary, scores)
    return summary


def chosen(cases: list[Path], only: str) -> list[Path]:
    """Return the cases that `--only` names, with or without the noughts before their numbers.

    Raises:
        InputError: there is no such case.
    """
    names = {case: case.name.partition('_')[2] for case in cases}
    kept = set()
    for wanted in only.split(','):
        found = [case for case, name in names.items() if name == wanted or (
            name.isdigit() and wanted.isdigit() and int(name) == int(wanted))]
        if not found:
            raise InputError(f'--only {wanted}: {cases[0].parent} holds no case_{wanted}')
        kept.update(found)
    return [case for case in cases if case in kept]


def prove_other(proof: Proof, folder: Path, progress: Callable[[str], None],
                say: Callable[[str], None]) -> dict:
    """Run and score the tool on a folder of cases from another hand; returns the summary.

    Raises:
        InputError: there are no such cases, one is damaged, or `out` holds something else.
    """
    begin = time.monotonic()
    cases = cases_in(folder)
    if proof.only:
        cases = chosen(cases, proof.only)
    note = proof.out / 'proof.json'
    # Kept as text: of the same folder under another name nothing is run again by mistake.
    plan = {'cases_from': str(folder.resolve()), 'command': proof.command,
            **({'other_motion': True} if proof.other_motion else {})}
    if note.exists():
        former = json.loads(note.read_text('utf8'))
        if any(former.get(key) != plan.get(key) for key in ('cases_from', 'other_motion')):
            raise InputError(f'--out {proof.out}: holds the proof of other cases; name another')
    elif proof.out.exists() and any(proof.out.iterdir()):
        raise InputError(f'--out {proof.out}: holds something else; name a new folder')
    # Damage is told before an hour is spent, and the truth is read again once the tool is done.
    for case in cases:
        progress(f'checking {case.name}')
        other_truth(case)
    proof.out.mkdir(parents=True, exist_ok=True)
    if not note.exists() or proof.run:
        note.write_text(json.dumps(plan, indent=1), 'utf8')
    plan = json.loads(note.read_text('utf8'))
    results = proof.out / 'results'
    if proof.again:
        for case in cases:
            shutil.rmtree(results / case.name, ignore_errors=True)
    say(f'{len(cases)} cases from {folder}')
    if proof.run:
        _run_all([(lambda c=c: run_tool(c, results / c.name, other_motion=proof.other_motion),
                   results / c.name) for c in cases], proof.jobs, progress)
    truths = [other_truth(case) for case in cases]
    if proof.other_motion:
        truths = [on_other_motion(truth) for truth in truths]
    scores = score_all(truths, results)
    summary = {'source': 'other', 'digest': None, 'seed': None, 'strata': None,
               **_told(proof, plan, begin), **summarise(scores)}
    _write(proof.out, summary, scores)
    return summary


def _told(proof: Proof, plan: dict, begin: float) -> dict:
    return {'date': datetime.now(UTC).isoformat(timespec='seconds'),
            'command': plan.get('command') or proof.command,
            'wall_seconds': time.monotonic() - begin,
            'commits': commits_in(proof.out / 'results')}


def strict_failures(summary: dict) -> list[str]:
    """What no proof may hold, whatever was drawn: a crash, a claim on a clean recording."""
    found = [f'{one["case"]} failed: {one["failure"]}' for one in summary['failures']]
    found += [f'{one["case"]}: false alarm: {", ".join(name for name, _ in one["claims"])}'
              for one in summary['misses'] if not one['hidden']]
    return found


def _planned(proof: Proof, home: Path) -> dict:
    """What is drawn, or was by an earlier start; kept in proof.json."""
    path = home / 'proof.json'
    wanted = {'cases': proof.cases, 'seed': proof.seed, 'strata': proof.strata,
              'effects': proof.effects}
    if path.exists():
        plan = _read(path)
        for name, value in wanted.items():
            if value is not None and value != plan[name]:
                raise InputError(f'{home} holds a proof with --{name} {plan[name]}; to go on with '
                                 'it leave that away, or name another --out')
        return plan
    if proof.reuse is not None:
        if not (home / 'cases').is_dir() or not (home / 'truth').is_dir():
            raise InputError(f'--reuse {home}: holds no cases; name the --out of an earlier proof')
        return {'cases': len(list((home / 'truth').glob('case_*.npz'))), 'seed': None,
                'strata': None, 'effects': None, 'digest': digest_of(home / 'truth')}
    if home.exists() and any(home.iterdir()):
        raise InputError(f'--out {home}: holds something else; name a new folder')
    if proof.frozen:
        proof = replace(proof, **FROZEN)
    seed = secrets.randbits(64) if proof.seed is None else proof.seed
    plan = {'brief': proof.frozen or proof.brief, 'frozen': proof.frozen,
            'cases': proof.cases or 100, 'seed': seed, 'command': proof.command,
            'strata': _checked(proof.strata or ''), 'effects': _known(proof.effects or ''),
            'digest': None}
    home.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(plan, indent=1), 'utf8')
    return plan


def _read(path: Path) -> dict:
    try:
        plan = json.loads(path.read_text('utf8'))
        assert {'cases', 'seed', 'strata', 'effects', 'digest'} <= set(plan)
    except (ValueError, AssertionError, TypeError) as error:
        raise InputError(f'{path}: is damaged') from error
    return plan


def _checked(strata: str) -> str:
    try:
        shares = parse_strata(strata)
    except ValueError as error:
        raise InputError(f'--strata {strata}: write it like clean=1,strong=2') from error
    wrong = [name for name in shares if name not in _STRATA]
    if wrong:
        raise InputError(f'--strata: no stratum {wrong[0]!r}; there are {", ".join(_STRATA)}')
    if not all(0.0 <= share < 1e6 for share in shares.values()) or not sum(shares.values()):
        raise InputError(f'--strata {strata}: shares must be numbers above 0')
    return strata


def _known(effects: str) -> str:
    names = [name for name in known() if not name.startswith('outside_')]
    wrong = [name for name in effects.split(',') if name and name not in names]
    if wrong:
        raise InputError(f'--effects: no effect {wrong[0]!r}; there are {", ".join(names)}')
    return effects


def _drawn(plan: dict, home: Path, jobs: int, progress: Callable[[str], None]
           ) -> tuple[list[Path], str]:
    """Draw what is still to draw; returns the folders of the cases, and the truth's digest."""
    cases, truth = home / 'cases', home / 'truth'
    if plan['digest'] is None:
        effects = plan['effects'].split(',') if plan['effects'] else None
        plan['digest'] = generate(plan['cases'], plan['seed'], cases, truth,
                                  parse_strata(plan['strata']), jobs, effects,
                                  progress=lambda text: progress(f'drawing {text}'),
                                  brief=plan.get('brief', False))
        (home / 'proof.json').write_text(json.dumps(plan, indent=1), 'utf8')
    sealed = digest_of(truth)
    if sealed != plan['digest']:
        raise InputError(f'{truth}: is not what was sealed (sha256 {plan["digest"]})')
    return sorted(p for p in cases.glob('case_*') if (truth / f'{p.name}.npz').exists()), sealed


def _run_all(work: list[tuple[Callable[[], str | None], Path]], jobs: int,
             progress: Callable[[str], None]) -> None:
    todo = [(job, at) for job, at in work if not (at / 'run.json').exists()]
    begin = time.monotonic()
    pool = ThreadPoolExecutor(jobs)
    waiting: dict[Future, Path] = {}
    try:
        for job, at in todo:
            waiting[pool.submit(job)] = at
        for count, done in enumerate(as_completed(waiting), 1):
            failure = done.result()
            at = waiting[done]
            if failure and _STOPPED.search(failure):
                raise KeyboardInterrupt
            left = (time.monotonic() - begin) * (len(todo) - count) / count / 60.0
            progress(f'{count}/{len(todo)} {at.parent.name} {at.name}: {failure or "done"}; '
                     f'about {left:.0f} min left')
    except BaseException:
        pool.shutdown(wait=True, cancel_futures=True)
        for done, at in waiting.items():
            if not done.cancelled() and done.exception() is None \
                    and _STOPPED.search(str(done.result())):
                (at / 'run.json').unlink(missing_ok=True)
        raise
    pool.shutdown()


def _baselines(names: list[str], truths: list[CaseTruth], out: Path) -> list[dict]:
    found = []
    for name, label in [*((name, BASELINES[name][0]) for name in names), ORACLE]:
        summary = summarise(score_all(truths, out / 'baselines' / name))
        keys = ('named_first', 'pairs_both', 'false_alarms', 'confident_wrong_outside',
                'held_out_removed', 'harm', 'seconds', 'failures')
        found.append({'name': name, 'label': label, 'gives_names': name in NAMING,
                      **{key: summary[key] for key in keys}})
    return found


def _write(out: Path, summary: dict, scores: list[CaseScore]) -> None:
    out.mkdir(parents=True, exist_ok=True)
    (out / 'scores.json').write_text(json.dumps(summary, indent=1), 'utf8')
    rows = [json.dumps(asdict(score)) for score in scores]
    (out / 'cases.jsonl').write_text('\n'.join(rows) + '\n', 'utf8')
    (out / 'scores.txt').write_text(as_text(summary) + '\n', 'utf8')
    (out / 'column.md').write_text(as_markdown([column_of(summary)]) + '\n', 'utf8')
    proof_page(summary, scores).write(out / 'index.html')
