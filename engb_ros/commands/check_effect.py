# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Check an effect of your own, one Python file (or all of a folder), before a diagnosis uses it.

Checked are names, units and bounds; that its functions give finite numbers at all starting
points, at rest and in both directions; that it vanishes where it says so; and that a motion
simulated with it needs, by the inverse dynamics, the effort that it was simulated with.

examples:
  engb check-effect my_effects/cable_drag.py
  engb diagnose run1 --model nominal.yaml --effects my_effects --out result

docs/add-an-effect.md goes through it. Status 2: something is wrong, told in a line each.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from engb_core.errors import InputError

__all__ = ['add_arguments', 'run']


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('file', metavar='FILE',
                        help='a Python file that holds an EFFECT, or a folder of such files')


def run(arguments: argparse.Namespace) -> int:
    """Run the command; the status says whether all effects are fit."""
    from engb_core.effects.catalogue import files_of_effects
    path = Path(arguments.file)
    if path.is_dir():
        return max(_checked(entry) for entry in files_of_effects(path))
    if not path.is_file():
        raise InputError(f'{path}: there is no such file')
    return _checked(path)


def _checked(path: Path) -> int:
    """Print what is wrong with the effect of a file; return the status."""
    from engb_core.effect_check import faults_of_effect
    from engb_core.effects.catalogue import effect_of_file
    effect = effect_of_file(path)
    faults = faults_of_effect(effect)
    for fault in faults:
        print(f'{effect.id}: {fault}')
    if faults:
        return 2
    print(f'{effect.id}: fit for use ({", ".join(effect.stages)}; '
          f'{", ".join(f"{entry.name} [{entry.unit}]" for entry in effect.parameters)})')
    return 0
