# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Sealed folders hold recordings and a model, and nothing of the truth."""
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores
import yaml

from tests.proof.bagfile import Bench, LAYOUTS, write_recording
from tests.proof.cases import Request
from tests.proof.catalogue import known
from tests.proof.generate import generate, parse_strata, plan
from tests.proof.nominal import Nominal
from tests.proof.references import DiscProfile, Reference, short_test
from tests.proof.sealing import digest_of, open_truth
from tests.proof.sensors import draw_sensors, record
from tests.proof.test_truth_plant import plant_of
from tests.proof.truth_plant import simulate

STORE = get_typestore(Stores.ROS2_JAZZY)


@pytest.fixture(scope='module')
def sealed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, str]:
    root = tmp_path_factory.mktemp('sealed')
    digest = generate(2, 3, root / 'cases', root / 'truth', {'strong': 1.0}, effects=[
        'cogging_torque', 'self_energizing'])
    return root / 'cases', root / 'truth', digest


def test_folders_hold_no_truth(sealed: tuple[Path, Path, str]) -> None:
    cases, _, _ = sealed
    words = [name.encode() for name in known()] + [b'strong', b'subtle', b'outside', b'seed']
    for folder in cases.iterdir():
        tops = {p.name.partition('.')[0].partition('_')[0] for p in folder.iterdir()}
        assert tops == {'train', 'test', 'nominal'}
        for path in folder.rglob('*'):
            if path.is_file():
                content = path.read_bytes()
                assert not [word for word in words if word in content], path
        model = yaml.safe_load((folder / 'nominal.yaml').read_text('utf8'))
        assert model['effects'] == []
        assert set(model) - {'joint'} == {'format', 'motor', 'load_torque', 'friction', 'cogging',
                                          'controller', 'effects'}


def test_truth_tells_what_is_hidden(sealed: tuple[Path, Path, str]) -> None:
    _, truth, _ = sealed
    facts = [open_truth(path)[0] for path in sorted(truth.glob('case_*.npz'))]
    names = {one['effects'][0]['effect'] for one in facts}
    assert names == {'cogging_torque', 'self_energizing'}
    for one in facts:
        assert one['effects'][0]['ratio'] == pytest.approx(4.95, rel=0.5)
        assert one['effects'][0]['parameters']


def test_digest_notices_a_change(sealed: tuple[Path, Path, str]) -> None:
    _, truth, digest = sealed
    assert digest_of(truth) == digest
    path = sorted(truth.glob('case_*.npz'))[0]
    before = path.read_bytes()
    path.write_bytes(before + b' ')
    assert digest_of(truth) != digest
    path.write_bytes(before)
    assert digest_of(truth) == digest


def test_plan_meets_every_effect_and_keeps_the_shares() -> None:
    requests = plan(230, parse_strata('clean=1,strong=1'), np.random.default_rng(1))
    strong = [r.effects[0] for r in requests if r.stratum == 'strong']
    assert len(strong) == 115
    assert {strong.count(name) for name in set(strong)} == {5}
    assert all(isinstance(r, Request) for r in requests)


def cut(reference: Reference, seconds: float) -> Reference:
    n = int(seconds * reference.rate)
    return Reference(reference.position[:n], reference.velocity[:n],
                     reference.acceleration[:n], reference.rate)


@pytest.mark.parametrize('layout', sorted(set(LAYOUTS)))
def test_every_layout_can_be_read(layout: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    reference = cut(short_test(rng, plain=True), 5.0)
    still = np.zeros(reference.position.size)
    run = simulate(plant_of(counts=8192.0), reference)
    recorded = record(run, draw_sensors(rng), rng)
    model = Nominal(6e-5, 1e-3, (0.0, 0.0, 0.0, 0.0), None, 0.0, 0.0, 1.0)
    bench = Bench('/engb', layout, 1_700_000_000_000_000_000)
    path = write_recording(tmp_path, 'train', bench, recorded, run, reference, model,
                           DiscProfile(still, still + 25.0), rng)
    with AnyReader([path], default_typestore=STORE) as reader:
        got = [reader.deserialize(raw, link.msgtype)
               for link, _, raw in reader.messages() if link.topic == '/engb/joint_states']
        topics = {link.topic.rsplit('/', 1)[1] for link in reader.connections}
    assert topics == {'joint_states', 'effort_command', 'reference', 'disc_speed',
                      'pad_temperature'}
    assert len(got) == recorded.stamp.size
    assert np.array_equal([m.position[0] for m in got], recorded.position, equal_nan=True)
    assert np.array_equal([m.effort[0] for m in got], recorded.effort, equal_nan=True)
    assert got[0].name == ['motor']
