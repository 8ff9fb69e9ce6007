# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""One damaged case per seed: a bag, a model file and a call of `engb`."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
import io
from pathlib import Path
import random
import tempfile

import numpy as np
import yaml

from engb_core.io.bags.write import FloatTable, JointTable, write_bag
from engb_core.model import Cogging, Controller, Friction, LoadTorque, Model

from .bombs import BOMBS, make_bomb
from .mutations import damage_bytes, damage_text, NUMBERS
from .tables import make_table, TABLES

__all__ = ['COMMANDS', 'Case', 'make_any', 'make_case', 'warm_up']

COMMANDS = ('diagnose', 'predict', 'identify', 'survey')
FORMATS = [('mcap', 'none'), ('mcap', 'chunk'), ('mcap', 'message'), ('mcap', 'file'),
           ('sqlite3', 'none'), ('sqlite3', 'file')]
RATE, SIZE = 200.0, 1200

MODEL = Model(
    load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4), contact_angle=5.0),
    friction=Friction(0.012, 0.11, 1.5), cogging=(Cogging(6.0, 1e-4, 0.1),),
    controller=Controller(0.05, 0.2, 0.002, 0.6, 1000.0))


@dataclass(frozen=True)
class Case:
    """What a seed gives.

    Attributes:
        arguments: of `engb`, within the case's folder.
        out: what the command writes.
        about: what was damaged, in words.
    """

    arguments: list[str]
    out: str
    about: str


_OUT = {'predict': 'out.npz', 'identify': 'out.yaml', 'diagnose': 'result', 'import': 'rec',
        'survey': 'fleet'}


def make_any(seed: int, folder: Path, commands: list[str] | None = None) -> Case:
    """Make case `seed`: a damaged table, bag or model, or a file made to take memory or time."""
    if commands:
        return make_case(seed, folder, tuple(commands))
    rng = random.Random(seed)
    draw = rng.random()
    if draw < 0.40:
        # A diagnosis takes a hundred times as long as a prediction.
        command = 'identify' if draw < 0.02 else 'diagnose' if draw < 0.023 else 'predict'
        return make_case(seed, folder, (command,))
    if draw < 0.98:
        arguments, about = make_table(seed, folder)
    else:
        about = rng.choice(list(BOMBS))
        arguments = make_bomb(about, folder, rng)
    out = str(folder / _OUT[arguments[0]])
    if '--list' not in arguments:
        arguments = [*arguments, '--out', out]
    return Case(arguments, out, about)


def warm_up() -> None:
    """Import what the cases need, and compile what `predict` computes with."""
    from engb_ros.commands.main import main
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bag = folder / 'run'
        _write(bag, motion(random.Random(0)), 'mcap', 'none')
        MODEL.write(folder / 'model.yaml')
        with contextlib.redirect_stdout(io.StringIO()):
            main(['predict', str(bag), '--model', str(folder / 'model.yaml'), '--out',
                  str(folder / 'out.npz')])
            for name in TABLES:
                TABLES[name](folder / name)
                main(['import', '--list', str(folder / name)])


def make_case(seed: int, folder: Path, commands: tuple[str, ...] = COMMANDS) -> Case:
    """Make the input files of case `seed` in `folder` and say how to call `engb`."""
    rng = random.Random(seed)
    command = commands[seed % len(commands)]
    kind = rng.choice(['bytes', 'bytes', 'values', 'values', 'model', 'model', 'both'])
    about = [command, kind]
    columns = motion(rng)
    if kind in ('values', 'both'):
        about.append(damage_values(columns, rng))
    bag = folder / 'run'
    storage, compression = rng.choice(FORMATS)
    about.append(f'{storage} {compression}')
    _write(bag, columns, storage, compression)
    if kind in ('bytes', 'both'):
        bag = _damage_file(bag, rng)
    model = folder / 'model.yaml'
    _write_model(model, rng if kind in ('model', 'both') else None)
    out = {'diagnose': 'result', 'predict': 'out.npz', 'identify': 'out.yaml',
           'survey': 'fleet'}[command]
    arguments = [command, str(bag), '--model', str(model), '--out', str(folder / out)]
    return Case(arguments, str(folder / out), ' '.join(about))


