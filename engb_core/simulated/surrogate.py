# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model that stands for somebody's simulator, identified from what it recorded.

The simulator's recording is diagnosed as a machine's would be: a first model of it, then the
physics that this leaves out. What comes of it, named and unnamed, is the surrogate: the nominal
model for the real recording, so that what a diagnosis names there is what the simulator lacks.

What the real recording could not show need not be described: effort noise of the real recording's
size is added to the simulator's, and the search ends where that noise begins.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from engb_core.diagnose.diagnosis import Diagnosis
from engb_core.diagnose.engine import diagnose
from engb_core.identify.first_model import first_model
from engb_core.model import Joint, Model
from engb_core.recording import Recording
from engb_core.signals.filtering import noise_of

__all__ = ['Surrogate', 'surrogate_of']


@dataclass(frozen=True)
class Surrogate:
    """A simulator as a model.

    Attributes:
        model: what stands for the simulator.
        diagnosis: of the simulator's recordings against their first model.
        remainder: what the surrogate misses of the simulator's effort where no fit saw it, root
            mean square [N·m].
        noise: what the added noise alone would leave there [N·m], None where that is not known.
    """

    model: Model
    diagnosis: Diagnosis
    remainder: float
    noise: float | None

    def told(self) -> tuple[str, ...]:
        """Return what is to be known of it, a sentence each."""
        unit = 'N·m' if self.model.joint.type == 'revolute' else 'N'
        held = [f'{entry.statement}' for entry in self.diagnosis.effects
                if entry.probability >= 0.5]
        lines = ['The simulator was described by a model of its own recording (a surrogate), '
                 f'which misses {self.remainder:.3g} {unit} rms of its effort'
                 + ('.' if self.noise is None else
                    f'; noise as in the real recording would leave {self.noise:.3g}.')]
        if held:
            lines.append('The simulator holds already: ' + ' '.join(held))
        if self.diagnosis.unexplained is not None and self.diagnosis.unexplained.share > 0.0:
            lines.append('Of the simulator the surrogate describes without a name: '
                         + self.diagnosis.unexplained.statement)
        if self.noise is not None and self.remainder > 2.0 * self.noise:
            lines.append('What the real machine and the simulator differ by below '
                         f'{self.remainder:.3g} {unit} may be the surrogate\'s own error.')
        return tuple(lines)


def surrogate_of(simulated: Sequence[Recording], real: Sequence[Recording],
                 joint: Joint | None = None, torque_constant: float | None = None,
                 progress: Callable[[str], None] | None = None) -> Surrogate:
    """Identify the model that stands for a simulator.

    Args:
        simulated: recordings that the simulator made, under any commands that move as far and as
            fast as the real ones.
        real: recordings of the machine; only their noise is used.
        joint: name and type (None: a revolute one of the recordings' name).
        torque_constant: [N·m/A], written into the model.
        progress: is told what is being done.

    Raises:
        InputError: too little motion.
    """
    tell = progress or (lambda text: None)
    level = float(np.median([noise_of(run.effort) for run in real]))
    noisy = [_with_noise(run, level, number) for number, run in enumerate(simulated)]
    tell('the simulator: a first model')
    first = first_model(noisy, joint, torque_constant, lambda text: tell(f'the simulator: {text}'))
    found = diagnose(noisy, first.model, progress=lambda text: tell(f'the simulator: {text}'))
    rows = [entry for entry in found.held_out if entry.quantity == 'effort']
    remainder = float(np.sqrt(np.mean([entry.rms_after ** 2 for entry in rows])))
    floors = [entry.noise_floor for entry in rows if entry.noise_floor is not None]
    floor = float(np.sqrt(np.mean(np.square(floors)))) if floors else None
    return Surrogate(found.model, found, remainder, floor)


def _with_noise(run: Recording, level: float, number: int) -> Recording:
    """Return the recording with as much effort noise as the real one has."""
    missing = np.sqrt(max(level ** 2 - noise_of(run.effort) ** 2, 0.0))
    draw = np.random.default_rng([29, number])
    return replace(run, effort=run.effort + draw.normal(0.0, missing, run.effort.size))
