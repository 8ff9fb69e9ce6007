# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""How long it takes until a fault is noticed, and until its reaction is there: measured.

    python -m benchmarks.fault_times [--rounds 5] [--only killed] [--write docs/integrate.md]

Processes are killed and frozen, commands and joint states spoilt, frames damaged on a real (UDP
multicast) bus, while a brake tracks an angle under default timeouts. Time runs from the moment of
the injection to the stamp of the diagnostics that tell of it, and to the arrival of the first
command of no torque, or the drive's first sample without. It prints the table of faults:
median and largest of the rounds, and how many kept what the parameters promise (LATENCY, for the
injection's own way, is added). 'no' and exit status 1: no reaction, a torque beyond the limit, or
a fault that does not stay latched when its cause is over. --write puts it into that page, in the
place of the table that is there, or, with --only, of those rows. Injection through a service takes
the service's time too.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import sys

import numpy as np

from benchmarks.faults import Fault, FAULTS, KEPT_ANGLE, LET_GO, UNTIMED
from benchmarks.page import markdown, write_table
from benchmarks.watched_loop import closed_loop, recover, wake, WatchedLoop
from engb_ros.processes.runner import RunnerError

# The final clamp's with the default parameters [N·m]; and how long a ramp from full torque takes,
# which goes down with each sample of the drive and so ends up to one after [s].
LIMIT, RAMP = 0.75, 0.2 + 0.004


class FaultNotHandledError(Exception):
    """A reaction that is not what is promised, however fast."""


def measured(fault: Fault, loop: WatchedLoop, rounds: int) -> dict[str, list[float]]:
    """Inject `fault` again and again into a healthy loop.

    Raises:
        FaultNotHandledError: a torque went beyond the limit, or a fault did not stay latched.
    """
    found: dict[str, list[float]] = {}
    for _ in range(rounds):
        recover(loop)
        loop.torques.clear()
        for what, took in fault.measure(loop).items():
            found.setdefault(what, []).append(took)
        beyond = [torque for _, torque in loop.torques if not abs(torque) <= LIMIT]
        if beyond:
            raise FaultNotHandledError(f'torque {beyond[0]} N·m')
        if 'noticed' in found and fault.latches:
            wake(loop)
            loop.during(0.3)   # the state's own message may come after the diagnostics
            if not loop.is_in('fault'):
                raise FaultNotHandledError('did not stay latched')
    recover(loop)
    return found


def shown(what: str, values: list[float]) -> str:
    """Return median and largest, in the unit of what they are of."""
    if what == KEPT_ANGLE:
        return f'{what} {np.median(values):.2f} rad ({max(values):.2f})'
    return f'{what} {1e3 * np.median(values):.0f} ms ({1e3 * max(values):.0f})'


def in_time(fault: Fault, found: dict[str, list[float]]) -> str:
    """Return how many of the rounds kept what is promised; what follows a ramp may take that
    longer."""
    first, *rest = (values for what, values in found.items() if what != KEPT_ANGLE)
    kept = [time <= fault.limit for time in first]
    for values in rest:
        kept = [so_far and time <= fault.limit + RAMP
                for so_far, time in zip(kept, values, strict=True)]
    if LET_GO in found:
        kept = [so_far and time == 0.0 for so_far, time in zip(kept, found[LET_GO], strict=True)]
    return f'{sum(kept)} of {len(kept)}'


def table(rows: list[tuple[str, ...]], rounds: int) -> str:
    """Return the table of faults as Markdown."""
    head = ('fault', 'promised within', f'measured, median (largest) of {rounds}', 'in time',
            'reaction', 'test')
    return markdown((head, ('---',) * len(head), *rows))


def replace_rows(page: Path, rows: list[tuple[str, ...]]) -> None:
    """Put rows into the page's table, in the place of those of the same faults."""
    new = {row[0]: '| ' + ' | '.join(row) + ' |' for row in rows}
    lines = page.read_text(encoding='utf-8').split('\n')
    begin = next(index for index, line in enumerate(lines) if '<!-- measured faults' in line)
    end = lines.index('<!-- end -->', begin)
    table_lines = [new.pop(line.split(' | ')[0].removeprefix('| '), line)
                   for line in lines[begin:end]]
    lines[begin:end] = [*table_lines, *new.values()]
    page.write_text('\n'.join(lines), encoding='utf-8')


def main() -> int:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--rounds', type=int, default=5, help='how often each is injected')
    parser.add_argument('--only', default='', metavar='TEXT', help='faults whose name holds TEXT')
    parser.add_argument('--list', action='store_true', help='name and count the kinds only')
    parser.add_argument('--write', metavar='PAGE', help='page whose table is replaced')
    options = parser.parse_args()
    chosen = [fault for fault in FAULTS if options.only in fault.name]
    if options.list:
        for name, test in [*((fault.name, fault.test) for fault in FAULTS),
                           *((name, test) for name, *_, test in UNTIMED)]:
            print(f'{name}: {test}')
        print(f'{len(FAULTS)} kinds of faults timed over real DDS and CAN, {len(UNTIMED)} that '
              'have no time of their own')
        return 0
    texts: dict[Fault, tuple[str, str]] = {}
    for kind in ('plant', 'spoilt', 'can', 'force', 'lossy'):
        of_kind = [fault for fault in chosen if fault.loop == kind]
        if not of_kind:
            continue
        with closed_loop(kind) as loop:
            for fault in of_kind:
                try:
                    found = measured(fault, loop, options.rounds)
                    texts[fault] = (
                        '; '.join(shown(what, times) for what, times in found.items()),
                        in_time(fault, found))
                except (RunnerError, FaultNotHandledError) as error:
                    texts[fault] = (str(error), 'no')
                print(f'{fault.name}: {texts[fault]}', file=sys.stderr, flush=True)
    rows = [(fault.name, fault.bound, *texts[fault], fault.reaction, f'`{fault.test}`')
            for fault in chosen]
    rows += [(name, bound, '-', '-', reaction, f'`{test}`')
             for name, bound, reaction, test in UNTIMED if not options.only]
    text = table(rows, options.rounds)
    print(text)
    if options.write and options.only:
        replace_rows(Path(options.write), rows)
    elif options.write:
        write_table(Path(options.write), 'faults', text)
    failed = [fault.name for fault, (_, kept) in texts.items() if kept == 'no']
    if failed:
        print('not as promised: ' + '; '.join(failed), file=sys.stderr)
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main())
