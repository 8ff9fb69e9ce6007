# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The unit's functions called as a simulator calls them: states as copies and as bytes."""

from __future__ import annotations

import ctypes
from pathlib import Path
import re
from types import SimpleNamespace
import zipfile

import pytest

from engb_core.effect_check import MODEL
from engb_core.export.fmu import compiler, write_fmu

pytestmark = pytest.mark.skipif(compiler() is None, reason='no C compiler (cc, gcc, clang)')
OK, ERROR = 0, 3
STEP = 0.002
# Value references.
EFFORT, POSITION, VELOCITY, ACTED_REFERENCE, RECORDED_EFFORT, NONE = 1, 4, 5, 10, 14, 15


@pytest.fixture(params=[2, 3])
def unit(request, tmp_path: Path) -> SimpleNamespace:
    """Return an initialised instance of the FMU, with what differs between the versions."""
    version = request.param
    path = tmp_path / 'unit.fmu'
    write_fmu(MODEL, path, version)
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    library = ctypes.CDLL(str(next((tmp_path / 'binaries').rglob('*.so'))))
    text = (tmp_path / 'modelDescription.xml').read_text('utf8')
    token = re.search(r'(?:guid|instantiationToken)="([^"]*)"', text)[1].encode()
    make = library.fmi2Instantiate if version == 2 else library.fmi3InstantiateCoSimulation
    make.restype = ctypes.c_void_p

    def made(token: bytes, kind: int = 1) -> ctypes.c_void_p:
        found = (make(b'unit', kind, token, None, None, 0, 0) if version == 2 else
                 make(b'unit', token, None, False, False, False, False, None, 0, None, None,
                      None))
        return ctypes.c_void_p(found)

    def call(two: str, three: str, *arguments: object) -> int:
        name = f'fmi2{two}' if version == 2 else f'fmi3{three}'
        return getattr(library, name)(instance, *arguments)

    def step(duration: float = STEP) -> int:
        flags = [ctypes.c_bool() for _ in range(3)]
        more = (0,) if version == 2 else (
            False, *(ctypes.byref(flag) for flag in flags), ctypes.byref(ctypes.c_double()))
        return call('DoStep', 'DoStep', ctypes.c_double(0.0), ctypes.c_double(duration), *more)

    def values(name: str, reference: int, given: float = 0.0) -> tuple[int, float]:
        number = ctypes.c_double(given)
        count = ctypes.c_size_t(1)
        status = call(f'{name}Real', f'{name}Float64', (ctypes.c_uint * 1)(reference), count,
                      ctypes.byref(number), *(() if version == 2 else (count,)))
        return status, number.value

    instance = made(token)
    assert instance
    assert call('ExitInitializationMode', 'ExitInitializationMode') == OK

    def advanced() -> list[float]:
        assert values('Set', EFFORT, 0.1) == (OK, 0.1)
        assert [step() for _ in range(50)] == [OK] * 50
        return [values('Get', reference)[1] for reference in (POSITION, VELOCITY)]

    return SimpleNamespace(made=made, token=token, call=call, step=step, values=values,
                           advanced=advanced, version=version)


def test_a_unit_is_made_for_its_own_token_only(unit):
    assert unit.made(unit.token)
    assert not unit.made(b'another')
    assert not unit.made(None)
    if unit.version == 2:
        assert not unit.made(unit.token, 0)      # model exchange


def test_a_step_needs_a_duration_above_0(unit):
    for duration in (0.0, -STEP, float('nan')):
        assert unit.step(duration) == ERROR
    assert unit.step() == OK


def test_what_is_given_out_is_not_set_and_others_are_refused(unit):
    for reference in (0, POSITION, ACTED_REFERENCE, RECORDED_EFFORT):
        assert unit.values('Get', reference)[0] == OK
        assert unit.values('Set', reference, 1.0)[0] == ERROR
    assert unit.values('Get', NONE)[0] == ERROR


def test_a_state_is_kept_taken_up_written_and_read(unit):
    unit.advanced()
    state, size = ctypes.c_void_p(), ctypes.c_size_t()
    kept = ctypes.byref(state)
    for _ in range(2):                            # made, and used again
        assert unit.call('GetFMUstate', 'GetFMUState', kept) == OK
    once = unit.advanced()
    assert unit.advanced() != once
    assert unit.call('SetFMUstate', 'SetFMUState', state) == OK
    assert unit.advanced() == once
    assert unit.call('SerializedFMUstateSize', 'SerializedFMUStateSize', state,
                     ctypes.byref(size)) == OK
    assert size.value > 0
    content = (ctypes.c_char * size.value)()
    short = ctypes.c_size_t(size.value - 1)
    assert unit.call('SerializeFMUstate', 'SerializeFMUState', state, content, short) == ERROR
    assert unit.call('SerializeFMUstate', 'SerializeFMUState', state, content, size) == OK
    assert unit.call('FreeFMUstate', 'FreeFMUState', kept) == OK
    assert state.value is None
    assert unit.call('DeSerializeFMUstate', 'DeserializeFMUState', content, short, kept) == ERROR
    assert state.value is None
    assert unit.call('DeSerializeFMUstate', 'DeserializeFMUState', content, size, kept) == OK
    assert unit.call('SetFMUstate', 'SetFMUState', state) == OK
    assert unit.advanced() == once
    assert unit.call('FreeFMUstate', 'FreeFMUState', kept) == OK