def motion(rng: random.Random) -> dict:
    """Strokes into contact and back, with a torque that fits MODEL but for Stribeck friction."""
    random_ = np.random.default_rng(rng.randrange(2**32))
    time = np.arange(SIZE) / RATE
    position = 20 - 20 * np.cos(2 * np.pi * 0.5 * time) + 2 * np.sin(2 * np.pi * 1.7 * time)
    velocity = np.gradient(position, time)
    load = np.polyval([2e-4, 1e-3, 0], np.maximum(position - 5, 0))
    friction = (0.012 + 0.11 * load) * np.tanh(velocity) * (1 + 0.5 * np.exp(-np.abs(velocity)))
    effort = 6.8e-5 * np.gradient(velocity, time) + 1.1e-3 * velocity + load + friction
    return {'stamp': 1_767_000_000_000_000_000 + np.rint(time * 1e9).astype(np.int64),
            'position': position + 1e-3 * random_.standard_normal(SIZE), 'velocity': velocity,
            'effort': effort + 1e-3 * random_.standard_normal(SIZE),
            'reference': position, 'joint': 'motor', 'speed': 5 * np.cos(time)}


def damage_values(columns: dict, rng: random.Random) -> str:
    """Damage what the bag says, not how it says it; return in words how."""
    kind = rng.choice(['numbers', 'constant', 'few', 'stamps', 'jump', 'order', 'scale', 'rate',
                       'velocity', 'names', 'noise', 'still', 'step'])
    name = rng.choice(['position', 'velocity', 'effort', 'reference', 'speed'])
    size = columns['stamp'].size
    if kind == 'numbers':
        for _ in range(rng.choice([1, 3, 100, 2000])):
            columns[name][rng.randrange(size)] = rng.choice(NUMBERS)
    elif kind == 'constant':
        columns[name][:] = rng.choice(NUMBERS)
    elif kind == 'few':
        _keep(columns, slice(0, rng.choice([0, 1, 2, 5, 19, 20, 21, 40, 100])))
    elif kind == 'stamps':
        columns['stamp'][:] = rng.choice([0, 1, 2**31 * 10**9 - 1, -10**9]) + rng.choice(
            [0, 1, 1000]) * np.arange(size)
    elif kind == 'jump':
        place = rng.randrange(size)
        columns['stamp'][place:] += rng.choice([10**6, 10**9, 60 * 10**9, 3600 * 10**9,
                                                20 * 3600 * 10**9, 10**17, -10**9])
    elif kind == 'order':
        order = list(range(size))
        rng.shuffle(order)
        _keep(columns, np.array(order))
    elif kind == 'scale':
        columns[name] *= rng.choice(NUMBERS)
    elif kind == 'rate':
        step = rng.choice([1, 1000, 10**5, 10**8, 10**9, 100 * 10**9])
        columns['stamp'] = columns['stamp'][0] + step * np.arange(size)
    elif kind == 'velocity':
        columns['velocity'] = None
    elif kind == 'names':
        columns['joint'] = rng.choice(['', 'x', 'ü' * 300, 'motor\n', '\0'])
    elif kind == 'noise':
        columns[name] = np.random.default_rng(rng.randrange(2**32)).standard_normal(size)
    elif kind == 'still':
        columns['position'][:] = 3.0
        columns['velocity'][:] = 0.0
    else:
        columns[name] = np.where(np.arange(size) < rng.randrange(size), 0.0, rng.choice(NUMBERS))
    return f'{kind} {name}'


def _keep(columns: dict, which: slice | np.ndarray) -> None:
    for name, column in columns.items():
        if isinstance(column, np.ndarray):
            columns[name] = column[which]


