# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""From ten tables of a simulated bench to a name, each in one command: how many are right.

    python benchmarks/ten_tables.py [SEED]
"""

from __future__ import annotations

import json
from pathlib import Path
import subprocess
import sys
import tempfile

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.tables.simulated_bench import TABLES, write_table  # noqa: E402


def main() -> None:
    """Print a line for each table, and how many got the right name."""
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    right = 0
    with tempfile.TemporaryDirectory() as folder:
        for table in TABLES:
            path = write_table(table, Path(folder), seed)
            out = Path(folder) / path.stem
            done = subprocess.run([sys.executable, '-m', 'engb_ros.commands.main', 'diagnose',
                                   str(path), *table.said, '--out', str(out)],
                                  capture_output=True, text=True, check=False)
            names = ['refused: ' + done.stderr.strip()]
            if done.returncode == 0:
                found = json.loads((out / 'diagnosis.json').read_text(encoding='utf-8'))
                names = [f'{entry["effect"]} {entry["probability"]:.2f}'
                         for entry in found['effects']]
            first = names[0].split()[0] if names else None
            right += first == table.effect
            print(f'{"yes" if first == table.effect else "NO ":<4}{table.name:<16}'
                  f'hidden: {table.effect or "nothing":<28}said: {", ".join(names) or "nothing"}',
                  flush=True)
    print(f'{right} of {len(TABLES)} right (seed {seed})')


if __name__ == '__main__':
    main()
