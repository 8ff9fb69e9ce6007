# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model, a motion, and the program, called here or as a process."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from engb_core.model import Model

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def engb(capsys, tmp_path, monkeypatch):
    """Call `engb` in this process, in an empty folder."""
    from engb_ros.commands.main import main
    monkeypatch.chdir(tmp_path)

    def call(*arguments) -> SimpleNamespace:
        status = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return SimpleNamespace(status=status, out=captured.out, err=captured.err)

    return call


@pytest.fixture
def refused(engb):
    """Call `engb` and assert that it ends in status 2 and one line with the words given."""

    def call(*arguments, words=()) -> None:
        outcome = engb(*arguments)
        assert (outcome.status, outcome.out) == (2, ''), outcome
        assert outcome.err.count('\n') == 1
        assert all(word in outcome.err for word in words), outcome.err

    return call


def start(*arguments) -> subprocess.Popen:
    """Start `engb` as a process."""
    return subprocess.Popen(
        [sys.executable, '-m', 'engb_ros.commands.main', *map(str, arguments)],
        env=os.environ | {'PYTHONPATH': str(ROOT)}, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True)


@pytest.fixture
def model_file(tmp_path) -> Path:
    """The default model, written."""
    path = tmp_path / 'model.yaml'
    Model().write(path)
    return path


def motion(size: int, rate: float) -> dict[str, np.ndarray]:
    """Strokes of a brake without load: time [s], position [rad], velocity, effort [N·m]."""
    time = np.arange(size) / rate
    position = 20 + 20 * np.sin(2 * np.pi * time - np.pi / 2)
    velocity = np.gradient(position, time)
    effort = 6.8e-5 * np.gradient(velocity, time) + 1.1e-3 * velocity + 0.01 * np.tanh(velocity)
    return {'time': time, 'position': position, 'velocity': velocity,
            'effort': effort + 1e-3 * np.random.default_rng(1).standard_normal(size)}