def _write(path: Path, columns: dict, storage: str, compression: str) -> None:
    stamp = columns['stamp']
    write_bag(path, {
        '/engb/joint_states': JointTable(stamp, columns['position'], columns['velocity'],
                                         columns['effort'], columns['joint'],
                                         log_time=np.maximum(stamp, 0) + 300_000),
        '/engb/reference': JointTable(stamp, columns['reference'], None, None, columns['joint'],
                                      log_time=np.maximum(stamp, 0)),
        '/engb/disc_speed': FloatTable(np.maximum(stamp, 0), columns['speed']),
    }, storage, compression)


def _damage_file(bag: Path, rng: random.Random) -> Path:
    """Damage one file of a bag; return the path to hand over, the folder's or the file's."""
    storage = next(entry for entry in bag.iterdir() if entry.name != 'metadata.yaml')
    target = bag / 'metadata.yaml' if rng.random() < 0.1 else storage
    data = target.read_bytes()
    if rng.random() < 0.3 and storage.suffix == '.mcap':
        # Within the messages: their structure is plain where nothing is compressed.
        # A JointState of the joint starts 28 bytes before the joint's name.
        place = data.rfind(b'motor\0', 0, rng.randrange(1, len(data)))
        if place > 60:
            start = place - 60      # takes the record's head in
            data = data[:start] + damage_bytes(data[start:start + 120], rng) + data[start + 120:]
    else:
        data = damage_bytes(data, rng)
    target.write_bytes(data)
    return bag if rng.random() < 0.5 else storage


def _write_model(path: Path, rng: random.Random | None) -> None:
    if rng is None:
        MODEL.write(path)
        return
    if rng.random() < 0.4:
        path.write_bytes(damage_text(yaml.safe_dump(MODEL.to_mapping()), rng))
        return
    data = MODEL.to_mapping()
    data['effects'] = rng.choice([[], _effects(rng), _effects(rng)])
    for _ in range(rng.choice([1, 1, 2])):
        place, keys = data, list(_leaves(data))
        *way, last = rng.choice(keys)
        for key in way:
            place = place[key]
        place[last] = rng.choice([*NUMBERS, *NUMBERS, None, 'x', [], {}, [1e9] * 3, -5])
    path.write_text(yaml.safe_dump(data), encoding='utf-8')


def _effects(rng: random.Random) -> list[dict]:
    """Effects out of the library with numbers out of nowhere."""
    from engb_core.effects.catalogue import catalogue
    found = []
    for _ in range(rng.choice([1, 2])):
        name = rng.choice([*_EFFECTS, *catalogue(), 'no_such_effect'])
        wanted = _EFFECTS.get(name, ()) if rng.random() < 0.8 else [rng.choice(_PARAMETERS)]
        found.append({'effect': name, 'parameters': {
            key: rng.choice([*NUMBERS, 0.1, 0.3, 2.0, 20.0]) for key in wanted}})
    return found


_EFFECTS = {
    'inertia_error': ('inertia',), 'contact_shift': ('shift',), 'torque_offset': ('offset',),
    'load_stiffness_error': ('scale',), 'load_dependent_friction': ('load_gain',),
    'asymmetric_friction': ('asymmetry',),
    'stribeck_friction': ('breakaway_ratio', 'stribeck_velocity'),
    'presliding_friction': ('presliding_distance',), 'friction_drift': ('friction_ratio',),
    'cogging_torque': ('order', 'amplitude'), 'torque_ripple': ('order', 'relative_amplitude'),
    'torque_saturation': ('torque_loss',), 'actuation_lag': ('lag',), 'backlash': ('gap',),
    'drivetrain_resonance': ('frequency',), 'load_hysteresis': ('hysteresis_ratio',),
    'pad_creep': ('relaxed_fraction', 'time_constant'), 'self_energizing': ('load_ratio',),
    'pad_friction_fade': ('ratio_change',), 'disc_runout': ('amplitude',),
}
_PARAMETERS = sorted({name for names in _EFFECTS.values() for name in names})


def _leaves(data, way=()):
    """Yield the paths of everything in nested mappings and lists."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items:
        yield (*way, key)
        if isinstance(value, (dict, list)) and value:
            yield from _leaves(value, (*way, key))
