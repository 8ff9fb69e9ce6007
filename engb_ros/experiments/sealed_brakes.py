# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Brakes drawn by another process, identified on live nodes; their seals are opened last."""

from __future__ import annotations

from collections.abc import Callable
import json
from pathlib import Path
import subprocess
import sys
from typing import Any

from engb_core.control.clamp_force import read_mechanism
from engb_core.errors import InputError
from engb_core.io.sealed import digest, read_sealed
from engb_core.model import Model
from engb_core.recording import Recording
from engb_core.reproduce.blind import estimate_brake
from engb_core.reproduce.opened_seals import open_brakes, SealedBrakes
from engb_core.reproduce.plan import Experiment
from engb_ros.experiments.draw_brake import DRAWING, SEAL
from engb_ros.experiments.live_experiments import record_experiment

__all__ = ['identify_sealed', 'open_all']

FOUND, MODEL = 'found.json', 'node.yaml'
Progress = Callable[[str], None]


def identify_sealed(folder: Path, count: int, seed: int, progress: Progress) -> None:
    """Draw `count` brakes, run each on live nodes and identify it; nothing is opened.

    Each brake leaves FOLDER/brake_K with its seal, its drawing, what was found, and the model
    that the identifier's node wrote.

    Args:
        folder: made anew.
        count: how many.
        seed: of the sensor noise.
        progress: told how far it is.

    Raises:
        InputError: a brake cannot be drawn.
        RunnerError: a node ended or did not answer.
    """
    for number in range(1, count + 1):
        place = folder / f'brake_{number}'
        drawn = subprocess.run(
            [sys.executable, '-m', 'engb_ros.experiments.draw_brake', str(place)],
            capture_output=True, text=True, check=False)
        if drawn.returncode:
            raise InputError(f'a brake cannot be drawn: {drawn.stderr.strip()[-300:]}')
        told = drawn.stdout.strip()
        progress(f'sealed brake {number} of {count}: {told}')

        def record(experiment: Experiment, model: Model, place: Path = place) -> Recording:
            live = place / MODEL if experiment.name == 'strokes' else None
            return record_experiment(experiment, model, place / 'bags' / experiment.name,
                                     seed, progress, sealed=place / SEAL, identified=live)

        found = estimate_brake(record, read_mechanism(place / DRAWING))
        (place / FOUND).write_text(json.dumps({'digest': told, 'ways': found}, indent=1,
                                              ensure_ascii=False), encoding='utf-8')


def open_all(folder: Path, origin: str) -> SealedBrakes | None:
    """Open the seals of all brakes under `folder` and judge what was found; None: there are none.

    Raises:
        InputError: a seal is not the one whose digest was told before.
    """
    entries: list[tuple[str, Any, Any]] = []
    for place in sorted(folder.glob('brake_*'), key=lambda entry: int(entry.name[6:])):
        try:
            found = json.loads((place / FOUND).read_text(encoding='utf-8'))
            told = digest((place / SEAL).read_text(encoding='ascii'))
        except (OSError, ValueError) as error:
            raise InputError(f'{place}: no sealed brake that was identified ({error})') from error
        if told != found['digest']:
            raise InputError(f'{place}: the seal is not the one that was told before')
        entries.append((told, found['ways'], read_sealed(place / SEAL)))
    return open_brakes(entries, origin) if entries else None
