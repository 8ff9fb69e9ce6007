# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A train of two masses: a gap with preload, or a compliant shaft with inertia beyond it.

Kinds: 1 a gap with stiff linear flanks, 2 a gap with Hunt-Crossley flanks (1975), 3 a linear
shaft, 4 a shaft that hardens, 5 a shaft that is softer near zero twist. Pushing (apply) rests on
the flank at zero, so that the load's angle equals the motor's there; the free way reaches from
-gap to 0.
"""
from __future__ import annotations

from numba import njit

__all__ = ['shaft_torque']


@njit(cache=True)
def shaft_torque(p, twist, rate):
    """Torque from motor to load [N·m] for twist = θ_motor - θ_load and its rate."""
    if p.train_kind >= 3:
        torque = p.stiffness * twist + p.damping * rate
        if p.train_kind == 4:
            torque += p.hardening * twist * twist * twist
        elif p.train_kind == 5:
            near = min(p.slack, max(-p.slack, twist))
            torque -= 0.4 * p.stiffness * near
        return torque
    if twist > 0.0:
        press, speed, side = twist, rate, 1.0
    elif twist < -p.gap:
        press, speed, side = -p.gap - twist, -rate, -1.0
    else:
        return 0.0
    if p.train_kind == 1:
        torque = p.stiffness * press + p.damping * speed
    else:
        torque = p.stiffness * 3.0 * press ** 1.5 * (1.0 + 0.6 * speed)
    return side * torque if torque > 0.0 else 0.0
