# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A bag of several joints: which one is meant is said by --joint, or by the model file."""

import dataclasses

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

import engb_core as library
from engb_core.errors import InputError
from engb_core.model import Joint, Model
from engb_ros.commands import diagnose

from .conftest import motion


@pytest.fixture
def two_joints(tmp_path):
    """A bag whose hip moves as a brake does, and whose knee stands."""
    store = get_typestore(Stores.ROS2_JAZZY)
    state = store.types['sensor_msgs/msg/JointState']
    header = store.types['std_msgs/msg/Header']
    stamp = store.types['builtin_interfaces/msg/Time']
    run = motion()
    path = tmp_path / 'legs'
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        to = writer.add_connection('/joint_states', state.__msgtype__, typestore=store)
        for time, angle, speed, effort in zip(*run.values(), strict=True):
            seconds, rest = divmod(round((1e9 + time) * 1e9), 1_000_000_000)
            told = state(header(stamp(seconds, rest), ''), ['hip', 'knee'],
                         *(np.array([value, 0.0]) for value in (angle, speed, effort)))
            writer.write(to, seconds * 1_000_000_000 + rest,
                         store.serialize_cdr(told, state.__msgtype__))
    return path


def test_which_joint_is_asked_with_the_way_to_say_it(refused, two_joints):
    for words in (['model', 'legs', '--out', 'm.yaml'], ['diagnose', 'legs', '--out', 'out'],
                  ['identify', 'legs', '--out', 'm.yaml']):
        refused(*words, words=['legs', "no joint 'motor' but hip, knee", '--joint NAME'])
        refused(*words, '--joint', 'toe', words=["no joint 'toe' but hip, knee"])
    with pytest.raises(InputError, match='hip, knee'):
        library.read(two_joints)
    assert np.ptp(library.read(two_joints, joint='hip').position) > 30.0


def test_a_model_is_made_of_the_joint_that_was_named(engb, two_joints, tmp_path):
    outcome = engb('model', 'legs', '--joint', 'hip', '--out', 'm.yaml')
    assert outcome.status == 0, outcome.err
    assert Model.read(tmp_path / 'm.yaml').joint == Joint('hip')


def test_the_named_joint_is_diagnosed_whatever_the_model_file_calls_it(
        engb, two_joints, model_file, monkeypatch):
    given = []

    def stop(recordings, model, **_):
        given.extend([recordings[0], model])
        raise InputError('enough')

    monkeypatch.setattr('engb_core.diagnose.engine.diagnose', stop)
    assert engb('diagnose', 'legs', '--model', model_file, '--joint', 'hip', '--out',
                'out').err == 'engb: enough\n'
    assert given[0].joint == given[1].joint.name == 'hip' and np.ptp(given[0].position) > 30.0
    given.clear()
    assert engb('diagnose', 'legs', '--joint', 'hip', '--out', 'out').err == 'engb: enough\n'
    assert given[1].joint.name == 'hip'


def test_a_joint_that_is_not_there_is_no_other_one(refused, bag, model_file):
    """A model file may call the only joint otherwise; whoever says --joint means it."""
    refused('diagnose', bag, '--model', model_file, '--joint', 'hip', '--out', 'out',
            words=['run1', "no joint 'hip' but 'motor'", '--joint motor'])


def test_a_robot_s_file_may_call_the_joint_otherwise(bag, monkeypatch, engb):
    model = dataclasses.replace(Model(), joint=Joint('shoulder'))
    monkeypatch.setattr(diagnose, 'model_given', lambda arguments: (model, ()))
    read = []

    def stop(recordings, *_, **__):
        read.append(recordings[0])
        raise InputError('enough')

    monkeypatch.setattr('engb_core.diagnose.engine.diagnose', stop)
    assert engb('diagnose', bag, '--model', 'robot.xml', '--joint', 'shoulder', '--out',
                'out').err == 'engb: enough\n'
    assert read[0].joint == 'motor'
