# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whose torque a drive obeys, where more than one node publishes it."""

from __future__ import annotations

from dataclasses import dataclass
import math

__all__ = ['PublisherWatch']

# Who comes first is obeyed alone unless silent for so long: longer than a controller's cycle and
# what delays it, shorter than a standby waits before it takes over [s].
_SILENT = 0.04

# Silent for so long, it has lost its place [s].
_GONE = 1.0

# Who has spoken for a larger part of the last ten seconds than who came first, by so much, takes
# its place. A message is worth the time since the one before it, up to a cycle at 100 Hz [s].
_MEMORY, _LARGER, _CYCLE = 10.0, 0.1, 0.01

# A message may be ahead of its publisher's last one by twice as many as it has sent meanwhile, at
# its pace, and by so many more.
_AHEAD = 2

# A pace is the mean of about so many intervals; the recent one of so few.
_USUAL, _RECENT = 100.0, 5.0

# Two of which one overtook the other lately are so near, and were taken for each other where their
# paces fit so much better the other way round (logarithm of the ratios).
_NEAR, _CLEAR = 100, 1.0

# So many publishers are told apart; of more, the one that was silent longest is forgotten.
_PUBLISHERS = 8


@dataclass(eq=False)
class _Publisher:
    """What is known of one: number and time of its last message, the time between its messages,
    when it was heard last, and the part of the time in which it has spoken."""

    number: int
    sent: float
    heard: float
    share: float = 0.0
    pace: float = 0.001     # until it is known
    recent: float = 0.001
    count: int = 0

    def share_at(self, now: float) -> float:
        return self.share * math.exp((self.heard - now) / _MEMORY)

    def may_send(self, now: float, number: int) -> bool:
        return 0 < number - self.number <= _AHEAD + 2.0 * (now - self.heard) / min(
            self.pace, self.recent)

    def speaks(self, now: float, number: int, sent: float) -> None:
        self.share = self.share_at(now) + min(now - self.heard, _CYCLE) / _MEMORY
        interval = (sent - self.sent) / (number - self.number)
        if interval > 0.0:   # else its clock was set
            self.count += 1
            self.pace += (interval - self.pace) / min(self.count, _USUAL)
            self.recent += (interval - self.recent) / min(self.count, _RECENT)
        self.number, self.sent, self.heard = number, sent, now

    def off_the_pace_of(self, other: _Publisher) -> float:
        return abs(math.log(self.recent / other.pace))

    def exchange(self, other: _Publisher) -> None:
        self.number, other.number = other.number, self.number
        self.sent, other.sent = other.sent, self.sent
        self.heard, other.heard = other.heard, self.heard
        self.recent, other.recent = other.recent, self.recent


class PublisherWatch:
    """Tells the publishers of one topic apart, and obeys one of them at a time.

    The middleware numbers the messages of each publisher; rclpy hands the number on, and when it
    was sent, but not whose it is. A message belongs to the publisher whose last number it
    follows. Where it follows those of two, in the moment in which one overtakes the other, it
    belongs to the one whose pace it keeps.

    Who comes first is obeyed as long as it speaks. A stranger's messages are not, be they one or a
    thousand a second. Where it falls silent, another one is obeyed at once (a standby that takes
    over), until it speaks again. Where the middleware does not number messages, all are obeyed.
    """

    def __init__(self) -> None:
        self._publishers: list[_Publisher] = []
        self._first: _Publisher | None = None

    def obeys(self, now: float, number: int | None, sent: float) -> bool:
        """Return whether a message shall be obeyed.

        Args:
            now: steady clock [s].
            number: of its publisher's messages; None: the middleware counts none.
            sent: when it was published [s], on a clock of the publisher's.
        """
        if number is None:
            return True
        speaker, first = self._speaker(now, number, sent), self._first
        if first is None or now - first.heard > _GONE or (
                speaker is not first and speaker.share > first.share_at(now) + _LARGER):
            self._first = first = speaker
        return speaker is first or now - first.heard > _SILENT

    def _speaker(self, now: float, number: int, sent: float) -> _Publisher:
        """Return the publisher of a message, which is now the last one heard of it."""
        known = self._publishers
        after = [each for each in known if each.may_send(now, number)]
        if not after:
            if len(known) >= _PUBLISHERS:
                known.remove(min((each for each in known if each is not self._first),
                                 key=lambda each: each.heard))
            known.append(_Publisher(number, sent, now))
            return known[-1]
        speaker = min(after, key=lambda each: (number - each.number,
                                               abs(sent - each.sent - each.pace)))
        speaker.speaks(now, number, sent)
        for each in known:   # one overtook the other: who is who shows by their paces
            if abs(each.number - number) <= _NEAR and (
                    each.off_the_pace_of(each) + speaker.off_the_pace_of(speaker)
                    > each.off_the_pace_of(speaker) + speaker.off_the_pace_of(each) + _CLEAR):
                each.exchange(speaker)
                return each
        return speaker
