# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which joint states may be used, and the loop's own time, which no clock stops or turns back."""

from __future__ import annotations

from collections.abc import Callable
import math

from engb_core.control.causes import Cause
from engb_core.control.sample_clock import SampleClock
from engb_core.control.supervisor_settings import SupervisorSettings

__all__ = ['LARGEST', 'StateWatch']

# An angle or speed beyond this is no measurement [rad, rad/s].
LARGEST = 1e6

# Stamps and the steady clock may part by so much between two samples [s].
_PARTED = 0.1

# Two samples are never closer than this, whatever their stamps say: bursts [s].
_SHORTEST = 0.001

# Clocks drift apart by no more than this: an oscillator's 100 ppm, and the 500 ppm by which NTP
# slews [s/s].
_DRIFT = 1e-3


class StateWatch:
    """Judges joint states by their numbers, their stamps, and by how far the angle moved.

    A stamp that does not advance is no new sample: whoever sends the same one again and again
    is silent. A stamp that goes backwards comes of a clock that was set: the sample is as good as
    any, only its time isn't, so `time` goes on by the steady clock.

    An angle that jumped is believed again only when it jumps back: were it enough that the motor
    *could* have gone there meanwhile, every lasting jump would be believed after a moment.

    How far it may have moved is told by the stamps, which do not wait as messages do. A message
    can be late, never early: what one stamp alone is ahead of the steady clock, more than two
    before it were, gives no room, and turns the loop's time on no farther. And a sample that used
    the room of a pause, from which the next one is back, was none of the drive's: no single
    message makes the angle lost. Nor do a few that walk away faster than the motor can be sped up:
    the next one is believed that goes on from the last sound one as a motor does.

    Args:
        note: called with a cause and the time when a sample shows one.

    Attributes:
        settings: `largest_speed`, `jump_time`.
        time: [s], continuous: what the loop integrates over.
        taken: when the samples were taken, evenly spaced.
        span: from the sample that was used before to the last one, in which the motor may have
            been moved and sped up [s].
        lost: the angle jumped and stayed; until `believe`.
        acceleration: the motor's largest [rad/s²]; whoever knows it says.
        velocity: the motor's at the last sample that was used [rad/s]; whoever used it says.
    """

    def __init__(self, settings: SupervisorSettings, note: Callable[[Cause, float], None]) -> None:
        self.settings = settings
        self._note = note
        self.acceleration = 0.0
        self.taken = SampleClock()
        self.reset()

    def reset(self) -> None:
        """Forget the past: the next sample is believed."""
        self.time = self.span = 0.0
        self.taken.reset()
        self.lost = False
        self.velocity = 0.0
        self._seen = False
        self._stamp = self._now = 0.0         # of the last sample that came
        self._angle = self._trusted = 0.0     # of the last one that came, and that was believed
        self._since = 0.0                     # [s] from the one that was believed
        self._before, self._between = 0.0, 0.0   # the one believed before it, and the time between
        self._far = False                     # whether it used the room of a pause
        self._sound = self._age = 0.0         # the last one to which a motor can have come, and
        self._told, self._paces = 0.0, (0.0, 0.0)   # the time from it; the last one's velocity,
        #                                     and that one's
        self._jumped: float | None = None     # since when
        self._ahead = self._earliest = 0.0    # stamp less steady clock: the last one's, and the
        #                                       most that two in a row had [s]

    @property
    def seen(self) -> bool:
        """Whether any sample has come."""
        return self._seen

    @property
    def in_doubt(self) -> bool:
        """Whether the angle jumped, and more than a sample has not been believed since."""
        return self._jumped is not None and self._now > self._jumped

    def believe(self) -> None:
        """Believe the angle where it is now."""
        self.lost = False
        self._jumped = None
        self._far = False
        self._trust(self._angle)

    def accept(self, now: float, stamp: float, position: float, velocity: float) -> bool:
        """Return whether a sample may be used; see `Supervisor.accept_state`."""
        if not (math.isfinite(stamp) and abs(position) < LARGEST) or abs(velocity) > LARGEST:
            self._note(Cause.STATE_NOT_FINITE, now)
            return False
        reach = self.settings.largest_speed
        if abs(velocity) > reach:
            self._note(Cause.STATE_JUMP, now)
            return False
        if not self._seen:
            self._seen = True
            self._stamp, self._now = stamp, now
            self._angle = self._trusted = self._sound = position
            self._ahead = self._earliest = stamp - now
            return True
        passed, waited = stamp - self._stamp, now - self._now
        ahead, before = stamp - now, self._ahead
        if passed == 0.0:
            self._note(Cause.STATE_REPEATED, now)
            return False
        was_set = passed < 0.0 or (abs(passed - waited) > _PARTED and passed > _PARTED)
        if was_set:
            self._note(Cause.CLOCK_JUMP, now)
            passed = room = max(waited, 1e-6)
            self._earliest = ahead
        else:
            room = passed - max(ahead - max(self._earliest, before), 0.0)
            self._earliest = max(min(ahead, before), self._earliest - _DRIFT * waited)
        self._ahead = ahead
        self.taken.step(passed, stamped=not was_set)
        self._stamp, self._now = stamp, now
        usual = max(self.taken.spacing, _SHORTEST)
        span = max(room, usual)
        self.time += min(passed, span)
        self._since += span
        sound = self._follows(position, span)
        self._told = velocity
        came_from, self._angle = self._angle, position
        jumps = abs(position - came_from) > reach * span
        if self._jumped is None:
            if not jumps:
                self._before, self._between = self._trusted, self._since
                self._far = abs(position - self._trusted) > reach * usual
                self._trust(position, sound)
                return True
            if sound or (self._far and abs(position - self._before) <= min(
                    reach * (self._between + self._since), abs(position - self._trusted))):
                self._note(Cause.STATE_JUMP, now)
                self._far = False
                self._trust(position, sound)
                return True
            self._jumped = now
        elif jumps and (sound or abs(position - self._trusted) <= reach * self._since):
            self._jumped = None
            self.lost = self._far = False
            self._trust(position, sound)
            return True
        self._note(Cause.STATE_JUMP, now)
        if now - self._jumped > self.settings.jump_time:
            self.lost = True
        return False

    def _follows(self, position: float, span: float) -> bool:
        """Return whether the motor can have come to `position` [rad], `span` [s] after the last
        sample, from the last sound one: with the speed that it had then, as it was told or as it
        was used, and with its largest acceleration."""
        if self._age == 0.0:
            self._paces = self._told, self.velocity
        self._age += span
        moved, age = position - self._sound, self._age
        if abs(moved) > self.settings.largest_speed * age:
            return False
        room = 0.5 * self.acceleration * age * age
        told, used = self._paces
        return abs(moved - used * age) <= room or abs(moved - told * age) <= room

    def _trust(self, position: float, sound: bool = False) -> None:
        self._trusted = position
        self.span, self._since = self._since, 0.0
        if sound or self._age > self.settings.jump_time:
            self._sound, self._age = position, 0.0
