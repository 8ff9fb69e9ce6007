# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Write recordings and model files the way a bench would leave them.

Messages are packed by patching a serialised template, since a case holds 10⁵ of them.
"""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
import shutil
import tempfile

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
import yaml

from .machines import Machine
from .nominal import Nominal
from .references import DiscProfile, Reference
from .sensors import Recorded
from .truth_plant import Run

__all__ = ['Bench', 'LAYOUTS', 'write_model', 'write_recording']

LAYOUTS = ('folder', 'folder', 'file', 'file', 'sqlite3', 'sqlite3_zstd', 'message_zstd', 'split')
_STORE = get_typestore(Stores.ROS2_JAZZY)
_MARKS = (1.0e10 + 1, 1.0e10 + 2, 1.0e10 + 3)


@dataclass(frozen=True)
class Bench:
    """Where and when a recording was made, and how it lies on the disc."""

    namespace: str
    layout: str
    start: int  # ns
    machine: Machine = Machine('brake')


def _joint_template(name: str) -> tuple[bytes, list[int]]:
    types = _STORE.types
    header = types['std_msgs/msg/Header'](
        stamp=types['builtin_interfaces/msg/Time'](sec=0, nanosec=0), frame_id='')
    message = types['sensor_msgs/msg/JointState'](
        header=header, name=[name], position=np.array(_MARKS[:1]),
        velocity=np.array(_MARKS[1:2]), effort=np.array(_MARKS[2:]))
    raw = bytes(_STORE.serialize_cdr(message, 'sensor_msgs/msg/JointState'))
    return raw, [raw.index(np.float64(mark).tobytes()) for mark in _MARKS]


def _joint_rows(name: str, stamp: np.ndarray, columns: list[np.ndarray]) -> list[bytes]:
    """Serialised JointState messages; `stamp` in ns."""
    raw, places = _joint_template(name)
    rows = np.tile(np.frombuffer(raw, np.uint8), (stamp.size, 1))
    rows[:, 4:8] = (stamp // 10**9).astype('<i4').view(np.uint8).reshape(-1, 4)
    rows[:, 8:12] = (stamp % 10**9).astype('<u4').view(np.uint8).reshape(-1, 4)
    for place, column in zip(places, columns, strict=True):
        data = np.ascontiguousarray(column, '<f8').view(np.uint8).reshape(-1, 8)
        rows[:, place:place + 8] = data
    return [row.tobytes() for row in rows]


def _float_rows(values: np.ndarray) -> list[bytes]:
    return [b'\x00\x01\x00\x00' + np.float64(v).tobytes() for v in values]


def _streams(bench: Bench, recorded: Recorded, run: Run, reference: Reference,
             model: Nominal, disc: DiscProfile | None, rng: np.random.Generator
             ) -> list[tuple[str, str, np.ndarray, list[bytes]]]:
    """(topic, type, log times in ns, messages) of every topic."""
    def nanoseconds(seconds: np.ndarray) -> np.ndarray:
        return bench.start + np.round(seconds * 1e9).astype(np.int64)

    def late(count: int) -> np.ndarray:
        return 4e-4 + np.minimum(rng.exponential(2.5e-4, count), 5e-3)

    joint, number = 'sensor_msgs/msg/JointState', 'std_msgs/msg/Float64'
    base, angle, torque = bench.namespace, bench.machine.angle, bench.machine.torque
    streams = [(f'{base}/joint_states', joint, nanoseconds(recorded.arrival),
                _joint_rows('motor', nanoseconds(recorded.stamp),
                            [recorded.position * angle, recorded.velocity * angle,
                             recorded.effort * torque]))]
    tick = np.arange(0, run.command.size, 2)
    streams.append((f'{base}/effort_command', number, nanoseconds(tick * 1e-3 + late(tick.size)),
                    _float_rows(np.round(run.command[tick] * 16384.0) / 16384.0 * torque)))
    tick = np.arange(0, run.command.size, 4)
    forward = model.inertia * reference.acceleration + model.viscous * reference.velocity
    columns = [reference.position[tick], reference.velocity[tick], forward[tick]]
    columns = [np.round(column * 32768.0) / 32768.0 * unit
               for column, unit in zip(columns, (angle, angle, torque), strict=True)]
    streams.append((f'{base}/reference', joint, nanoseconds(tick * 1e-3 + late(tick.size)),
                    _joint_rows('motor', nanoseconds(tick * 1e-3), columns)))
    if disc is not None:
        for name, every, values, grain in (('disc_speed', 10, disc.speed, 64.0),
                                           ('pad_temperature', 100, disc.temperature, 8.0)):
            tick = np.arange(0, values.size, every)
            noise = rng.normal(0.0, 0.02 if name == 'disc_speed' else 0.1, tick.size)
            noise[values[tick] == 0.0] = 0.0
            streams.append((f'{base}/{name}', number, nanoseconds(tick * 1e-3 + late(tick.size)),
                            _float_rows(np.round((values[tick] + noise) * grain) / grain)))
    return streams


def _write_bag(path: Path, streams: list, layout: str, span: tuple[float, float]) -> None:
    sqlite = layout.startswith('sqlite3')
    writer = Writer(path, version=8,
                    storage_plugin=StoragePlugin.SQLITE3 if sqlite else StoragePlugin.MCAP)
    if layout == 'sqlite3_zstd':
        writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    elif layout == 'message_zstd':
        writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    elif not sqlite:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        entries = []
        for topic, kind, times, rows in streams:
            link = writer.add_connection(topic, kind, typestore=_STORE)
            entries += [(t, link, row) for t, row in zip(times.tolist(), rows, strict=True)
                        if span[0] <= t < span[1]]
        entries.sort(key=lambda entry: entry[0])
        for t, link, row in entries:
            writer.write(link, t, row)


def _join(first: Path, second: Path, target: Path) -> None:
    """Two single-file bags become one split bag."""
    target.mkdir()
    infos = []
    for k, part in enumerate((first, second)):
        text = yaml.safe_load((part / 'metadata.yaml').read_text('utf8'))
        infos.append(text['rosbag2_bagfile_information'])
        name = f'{target.name}_{k}.mcap'
        shutil.move(str(next(part.glob('*.mcap'))), target / name)
        infos[k]['relative_file_paths'] = [name]
        infos[k]['files'][0]['path'] = name
    a, b = infos
    for key in ('relative_file_paths', 'files'):
        a[key] = a[key] + b[key]
    a['message_count'] += b['message_count']
    end = b['starting_time']['nanoseconds_since_epoch'] + b['duration']['nanoseconds']
    a['duration']['nanoseconds'] = end - a['starting_time']['nanoseconds_since_epoch']
    topics = 'topics_with_message_count'
    for one, other in zip(a[topics], b[topics], strict=True):
        one['message_count'] += other['message_count']
    text = yaml.safe_dump({'rosbag2_bagfile_information': a}, sort_keys=False)
    (target / 'metadata.yaml').write_text(text, 'utf8')


def write_recording(folder: Path, name: str, bench: Bench, recorded: Recorded, run: Run,
                    reference: Reference, model: Nominal, disc: DiscProfile | None,
                    rng: np.random.Generator) -> Path:
    """Write one recording below `folder`; returns the bag's path. `model` gave the feedforward."""
    streams = _streams(bench, recorded, run, reference, model, disc, rng)
    everything = (-1.0, 4e18)
    target = folder / name
    if bench.layout == 'split':
        middle = float(streams[0][2][streams[0][2].size // 2])
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            parts = [Path(scratch) / 'a', Path(scratch) / 'b']
            _write_bag(parts[0], streams, 'folder', (everything[0], middle))
            _write_bag(parts[1], streams, 'folder', (middle, everything[1]))
            _join(parts[0], parts[1], target)
        return target
    _write_bag(target, streams, bench.layout, everything)
    if bench.layout == 'file':
        single = folder / f'{name}.mcap'
        shutil.move(str(target / f'{name}.mcap'), single)
        shutil.rmtree(target)
        return single
    return target


def _load_torque(model: Nominal, machine: Machine) -> dict[str, object]:
    load = np.asarray(model.load) * machine.torque
    if model.turn:
        # The angle in the machine's own units is that inside times its unit, which is `turn`.
        return {'form': 'sinusoid', 'amplitude': _short(float(np.hypot(load[0], load[1]))),
                'phase': _short(float(np.arctan2(load[1], load[0])))}
    load = load / machine.angle ** np.arange(4)
    return {'form': 'polynomial', 'coefficients': [_short(x) for x in load],
            'contact_angle': None if model.contact is None
            else _short(model.contact * machine.angle)}


def _short(value: float) -> float:
    return float(f'{value:.6g}')


def write_model(path: Path, model: Nominal, plant: np.ndarray, machine: Machine) -> None:
    """Write the nominal model file, in the machine's own units."""
    p, per = plant[0], machine.torque / machine.angle
    content = {
        'format': 'engb-model/1',
        'motor': {'torque_constant': 0.0174, 'inertia': _short(model.inertia * per),
                  'viscous_friction': _short(model.viscous * per)},
        'load_torque': _load_torque(model, machine),
        'friction': {'coulomb': _short(model.coulomb * machine.torque),
                     'load_gain': _short(model.gain),
                     'saturation_velocity': _short(model.saturation * machine.angle)},
        'cogging': [],
        'controller': {'proportional': _short(p['kp'] * per), 'integral': _short(p['ki'] * per),
                       'derivative': _short(p['kd'] * per),
                       'effort_limit': _short(p['limit'] * machine.torque), 'rate': 1000.0},
        'effects': [],
    }
    if machine.kind == 'axis':
        content['joint'] = {'name': 'motor', 'type': 'prismatic'}
    path.write_text(yaml.safe_dump(content, sort_keys=False), 'utf8')
