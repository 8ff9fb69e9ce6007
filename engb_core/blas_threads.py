# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Keeps the numeric libraries (BLAS, OpenMP) to one thread in a process.

A diagnosis runs its own fits side by side. A BLAS that takes all processors for each small product
as well makes them wait for each other, the more so beside other work.
"""

from __future__ import annotations

import os

__all__ = ['ONE_THREAD', 'one_blas_thread']

# Variables that the libraries read as they are loaded.
ONE_THREAD = dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS',
                            'NUMBA_NUM_THREADS'), '1')


def one_blas_thread() -> None:
    """Ask for one thread in this process and those that it starts, unless the environment says
    otherwise. Without effect once numpy has been imported."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
