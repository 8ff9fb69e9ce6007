# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The contact angle: found, or told as not determined; never confidently wrong."""

from dataclasses import replace

import numpy as np
import pytest

from engb_core.bench.apparent import apparent_model
from engb_core.identify.contact import contact_estimate, contact_profile, fit_contacts, TOLERANCE
from engb_core.identify.procedure import identify
from engb_core.identify.regression import fit, Form
from engb_core.identify.smoothing import motions
from engb_core.model import Model
from engb_core.reproduce.drawn_brakes import draw_brake
from engb_core.reproduce.in_process import run_experiment
from engb_core.reproduce.plan import STROKES


def strokes_of(brake, seed=1):
    return run_experiment(replace(STROKES, brake=brake), Model(), seed)


@pytest.mark.parametrize('seed', range(6))
def test_contact_is_right_or_told_as_undetermined(seed):
    brake = draw_brake(seed)
    found = identify([strokes_of(brake, seed)])
    contact = found.estimates['contact_angle']
    true = apparent_model(brake).load_torque.contact_angle
    assert abs(contact.value - true) < 4.0 * contact.std
    if contact.determined:
        assert contact.value == pytest.approx(true, rel=TOLERANCE)
    else:
        assert 'not determined' in found.summary()
    assert [wave.order for wave in found.model.cogging] == [brake.cogging[0][0]]
    assert found.model.load_torque.coefficients[1] >= 0.0


def plain_fit(brake):
    pieces = [piece for piece in motions(strokes_of(brake)) if piece.rows.size]
    start = {'inertia': 7e-5, 'viscous_friction': 1e-3, 'coulomb': 0.01,
             'saturation_velocity': 1.5}
    return pieces, fit(pieces, Form(orders=tuple(wave[0] for wave in brake.cogging)), start)


def test_profile_is_what_the_fit_gives_with_the_contact_held():
    pieces, plain = plain_fit(draw_brake(3))
    profile = contact_profile(pieces, plain.form, plain.values, np.array([3.0, 5.0, 7.0]))
    for angle, squares, numbers in zip(profile.angles, profile.squares, profile.numbers,
                                       strict=True):
        held = fit(pieces, replace(plain.form, contact=True, held=frozenset(
            {'contact_angle', 'saturation_velocity'})), numbers)
        # The profile lets friction's growth with load go free: it can only be lower.
        assert squares <= float(held.residual @ held.residual) * (1.0 + 1e-9)
        assert squares == pytest.approx(float(held.residual @ held.residual), rel=0.15)
        assert numbers['contact_angle'] == angle


def test_a_rival_that_fits_as_well_is_told():
    pieces, plain = plain_fit(draw_brake(3))
    best = fit_contacts(pieces, plain)[0]
    other = replace(best, values=best.values | {
        'contact_angle': best.values['contact_angle'] + 2.0})
    estimate = contact_estimate([best, other], 0.0)
    assert not estimate.determined
    assert estimate.std > 2.0
    assert 'fits as well' in estimate.remark
    worse = replace(other, rms=1.2 * best.rms)
    assert 'fits as well' not in contact_estimate([best, worse], 0.0).remark
