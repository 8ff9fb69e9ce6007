# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Where a diagnosis gets its nominal model from: a model file, a robot's joint, a simulator."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from engb_core.errors import InputError
from engb_ros.commands.common import read_model
from engb_ros.commands.inputs import read_inputs

if TYPE_CHECKING:
    from engb_core.io.tables.request import Request
    from engb_core.model import Joint, Model
    from engb_core.recording import Recording

__all__ = ['SURROGATE', 'Simulator', 'add_nominal', 'is_joint_file', 'model_given', 'simulator_of',
           'simulator_paths']

SURROGATE = 'surrogate.yaml'


@dataclass(frozen=True)
class Simulator:
    """What stands for somebody's simulator, and what is to be told of it, a sentence each."""

    model: Model
    told: tuple[str, ...]


def add_nominal(parser: argparse.ArgumentParser) -> None:
    """Add --model, --joint, --simulated, --fmu and --fmu-variable."""
    group = parser.add_argument_group(
        'nominal model', 'what the recordings are compared with; without any of these a first '
        'model is made of the recordings')
    which = group.add_mutually_exclusive_group()
    which.add_argument('--model', metavar='MODEL', help='a model file (.yaml), or a joint of a '
                       'MuJoCo model (.xml, .mjcf) or a .urdf')
    which.add_argument('--simulated', nargs='+', metavar='RECORDING', help='recordings or tables '
                       'that your simulator made: the result says what it lacks')
    which.add_argument('--fmu', metavar='FILE.fmu', help='your simulator as an FMU (FMI 2 or 3, '
                       'co-simulation; needs FMPy): it is driven along the recorded motion')
    group.add_argument('--joint', metavar='NAME', help='which joint of an .xml or .urdf, '
                       'or of recordings that hold several')
    group.add_argument('--fmu-variable', nargs='+', action='extend', default=[],
                       metavar='ROLE=NAME', help='which variable of the FMU is what: '
                       'effort=NAME position=NAME')


def model_given(arguments: argparse.Namespace) -> tuple[Model | None, tuple[str, ...]]:
    """Return the model that --model names, and what of its file it does not hold.

    Raises:
        InputError: it can't be read.
    """
    from engb_core.simulated.joint_files import model_of_joint
    path = arguments.model
    if path is None:
        return None, ()
    if not is_joint_file(path):
        model = read_model(path)
        # What the recordings call it may be none of the file's business.
        return (model if arguments.joint is None else replace(model, joint=replace(
            model.joint, name=arguments.joint))), ()
    model, lacks = model_of_joint(path, arguments.joint)
    return model, tuple(f'{Path(path).name}: not taken over: {line}' for line in lacks)


def is_joint_file(path: str | None) -> bool:
    """Whether --model names a robot's file, with joints in it."""
    from engb_core.simulated.joint_files import JOINT_FILES
    return path is not None and Path(path).suffix.lower() in JOINT_FILES


def simulator_paths(arguments: argparse.Namespace) -> tuple[str, ...]:
    """Return the files of the simulator that the options name; none: there is no simulator."""
    return tuple(arguments.simulated or ()) + ((arguments.fmu,) if arguments.fmu else ())


def simulator_of(arguments: argparse.Namespace, real: Sequence[Recording], joint: Joint,
                 request: Request, progress: Callable[[str], None]) -> Simulator:
    """Return the model that stands for the simulator of --simulated or --fmu.

    Raises:
        InputError: it can't be read or run, or moves too little.
    """
    from engb_core.simulated.clock_match import clock_match
    from engb_core.simulated.surrogate import surrogate_of
    if arguments.fmu:
        from engb_core.simulated.fmu_drive import recording_of_fmu
        simulated = [recording_of_fmu(arguments.fmu, run, _variables(arguments), progress)
                     for run in real]
        told: list[str] = [f'{Path(arguments.fmu).name} was driven along the recorded motion.']
    else:
        inputs = read_inputs(arguments.simulated, None, None, progress, request, arguments.joint,
                             other_joint=True)
        simulated, told = list(inputs.recordings), list(inputs.told)
        request = inputs.request
    surrogate = surrogate_of(simulated, real, joint, request.torque_constant, progress)
    if not arguments.fmu:
        units = ('rad', 'N·m') if joint.type == 'revolute' else ('m', 'N')
        for other in simulated:
            matches = [(run, match) for run in real
                       if (match := clock_match(run, other)) is not None]
            told += [match.statement(run.name, f'the simulated {other.name}', *units)
                     for run, match in matches]
            if not matches:
                told.append(f'The simulated {other.name} has not the same commands as '
                            f'{" or ".join(run.name for run in real)}: no clocks are compared.')
    return Simulator(surrogate.model, (*told, *surrogate.told()))


def _variables(arguments: argparse.Namespace) -> dict[str, str]:
    found = {}
    for text in arguments.fmu_variable:
        role, _, name = text.partition('=')
        if role not in ('effort', 'position') or not name:
            raise InputError(f'--fmu-variable {text}: write effort=NAME or position=NAME')
        found[role] = name
    return found
