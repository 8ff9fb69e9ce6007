# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The gallery has every effect and is made from the effects as they are now."""

from pathlib import Path

import pytest

from engb_core.effects.catalogue import catalogue
from engb_core.report.effect_pictures import effect_pictures, KINDS
from engb_core.report.pictures import Units
from tests.docs_scripts import docs_script

ROOT = Path(__file__).resolve().parents[2]
NAMED = [effect for effect in catalogue().values() if not effect.unnamed]


@pytest.fixture(scope='module')
def gallery():
    return docs_script('make_gallery')


def test_every_effect_is_in_it():
    text = (ROOT / 'docs/gallery.html').read_text(encoding='utf-8')
    assert [effect.id for effect in NAMED if f'<code>{effect.id}</code>' not in text] == []


def test_it_is_current(gallery):
    text = (ROOT / 'docs/gallery.html').read_text(encoding='utf-8')
    assert gallery.fingerprint() in text, 'run docs/make_gallery.py again'


@pytest.mark.parametrize('effect', NAMED, ids=lambda effect: effect.id)
def test_every_effect_says_how_it_is_drawn_and_told(effect):
    assert effect.picture
    assert set(effect.picture.split()) <= set(KINDS)
    assert effect.seen and effect.confused and effect.measure


@pytest.mark.parametrize('name', ['stribeck_friction', 'torque_saturation'])
def test_the_corrected_curve_lies_nearer_to_the_points(gallery, name):
    import numpy as np

    from engb_core.diagnose.diagnosis import Diagnosis
    traces, model = gallery.traces_of(catalogue()[name])
    units = Units(Diagnosis('explained', (), (), (), None, (), None, model))
    panel = effect_pictures(name, traces, model, units)[0].panels[0]
    before, after, measured = (np.asarray(entry.y) for entry in panel.series[:3])
    assert np.sum((after - measured) ** 2) < 0.1 * np.sum((before - measured) ** 2)
