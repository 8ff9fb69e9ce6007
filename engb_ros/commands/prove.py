# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Measure the diagnosis on cases whose truth is sealed: concealed effects, honest scores.

Draws brakes at random, conceals effects in them, seals the truth and prints its digest; runs
`engb diagnose` as separate processes on copies that hold only recording and nominal model; opens
the truth, checks the digest, scores. Writes into DIR: index.html (start here), scores.json,
cases.jsonl, column.md, and results/ with the report of every case. Started again with the same
DIR it goes on where it stopped. Without --seed the cases come from the operating system's entropy.

examples:
  engb prove --cases 100 --jobs 2 --out out/proof
  engb prove --cases 300 --strata clean --out out/null
  engb prove --reuse out/proof --out out/again
  engb prove --frozen --jobs 2 --out out/frozen
  engb prove --cases-from FOLDER --jobs 2 --out out/other
  engb prove --real FOLDER --out out/real
  engb prove --table out/proof out/other out/real
  engb prove --calibrate out/a out/b --check out/other --out out/cause_sets.json
  engb prove --open bags/brake_1/truth.sealed --diagnosis result/diagnosis.json

With --cases-from the cases are those of another hand: a folder of case_…, each with train…, test,
nominal.yaml, truth.json and truth.npz; they are scored by the same tables.

With --real no case is drawn: of the best model of each machine one term at a time is taken out,
with --pairs two as well, to see whether the tool names just that; index.html also holds the
held-out ladder, how the model's numbers lie apart over the recordings, how the model of one unit
does on another (a set whose file set.yaml says machine_of: FOLDER), and what an expert expects of
the machines that are listed.

With --calibrate nothing is run: the calibration of the sets of causes is made of the cases that
earlier proofs drew, and written to the file --out (as engb_core/diagnose/cause_sets.json was), and
what the sets would hold there, and in the folders of --check, is printed.

With --table nothing is run: what earlier proofs left in these folders is printed side by side as
Markdown, a column per folder (column.md in each holds its own).
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import json
from pathlib import Path
import shlex
import sys
from types import ModuleType
from typing import Any

from engb_core.errors import InputError
from engb_core.text.printable import printable
from engb_ros.commands.common import add_progress, Progress

__all__ = ['add_arguments', 'run']

