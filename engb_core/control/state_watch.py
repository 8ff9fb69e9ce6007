"""Which joint states may be used, and the loop's own time, which no clock stops or turns back."""

from __future__ import annotations

from collections.abc import Callable
import math

from engb_core.control.causes import Cause
from engb_core.control.supervisor_settings import SupervisorSettings

__all__ = ['LARGEST', 'StateWatch']

# An angle or speed beyond this is no measurement [rad, rad/s].
LARGEST = 1e6

# Stamps and the steady clock may part by so much between two samples [s].
_PARTED = 0.1

# Two samples are never closer than this, whatever their stamps say: bursts [s].
_SHORTEST = 0.001


class StateWatch:
    """Judges joint states by their numbers, their stamps, and by how far the angle moved.

    A stamp that does not advance is no new sample: whoever sends the same one again and again
    is silent. A stamp that goes backwards comes of a clock that was set: the sample is as good as
    any, only its time isn't, so `time` goes on by the steady clock.

    An angle that jumped is believed again only when it jumps back: were it enough that the motor
    *could* have gone there meanwhile, every lasting jump would be believed after a moment.

    Args:
        note: called with a cause and the time when a sample shows one.

    Attributes:
        settings: `largest_speed`, `jump_time`.
        time: [s], continuous: what the loop integrates over.
        lost: the angle jumped and stayed; until `believe`.
    """

    def __init__(self, settings: SupervisorSettings, note: Callable[[Cause, float], None]) -> None:
        self.settings = settings
        self._note = note
        self.reset()

    def reset(self) -> None:
        """Forget the past: the next sample is believed."""
        self.time = 0.0
        self.lost = False
        self._seen = False
        self._stamp = self._now = 0.0         # of the last sample that came
        self._angle = self._trusted = 0.0     # of the last one that came, and that was believed
        self._since = 0.0                     # [s] from the one that was believed
        self._period = _SHORTEST
        self._jumped: float | None = None     # since when

    @property
    def seen(self) -> bool:
        """Whether any sample has come."""
        return self._seen

    def believe(self) -> None:
        """Believe the angle where it is now."""
        self.lost = False
        self._jumped = None
        self._trusted = self._angle

    def accept(self, now: float, stamp: float, position: float, velocity: float) -> bool:
        """Return whether a sample may be used; see `Supervisor.accept_state`."""
        if not (math.isfinite(stamp) and abs(position) < LARGEST) or abs(velocity) > LARGEST:
            self._note(Cause.STATE_NOT_FINITE, now)
            return False
        if not self._seen:
            self._seen = True
            self._stamp, self._now = stamp, now
            self._angle = self._trusted = position
            return True
        passed, waited = stamp - self._stamp, now - self._now
        if passed == 0.0:
            self._note(Cause.STATE_REPEATED, now)
            return False
        if passed < 0.0 or (abs(passed - waited) > _PARTED and passed > _PARTED):
            self._note(Cause.CLOCK_JUMP, now)
            passed = max(waited, 1e-6)
        else:
            self._period += 0.05 * (min(passed, 2.0 * self._period) - self._period)
        self.time += passed
        self._stamp, self._now = stamp, now
        span = max(passed, self._period, _SHORTEST)
        reach = self.settings.largest_speed
        self._since += span
        came_from, self._angle = self._angle, position
        jumps = abs(position - came_from) > reach * span
        if self._jumped is None:
            if not jumps:
                self._trusted, self._since = position, 0.0
                return True
            self._jumped = now
        elif jumps and abs(position - self._trusted) <= reach * self._since:
            self._jumped = None
            self.lost = False
            self._trusted, self._since = position, 0.0
            return True
        self._note(Cause.STATE_JUMP, now)
        if now - self._jumped > self.settings.jump_time:
            self.lost = True
        return False
