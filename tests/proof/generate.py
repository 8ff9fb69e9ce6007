# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Draw and seal a set of cases: `python -m tests.proof.generate --cases 120 --seed 1 ...`.

Cases go to `--out`/case_0001 …, their truth to `--truth`/case_0001.npz; what each holds is
known from the truth alone. Interrupted, it goes on where it stopped.
"""
from __future__ import annotations

import argparse
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
import secrets
import shutil
import sys

import numpy as np

from .cases import draw_case, Request
from .catalogue import known
from .held_numbers import draw_held
from .hide_outside import DESCRIBED
from .hide_undescribed import stratum_of, UNDESCRIBED
from .machines import Machine, MACHINES
from .sealing import digest_of, open_truth, write_case

__all__ = ['DEFAULT_STRATA', 'generate', 'parse_strata', 'plan']

DEFAULT_STRATA = {'clean': 0.16, 'strong': 0.22, 'subtle': 0.2, 'pair': 0.1, 'triple': 0.06,
                  'described': 0.08, 'undescribed': 0.18}
ROUTINE = 0.25
_MACHINES = (0.7, 0.15, 0.15)
_SHAPED, _SEVERAL, _BEGINS = 0.25, 0.3, 0.3


def _singles() -> list[str]:
    return [name for name, draw in known().items() if not name.startswith('outside_')]


def _clash(names: set[str]) -> bool:
    """Whether these cannot be told apart, or not be in one plant."""
    trains = {'backlash', 'drivetrain_resonance'}
    numbers = {name for name in _singles() if name.endswith('_error')} | {'contact_shift'}
    return bool(names >= trains or names >= {'self_energizing', 'pad_friction_fade'}
                or len(names & numbers) > 1
                or (names & trains and 'presliding_friction' in names)
                or names >= {'torque_offset', 'asymmetric_friction'})


def _several(rng: np.random.Generator, count: int, machine: Machine) -> tuple[str, ...]:
    names = [name for name in _singles() if machine.can_hold(name)]
    while True:
        chosen = tuple(str(x) for x in rng.choice(names, count, replace=False))
        if not _clash(set(chosen)):
            return chosen


def _from(deck: list[str], names: list[str], machine: Machine, rng: np.random.Generator) -> str:
    """The next effect of the deck that the machine can hold; the deck is filled where empty."""
    for _ in range(2):
        for name in reversed(deck):
            if machine.can_hold(name):
                deck.remove(name)
                return name
        deck[:0] = [str(x) for x in rng.permutation(names)]
    raise ValueError(f'a {machine.kind} can hold none of {", ".join(names)}')


def plan(count: int, strata: dict[str, float], rng: np.random.Generator,
         effects: list[str] | None = None, brief: bool = False) -> list[Request]:
    """Requests in random order; effects come in turn, so that each is met equally often.

    What a refit held, the machine, the load curve's form and the recordings are drawn first,
    without regard to what will be hidden.
    """
    shares = np.array(list(strata.values()))
    sizes = np.floor(shares / shares.sum() * count).astype(int)
    sizes[int(np.argmax(sizes))] += count - sizes.sum()
    requests = []
    for stratum, size in zip(strata, sizes, strict=True):
        names = {'described': list(DESCRIBED), 'undescribed': list(UNDESCRIBED)}.get(
            stratum, effects or _singles())
        deck: list[str] = []
        for _ in range(size):
            refitted = bool(rng.random() < 0.6)
            held = draw_held(rng, refitted)
            machine = Machine(str(rng.choice(MACHINES, p=_MACHINES)))
            if not any(machine.can_hold(name) for name in names):
                machine = Machine('brake')
            motion = 'brief' if brief else 'routine' if rng.random() < ROUTINE else 'rich'
            shaped, begins = bool(rng.random() < _SHAPED), bool(rng.random() < _BEGINS)
            recordings = int(rng.integers(2, 5)) if rng.random() < _SEVERAL and not brief else 1
            chosen: tuple[str, ...] = ()
            if stratum in ('pair', 'triple'):
                chosen = _several(rng, 2 if stratum == 'pair' else 3, machine)
            elif stratum != 'clean':
                chosen = (_from(deck, names, machine, rng),)
            told = stratum_of(chosen[0]) if stratum == 'undescribed' else stratum
            requests.append(Request(told, chosen, motion, refitted, held, machine.kind, shaped,
                                    recordings, begins))
    return [requests[i] for i in rng.permutation(len(requests))]


def _one(job: tuple[int, Request, np.random.SeedSequence, Path, Path]) -> str:
    number, request, seeds, out, truth = job
    name = f'case_{number:04d}'
    sealed = truth / f'{name}.npz'
    if sealed.exists():
        return name
    if (out / name).exists():
        shutil.rmtree(out / name)
    draw, write = (np.random.default_rng(s) for s in seeds.spawn(2))
    case = draw_case(request, draw)
    scratch = truth / f'.{name}.npz'
    write_case(case, out / name, scratch, write)
    scratch.rename(sealed)
    return name


def generate(count: int, seed: int, out: Path, truth: Path, strata: dict[str, float],
             jobs: int = 1, effects: list[str] | None = None, first: int = 1,
             progress: Callable[[str], None] | None = None, brief: bool = False) -> str:
    """Draw, write and seal; returns the digest of the truth."""
    told = progress or _tell
    root = np.random.SeedSequence(seed)
    planner, *cases = root.spawn(count + 1)
    requests = plan(count, strata, np.random.default_rng(planner), effects, brief)
    out.mkdir(parents=True, exist_ok=True)
    truth.mkdir(parents=True, exist_ok=True)
    work = [(first + i, request, cases[i], out, truth) for i, request in enumerate(requests)]
    if jobs > 1:
        with get_context('spawn').Pool(jobs) as pool:
            for done, name in enumerate(pool.imap_unordered(_one, work), 1):
                told(f'{done}/{count} {name}')
    else:
        for done, job in enumerate(work, 1):
            told(f'{done}/{count} {_one(job)}')
    if progress is None:
        print(file=sys.stderr)
    return digest_of(truth)


def _tell(text: str) -> None:
    print(f'\r{text}', end='', file=sys.stderr, flush=True)


def parse_strata(text: str) -> dict[str, float]:
    """`clean=1,strong=2` as a dictionary; the default mix for nothing."""
    if not text:
        return dict(DEFAULT_STRATA)
    pairs = [part.partition('=') for part in text.split(',')]
    return {name: float(value or 1.0) for name, _, value in pairs}


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--cases', type=int, default=100)
    parser.add_argument('--seed', type=int, default=None, help='default: from the system')
    parser.add_argument('--out', type=Path, required=True)
    parser.add_argument('--truth', type=Path, required=True)
    parser.add_argument('--strata', default='', help='e.g. clean=1,strong=2,subtle=2')
    parser.add_argument('--effects', default='', help='only these, comma separated')
    parser.add_argument('--jobs', type=int, default=1)
    parser.add_argument('--plain', action='store_true',
                        help='also write the truth as readable JSON (development only)')
    args = parser.parse_args()
    seed = secrets.randbits(64) if args.seed is None else args.seed
    effects = args.effects.split(',') if args.effects else None
    digest = generate(args.cases, seed, args.out, args.truth, parse_strata(args.strata), args.jobs,
                      effects)
    print(f'{args.cases} cases sealed, truth digest sha256 {digest}')
    if args.plain:
        import json
        for path in sorted(args.truth.glob('case_*.npz')):
            facts, _ = open_truth(path)
            text = json.dumps(facts, indent=1)
            path.with_suffix('.json').write_text(text, 'utf8')


if __name__ == '__main__':
    main()
