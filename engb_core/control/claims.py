# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which of several controllers of one brake speaks: by claims that must be kept up."""

from __future__ import annotations

import math

__all__ = ['CLAIM_PERIOD', 'ControllerClaims', 'STANDBY_CLAIM']

# A healthy controller that speaks says so this often [s].
CLAIM_PERIOD = 0.1

# What a silent standby says: it is there, and yields to everybody.
STANDBY_CLAIM = 2**64 - 1

# A claim that is not kept up is forgotten after this [s].
_GONE = 0.5

# Who speaks already yields only to a claim that has been kept up for so long [s], so often.
_KEPT_UP, _OFTEN = 0.3, 3

# Whoever publishes torque is given so long to say who it is: the graph shows its publisher before
# it is active, and before its first claim [s].
_SAYS = 1.0

# Who spoke for so long, and nobody had claimed to be first, was here before whoever says nothing
# of himself [s].
_FIRST = 1.0

# More claims at once than this are noise.
_CLAIMS = 16


class ControllerClaims:
    """Hears the others' claims: each says since when its controller is active [ns].

    Of two that claim, the later one yields. A claim counts while it is kept up, so no single
    message silences anybody, nobody yields to one who is gone, and two can never yield to each
    other: both compare the same two numbers.
    """

    def __init__(self) -> None:
        self.start(0.0, 0)

    def start(self, now: float, own: int) -> None:
        """Begin with an own claim [ns]."""
        self.own = own
        self._heard: dict[int, list[float]] = {}   # first, last [s], how often
        self._known: set[int] = set()
        self._first_since: float | None = None
        self._present_since: float | None = None

    def take_over(self, own: int) -> None:
        """Claim anew, in the place of those heard so far; one word of them is enough to yield."""
        self.own = own
        self._known = set(self._heard)
        self._heard.clear()
        # The graph shows one who was killed for a while yet: only a claim counts against this.
        self._first_since = -math.inf

    def hear(self, now: float, claim: int) -> None:
        """Take somebody's claim."""
        if claim == self.own:
            return
        entry = self._heard.get(claim)
        if entry is not None and now - entry[1] <= _GONE:
            entry[1], entry[2] = now, entry[2] + 1
            return
        self._heard = {name: times for name, times in self._heard.items()
                       if now - times[1] <= _GONE}
        if len(self._heard) < _CLAIMS:
            self._heard[claim] = [now, now, 1]

    def rivals(self, now: float, speaking: bool) -> list[int]:
        """Return the claims that count now; for one who speaks only what was kept up."""
        found = []
        for claim, (first, last, often) in self._heard.items():
            kept_up = claim == STANDBY_CLAIM or often >= _OFTEN and last - first >= _KEPT_UP
            if now - last <= _GONE and (kept_up or not speaking or claim in self._known):
                found.append(claim)
        return found

    def standby(self, now: float) -> bool:
        """Whether a healthy standby has just said that it is there."""
        return STANDBY_CLAIM in self.rivals(now, False)

    def claimed_since(self, since: float) -> bool:
        """Whether a healthy controller that speaks has said so after `since` [s]."""
        return any(claim != STANDBY_CLAIM and last > since
                   for claim, (_, last, _) in self._heard.items())

    def unclear(self, now: float) -> bool:
        """Whether somebody publishes torque who has had no time yet to say who it is; for
        one who does not speak yet that is no time to begin."""
        return (self._present_since is not None and now - self._present_since < _SAYS
                and not self.rivals(now, False))

    def judge(self, now: float, publishers: int, speaking: bool, faulty: bool,
              ) -> tuple[bool, bool]:
        """Return whether somebody else drives the brake, and whether this one was first.

        Args:
            now: steady clock [s].
            publishers: of torque, this one included.
            speaking: this one has sent torque already.
            faulty: it has a fault: it yields to any healthy one.
        """
        present = publishers > 1
        if not present:
            self._present_since = None
        elif self._present_since is None:
            self._present_since = now
        rivals = self.rivals(now, speaking)
        others = [claim for claim in rivals if claim != STANDBY_CLAIM]
        if others and (faulty or self.own > min(others)):
            return present, False
        if speaking and self._first_since is None and (rivals or not present):
            self._first_since = now
        if rivals or self.unclear(now):
            return present, True
        return present, self._first_since is not None and now - self._first_since > _FIRST
