# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Small files made to take memory or time: each kind as a call of `engb`.

A bomb follows from its kind and its random generator alone. What a reader must do with it: end
within a minute and a gigabyte, with a result or with one line.
"""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from pathlib import Path
import random
import sqlite3
import struct
import sys
import zipfile
import zlib

import numpy as np
import yaml

from engb_core.io.bags.write import joint_state_rows, JointTable, write_bag
from engb_core.model import Model

__all__ = ['BOMBS', 'make_bomb']

_JOINT_STATES, _KIND = '/engb/joint_states', 'sensor_msgs/msg/JointState'
_TIME = 1_767_000_000_000_000_000
_IMPORT = ['--column', 'time=t', '--column', 'position=q', '--column', 'effort=i']


def make_bomb(kind: str, folder: Path, rng: random.Random) -> list[str]:
    """Make the files of a bomb in `folder`; return what `engb` is called with, but for --out."""
    return BOMBS[kind](folder, rng)


def _model(folder: Path) -> Path:
    path = folder / 'model.yaml'
    if not path.exists():
        Model().write(path)
    return path


def _rows(size: int, rng: random.Random, joint: str = 'motor') -> tuple[np.ndarray, np.ndarray]:
    """Return log times (n,) [ns] and serialised JointStates (n, size) of a plain motion."""
    stamp = _TIME + 1_000_000 * np.arange(size)
    angle = np.sin(np.arange(size) / rng.choice([30.0, 100.0]))
    return stamp, joint_state_rows(stamp, angle, angle, 0.1 * angle, joint)


def _bag(folder: Path, name: str = 'run', storage: str = 'mcap') -> Path:
    path = folder / name
    stamp = _TIME + 1_000_000 * np.arange(3000)
    angle = 20 * np.sin(np.arange(3000) / 100)
    write_bag(path, {_JOINT_STATES: JointTable(stamp, angle, None, 0.01 * np.sign(angle))},
              storage)
    return path


# Bags.

def _nested_metadata(folder: Path, rng: random.Random) -> list[str]:
    bag = _bag(folder)
    depth = rng.choice([10_000, 100_000, 400_000])
    (bag / 'metadata.yaml').write_text(rng.choice([
        '[' * depth + ']' * depth, 'a: ' + '{b: ' * depth, '- ' * depth,
        '? ' * depth, ''.join(' ' * n + 'a:\n' for n in range(1200))]))
    return ['predict', str(bag), '--model', str(_model(folder))]


def _one_file_many_names(folder: Path, rng: random.Random) -> list[str]:
    bag = _bag(folder)
    name = next(entry.name for entry in bag.iterdir() if entry.suffix == '.mcap')
    entries = ''.join(f'  - {name}\n' for _ in range(rng.choice([10_000, 100_000])))
    (bag / 'metadata.yaml').write_text(
        'rosbag2_bagfile_information:\n  relative_file_paths:\n' + entries)
    return ['predict', str(bag), '--model', str(_model(folder))]


def _record(opcode: int, body: bytes) -> bytes:
    return struct.pack('<BQ', opcode, len(body)) + body


def _text(text: str) -> bytes:
    return struct.pack('<I', len(text)) + text.encode()


def _mcap_heads() -> bytes:
    return (_record(3, struct.pack('<H', 1) + _text(_KIND) + _text('ros2msg') + _text(''))
            + _record(4, struct.pack('<HH', 1, 1) + _text(_JOINT_STATES) + _text('cdr')
                      + struct.pack('<I', 0)))


def _message(time: int, payload: bytes) -> bytes:
    return _record(5, struct.pack('<HIQQ', 1, 0, time, time) + payload)


def _chunk(records: bytes, compression: str = '', claimed: int | None = None) -> bytes:
    packed = records
    return _record(6, struct.pack('<QQQI', _TIME, _TIME, len(records) if claimed is None
                                  else claimed, 0)
                   + _text(compression) + struct.pack('<Q', len(packed)) + packed)


def _mcap(path: Path, body: bytes, chunk_starts: list[int] | None = None) -> Path:
    """Write an MCAP file of these records with a summary."""
    head = b'\x89MCAP0\r\n' + _record(1, _text('ros2') + _text(''))
    body = head + body + _record(15, struct.pack('<I', 0))
    summary = _mcap_heads() + b''.join(
        _record(8, struct.pack('<QQQQ', _TIME, _TIME, start, 100) + bytes(20))
        for start in chunk_starts or [])
    foot = _record(2, struct.pack('<QQI', len(body), 0, 0)) + b'\x89MCAP0\r\n'
    path.write_bytes(body + summary + foot)
    return path


def _mcap_index(folder: Path, rng: random.Random) -> list[str]:
    """An index of thousands of entries, all of them on one message of megabytes."""
    times, rows = _rows(100, rng)
    large = rows[0].tobytes() + bytes(rng.choice([1 << 20, 4 << 20]))
    records = _message(_TIME, large) + b''.join(
        _message(int(time), row.tobytes()) for time, row in zip(times, rows, strict=True))
    count = rng.choice([3000, 30_000])
    index = struct.pack('<HI', 1, 16 * count) + struct.pack('<QQ', _TIME, 0) * count
    path = _mcap(folder / 'run.mcap', _mcap_heads() + _chunk(records) + _record(7, index))
    return ['predict', str(path), '--model', str(_model(folder))]


def _mcap_bad_chunks(folder: Path, rng: random.Random) -> list[str]:
    """A summary that names very many chunks where there are none, or all of the file in each."""
    count = rng.choice([20_000, 100_000])
    kind = rng.choice(['none', 'whole', 'head'])
    head = {'none': b'\x05' + struct.pack('<Q', 1 << 40), 'whole': b'\x06' + struct.pack(
        '<Q', 1 << 27), 'head': _chunk(b'', 'zstd', 1 << 20)[:40]}[kind]
    begin = 8 + 17
    path = _mcap(folder / 'run.mcap', head * count, [begin + len(head) * n for n in range(count)])
    return ['predict', str(path), '--model', str(_model(folder))]


def _zstd(data: bytes, repeat: int) -> bytes:
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    packer = zstd.ZstdCompressor()
    parts = [packer.compress(data) for _ in range(repeat)]
    return b''.join([*parts, packer.flush()])


def _zstd_chunk(folder: Path, rng: random.Random) -> list[str]:
    """Chunks that unpack to a gigabyte of zeros, or to as much as may be, many times."""
    size, count = rng.choice([(1024, 1), (255, 1), (255, 40), (4096, 1)])
    claimed = size << 20
    zeros = _zstd(bytes(1 << 20), min(size, 1024))
    one = _record(6, struct.pack('<QQQI', _TIME, _TIME, claimed, 0) + _text('zstd')
                  + struct.pack('<Q', len(zeros)) + zeros)
    path = _mcap(folder / 'run.mcap', _mcap_heads() + one * count)
    return ['predict', str(path), '--model', str(_model(folder))]


def _zstd_messages(folder: Path, rng: random.Random) -> list[str]:
    """A chunk of millions of valid, equal messages."""
    times, rows = _rows(1, rng)
    record = _message(int(times[0]), rows[0].tobytes())
    block = record * ((1 << 20) // len(record))
    repeat = rng.choice([20, 200])
    packed = _zstd(block, repeat)
    chunk = _record(6, struct.pack('<QQQI', _TIME, _TIME, len(block) * repeat, 0) + _text('zstd')
                    + struct.pack('<Q', len(packed)) + packed)
    path = _mcap(folder / 'run.mcap', _mcap_heads() + chunk)
    return ['predict', str(path), '--model', str(_model(folder))]


def _zstd_file(folder: Path, rng: random.Random) -> list[str]:
    """A whole file that unpacks to gigabytes."""
    path = folder / f'run.{rng.choice(["mcap", "db3"])}.zstd'
    head = rng.choice([b'', b'\x89MCAP0\r\n' + _mcap_heads()])
    path.write_bytes(_zstd(head, 1) * bool(head) + _zstd(bytes(1 << 20), rng.choice([500, 4000])))
    return ['predict', str(path), '--model', str(_model(folder))]


def _sqlite(folder: Path, rng: random.Random) -> list[str]:
    """Views without end, computed columns, virtual tables where tables should be."""
    path = folder / 'run.db3'
    _, rows = _rows(1, rng)
    hexed = rows[0].tobytes().hex()
    endless = ('WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n{end}) '
               'SELECT i AS id, 1 AS topic_id, i AS timestamp, {data} AS data FROM n')
    topics = ('CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT, '
              'serialization_format TEXT, offered_qos_profiles TEXT)')
    messages = ('CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, '
                'timestamp INTEGER, data BLOB)')
    kind = rng.choice(['endless', 'large', 'topics', 'generated', 'stored', 'virtual', 'cross'])
    with contextlib.closing(sqlite3.connect(path)) as base:
        if kind == 'topics':
            base.execute(messages)
            base.execute('CREATE VIEW topics AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL '
                         'SELECT i + 1 FROM n) SELECT i AS id, \'/engb/joint_states\' || i '
                         f'AS name, \'{_KIND}\' AS type, \'cdr\' AS serialization_format FROM n')
            base.commit()
            return ['predict', str(path), '--model', str(_model(folder))]
        base.execute(topics)
        base.execute('INSERT INTO topics VALUES (1, ?, ?, \'cdr\', \'\')', (_JOINT_STATES, _KIND))
        if kind == 'endless':
            base.execute('CREATE VIEW messages AS ' + endless.format(end='', data=f"x'{hexed}'"))
        elif kind == 'large':
            base.execute('CREATE VIEW messages AS ' + endless.format(
                end=' WHERE i < 3000', data=f'zeroblob({rng.choice([4, 900])}000000)'))
        elif kind in ('generated', 'stored'):
            base.execute('CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, '
                         'timestamp INTEGER, data BLOB GENERATED ALWAYS AS (zeroblob('
                         f'{4_000_000 if kind == "generated" else 1000})) '
                         f'{"VIRTUAL" if kind == "generated" else "STORED"})')
            base.executemany('INSERT INTO messages (topic_id, timestamp) VALUES (1, ?)',
                             ((n,) for n in range(5000)))
        elif kind == 'virtual':
            base.execute('CREATE VIRTUAL TABLE messages USING fts5(topic_id, timestamp, data)')
        else:
            base.execute('CREATE TABLE m (i INTEGER)')
            base.executemany('INSERT INTO m VALUES (?)', ((n,) for n in range(3000)))
            base.execute(f'CREATE VIEW messages AS SELECT a.i AS id, 1 AS topic_id, a.i AS '
                         f'timestamp, x\'{hexed}\' AS data FROM m a, m b, m c')
        base.commit()
    return ['predict', str(path), '--model', str(_model(folder))]


def _sqlite_tree(folder: Path, rng: random.Random) -> list[str]:
    """A database whose pages all name each other: a tree of few pages and endless leaves."""
    bag = _bag(folder, storage='sqlite3')
    path = next(entry for entry in bag.iterdir() if entry.suffix == '.db3')
    data = bytearray(path.read_bytes())
    size = int.from_bytes(data[16:18], 'big')
    pages = [number for number in range(1, len(data) // size) if data[number * size] in (5, 13)]
    interior = [number for number in pages if data[number * size] == 5]
    leaves = [number for number in pages if data[number * size] == 13]
    for number in interior:
        base = number * size
        for cell in range(int.from_bytes(data[base + 3:base + 5], 'big')):
            place = base + int.from_bytes(data[base + 12 + 2 * cell:base + 14 + 2 * cell], 'big')
            data[place:place + 4] = struct.pack('>I', rng.choice(leaves[:2] or pages) + 1)
    path.write_bytes(data)
    return ['predict', str(path), '--model', str(_model(folder))]


def _bursts(folder: Path, rng: random.Random) -> list[str]:
    """Samples at 100 kHz in bursts, almost a minute between them."""
    burst = rng.choice([50, 100, 300])
    number = np.arange(3000)
    stamp = _TIME + 10_000 * number + (number // burst) * rng.choice([1, 10, 58]) * 10**9
    angle = np.sin(number / 30.0)
    write_bag(folder / 'run', {_JOINT_STATES: JointTable(stamp, angle, angle, 0.1 * angle)})
    return [rng.choice(['predict', 'diagnose', 'identify']), str(folder / 'run'), '--model',
            str(_model(folder))]


# Model files.

def _yaml_aliases(folder: Path, rng: random.Random) -> list[str]:
    depth = rng.choice([9, 20, 40])
    parts = ['&a0 [' + ', '.join(['x'] * 9) + ']']
    parts += [f'&a{n} [' + ', '.join([f'*a{n - 1}'] * 9) + ']' for n in range(1, depth)]
    bomb = '[' + ', '.join(parts) + ']'
    text = yaml.safe_dump(Model().to_mapping())
    place = rng.choice(['inertia: ', 'format: ', 'type: ', 'effects: ', 'cogging: ', 'form: '])
    start = text.index(place) + len(place)
    text = text[:start] + bomb + text[text.index('\n', start):]
    (folder / 'model.yaml').write_text(text)
    return ['predict', str(_bag(folder)), '--model', str(folder / 'model.yaml')]


def _large_model(folder: Path, rng: random.Random) -> list[str]:
    text = yaml.safe_dump(Model().to_mapping())
    kind = rng.choice(['cogging', 'comment', 'name', 'deep', 'some', 'twice', 'key', 'number'])
    entry = '- {order: 1.0, amplitude: 1.0e-5, phase: 0.0}\n'
    text += {'cogging': '', 'some': '', 'comment': '#' + 'x' * 15_000_000,
             'name': 'joint: {name: ' + 'x' * 15_000_000 + '}\n', 'deep': 'x: ' + '[' * 200_000,
             'twice': 'motor: {inertia: 1.0e-5, viscous_friction: 0.0}\n',
             'key': 'k' * 200_000 + ': 1\n', 'number': 'format: ' + '9' * 200_000}[kind]
    if kind in ('cogging', 'some'):
        text = text.replace('cogging: []\n', 'cogging:\n' + entry * (
            300_000 if kind == 'cogging' else rng.choice([100, 4000])))
    (folder / 'model.yaml').write_text(text)
    return [rng.choice(['predict', 'identify']), str(_bag(folder)), '--model',
            str(folder / 'model.yaml')]


def _loop_rate(folder: Path, rng: random.Random) -> list[str]:
    from engb_core.model import Controller
    rate = rng.choice([1e9, 1e6, 1e5, 1e-9, 1e300])
    Model(controller=Controller(0.05, 0.2, 0.002, 0.6, rate)).write(folder / 'model.yaml')
    stamp = _TIME + rng.choice([1_000_000, 900_000_000]) * np.arange(3000)
    angle = 20 * np.sin(np.arange(3000) / 100)
    table = JointTable(stamp, angle, None, 0.01 * np.sign(angle))
    write_bag(folder / 'run', {_JOINT_STATES: table,
                               '/engb/reference': JointTable(stamp, angle, None, None)})
    return ['predict', str(folder / 'run'), '--model', str(folder / 'model.yaml')]


def _slow(folder: Path, rng: random.Random) -> list[str]:
    """Samples a second or a minute apart, over hours or days: a fine grid would be endless."""
    from engb_core.model import Controller
    Model(controller=Controller(0.05, 0.2, 0.002, 0.6, 1000.0)).write(folder / 'model.yaml')
    count, step = rng.choice([(1200, 1), (30_000, 1), (3000, 58)])
    stamp = _TIME + step * 1_000_000_000 * np.arange(count)
    angle = 20 * np.sin(np.arange(count) / 10)
    table = JointTable(stamp, angle, None, 0.01 * np.sign(angle))
    write_bag(folder / 'run', {_JOINT_STATES: table,
                               '/engb/reference': JointTable(stamp, angle, None, None)})
    return [rng.choice(['predict', 'diagnose', 'identify']), str(folder / 'run'), '--model',
            str(folder / 'model.yaml')]


# Tables.

def _npz(folder: Path, rng: random.Random) -> list[str]:
    """An archive of zeros, a header that claims more than there is, an object, a nested zip."""
    path = folder / 'bench.npz'
    size = rng.choice([3000, 1 << 28, 1 << 45, 2**62])
    kind = rng.choice(['zeros', 'header', 'object', 'structure', 'dimensions'])
    with zipfile.ZipFile(path, 'w', zipfile.ZIP_DEFLATED) as archive:
        for name in 'tqi':
            shape = f'({size},)' if kind != 'dimensions' else '(' + '1,' * 500 + ')'
            kinds = {'object': "'|O'", 'structure': repr([('a', '<f8')] * 1)}
            head = (f"{{'descr': {kinds.get(kind, repr('<f8'))}, 'fortran_order': False, "
                    f"'shape': {shape}, }}").encode()
            with archive.open(f'{name}.npy', 'w', force_zip64=True) as file:
                file.write(b'\x93NUMPY\x01\x00' + struct.pack('<H', len(head)) + head)
                count = (3 << 30) >> 20 if kind == 'zeros' and size == 1 << 28 else 1
                for _ in range(count):
                    file.write(bytes(1 << 20))
    return ['import', str(path), *_IMPORT]


def _element(kind: int, body: bytes) -> bytes:
    return struct.pack('<II', kind, len(body)) + body + bytes(-len(body) % 8)


def _matrix(name: str, flags: int, shape: tuple[int, ...], body: bytes) -> bytes:
    content = (_element(6, struct.pack('<II', flags, 0))
               + _element(5, struct.pack(f'<{len(shape)}i', *shape))
               + _element(1, name.encode()) + body)
    return struct.pack('<II', 14, len(content)) + content


def _mat(folder: Path, rng: random.Random) -> list[str]:
    """Cells in cells in cells, gigabytes of zeros, a size that is not there."""
    path = folder / 'bench.mat'
    head = b'MATLAB 5.0 MAT-file'.ljust(124) + struct.pack('<H', 0x0100) + b'IM'
    kind = rng.choice(['cells', 'zeros', 'claims', 'version4'])
    if kind == 'cells':
        body = _matrix('', 6, (1, 1), _element(9, struct.pack('<d', 1.0)))
        for _ in range(rng.choice([100, 20_000])):
            # By hand: an element around all that is there, without copying it each time.
            content = (_element(6, struct.pack('<II', 1, 0))
                       + _element(5, struct.pack('<ii', 1, 1)) + _element(1, b't'))
            body = struct.pack('<II', 14, len(content) + len(body)) + content + body
            if len(body) > 1_000_000:
                break
        content = body
    elif kind == 'zeros':
        size = 1 << 28
        packer = zlib.compressobj()
        start = (_element(6, struct.pack('<II', 6, 0)) + _element(5, struct.pack('<ii', size, 1))
                 + _element(1, b't') + struct.pack('<II', 9, 8 * size & 0xffffffff))
        parts = [packer.compress(struct.pack('<II', 14, 0xffffff00) + start)]
        parts += [packer.compress(bytes(1 << 20)) for _ in range(2000)]
        packed = b''.join([*parts, packer.flush()])
        content = struct.pack('<II', 15, len(packed)) + packed
    elif kind == 'claims':
        content = _matrix('t', 6, (2**31 - 1, 2**31 - 1), _element(9, bytes(800)))
    else:
        head = struct.pack('<5i', 0, 2**31 - 1, 2**30, 0, 2) + b't\0'
        content = bytes(1000)
    path.write_bytes(head + content)
    return ['import', str(path), *_IMPORT]


def _csv(folder: Path, rng: random.Random) -> list[str]:
    """Lines without end, columns without number, quotes that never close, zeros, other codes."""
    path = folder / 'bench.csv'
    plain = 't,q,i\n' + ''.join(f'{n / 1000},{n % 7},{n % 3}\n' for n in range(300))
    kind = rng.choice(['line', 'columns', 'quote', 'zeros', 'utf16', 'returns', 'long', 'digits',
                       'binary', 'wide'])
    content: bytes = {
        'line': lambda: b'1' * 300_000_000,
        'columns': lambda: b',' * 50_000_000,
        'quote': lambda: b't,q,i\n0,"' + b'x,\n' * 20_000_000,
        'zeros': lambda: bytes(300_000_000),
        'utf16': lambda: plain.encode('utf-16'),
        'returns': lambda: plain.replace('\n', '\r').encode(),
        'long': lambda: plain.encode() + b'0,1,' + b'2' * 100_000 + b'\n',
        'digits': lambda: plain.encode() + ('1e999999999,' * 2 + '9' * 5000 + '\n').encode(),
        'binary': lambda: rng.randbytes(1_000_000),
        'wide': lambda: b't,q,i' + b',x' * 100_000 + b'\n' + (b'1,2,3' + b',4' * 100_000
                                                             + b'\n') * 30,
    }[kind]()
    path.write_bytes(content)
    return ['import', str(path), *_IMPORT]


_LISTED = ['--column', 'time=t', '--column', 'position=q', '--column', 'effort=i', '--unit',
           'time=s', 'position=rad', 'effort=Nm']


def _hdf5(folder: Path, rng: random.Random) -> list[str]:
    """Terabytes that a few kilobytes claim or unfold to, links in a circle, groups in groups."""
    import h5py
    path = folder / 'bench.h5'
    kind = rng.choice(['fill', 'gzip', 'circle', 'deep', 'many', 'text', 'compound', 'virtual',
                       'external', 'references'])
    with h5py.File(path, 'w') as file:
        for name in 'tqi':
            if kind == 'fill':          # never written: the fill value for ever
                file.create_dataset(name, (1 << 40,), 'f8', chunks=(1 << 20,), fillvalue=1.0)
            elif kind == 'gzip':
                data = file.create_dataset(name, (1 << 27,), 'f8', chunks=(1 << 27,),
                                           compression='gzip', compression_opts=1)
                data.id.write_direct_chunk((0,), zlib.compress(bytes(1 << 24)))
            elif kind == 'compound':
                file.create_dataset(name, (100,), [(f'f{k}', 'f8') for k in range(500)])
            elif kind == 'virtual':
                layout = h5py.VirtualLayout((1 << 40,), 'f8')
                layout[:100] = h5py.VirtualSource('.', name, (100,))
                file.create_virtual_dataset(name, layout)
            elif kind == 'external':
                file[name] = h5py.ExternalLink('/dev/zero', 'x')
            elif kind == 'references':
                made = file.create_dataset(name, (3000,), h5py.ref_dtype)
                made[0] = made.ref
            elif kind == 'text':
                file.create_dataset(name, data=['x' * 1000] * 3000)
            else:
                file.create_dataset(name, data=np.arange(3000) / 1e3)
        if kind == 'circle':
            file['a/b/c'] = h5py.SoftLink('/a')
            file['hard'] = file['/']
        if kind == 'deep':
            group = file
            for _ in range(1500):
                group = group.create_group('g')
        if kind == 'many':
            for number in range(60_000):
                file.create_group(f'g{number}')
    return ['import', str(path), *_LISTED]


def _parquet(folder: Path, rng: random.Random) -> list[str]:
    """Columns that unfold from bytes to gigabytes, types within types."""
    import pyarrow
    from pyarrow import feather, parquet
    kind = rng.choice(['nulls', 'runs', 'dictionary', 'nested', 'strings', 'wide', 'feather'])
    path = folder / ('bench.arrow' if kind == 'feather' else 'bench.parquet')
    count = 60_000_000
    if kind in ('nulls', 'runs', 'dictionary', 'feather'):
        column = {'nulls': lambda: pyarrow.nulls(count, pyarrow.float64()),
                  'dictionary': lambda: pyarrow.DictionaryArray.from_arrays(
                      pyarrow.array(np.zeros(count // 2, np.int8)), pyarrow.array(['x' * 10000])),
                  }.get(kind, lambda: pyarrow.array(np.zeros(count)))()
        table = pyarrow.table(dict.fromkeys('tqi', column))
    elif kind == 'nested':
        column = pyarrow.array([1.0] * 100)
        for _ in range(200):
            column = pyarrow.StructArray.from_arrays([column], ['s'])
        table = pyarrow.table(dict.fromkeys('tqi', column))
    elif kind == 'strings':
        table = pyarrow.table(dict.fromkeys('tqi', ['7' * 100_000] * 3000))
    else:
        plain = np.arange(50.0)
        table = pyarrow.table(dict.fromkeys(['t', 'q', 'i', *map(str, range(30000))], plain))
    if kind == 'feather':
        feather.write_feather(table, str(path), compression='zstd')
    else:
        parquet.write_table(table, path, compression='zstd')
    return ['import', str(path), *_LISTED]


def _tdms(folder: Path, rng: random.Random) -> list[str]:
    """Segments that claim more samples than the file holds, or thousands of channels."""
    path = folder / 'bench.tdms'
    kind = rng.choice(['claims', 'channels', 'strings', 'length'])

    def text(value: str) -> bytes:
        return struct.pack('<I', len(value)) + value.encode()

    names = [f"/'b'/'{name}'" for name in 'tqi']
    if kind == 'channels':
        names += [f"/'b'/'c{number}'" for number in range(40_000)]
    count = {'claims': 1 << 40, 'length': 100}.get(kind, 10)
    objects = struct.pack('<I', len(names))
    for name in names:
        objects += text(name) + struct.pack('<IIIQ', 20, 0x20 if kind == 'strings' else 10, 1,
                                            count)
        if kind == 'strings':
            objects += struct.pack('<Q', 1 << 60)
        objects += struct.pack('<I', 0)
    data = bytes(8 * 10 * 3)
    total = (1 << 62) if kind == 'length' else len(objects) + len(data)
    head = b'TDSm' + struct.pack('<IIQQ', 0x0e, 4713, total, len(objects))
    path.write_bytes((head + objects + data) * (1 if kind == 'channels' else 3))
    return ['import', str(path), *_LISTED]


def _mdf(folder: Path, rng: random.Random) -> list[str]:
    """An honest measurement whose blocks point at each other, or claim gigabytes."""
    import asammdf
    path = folder / 'bench.mf4'
    time = np.arange(3000) / 1e3
    with asammdf.MDF(version='4.10') as file:
        file.append([asammdf.Signal(np.sin(9 * time + k), time, unit=unit, name=name)
                     for k, (name, unit) in enumerate((('q', 'rad'), ('i', 'Nm')))])
        file.save(path, overwrite=True, compression=rng.choice([0, 1, 2]))
    data = bytearray(path.read_bytes())
    starts = [place for place in range(len(data) - 24)
              if data[place:place + 2] == b'##' and data[place + 2:place + 4].isalpha()]
    for _ in range(rng.choice([1, 2, 5])):
        place = rng.choice(starts)
        count = struct.unpack_from('<Q', data, place + 16)[0]
        link = place + 24 + 8 * rng.randrange(max(min(count, 8), 1))
        if link + 8 <= len(data):
            struct.pack_into('<Q', data, link, rng.choice(
                [place, rng.choice(starts), 0, len(data) + 5, (1 << 63) - 1]))
        if rng.random() < 0.4:
            struct.pack_into('<Q', data, place + rng.choice([8, 16]),
                             rng.choice([1 << 40, (1 << 64) - 1, 24, 0]))
    path.write_bytes(data)
    return ['import', str(path), '--column', 'position=q', '--column', 'effort=i']


def _labels(folder: Path, rng: random.Random) -> list[str]:
    """Text with a label before each number, bars, codes of the east, and much too much of it."""
    path = folder / 'bench.txt'
    kind = rng.choice(['labels', 'long label', 'colons', 'bars', 'rules', 'east', 'mixed',
                       'signs'])
    rows = [(k / 1e3, k % 7, k % 3) for k in range(3000)]
    content = {
        'labels': lambda: ''.join(f't:{t},q:{q},i:{i}\n' for t, q, i in rows).encode(),
        'long label': lambda: ''.join(f'{"t" * 2000}:{t},q:{q},i:{i}\n' for t, q, i in rows
                                      ).encode(),
        'colons': lambda: (b't' + b':' * 900_000 + b'1,q:2,i:3\n') * 50,
        'bars': lambda: b'|t|q|i|\n' + b'|' * 1_000_000 + b'\n' + b'|1|2|3|\n' * 3000,
        'rules': lambda: b'|t|q|i|\n' + b'|---|:-:|---|\n' * 300_000 + b'|1|2|3|\n' * 50,
        'east': lambda: '時間,位置,電流\n'.encode('cp932') * 40_000 + rng.randbytes(200_000),
        'mixed': lambda: ''.join(rng.choice([f't:{t},q:{q},i:{i}', f'{t},{q},{i}']) + '\n'
                                 for t, q, i in rows).encode(),
        'signs': lambda: ''.join(f't=:{t},q:={q},i={i}\n' for t, q, i in rows).encode(),
    }[kind]()
    path.write_bytes(content)
    return ['import', str(path), *_IMPORT]


BOMBS: dict[str, Callable[[Path, random.Random], list[str]]] = {
    'nested metadata': _nested_metadata, 'one file of many names': _one_file_many_names,
    'mcap index': _mcap_index, 'bad chunks': _mcap_bad_chunks, 'zstd chunk': _zstd_chunk,
    'zstd messages': _zstd_messages, 'zstd file': _zstd_file, 'sqlite': _sqlite,
    'sqlite tree': _sqlite_tree, 'bursts': _bursts, 'yaml aliases': _yaml_aliases,
    'large model': _large_model, 'loop rate': _loop_rate, 'slow samples': _slow, 'npz': _npz,
    'mat': _mat, 'csv': _csv, 'hdf5': _hdf5, 'parquet': _parquet, 'tdms': _tdms, 'mdf': _mdf,
    'labels': _labels,
}
