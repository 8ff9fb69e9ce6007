# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A load's numbers as the model file has them: coefficients, contact angle, amplitude and phase.

A fit has other ones, columns that are scaled to the stroke and a sine beside a cosine, which are
well conditioned and say nothing to a reader.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engb_core.identify.load_forms import LoadForm
from engb_core.model import Joint, LoadTorque

__all__ = ['load_units', 'load_values']

Array = NDArray[np.float64]


def load_units(form: LoadForm, load: LoadTorque, joint: Joint) -> dict[str, str]:
    """Return the names of a load's numbers, in the model file's order, with their units.

    Args:
        form: of the load; 'offset' is the name of a constant's only number.
        load: what it came to.
        joint: tells angles from lengths.
    """
    angle, torque = ('rad', 'N·m') if joint.type == 'revolute' else ('m', 'N')
    if not form.names:
        return {}
    if load.form == 'sinusoid':
        return {'amplitude': torque, 'phase': 'rad'}
    if not form.has_load:
        return {'offset': torque}
    raised = ('', angle, *(f'{angle}{digit}' for digit in '²³⁴⁵'))
    units = {f'p{power}': torque + (f'/{raised[power]}' if power else '')
             for power in range(len(load.coefficients))}
    if load.contact_angle is not None:
        # Below its contact there is nothing: what is there at it is nothing, too.
        del units['p0']
        units['contact_angle'] = angle
    return units


def load_values(form: LoadForm, fitted: Array, near: LoadTorque) -> Array:
    """Return a load's numbers (k,), in the order of `load_units`.

    Args:
        form: of the load.
        fitted: (k,) the numbers of its columns.
        near: the load of the whole fit, by whose phase a turn more or less is told.
    """
    if not form.names:
        return np.zeros(0)
    load = form.load(fitted)
    if load.form == 'sinusoid':
        turned = math.remainder(load.phase - near.phase, 2.0 * math.pi)
        return np.array([load.amplitude, near.phase + turned])
    if load.contact_angle is None:
        return np.array(load.coefficients)
    return np.array([*load.coefficients[1:], load.contact_angle])
