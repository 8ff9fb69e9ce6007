# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Recordings and nominal models as the plain methods read them: with nothing of the tool."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores
import yaml

from .nominal import low_pass, Nominal

__all__ = ['at_full_speed', 'in_units', 'model_in_units', 'RATE', 'read_nominal', 'read_samples',
           'read_signals', 'Samples', 'Signals']

RATE = 500.0


@dataclass(frozen=True)
class Signals:
    """A recording on an even grid; disc and temperature None where not recorded."""

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    effort: np.ndarray
    disc: np.ndarray | None
    temperature: np.ndarray | None


@dataclass(frozen=True)
class Samples:
    """What a bag holds, in order of time: stamps [s from the first], position, effort, others.

    `others` has (times [s], values) of disc_speed and pad_temperature where recorded.
    """

    time: np.ndarray
    position: np.ndarray
    effort: np.ndarray
    others: dict[str, tuple[np.ndarray, np.ndarray]]


def read_samples(path: Path) -> Samples:
    """Read a bag's joint_states (finite ones, a stamp once) and what the disc does."""
    rows: list[tuple[float, float, float]] = []
    others: dict[str, list[tuple[float, float]]] = {'disc_speed': [], 'pad_temperature': []}
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        wanted = [c for c in reader.connections
                  if c.topic.rsplit('/', 1)[1] in ('joint_states', *others)]
        for link, logged, raw in reader.messages(connections=wanted):
            name, message = link.topic.rsplit('/', 1)[1], reader.deserialize(raw, link.msgtype)
            if name == 'joint_states':
                stamp = message.header.stamp
                rows.append((stamp.sec + 1e-9 * stamp.nanosec, message.position[0],
                             message.effort[0]))
            else:
                others[name].append((1e-9 * logged, message.data))
    table = np.array(rows)
    begin = table[:, 0].min()
    table = table[np.isfinite(table).all(axis=1)]
    stamp, first = np.unique(table[:, 0] - begin, return_index=True)
    found = {name: np.array(values).T for name, values in others.items() if values}
    return Samples(stamp, table[first, 1], table[first, 2],
                   {name: (data[0] - begin, data[1]) for name, data in found.items()})


@lru_cache(maxsize=8)
def read_signals(path: Path) -> Signals:
    """Read a bag (the last few are kept); positions and effort low-passed at 150 Hz alike."""
    samples = read_samples(path)
    fine = np.arange(0.0, samples.time[-1], 0.5 / RATE)
    position, effort = (low_pass(np.interp(fine, samples.time, values), 2.0 * RATE, 150.0)
                        for values in (samples.position, samples.effort))
    velocity = np.gradient(position) * 2.0 * RATE
    smooth = [one[::2] for one in (position, velocity, np.gradient(velocity) * 2.0 * RATE, effort)]
    time = fine[::2]
    extra = [np.interp(time, *samples.others[name]) if name in samples.others else None
             for name in ('disc_speed', 'pad_temperature')]
    return Signals(time, *smooth, *extra)


def read_nominal(path: Path) -> Nominal:
    """The numbers of a nominal model file."""
    content = yaml.safe_load(path.read_text('utf8'))
    motor, load, friction = content['motor'], content['load_torque'], content['friction']
    turn, contact = 0.0, load.get('contact_angle')
    if load.get('form') == 'sinusoid':
        size, phase, turn = load['amplitude'], load['phase'], 1.0
        coefficients = (size * float(np.cos(phase)), size * float(np.sin(phase)), 0.0, 0.0)
    else:
        coefficients = (*load['coefficients'], 0.0, 0.0, 0.0, 0.0)[:4]
    return Nominal(motor['inertia'], motor['viscous_friction'], tuple(coefficients), contact,
                   friction['coulomb'], friction['load_gain'], friction['saturation_velocity'],
                   turn)


def at_full_speed(run: Signals) -> float:
    """The unit of angle in which a recording's full speed is 60: what counts as standing."""
    return float(np.abs(run.velocity).max()) / 60.0


def in_units(run: Signals, unit: float) -> Signals:
    """The recording with its angles in this unit."""
    return replace(run, position=run.position / unit, velocity=run.velocity / unit,
                   acceleration=run.acceleration / unit)


def model_in_units(model: Nominal, unit: float) -> Nominal:
    """The model for angles in this unit; torques stay."""
    load = model.load if model.turn else tuple(
        p * unit ** k for k, p in enumerate(model.load))
    return replace(model, inertia=model.inertia * unit, viscous=model.viscous * unit, load=load,
                   contact=None if model.contact is None else model.contact / unit,
                   saturation=model.saturation / unit, turn=model.turn * unit)
