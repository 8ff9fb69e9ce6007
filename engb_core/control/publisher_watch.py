# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whose torque a drive obeys, where more than one node publishes it."""

from __future__ import annotations

from collections import deque
import math

__all__ = ['PublisherWatch']

# Who comes first is obeyed alone unless silent for so long: longer than a controller's cycle and
# what delays it, shorter than a standby waits before it takes over [s].
_SILENT = 0.04

# A standby goes on from the torque that is there: to within this part of the drive's limit.
_GOES_ON = 0.2

# Silent for so long, it has lost its place [s].
_GONE = 1.0

# Who has spoken for a larger part of the last ten seconds than who came first, by so much, takes
# its place. A message is worth the time since the one before it, up to a cycle at 100 Hz [s].
_MEMORY, _LARGER, _CYCLE = 10.0, 0.1, 0.01

# A message may be ahead of its publisher's last one by twice as many as it has sent meanwhile, at
# its pace, and by so many more. What a busy computer reads late came before: two that are read one
# right after the other may have come at times so far apart, at most [s].
_AHEAD, _LONGEST_WAIT = 2, 1.0

# A pace is the mean of about so many intervals; the recent one the median of so few. Before it is
# known [s].
_USUAL, _RECENT = 100, 5
_FIRST_PACE = 0.001

# While one overtakes the other, and for so long after it [s], they may be taken for each other:
# where the first's usual pace fits the other's messages so much better (logarithm of the ratios).
_MEETING, _CLEAR = 0.3, 0.5

# So many publishers are told apart; of more, the one that was silent longest is forgotten.
_PUBLISHERS = 8


