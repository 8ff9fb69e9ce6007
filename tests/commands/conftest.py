# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Small recordings and models, and the program as a process."""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest

from engb_core.io.bags.write import FloatTable, JointTable, write_bag
from engb_core.model import Model

ROOT = Path(__file__).resolve().parents[2]


@dataclass
class Outcome:
    """How a call of `engb` ended."""

    status: int
    out: str
    err: str


@pytest.fixture
def engb(capsys, tmp_path, monkeypatch):
    """Call `engb` in this process, in an empty folder."""
    from engb_ros.commands.main import main
    monkeypatch.chdir(tmp_path)

    def call(*arguments) -> Outcome:
        status = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Outcome(status, captured.out, captured.err)

    return call


@pytest.fixture
def refused(engb):
    """Call `engb` and assert that it ends in status 2 and one line with the words given."""

    def call(*arguments, words=()) -> None:
        outcome = engb(*arguments)
        assert outcome.status == 2, outcome
        assert outcome.out == ''
        lines = outcome.err.splitlines()
        assert len(lines) == 1, outcome.err
        for word in words:
            assert word in lines[0], lines[0]

    return call


def start(*arguments, **options) -> subprocess.Popen:
    """Start `engb` as a process."""
    environment = os.environ | {'PYTHONPATH': str(ROOT)}
    return subprocess.Popen(
        [sys.executable, '-m', 'engb_ros.commands.main', *map(str, arguments)],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


@pytest.fixture
def model_file(tmp_path) -> Path:
    """The default model, written."""
    path = tmp_path / 'model.yaml'
    Model().write(path)
    return path


def motion(size: int = 4000, rate: float = 1000.0) -> dict[str, np.ndarray]:
    """Strokes of a brake without load: time [s], position [rad], velocity, effort [N·m]."""
    time = np.arange(size) / rate
    position = 20 + 20 * np.sin(2 * np.pi * time - np.pi / 2)
    velocity = np.gradient(position, time)
    effort = 6.8e-5 * np.gradient(velocity, time) + 1.1e-3 * velocity + 0.01 * np.tanh(velocity)
    return {'time': time, 'position': position, 'velocity': velocity,
            'effort': effort + 1e-3 * np.random.default_rng(1).standard_normal(size)}


@pytest.fixture
def bag(tmp_path) -> Path:
    """A good recording."""
    run = motion()
    time = 1.7e9 + run['time']
    path = tmp_path / 'run1'
    write_bag(path, {
        '/engb/joint_states': JointTable(time, run['position'], run['velocity'], run['effort']),
        '/engb/reference': JointTable(time, run['position'], run['velocity'], 0 * time),
        '/engb/disc_speed': FloatTable(time, 0 * time)})
    return path
