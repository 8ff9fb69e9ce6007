# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""When a topic's first messages were sent, which may all come at once, seconds later.

Publisher and subscriber find one another by messages that a busy network repeats after seconds.
What was said meanwhile comes in one burst then; its time of arrival is seconds too late, and for a
message without a stamp it is the only time there is. The middleware tells when each was sent, by
the publisher's clock, which need not be this computer's: what parts the two is the least time that
a message seems to take, once there are some that come as they are sent.
"""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ['HOLD', 'FirstMessages']

# A topic's messages are held back for so long from the first one on [ns]: five of a topic of
# 10 Hz, the slowest of a recording, that come as they are sent.
HOLD = 500_000_000


@dataclass
class FirstMessages:
    """What came first of one topic.

    Attributes:
        since: when it was subscribed to [ns]; nothing that comes of it was sent before.
    """

    since: int
    _held: list[tuple[int, int, bytes]] = field(default_factory=list)

    @property
    def count(self) -> int:
        """How many are held."""
        return len(self._held)

    def hold(self, sent: int, received: int, message: bytes) -> None:
        """Hold a message that was sent (0: nobody tells) and received at these times [ns]."""
        self._held.append((sent, received, message))

    def are_complete(self, now: int) -> bool:
        """Whether enough has been held at `now` [ns]."""
        return bool(self._held) and now - self._held[0][1] >= HOLD

    def dated(self, one_publisher: bool) -> list[tuple[int, bytes]]:
        """Return all messages, and when each was sent by this computer's clock [ns].

        Args:
            one_publisher: all are of one; clocks of several would be taken for one another's, so
                that their messages get the times at which they were received.
        """
        if not self._held or not one_publisher or any(not sent for sent, _, _ in self._held):
            return [(received, message) for _, received, message in self._held]
        apart = min(received - sent for sent, received, _ in self._held)
        return [(max(min(received, sent + apart), min(received, self.since)), message)
                for sent, received, message in self._held]
