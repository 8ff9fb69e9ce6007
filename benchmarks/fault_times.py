"""How long it takes until a fault is noticed, and until its reaction is there: measured.

    python -m benchmarks.fault_times [--rounds 5] [--only killed] [--write docs/integrate.md]

Processes are killed and frozen, commands and joint states spoilt, frames damaged on a real (UDP
multicast) bus, while a brake tracks an angle under default timeouts. Time runs from the moment of
the injection to the stamp of the diagnostics that tell of it, and to the arrival of the first
command of no torque, or the drive's first sample without. It prints the table of faults:
median and largest of the rounds. --write puts it into that page, in the place of the table that
is there. Injection through a service takes the service's time too.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

import numpy as np

from benchmarks.faults import Fault, FAULTS, UNTIMED
from benchmarks.page import write_table
from benchmarks.watched_loop import closed_loop, recover, WatchedLoop


def measured(fault: Fault, loop: WatchedLoop, rounds: int) -> dict[str, list[float]]:
    """Inject `fault` again and again into a healthy loop."""
    found: dict[str, list[float]] = {}
    for _ in range(rounds):
        recover(loop)
        for what, took in fault.measure(loop).items():
            found.setdefault(what, []).append(took)
    recover(loop)
    return found


def table(rows: list[tuple[str, str, str, str, str]], rounds: int) -> str:
    """Return the table of faults as Markdown."""
    head = ('fault', 'promised within', f'measured, median (largest) of {rounds}', 'reaction',
            'test')
    return '\n'.join('| ' + ' | '.join(row) + ' |' for row in (head, ('---',) * 5, *rows))


def main() -> int:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rounds', type=int, default=5, help='how often each is injected')
    parser.add_argument('--only', default='', metavar='TEXT', help='faults whose name holds TEXT')
    parser.add_argument('--write', metavar='PAGE', help='page whose table is replaced')
    options = parser.parse_args()
    chosen = [fault for fault in FAULTS if options.only in fault.name]
    texts: dict[Fault, str] = {}
    for kind in ('plant', 'spoilt', 'can', 'force'):
        of_kind = [fault for fault in chosen if fault.loop == kind]
        if not of_kind:
            continue
        with closed_loop(kind) as loop:
            for fault in of_kind:
                texts[fault] = '; '.join(
                    f'{what} {1e3 * np.median(times):.0f} ms ({1e3 * max(times):.0f})'
                    for what, times in measured(fault, loop, options.rounds).items())
                print(f'{fault.name}: {texts[fault]}', file=sys.stderr, flush=True)
    rows = [(fault.name, fault.bound, texts[fault], fault.reaction, f'`{fault.test}`')
            for fault in chosen]
    rows += [(name, bound, '-', reaction, f'`{test}`')
             for name, bound, reaction, test in UNTIMED if not options.only]
    text = table(rows, options.rounds)
    print(text)
    if options.write:
        write_table(Path(options.write), 'faults', text)
    return 0


if __name__ == '__main__':
    sys.exit(main())
