# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Node `identifier`: collects the strokes live and publishes what it identified from them."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
import math
import os
import sys
import threading
from typing import Any

import numpy as np
from sensor_msgs.msg import JointState
import yaml

from engb_core.control.feedforward import Feedforward
from engb_core.errors import InputError
from engb_core.identify.giving_up import GivenUp
from engb_core.io.outputs import file_output
from engb_core.model import Model
from engb_core.recording import Recording
from engb_ros import interface
from engb_ros.nodes.base import ManagedNode, run
from engb_ros.nodes.joint import JOINT, JointListener, with_joint
from engb_ros.nodes.messages import scalar, StampClock
from engb_ros.nodes.parameters import ParameterSpec, path_of

__all__ = ['IdentifierNode', 'main']


# An evaluation of a fit takes milliseconds. Only an identification that has just begun, and still
# imports what it needs, may take longer than this to be given up [s].
_LONGEST_EVALUATION = 1.0
_WORKER = 'identification'


class IdentifierNode(ManagedNode):
    """Steps 2 to 6 on the samples of the running brake.

    The identification runs in a thread of its own; the samples go on being collected. Once it
    is done, `load_torque` and `friction_torque` follow the measured angle and velocity. A node
    that ends, or is cleaned up, gives up what is under way.
    """

    node_name = 'identifier'
    parameters = (
        ParameterSpec('model', '', 'start model file; empty: the paper\'s nominal motor'),
        JOINT,
        ParameterSpec('model_out', '', 'file (.yaml) that service ~/write_model writes; one that '
                      'engb did not write, or that was changed since, stays; empty: it answers '
                      'with the YAML'),
        ParameterSpec('longest', 300.0, 'how much is collected; then the oldest half is dropped',
                      's', 1.0, 36000.0),
        ParameterSpec('period', 0.0, 'identify anew this often; 0: on request only', 's', 0.0,
                      36000.0),
        ParameterSpec('publish_every', 4, 'publish the torques every n-th sample', '', 1, 1000),
    )

    def configure(self, values: dict[str, Any]) -> None:
        """Get ready to collect."""
        self._start_model = with_joint(
            Model.read(values['model']) if values['model'] else Model(), values)
        self._joint = JointListener(self, self._start_model.joint.name)
        self._samples = [array('d') for _ in range(4)]
        self._stamps = StampClock()
        self._identified: Model | None = None
        self._torques: Feedforward | None = None
        self._worker: threading.Thread | None = None
        self._count = 0
        self._every = values['publish_every']
        self._publish_load = self.advertise(interface.LOAD_TORQUE).publish
        self._publish_friction = self.advertise(interface.FRICTION_TORQUE).publish
        self.listen(interface.JOINT_STATES, self._on_joint_states, every=True)
        self.serve(interface.IDENTIFY, self._identify)
        self.serve(interface.WRITE_MODEL, self._write_model)
        self.serve(interface.CLEAR, self._clear)
        if values['period'] > 0.0:
            self.every(values['period'], self._identify_again)

    def close(self) -> None:
        """Give up an identification under way: it takes up to a minute, and launch waits 5 s."""
        worker = getattr(self, '_worker', None)
        if worker is not None and worker.is_alive():
            self._unwanted.set()
            self.get_logger().warning('the identification under way is given up')
            worker.join(_LONGEST_EVALUATION)

    def _on_joint_states(self, message: JointState) -> None:
        if not self.active:
            return
        sample = self._joint.sample(message)
        if sample is None:
            return
        time = self._stamps.seconds(message.header.stamp)
        for column, value in zip(self._samples, (time, *sample), strict=True):
            column.append(value)
        if time - self._samples[0][0] > self.values['longest']:
            for column in self._samples:
                del column[:len(column) // 2]
        self._count += 1
        torques = self._torques
        if torques is not None and self._count % self._every == 0:
            load = torques.load_torque(sample.position)
            velocity = sample.velocity if math.isfinite(sample.velocity) else 0.0
            self._publish_load(scalar(load))
            self._publish_friction(scalar(torques.friction_torque(load, velocity)))

    def _identify(self) -> str:
        if self._worker is not None and self._worker.is_alive():
            raise InputError('an identification is under way; ask again when it is done')
        time, position, velocity, effort = (np.array(column) for column in self._samples)
        known = bool(velocity.size) and bool(np.isfinite(velocity).mean() > 0.5)
        recording = Recording.from_samples('live', time, position, effort,
                                           velocity if known else None, joint=self._joint.name)
        self._unwanted = threading.Event()
        self._worker = threading.Thread(target=self._work, args=(recording, self._unwanted),
                                        name=_WORKER, daemon=True)
        self._worker.start()
        return f'identifying from {recording.time.size} samples, {recording.duration:.1f} s'

    def _identify_again(self) -> None:
        try:
            self._identify()
        except InputError as error:
            self.get_logger().info(str(error))

    def _work(self, recording: Recording, unwanted: threading.Event) -> None:
        from engb_core.identify.procedure import identify  # here: the node starts faster
        try:
            found = identify([recording], self._start_model, give_up=unwanted.is_set)
        except GivenUp:
            return
        except InputError as error:
            self.get_logger().error(f'not identified: {error}')
            return
        except Exception as error:   # the node lives on; the cause is told in full
            self.get_logger().error(f'not identified: {type(error).__name__}: {error}')
            return
        if unwanted.is_set():
            return
        self._identified = found.model
        self._torques = Feedforward(found.model)
        self.get_logger().info('identified:\n' + found.summary())

    def _write_model(self) -> str:
        model = self._identified
        if model is None:
            raise InputError('nothing is identified yet; drive strokes, then call ~/identify')
        if not self.values['model_out']:
            return yaml.safe_dump(model.to_mapping(), sort_keys=False, allow_unicode=True)
        path = path_of('model_out', self.values['model_out']).absolute()
        # What somebody else made, or changed, is not overwritten.
        with file_output(path, '.yml' if path.suffix == '.yml' else '.yaml',
                         told=f'parameter model_out {path}') as made:
            model.write(made)
        return str(path)

    def _clear(self) -> str:
        count = len(self._samples[0])
        for column in self._samples:
            del column[:]
        return f'{count} samples forgotten'


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    status = run(IdentifierNode, args)
    if any(thread.name == _WORKER for thread in threading.enumerate()):
        # All is closed. Python would end the thread in the midst of a library's code, which may
        # abort the process.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    return status
