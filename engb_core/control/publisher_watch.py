# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whose messages count, where more than one node publishes a topic."""

from __future__ import annotations

import math

__all__ = ['FirstPublisher', 'PublisherWatch']

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

# So many publishers are known; of more, the one that was silent longest is forgotten.
_PUBLISHERS = 8


class _Publisher:
    """What is known of one.

    Attributes:
        heard: when it spoke last [s].
        beside: when it spoke beside the first last, as no controller does that was not obeyed
            before [s].
        was_obeyed: it was ever.
    """

    def __init__(self, now: float) -> None:
        self.heard, self.beside, self.was_obeyed = now, -math.inf, False
        self._share = 0.0

    def share(self, now: float) -> float:
        """Return the part of the last `_MEMORY` seconds in which it has spoken."""
        return self._share * math.exp((self.heard - now) / _MEMORY)

    def inherit(self, other: _Publisher, now: float) -> None:
        """Take the place of another one, as if it had spoken when that one did."""
        self._share = max(self.share(now), other.share(now))

    def speaks(self, now: float) -> None:
        """Take a message of it."""
        self._share = self.share(now) + min(now - self.heard, _CYCLE) / _MEMORY
        self.heard = now


class FirstPublisher:
    """Tells who of several publishers of one topic came first, as long as it speaks.

    A second of silence costs the first its place, and so does somebody who has spoken for a larger
    part of the last ten seconds.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew: whoever speaks next comes first."""
        self._publishers: dict[bytes, _Publisher] = {}
        self._first: _Publisher | None = None

    def is_first(self, now: float, publisher: bytes | None) -> bool:
        """Take a message that came at `now` (steady clock) [s]; return whether it is of who came
        first.

        Args:
            now: steady clock [s].
            publisher: whose it is; None: that is not known, and everybody is the first.
        """
        if publisher is None:
            return True
        speaker, first = self._heard(now, publisher)
        return speaker is first

    def _heard(self, now: float, publisher: bytes) -> tuple[_Publisher, _Publisher]:
        """Take a message; return whose it is, and who is the first."""
        known, first = self._publishers, self._first
        speaker = known.get(publisher)
        if speaker is None:
            if len(known) >= _PUBLISHERS:
                del known[min((name for name, each in known.items() if each is not first),
                              key=lambda name: known[name].heard)]
            speaker = known[publisher] = _Publisher(now)
        else:
            speaker.speaks(now)
        if first is None or speaker is not first and (
                now - first.heard > _GONE or speaker.share(now) > first.share(now) + _LARGER):
            self._first = first = self._heir(now) or speaker
        return speaker, first

    def _heir(self, now: float) -> _Publisher | None:
        """Return who has the first's place after it; None: whoever speaks."""
        return None


class PublisherWatch(FirstPublisher):
    """Obeys one publisher of torque at a time.

    Who comes first is obeyed as long as it speaks. A stranger's messages are not, be they one or a
    thousand a second. Where it falls silent, one who has not spoken beside it lately is, until it
    speaks again: one that goes on from the torque that is there (a standby that takes over), and
    once the drive has let go anyone.

    Args:
        command_timeout: without torque for so long the drive lets go [s].
        effort_limit: of the drive [N·m].
    """

    def __init__(self, command_timeout: float, effort_limit: float) -> None:
        self._command_timeout, self._tolerance = command_timeout, _GOES_ON * effort_limit
        super().__init__()

    def forget(self) -> None:
        """Begin anew: whoever speaks next comes first."""
        super().forget()
        self._successor: _Publisher | None = None
        self._torque = 0.0

    def obeys(self, now: float, torque: float, publisher: bytes | None) -> bool:
        """Return whether a message shall be obeyed.

        Args:
            now: steady clock [s].
            torque: what it asks for [N·m].
            publisher: whose it is; None: that is not known, and all are obeyed.
        """
        if publisher is None:
            return True
        speaker, first = self._heard(now, publisher)
        silent = now - first.heard
        if speaker is first:
            self._successor = None
        elif silent <= _SILENT:
            if not speaker.was_obeyed:   # else a standby whose primary speaks again, or that one
                speaker.beside = now
            return False
        elif speaker is not self._successor:
            goes_on = abs(torque - self._torque) <= self._tolerance
            if now - speaker.beside < _GONE or not (goes_on or silent > self._command_timeout):
                return False
            speaker.inherit(first, now)
            self._successor = speaker
        speaker.was_obeyed = True
        self._torque = torque
        return True

    def _heir(self, now: float) -> _Publisher | None:
        """Return the one that took over, if it still speaks."""
        heir = self._successor
        return heir if heir is not None and now - heir.heard <= self._command_timeout else None
