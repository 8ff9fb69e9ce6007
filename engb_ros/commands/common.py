# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What the commands share: reading inputs, telling progress; `outputs` writes results whole."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_core.io.outputs import file_output, folder_output
from engb_core.text.printable import printable

if TYPE_CHECKING:
    from engb_core.model import Model

__all__ = ['Progress', 'add_effects', 'add_joint', 'add_model', 'add_namespace', 'add_progress',
           'file_output', 'folder_output', 'read_effects', 'read_model', 'tell_what_is_missing']


def add_model(parser: argparse.ArgumentParser, required: bool = True, text: str = '') -> None:
    """Add --model."""
    parser.add_argument('--model', required=required, metavar='MODEL.yaml',
                        help=text or 'the model file (format: engb-model/1)')


def add_effects(parser: argparse.ArgumentParser) -> None:
    """Add --effects, whose effects are read before the command runs (main.py)."""
    parser.add_argument('--effects', dest='effects_folder', metavar='FOLDER',
                        help='effects of your own, a Python file each '
                        '(docs/add-an-effect.md), beside those of ENGB_EFFECTS')


def read_effects(folder: str | None) -> None:
    """Read the effects of --effects, and look whether they and those of the user's own folder can
    be computed.

    Raises:
        InputError: one can't; names its file.
    """
    from engb_core.effects.catalogue import files_of_effects, own_effects_folder, read_effects_of
    own = own_effects_folder()
    files = files_of_effects(own) if own.is_dir() and any(own.glob('*.py')) else []
    if folder is not None:
        files += files_of_effects(folder)
    if files:
        from engb_core.effect_check import refuse_unfit
        refuse_unfit(files)
    if folder is not None:
        read_effects_of(folder)


def read_model(path: str | os.PathLike[str]) -> Model:
    """Read a model file whose effects are all known.

    Raises:
        InputError: it can't be read, or a value is wrong; names the file.
    """
    from engb_core.model import Model
    model = Model.read(path)
    if model.effects:
        from engb_core.physics.plant import effects_of
        try:
            _refuse_misspelt(model)
            effects_of(model)
        except InputError as error:
            raise InputError(f'{path}: {error}') from error
    return model


def _refuse_misspelt(model: Model) -> None:
    """Raise InputError where a name is unknown that is nearly that of an effect or parameter."""
    from difflib import get_close_matches

    from engb_core.effects.catalogue import catalogue
    effects = catalogue()
    for setting in model.effects:
        effect = effects.get(setting.effect)
        # A law's parameters are those of its own formula.
        asked = {setting.effect: list(effects)} if effect is None else dict.fromkeys(
            setting.parameters, list(effect.names)) if effect.made_of is None else {}
        for name, known in asked.items():
            if name not in known and (near := get_close_matches(name, known, 1)):
                kind = 'unknown effect' if effect is None else f'{effect.id} has no parameter'
                raise InputError(f'effects: {kind} {name!r}; did you mean {near[0]}?')


def add_namespace(parser: argparse.ArgumentParser) -> None:
    """Add --namespace."""
    parser.add_argument('--namespace', metavar='/NAME', help='the brake\'s namespace, where a '
                        'recording holds several joint_states, e.g. /front_left')


def add_joint(parser: argparse.ArgumentParser) -> None:
    """Add --joint."""
    parser.add_argument('--joint', metavar='NAME', help='which joint of recordings that hold '
                        'several')


def add_progress(parser: argparse.ArgumentParser) -> None:
    """Add --verbose and --quiet."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument('--verbose', action='store_true', help='tell each step on standard error '
                       '(by default only on a terminal)')
    group.add_argument('--quiet', action='store_true', help='tell no step')


class Progress:
    """Tells what is going on, on standard error; call it with one line of text.

    On a terminal the line is overwritten by the next; otherwise it is silent unless asked, so
    that a script sees nothing there but an error.
    """

    def __init__(self, arguments: argparse.Namespace) -> None:
        self._terminal = sys.stderr.isatty()
        self._on = arguments.verbose or (self._terminal and not arguments.quiet)
        self._shown = False

    def __call__(self, text: str) -> None:
        if not self._on:
            return
        text = printable(text)
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            print(f'\r\033[K{text[:width]}', end='', file=sys.stderr, flush=True)
            self._shown = True
        else:
            print(text, file=sys.stderr, flush=True)

    def done(self) -> None:
        """Clear the line."""
        if self._shown:
            print('\r\033[K', end='', file=sys.stderr, flush=True)
            self._shown = False

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        self.done()


def tell_what_is_missing() -> None:
    """Say on standard error that computing takes long, where there is no compiler."""
    from engb_core.physics.compiled import WHY_NOT
    if WHY_NOT:
        why = printable(' '.join(WHY_NOT.split()))
        print(f'engb: {why}: this takes about 100 times as long, for each minute of recording at '
              '1 kHz about a quarter of an hour; Ctrl-C ends it; pip install numba, or apt '
              'install python3-numba', file=sys.stderr, flush=True)
