# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a model says where torque is late: before a stop, and of a shaft that only creeps."""

from dataclasses import replace

import numpy as np

from engb_core.model import EffectSetting, Friction, LoadTorque, Model
from engb_core.prediction import predict_effort
from engb_core.recording import Recording

from .bench import Bench, strokes

MODEL = Model(load_torque=LoadTorque(coefficients=(0.0, 1e-3, 2e-4, 5e-6)),
              friction=Friction(0.012, 0.11, 0.3))
TIME = np.arange(0.0, 4.0, 1e-3)
CREEPING = (TIME > 1.1) & (TIME < 1.9)


def recording() -> Recording:
    """A fast stroke, a second of creeping back, a stroke that comes to rest in 0.1 s."""
    velocity = np.select([TIME < 1.0, TIME < 2.0], [40.0 * np.sin(np.pi * TIME) ** 2, -0.3],
                         np.clip(50.0 * (3.0 - TIME), 0.0, 5.0))
    position = np.cumsum(velocity) * 1e-3
    return Recording.from_samples('run', TIME, position, np.zeros_like(TIME), velocity)


def predicted(delay: float = 0.0) -> np.ndarray:
    late = EffectSetting('sampling_delay', {'delay': delay})
    return predict_effort(recording(), replace(MODEL, effects=(late,) if delay else ()))


def test_a_creeping_shaft_is_no_standing_one():
    # 0.3 rad/s is slower than what the fit takes for motion; a delay of 0.1 ms changes nothing.
    assert np.abs(predicted(delay=1e-4) - predicted())[CREEPING].max() < 5e-4


def test_late_torque_before_a_stop_is_that_of_the_motion():
    prompt, late = predicted(), predicted(delay=0.02)
    moving, stopped = (TIME > 2.975) & (TIME < 2.985), TIME > 3.1
    # 20 ms later friction is on its way to nothing: that would show without holding it.
    assert np.abs(late - prompt)[moving].max() < 3e-3
    assert np.ptp(prompt[(TIME > 2.975) & (TIME < 3.005)]) > 0.01
    assert np.abs(late - prompt)[stopped].max() < 1e-9


def test_a_glitch_of_the_position_is_not_followed():
    healthy = Bench(noise=2e-3).run(strokes())
    position = healthy.position.copy()
    at = position.size // 3
    position[at] += 1.5
    prompt, glitched = (predict_effort(one, MODEL) for one in (
        healthy, replace(healthy, position=position)))
    assert glitched.shape == healthy.time.shape
    # One lost sample is bridged: the error stays that of what it hides, not of the jump.
    assert np.abs(glitched - prompt).max() < 0.1 * np.abs(prompt).max()
