# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings of real machines: what a folder holds, and what others reached on it.

A set is a folder with `nominal.yaml` and bags whose names begin with `train` and `holdout`. Where
its machine is another unit of one that stands in a folder beside it, a file `set.yaml` says so:

    machine_of: FOLDER
"""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import re

import yaml

from engb_core.errors import InputError

__all__ = ['Expected', 'Published', 'RealSet', 'sets_in', 'with_loop']


@dataclass(frozen=True)
class Published:
    """A number from elsewhere; `measure` is 'force' (relative error), 'position' (m or rad), or
    'driven': that of a model driven by the recorded effort."""

    who: str
    measure: str
    train: float | None
    holdout: float | None


@dataclass(frozen=True)
class Expected:
    """A cause that an expert expects in a machine.

    Attributes:
        names: any of these says it.
        sure: whether the expert is sure, or holds it for likely or possible only.
        parameter: whose number is expected from `low` to `high` ('': none is).
    """

    names: tuple[str, ...]
    sure: bool
    parameter: str = ''
    low: float = 0.0
    high: float = 0.0


@dataclass(frozen=True)
class RealSet:
    """Recordings of one machine; `nominal` is the mapping of its model file, `band` [Hz] that up
    to which its position tells the torque that its motion needs; `machine_of` names the set of
    another unit of the same machine, '' where there is none."""

    name: str
    nominal: dict
    train: tuple[Path, ...]
    holdout: tuple[Path, ...]
    published: tuple[Published, ...]
    band: float
    expected: tuple[Expected, ...] = ()
    machine_of: str = ''


# Janot, Gautier and Brunot (2019), as told on nonlinearbenchmark.org; the folder's README.
_EMPS = (
    Published('authors: mass, viscous, Coulomb, offset', 'force', 0.0408, 0.0598),
    Published('others, further models: about', 'force', None, 0.033),
    Published('others, physical models (not checked): from', 'driven', None, 0.0040),
    Published('others, black boxes (not checked): from', 'driven', None, 0.0026),
)
# Cleaned subset of all masses and arms there, one mass and arm here: not the same recordings.
_SERVO = (
    Published('recorders: Coulomb and viscous friction (their subset)', 'position', None, 0.032),
    Published('recorders: most detailed friction (their subset)', 'position', None, 0.031),
)
_PUBLISHED = {'emps': _EMPS, 'servo_sts3215': _SERVO}
# From the table at the end of the folder's README. The servo's rate limit is that of the goal;
# its delay is that of the goal or of the torque.
_EXPECTED = {
    'emps': (
        Expected(('asymmetric_friction',), True),
        Expected(('actuation_lag', 'effort_measurement_lag', 'sampling_delay'), False),
        Expected(('stribeck_friction', 'nonlinear_viscous_friction'), False)),
    'servo_sts3215': (
        Expected(('command_delay', 'actuation_lag'), True),
        Expected(('command_rate_limit',), True, 'speed', 4.5, 5.5),
        Expected(('load_dependent_friction',), True, 'load_gain', 0.3, 0.45)),
    'ak80_pendulum': (
        Expected(('effort_scale_error',), False, 'scale', 1.0 / 1.26, 1.0 / 1.19),
        Expected(('coulomb_friction_error',), True, 'coulomb', 0.14, 0.2),
        Expected(('actuation_lag', 'effort_measurement_lag'), False)),
}
# Coarse counts end it early; of a machine that is not listed nothing is known.
_BANDS = {'emps': 40.0, 'servo_sts3215': 8.0, 'ak80_pendulum': 8.0}
_USUAL_BAND = 20.0


def sets_in(folder: Path) -> list[RealSet]:
    """All sets below `folder`, or the one that it is.

    Raises:
        InputError: there is no such folder, no set in it, or a set names another one as that of
            its machine which is not there.
    """
    if not folder.is_dir():
        raise InputError(f'--real {folder}: no such folder; nothing to do without the recordings '
                         '(they are not part of the project)')
    homes = [folder] if (folder / 'nominal.yaml').exists() else sorted(
        path.parent for path in folder.glob('*/nominal.yaml'))
    found = [_set(home) for home in homes]
    if not found:
        raise InputError(f'--real {folder}: no nominal.yaml in it or one folder below; name a '
                         'folder of sets, each with nominal.yaml, train* and holdout*')
    names = {one.name for one in found}
    for one in found:
        if one.machine_of and (one.machine_of == one.name or one.machine_of not in names):
            raise InputError(f'{one.name}/set.yaml: machine_of is {one.machine_of}, which is no '
                             'other set here; give --real the folder that holds both')
    return found


def _set(home: Path) -> RealSet:
    train, holdout = (tuple(sorted(path for path in home.glob(f'{part}*') if path.is_dir()
                                   or path.suffix in ('.mcap', '.db3', '.zstd')))
                      for part in ('train', 'holdout'))
    if not train or not holdout:
        raise InputError(f'{home}: needs recordings named train… and holdout…')
    nominal = yaml.safe_load((home / 'nominal.yaml').read_text('utf8'))
    return RealSet(home.name, nominal, train, holdout, _PUBLISHED.get(home.name, ()),
                   _BANDS.get(home.name, _USUAL_BAND), _EXPECTED.get(home.name, ()),
                   _machine_of(home / 'set.yaml'))


def _machine_of(path: Path) -> str:
    """What a set's description names as the set of its machine; '' where there is none."""
    if not path.exists():
        return ''
    try:
        content = yaml.safe_load(path.read_text('utf8')) or {}
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f'{path}: cannot be read as YAML; write machine_of: FOLDER') from error
    if not isinstance(content, dict) or set(content) - {'machine_of'} or not isinstance(
            content.get('machine_of', ''), str):
        raise InputError(f'{path}: may hold only machine_of: FOLDER')
    return str(content.get('machine_of', ''))


def with_loop(one: RealSet, model: dict, recording: Path) -> dict:
    """The model as it stood in the loop of `recording`: the servo's gain is in the name."""
    gain = re.search(r'_kp(\d+)_', recording.name)
    if one.name != 'servo_sts3215' or gain is None:
        return model
    # K·12 V·0.16489·kp and K·12 V (the folder's README); the servo's loop rate is not published.
    loop = {'proportional': 1.12489 * int(gain[1]), 'integral': 0.0, 'derivative': 0.0,
            'effort_limit': 6.822, 'rate': 1000.0}
    return {**model, 'controller': loop}
