# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A sealed truth of this generator, as the scorer reads it."""
from __future__ import annotations

from pathlib import Path

import numpy as np

from .locate import BIN, Stretch
from .nominal import low_pass, moving, rms
from .score import CaseTruth
from .sealing import open_truth

__all__ = ['truth_of']


def truth_of(name: str, path: Path) -> CaseTruth:
    """Read the sealed truth of case `name`."""
    facts, arrays = open_truth(path)
    unit = facts.get('unit_of_angle', 1.0)
    true = arrays['test_effort'].astype(float)
    move = moving(arrays['test_velocity'] / unit)

    def size(effort: np.ndarray) -> float:
        return rms(low_pass(move * (effort - true), cutoff=facts['cutoff'])[move])

    def error(time: np.ndarray, effort: np.ndarray) -> float:
        return size(np.interp(np.arange(true.size) * 1e-3, time, effort))

    hidden = tuple(one['effect'] for one in facts['effects'])
    accepted = facts.get('accepted')
    if accepted is None:    # sealed before the truth told
        accepted = [*hidden, *(['self_energizing'] if 'pad_friction_fade' in hidden else [])]
    names = facts.get('recordings', ['train'])
    stretches = []
    for recording in names:
        energy = arrays[f'{recording}_energy'].astype(float)
        judged = arrays.get(f'{recording}_moves', np.ones(energy.size, bool))
        stretches.append(Stretch(recording, (np.arange(energy.size) + 0.5) * BIN, energy, judged))
    zones = {}
    if len(names) == 1:
        zones = {key: arrays[key] for key in ('train_energy', 'train_position', 'train_velocity')
                 if key in arrays} | {'unit': np.array(unit)}
    onset = facts.get('onset')
    parameters = tuple((one['effect'], key, value, ()) for one in facts['effects']
                       for key, value in one['parameters'].items())
    return CaseTruth(
        name, facts['stratum'], hidden, tuple(one['formulation'] for one in facts['effects']),
        tuple(accepted), size(arrays['test_nominal'].astype(float)),
        size(arrays['test_oracle'].astype(float)), facts['test_floor'], error, tuple(stretches),
        fair=tuple(facts.get('fair', ())), parameters=parameters,
        tags=tuple(facts.get('tags', ())), motion=facts['motion'], refitted=facts['refitted'],
        depends_on=tuple(tuple(group) for group in facts.get('depends_on', ())),
        memory=facts.get('memory', False),
        other_load_shape=facts.get('other_load_shape', False),
        held_out_scored=bool(facts['effects']), band=facts['cutoff'], zones=zones,
        onset=onset and (onset['recording'], float(onset['time'])))
