# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""From tables of simulated benches to a name, each in one command: how many are right.

    python benchmarks/ten_tables.py [SEED] [NAME...]

There are three times ten: of a bench with one loop, of drives as machine builders have them, and
of machines whose loggers speak other languages.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import subprocess
import sys
import tempfile

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.tables.foreign_benches import FOREIGN_TABLES  # noqa: E402
from tests.tables.other_benches import OTHER_TABLES  # noqa: E402
from tests.tables.simulated_bench import BenchTable, TABLES, write_table  # noqa: E402


def main(words: list[str] | None = None) -> None:
    """Print a line for each table, and how many of each ten got the right name."""
    tables = [table.name for table in (*TABLES, *OTHER_TABLES, *FOREIGN_TABLES)]
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('seed', nargs='?', type=int, default=0)
    parser.add_argument('names', nargs='*', metavar='NAME', help=', '.join(tables))
    arguments = parser.parse_args(words)
    unknown = [name for name in arguments.names if name not in tables]
    if unknown:
        parser.error(f'there is no table {unknown[0]}; known: {", ".join(tables)}')
    with tempfile.TemporaryDirectory() as folder:
        for which in (TABLES, OTHER_TABLES, FOREIGN_TABLES):
            chosen = [table for table in which if table.name in (arguments.names or tables)]
            if chosen:
                right = sum(_right(table, Path(folder), arguments.seed) for table in chosen)
                print(f'{right} of {len(chosen)} right (seed {arguments.seed})', flush=True)


def _right(table: BenchTable, folder: Path, seed: int) -> bool:
    """Print what is said of a table; return whether it's right."""
    path = write_table(table, folder, seed)
    out = folder / path.stem
    done = subprocess.run([sys.executable, '-m', 'engb_ros.commands.main', 'diagnose', str(path),
                           *table.said, '--out', str(out)],
                          capture_output=True, text=True, check=False)
    names = ['refused: ' + done.stderr.strip()]
    if done.returncode == 0:
        found = json.loads((out / 'diagnosis.json').read_text(encoding='utf-8'))
        names = [f'{entry["effect"]} {entry["probability"]:.2f}' for entry in found['effects']]
    first = names[0].split()[0] if names else None
    print(f'{"yes" if first == table.effect else "NO ":<4}{table.name:<16}'
          f'hidden: {table.effect or "nothing":<28}said: {", ".join(names) or "nothing"}',
          flush=True)
    return first == table.effect


if __name__ == '__main__':
    main()
