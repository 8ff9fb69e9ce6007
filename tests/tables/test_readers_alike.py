# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A reader in this process and in one of its own: the same channels, numbers and complaints."""

from __future__ import annotations

import random

import numpy as np
import pytest

from engb_core.errors import InputError
from engb_core.io.tables.formats import kind_of, open_here
from engb_core.io.tables.open import open_table
from tests.fuzz.mutations import damage_bytes

from . import test_formats as formats

WRITTEN = [(formats.mdf, 'a.mf4'), (formats.mdf3, 'a.mdf'), (formats.mat73, 'a.mat'),
           (formats.ros1, 'a.bag'), (formats.ros1_numbers, 'a.bag'), (formats.tdms, 'a.tdms'),
           (formats.parquet, 'a.parquet'), (formats.arrow, 'a.arrow'),
           (formats.arrow_stream, 'a.arrow'), (formats.hdf5, 'a.h5'), (formats.mat5, 'a.mat'),
           (formats.simulink, 'a.mat'), (formats.logger, 'a.csv')]


@pytest.mark.parametrize(('write', 'name'), WRITTEN)
def test_here_and_apart_are_alike(tmp_path, write, name):
    path = tmp_path / name
    write(path)
    here, apart = open_here(path, kind_of(path)), open_table(path)
    assert here.channels == apart.channels and here.kind == apart.kind
    places = list(range(len(here.channels)))
    one, other = here.read(places), apart.read(places)
    for place in places:
        np.testing.assert_array_equal(one[place].value, other[place].value)
        assert (one[place].time is None) == (other[place].time is None)
        if one[place].time is not None:
            np.testing.assert_array_equal(one[place].time, other[place].time)


# asammdf's own end stumbles over a file that it could not open.
@pytest.mark.filterwarnings('ignore::pytest.PytestUnraisableExceptionWarning')
@pytest.mark.parametrize(('write', 'name'), WRITTEN)
def test_damage_is_told_in_one_line_or_read_around(tmp_path, write, name):
    """Whatever a reader's library raises on a broken file, it reaches nobody."""
    good = tmp_path / name
    write(good)
    data = good.read_bytes()
    told = 0
    for seed in range(12):
        rng = random.Random(seed)
        path = tmp_path / f'{seed}_{name}'
        path.write_bytes(data[:rng.randrange(len(data))] if seed < 4 else damage_bytes(data, rng))
        try:
            table = open_here(path, kind_of(path))
            for samples in table.read(range(len(table.channels))).values():
                assert samples.value.ndim == 1
                assert samples.time is None or samples.time.size == samples.value.size
        except InputError as error:
            told += 1
            assert str(error).startswith(f'{path}: ') and '\n' not in str(error)
        except MemoryError:
            told += 1       # the process apart tells it, with the bound that it has
    assert told or name.endswith('.csv')