class _Publisher:
    """What is known of one.

    Attributes:
        number: of its last message.
        sent, came, heard: when that was sent, came to this computer, and was read [s].
        pace: the usual time from one of its messages to the next [s].
        beside: when it spoke beside the first last, as no controller does [s].
    """

    def __init__(self, now: float, number: int, sent: float, came: float) -> None:
        self.number, self.sent, self.came, self.heard = number, sent, came, now
        self.pace = _FIRST_PACE
        self._intervals = deque([_FIRST_PACE], maxlen=_RECENT)
        self._share, self._count = 0.0, 0
        self.beside = -math.inf

    @property
    def recent_pace(self) -> float:
        """The median of the last intervals: a pause is no other pace [s]."""
        return sorted(self._intervals)[len(self._intervals) // 2]

    def share(self, now: float) -> float:
        """Return the part of the last `_MEMORY` seconds in which it has spoken."""
        return self._share * math.exp((self.heard - now) / _MEMORY)

    def may_send(self, now: float, number: int, came: float) -> bool:
        """Return whether it can have come to this number by then."""
        passed = max(now - self.heard, min(came - self.came, _LONGEST_WAIT))
        return 0 < number - self.number <= (
            _AHEAD + 2.0 * passed / min(self.pace, self.recent_pace))

    def off_its_time(self, number: int, sent: float) -> float:
        """Return how far this message would be off its time, as a part of that time."""
        expected = (number - self.number) * self.pace
        return abs(sent - self.sent - expected) / expected

    def speaks(self, now: float, number: int, sent: float, came: float) -> None:
        """Take a message of it."""
        self._share = self.share(now) + min(now - self.heard, _CYCLE) / _MEMORY
        interval = (sent - self.sent) / (number - self.number)
        if interval > 0.0:   # else its clock was set
            if not self._count:
                self._intervals.clear()
            self._count += 1
            self._intervals.append(interval)
            self.pace += (self.recent_pace - self.pace) / min(self._count, _USUAL)
        self.number, self.sent, self.came, self.heard = number, sent, came, now

    def was_taken_for(self, first: _Publisher, now: float) -> bool:
        """Return whether messages of another one were taken for `first`'s when one overtook the
        other, and these are its own: they keep its usual pace, which what is taken for its does
        not, or they began when that ended."""
        if not self._count:
            return False
        off = abs(math.log(self.recent_pace / first.pace))
        ended = now - first.heard > 3.0 * first.pace and self._count <= 2 * _RECENT
        return (off < _CLEAR and ended
                or off + _CLEAR < abs(math.log(first.recent_pace / first.pace)))

    def exchange(self, other: _Publisher) -> None:
        """Take each other's messages: they had been taken for each other's."""
        for name in ('number', 'sent', 'came', 'heard', '_intervals'):
            mine = getattr(self, name)
            setattr(self, name, getattr(other, name))
            setattr(other, name, mine)


class PublisherWatch:
    """Tells the publishers of one topic apart, and obeys one of them at a time.

    The middleware numbers the messages of each publisher; rclpy hands the number on, and when it
    was sent, but not whose it is. A message belongs to the publisher whose last number it
    follows. Where it follows those of two, in the moment in which one overtakes the other, it
    belongs to the one whose pace it keeps.

    Who comes first is obeyed as long as it speaks. A stranger's messages are not, be they one or a
    thousand a second. Where it falls silent, one that goes on from the torque that is there is
    obeyed (a standby that takes over), and once the drive has let go anyone who has not spoken
    beside the first lately, until the first speaks again. Where the middleware does not number
    messages, all are obeyed.

    Args:
        command_timeout: without torque for so long the drive lets go [s].
        effort_limit: of the drive [N·m].
    """

    def __init__(self, command_timeout: float, effort_limit: float) -> None:
        self._command_timeout, self._tolerance = command_timeout, _GOES_ON * effort_limit
        self.forget()

    def forget(self) -> None:
        """Begin anew: whoever speaks next comes first."""
        self._publishers: list[_Publisher] = []
        self._first: _Publisher | None = None
        self._successor: _Publisher | None = None
        self._met_at = -math.inf   # when one could be the first's or another's
        self._torque = 0.0

    def obeys(self, now: float, torque: float, number: int | None, sent: float,
              came: float) -> bool:
        """Return whether a message shall be obeyed.

        Args:
            now: steady clock [s].
            torque: what it asks for [N·m].
            number: of its publisher's messages; None: the middleware counts none.
            sent: when it was published [s], on a clock of the publisher's.
            came: when it came [s], on a clock that may be set; it may be read later.
        """
        if number is None:
            return True
        speaker, first = self._speaker(now, number, sent, came), self._first
        if first is None or now - first.heard > _GONE or (
                speaker is not first and speaker.share(now) > first.share(now) + _LARGER):
            self._first = first = speaker
        elif (speaker is not first and now - self._met_at < _MEETING
                and speaker.was_taken_for(first, now)):
            first.exchange(speaker)
            speaker = first
        silent = now - first.heard
        if speaker is first:
            self._successor = None
        elif silent <= _SILENT:
            speaker.beside = now
            return False
        elif speaker is not self._successor:
            if not abs(torque - self._torque) <= self._tolerance and (
                    silent <= self._command_timeout or now - speaker.beside < _GONE):
                return False
            self._successor = speaker
        self._torque = torque
        return True

    def _speaker(self, now: float, number: int, sent: float, came: float) -> _Publisher:
        """Return the publisher of a message, which is now the last one heard of it."""
        known = self._publishers
        after = [each for each in known if each.may_send(now, number, came)
                 and (each is self._first or now - each.heard <= self._command_timeout)]
        if not after:
            if len(known) >= _PUBLISHERS:
                known.remove(min((each for each in known if each is not self._first),
                                 key=lambda each: each.heard))
            known.append(_Publisher(now, number, sent, came))
            return known[-1]
        if len(after) > 1 and self._first in after:
            self._met_at = now
        speaker = min(after, key=lambda each: each.off_its_time(number, sent))
        speaker.speaks(now, number, sent, came)
        return speaker