_NOT_STRICT = 1
_MOST_CASES = 9999


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('--out', metavar='DIR', help='where cases and scores go')
    parser.add_argument('--cases', type=int, metavar='N', help='how many to draw (default: 100)')
    parser.add_argument('--seed', type=int, metavar='S',
                        help='draw these cases again (default: new ones)')
    parser.add_argument('--strata', metavar='NAME=SHARE,…', help='what to draw of clean, strong, '
                        'subtle, pair, triple, described and undescribed (outside the library), '
                        'e.g. clean=1,strong=2')
    parser.add_argument('--effects', metavar='NAME,…', help='conceal only these')
    parser.add_argument('--jobs', type=int, default=1, metavar='J',
                        help='cases at a time (default: %(default)s)')
    parser.add_argument('--reuse', metavar='DIR',
                        help='run the tool on the cases of an earlier proof')
    parser.add_argument('--cases-from', metavar='DIR',
                        help='run and score the cases of another hand that DIR holds')
    parser.add_argument('--only', metavar='N,…', help='with --cases-from: only case_N, …')
    parser.add_argument('--other-motion', action='store_true', help="with --cases-from: diagnose "
                        "each case's test recording in place of the training ones, on which "
                        'names alone are scored')
    parser.add_argument('--again', action='store_true', help='run the tool anew on all cases')
    parser.add_argument('--score', action='store_true', help='run nothing more: score what an '
                        'earlier start, stopped or not, has run')
    parser.add_argument('--baselines', action='store_true',
                        help='score plain methods on the same cases, too')
    parser.add_argument('--strict', action='store_true', help='end with status 1 after a crash or '
                        'a false alarm on a clean recording')
    parser.add_argument('--brief', action='store_true',
                        help='draw short recordings (15 s at 250 or 500 Hz)')
    parser.add_argument('--frozen', action='store_true', help='draw the frozen list of short '
                        'cases of continuous integration; status 1 where a rate fell '
                        'below its bound')
    parser.add_argument('--real', metavar='DIR', help='take one term at a time out of the model '
                        'of a real machine; DIR holds sets of nominal.yaml, train*, holdout*')
    parser.add_argument('--pairs', action='store_true',
                        help='with --real: take out two terms at a time as well')
    parser.add_argument('--table', metavar='DIR', nargs='+', help='print the scores of earlier '
                        'proofs side by side as a table in Markdown')
    parser.add_argument('--calibrate', metavar='DIR', nargs='+', help='write the calibration of '
                        'the sets of causes, from the cases of earlier proofs, to the file --out')
    parser.add_argument('--check', metavar='DIR', nargs='+', default=[],
                        help='with --calibrate: proofs on other cases, to check it on')
    parser.add_argument('--open', metavar='FILE.sealed', help='show a sealed truth')
    parser.add_argument('--diagnosis', metavar='diagnosis.json',
                        help='with --open: what the tool said')
    add_progress(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the command."""
    if arguments.open:
        _open(arguments.open, arguments.diagnosis)
        return 0
    if arguments.table:
        print(_proof('readme_table').table([Path(folder) for folder in arguments.table]))
        return 0
    if arguments.calibrate:
        if not arguments.out:
            raise InputError('--calibrate: --out FILE is needed: where the calibration goes')
        if Path(arguments.out).is_dir():
            raise InputError(f'--out {arguments.out}: is a folder; name a file')
        from engb_core.diagnose.constants import SET_LEVEL
        print(_proof('cause_sets').calibrate(
            [Path(folder) for folder in arguments.calibrate],
            [Path(folder) for folder in arguments.check], Path(arguments.out), SET_LEVEL))
        return 0
    if arguments.check:
        raise InputError('--check belongs to --calibrate')
    if arguments.diagnosis:
        raise InputError('--diagnosis belongs to --open FILE.sealed')
    _check(arguments)
    if arguments.real:
        _real(arguments)
        return 0
    proof = _proof('prove')
    job = proof.Proof(
        Path(arguments.out), arguments.cases, arguments.seed, arguments.strata,
        arguments.effects, arguments.jobs, Path(arguments.reuse) if arguments.reuse else None,
        arguments.again, arguments.baselines, shlex.join(['engb', *sys.argv[1:]]),
        arguments.only, arguments.frozen, arguments.brief, not arguments.score,
        arguments.other_motion)
    with Progress(arguments) as progress:
        def say(text: str) -> None:
            progress.done()
            print(text, flush=True)
        if arguments.cases_from:
            summary = proof.prove_other(job, Path(arguments.cases_from), progress, say)
        else:
            summary = proof.prove(job, progress, say)
    print((job.out / 'scores.txt').read_text('utf8'), end='')
    for one in summary.get('baselines', []):
        print(_baseline(one))
    if 'thresholding' in summary:
        print(f'sparse regression by {summary["thresholding"]}')
    print(f'{summary["wall_seconds"]:.0f} s in all')
    print(printable(f'scores: {job.out / "index.html"}'))
    wrong = proof.strict_failures(summary) if arguments.strict else []
    if arguments.frozen:
        wrong += [f'{one["case"]} failed: {one["failure"]}' for one in summary['failures']]
    for name, rate in summary.get('frozen', {}).items():
        told = (f'{name}: {rate["hits"]} of {rate["of"]} (measured before {rate["measured"]}, at '
                f'least {rate["least"]})')
        print(f'frozen list, {told}')
        if rate['hits'] < rate['least']:
            wrong.append(f'the rate fell: {told}')
    for line in wrong:
        print(f'engb: {line}', file=sys.stderr)
    return _NOT_STRICT if wrong else 0


def _check(arguments: argparse.Namespace) -> None:
    if not arguments.out:
        raise InputError('--out DIR is needed: where cases and scores go')
    if arguments.cases is not None and not 1 <= arguments.cases <= _MOST_CASES:
        raise InputError(f'--cases {arguments.cases}: must lie within 1 and {_MOST_CASES}')
    drawn = {'--cases': arguments.cases, '--seed': arguments.seed, '--strata': arguments.strata,
             '--effects': arguments.effects, '--reuse': arguments.reuse,
             '--baselines': arguments.baselines or None, '--strict': arguments.strict or None,
             '--frozen': arguments.frozen or None, '--brief': arguments.brief or None}
    given = [name for name, value in drawn.items() if value is not None]
    for name, value in (('--real', arguments.real), ('--cases-from', arguments.cases_from)):
        allowed = {'--strict'} if name == '--cases-from' else set()
        if value and set(given) - allowed:
            wrong = next(one for one in given if one not in allowed)
            raise InputError(f'{name} draws no case; leave {wrong} away')
    if arguments.real and arguments.cases_from:
        raise InputError('--real and --cases-from: give one of them')
    if arguments.frozen:
        own = [name for name in ('--cases', '--seed', '--strata', '--effects', '--reuse')
               if drawn[name] is not None]
        if own:
            raise InputError(f'--frozen is a fixed list of cases; leave {own[0]} away')
    if arguments.pairs and not arguments.real:
        raise InputError('--pairs belongs to --real')
    if arguments.only and not arguments.cases_from:
        raise InputError('--only belongs to --cases-from')
    if arguments.other_motion and not arguments.cases_from:
        raise InputError('--other-motion belongs to --cases-from')
    if arguments.cases_from and not Path(arguments.cases_from).is_dir():
        raise InputError(f'--cases-from {arguments.cases_from}: no such folder')
    if arguments.score:
        for name, asked in (('--again', arguments.again), ('--real', arguments.real),
                            ('--baselines', arguments.baselines)):
            if asked:
                raise InputError(f'--score runs nothing; leave {name} away')
        if not any((Path(arguments.out) / 'results').glob('*/run.json')):
            raise InputError(f'--score: {arguments.out} holds nothing that was run; leave it away')
    if arguments.seed is not None and arguments.seed < 0:
        raise InputError(f'--seed {arguments.seed}: must not be below 0')
    if arguments.jobs < 1:
        raise InputError(f'--jobs {arguments.jobs}: must be at least 1')
    if Path(arguments.out).exists() and not Path(arguments.out).is_dir():
        raise InputError(f'--out {arguments.out}: is a file; name a folder')
    if not _former_proof(Path(arguments.out)):
        raise InputError(f'--out {arguments.out}: holds something else; name a new folder')


def _former_proof(folder: Path) -> bool:
    """Whether a folder is new, empty, or what an earlier proof has left, also a stopped one."""
    entries = {entry.name for entry in folder.iterdir()} if folder.exists() else set()
    for name, key in (('proof.json', 'digest'), ('proof.json', 'cases_from'),
                      ('scores.json', 'digest'), ('real.json', 'sets')):
        try:
            if key in json.loads((folder / name).read_text('utf8')):
                return True
        except (OSError, ValueError, TypeError):
            continue
    # A stopped one has no scores yet.
    return entries <= {'results', 'baselines'} and all(
        entry.name.startswith('case_') for entry in folder.glob('results/*')) or (
        entries == {'real'} and all((entry / 'best').is_dir() for entry in folder.glob('real/*')))


def _real(arguments: argparse.Namespace) -> None:
    real = _proof('real')
    out = Path(arguments.out)
    with Progress(arguments) as progress:
        result = real.prove_real(Path(arguments.real), out, arguments.jobs, arguments.again,
                                 shlex.join(['engb', *sys.argv[1:]]), progress,
                                 arguments.pairs)
    print(_proof('real_text').as_text(result))
    print(f'{result["wall_seconds"]:.0f} s in all')
    print(printable(f'scores: {out / "index.html"}'))


def _proof(name: str) -> ModuleType:
    """Import a module of tests/proof: of the source tree that this file lies in, else as it was
    installed with the package."""
    from engb_core.physics.compiled import WHY_NOT
    if WHY_NOT:
        raise InputError(f'engb prove needs numba: {WHY_NOT}; pip install numba')
    root = Path(__file__).resolve().parents[2]
    if (root / 'tests' / 'proof' / 'prove.py').exists():
        if str(root) not in sys.path:
            sys.path.insert(0, str(root))
        return importlib.import_module(f'tests.proof.{name}')
    if importlib.util.find_spec('engb_proof') is None:
        raise InputError('engb prove needs the package engb_proof (tests/proof of the source '
                         'tree), which draws and scores the cases; install engb_ros anew')
    return importlib.import_module(f'engb_proof.{name}')


def _baseline(one: dict[str, Any]) -> str:
    named = [('strong', one['named_first'].get('strong')),
             ('subtle', one['named_first'].get('subtle')), ('both of a pair', one['pairs_both']),
             ('false alarms', one['false_alarms']),
             ('wrong names outside', one['confident_wrong_outside'])]
    shown = [*(named if one['gives_names'] else []), ('harm', one['harm'])]
    parts = [f'{name} {entry["hits"]}/{entry["of"]}' for name, entry in shown if entry]
    parts += [f'error removed, {name} {share:.0%}'
              for name, share in one['held_out_removed'].items()
              if name != 'named_singles' and share is not None]
    return f'baseline {one["label"]}: {", ".join(parts)}'


def _open(path: str, diagnosis: str | None) -> None:
    from engb_core.io.sealed import digest, opened
    try:
        text = Path(path).read_text('ascii')
        truth = opened(text)
        effect, parameters = str(truth['effect']), dict(truth['parameters'])
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f'{path}: is not a sealed truth, or damaged') from error
    print(f'sha256 {digest(text)}')
    print(f'concealed: {effect}')
    claims = [] if diagnosis is None else _claims(diagnosis)
    found: dict[str, Any] = next((claim['parameters'] for claim in claims
                                  if claim['effect'] == effect), {})
    for name, value in parameters.items():
        line = f'   {name} = {value:g}'
        if name in found:
            said = found[name]
            std = '' if said.get('std') is None else f' ± {said["std"]:.2g}'
            line += f'; found {said["value"]:.4g}{std}'
        print(line)
    if diagnosis is None:
        return
    print('said:')
    for number, claim in enumerate(claims, 1):
        mark = ' ← concealed' if claim['effect'] == effect else ''
        print(f'   {number}. {claim["effect"]} (probability {claim["probability"]:.2f}){mark}')
    if not claims:
        print('   nothing')


def _claims(path: str) -> list[dict[str, Any]]:
    try:
        claims = json.loads(Path(path).read_text('utf8'))['effects']
        return [{'effect': str(claim['effect']), 'probability': float(claim['probability']),
                 'parameters': dict(claim['parameters'])} for claim in claims]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f'{path}: is not a diagnosis.json') from error
