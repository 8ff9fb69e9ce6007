# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What is missing of a joint's samples, in words, for who only listens to them."""

from __future__ import annotations

from collections.abc import Sequence
import math

__all__ = ['PATIENCE', 'SILENCE', 'SampleWatch']

# After so long without a usable sample none are coming [s]: whoever has been silent for that is
# no longer counted as a joint's drive either.
PATIENCE = 1.0

SILENCE = 'no joint_states come'

_NAMES = ('position', 'velocity', 'effort')


class SampleWatch:
    """Tells whether usable samples of a joint come, and if not, what comes in their place.

    Args:
        joint: its name.
        longest: two samples farther apart than this are of no use [s].
    """

    def __init__(self, joint: str, longest: float = math.inf) -> None:
        self._joint = joint
        self._longest = longest
        self.reset(0.0)

    def reset(self, now: float) -> None:
        """Forget the past, and be patient from `now` on [s]."""
        self._usable_at = self._present_at = now
        self._fault, self._fault_at = '', -math.inf
        self._others_since = self._others_at = -math.inf
        self._told = False
        self._time: float | None = None

    def present(self, now: float) -> None:
        """Note a message that holds the joint [s]."""
        self._present_at = now
        self._told = False

    def other(self, now: float, names: Sequence[str]) -> str:
        """Note a message that holds other joints only, and return what to say of it, once.

        Several nodes may publish a joint each: the joint is missing when none of them has sent it
        for as long as one is patient.
        """
        if now - self._others_at > PATIENCE:
            self._others_since = now
        self._others_at = now
        self._note(now, f'joint_states hold {", ".join(names) or "no joint"}, and no position of '
                        f'{self._joint}; set parameter joint, or the name in the model file')
        if self._told or now - max(self._present_at, self._others_since) <= PATIENCE:
            return ''
        self._told = True
        return self._fault

    def take(self, now: float, time: float, position: float, velocity: float,
             effort: float) -> bool:
        """Note a sample and return whether it is usable.

        Args:
            now: by a steady clock [s].
            time: the sample's stamp [s].
            position, velocity, effort: [rad], [rad/s], [N·m].
        """
        self.present(now)
        passed = math.nan if self._time is None else time - self._time
        self._time = time
        wrong = [name for name, value in zip(_NAMES, (position, velocity, effort), strict=True)
                 if not math.isfinite(value)]
        if wrong:
            self._note(now, f'joint_states hold no finite {" and ".join(wrong)} of {self._joint}')
        elif passed <= 0.0:
            self._note(now, 'the stamps of joint_states do not advance')
        elif passed >= self._longest:
            self._note(now, f'joint_states do not come every {self._longest:g} s')
        else:
            self._usable_at = now
            return True
        return False

    def missing(self, now: float) -> str:
        """Return what is missing [s]; '' while usable samples come."""
        if now - self._usable_at <= PATIENCE:
            return ''
        if now - self._fault_at <= PATIENCE:
            return self._fault
        return SILENCE

    def _note(self, now: float, fault: str) -> None:
        self._fault, self._fault_at = fault, now
