"""Prove a diagnosis tool on sealed cases.

    python -m tests.proof.run --cases 100 --seed 1 --out DIR --jobs 2
    python -m tests.proof.run --reuse CASES_DIR --truth TRUTH_DIR --out DIR

draws and seals cases (or takes those of an earlier draw), prints the digest of the truth, runs
`engb diagnose` and `engb predict` as separate processes on copies that hold only recording and
nominal model, then opens the truth, checks the digest, and scores. Interrupted, it goes on where
it stopped; `--again` runs the tool anew on the same cases.
"""
from __future__ import annotations

import argparse
from concurrent.futures import as_completed, ThreadPoolExecutor
from dataclasses import asdict
import json
import os
from pathlib import Path
import secrets
import shutil
import subprocess
import sys
import tempfile
import time

from .generate import generate, parse_strata
from .score import CaseScore, score_case
from .sealing import digest_of
from .summary import as_text
from .totals import summarise

__all__ = ['call', 'run_tool', 'score_all', 'TOOL']

TOOL = [sys.executable, '-m', 'engb_ros.commands.main']
_TIMEOUT = 600.0
_ROOT = Path(__file__).resolve().parents[2]


def _recording(folder: Path, name: str) -> Path:
    return next(p for p in (folder / name, folder / f'{name}.mcap') if p.exists())


def run_tool(case: Path, results: Path, tool: list[str] = TOOL) -> str | None:
    """Diagnose a copy of `case`, predict its test run; returns what failed, or None."""
    if results.exists():
        shutil.rmtree(results)
    results.mkdir(parents=True)
    failure, seconds = None, None
    with tempfile.TemporaryDirectory(prefix='case_') as scratch:
        copy = Path(scratch) / 'case'
        shutil.copytree(case, copy)
        for path in (copy, *copy.rglob('*')):
            os.utime(path)      # the originals' times tell how long a case took to draw
        out = Path(scratch) / 'out'
        start = time.monotonic()
        failure = call(['diagnose', str(_recording(copy, 'train')), '--model',
                        str(copy / 'nominal.yaml'), '--out', str(out)], tool, Path(scratch))
        seconds = time.monotonic() - start
        for model, name in ((out / 'model.yaml', 'corrected'), (copy / 'nominal.yaml', 'nominal')):
            if failure is None:
                failure = call(['predict', str(_recording(copy, 'test')), '--model',
                                str(model), '--out', str(out / f'{name}.npz')], tool,
                               Path(scratch))
        for name in ('diagnosis.json', 'model.yaml', 'report.html', 'corrected.npz',
                     'nominal.npz'):
            if (out / name).exists():
                shutil.copy(out / name, results / name)
    (results / 'run.json').write_text(json.dumps({'seconds': seconds, 'failure': failure}), 'utf8')
    return failure


def call(arguments: list[str], tool: list[str] = TOOL, folder: Path | None = None) -> str | None:
    """Run the tool as a process of its own, in `folder`; returns what failed, or None."""
    path = os.pathsep.join([str(_ROOT), os.environ.get('PYTHONPATH', '')]).rstrip(os.pathsep)
    try:
        done = subprocess.run([*tool, *arguments], capture_output=True, text=True, cwd=folder,
                              timeout=_TIMEOUT, env={**os.environ, 'PYTHONPATH': path})
    except subprocess.TimeoutExpired:
        return f'{arguments[0]}: over {_TIMEOUT:.0f} s'
    if done.returncode == 0:
        return None
    last = (done.stderr.strip() or 'no message').splitlines()[-1]
    return f'{arguments[0]}: exit {done.returncode}: {last}'


def _run_all(cases: list[Path], results: Path, jobs: int, again: bool) -> None:
    todo = [c for c in cases if again or not (results / c.name / 'run.json').exists()]
    with ThreadPoolExecutor(jobs) as pool:
        waiting = {pool.submit(run_tool, case, results / case.name): case for case in todo}
        for count, done in enumerate(as_completed(waiting), 1):
            note = done.result() or 'done'
            print(f'{count}/{len(todo)} {waiting[done].name}: {note}', file=sys.stderr, flush=True)


def score_all(cases: list[Path], truth: Path, results: Path) -> list[CaseScore]:
    """Score every case that has been run."""
    return [score_case(c.name, truth / f'{c.name}.npz', results / c.name) for c in cases
            if (results / c.name / 'run.json').exists()]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--cases', type=int, default=100)
    parser.add_argument('--seed', type=int, default=None, help='default: from the system')
    parser.add_argument('--strata', default='', help='e.g. clean=1,strong=2,subtle=2')
    parser.add_argument('--effects', default='', help='only these, comma separated')
    parser.add_argument('--reuse', type=Path, default=None, help='cases drawn before')
    parser.add_argument('--truth', type=Path, default=None, help='with --reuse: their truth')
    parser.add_argument('--only', default='', help='only these cases, comma separated')
    parser.add_argument('--first', type=int, default=None, help='only the first so many cases')
    parser.add_argument('--again', action='store_true', help='run the tool on all cases anew')
    parser.add_argument('--score-only', action='store_true', help='do not run the tool')
    parser.add_argument('--out', type=Path, required=True)
    parser.add_argument('--jobs', type=int, default=1)
    args = parser.parse_args()
    cases, truth = args.reuse or args.out / 'cases', args.truth or args.out / 'truth'
    if args.reuse is None:
        seed = secrets.randbits(64) if args.seed is None else args.seed
        effects = args.effects.split(',') if args.effects else None
        generate(args.cases, seed, cases, truth, parse_strata(args.strata), args.jobs, effects)
    sealed = digest_of(truth)
    print(f'truth sealed: sha256 {sealed}', flush=True)
    folders = sorted(p for p in cases.glob('case_*') if (truth / f'{p.name}.npz').exists())
    if args.only:
        folders = [p for p in folders if p.name in args.only.split(',')]
    folders = folders[:args.first]
    results = args.out / 'results'
    if not args.score_only:
        _run_all(folders, results, args.jobs, args.again)
    if digest_of(truth) != sealed:
        sys.exit('the truth was changed while the tool ran: no score')
    scores = score_all(folders, truth, results)
    summary = {'digest': sealed, **summarise(scores)}
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / 'scores.json').write_text(json.dumps(summary, indent=1), 'utf8')
    rows = [json.dumps(asdict(score)) for score in scores]
    (args.out / 'cases.jsonl').write_text('\n'.join(rows) + '\n', 'utf8')
    print(as_text(summary))


if __name__ == '__main__':
    main()
