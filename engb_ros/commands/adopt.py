# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Give a law that a diagnosis found a name: write it as an effect of the library, with a test.

DIR is what engb diagnose wrote. The effect's file (equation, units, bounds) and its test go into
the folder from which every later command reads effects of your own: ENGB_EFFECTS, or
~/.local/share/engb/effects. From then on a diagnosis tries it like any other effect, and model
files may use its name.

examples:
  engb adopt result --name screw_lead_error
  engb adopt result --name screw_lead_error --out my_effects
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from engb_core.effects.catalogue import catalogue, own_effects_folder
from engb_core.errors import InputError
from engb_core.io.outputs import folder_output
from engb_core.model import Model
from engb_core.text.printable import printable

__all__ = ['add_arguments', 'run']


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument('diagnosis', metavar='DIR', help='what engb diagnose wrote')
    parser.add_argument('--name', required=True, help='of the effect, such as screw_lead_error')
    parser.add_argument('--out', metavar='FOLDER', default=None,
                        help='where the effect goes (default: where effects of your own are read)')


def run(arguments: argparse.Namespace) -> None:
    """Run the command."""
    from engb_core.laws.adoption import effect_text, test_text
    folder = Path(arguments.diagnosis)
    document = _document(folder / 'diagnosis.json')
    rest = document.get('unexplained')
    law = rest.get('law') if isinstance(rest, dict) else None
    if not isinstance(law, dict):
        raise InputError(f'{folder / "diagnosis.json"}: no law was found there; only a diagnosis '
                         'with unexplained.law can be adopted')
    own = Path(arguments.out) if arguments.out else own_effects_folder()
    known = {name for name in catalogue() if not (own / f'{name}.py').exists()}
    if arguments.name in known:
        raise InputError(f'--name {arguments.name}: there is such an effect already; '
                         'take another name')
    model = Model.read(folder / 'model.yaml')
    own_law = next((entry for entry in model.effects
                    if entry.effect == 'law' and entry.formula == law.get('pattern')), None)
    within = {}
    if own_law is not None:
        # The model file knows whether torque or position is late.
        within, law = own_law.within, {**law, 'acts_as': own_law.acts_as}
    recordings = sorted({str(entry.get('recording')) for entry in
                         (document.get('fit') or {}).get('held_out') or []
                         if isinstance(entry, dict)})
    text = effect_text(arguments.name, law, within,
                       f'found in {", ".join(recordings) or "a recording"}')
    names = (f'{arguments.name}.py', f'test_{arguments.name}.py')
    with folder_output(own, names, [folder]) as scratch:
        (scratch / names[0]).write_text(text, encoding='utf-8')
        (scratch / names[1]).write_text(test_text(arguments.name), encoding='utf-8')
    print(f'{printable(str(own / names[0]))}: {law.get("acts_as")} {law.get("pattern")}')
    if own != own_effects_folder():
        print(f'to have it read by every command: ENGB_EFFECTS={printable(str(own))}')


def _document(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise InputError(f'{path}: cannot be read ({error.strerror}); name the folder that '
                         'engb diagnose wrote') from None
    except (ValueError, RecursionError):
        raise InputError(f'{path}: not valid JSON; write it anew with engb diagnose') from None
    if not isinstance(document, dict):
        raise InputError(f'{path}: not a diagnosis; write it anew with engb diagnose')
    return document
