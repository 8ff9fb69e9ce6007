# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Whose command counts: the one place where commands are judged, and one source chosen."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
import math

from engb_core.control.causes import Cause
from engb_core.control.state_watch import LARGEST
from engb_core.control.supervisor_settings import SupervisorSettings

__all__ = ['ANONYMOUS', 'Command', 'CommandArbiter']

# The source of commands that carry no name.
ANONYMOUS = ''

# Where `command_timeout` is 0 (never stale) a source counts as silent after this [s].
_SILENT = 0.25

# So many sources are told apart; of more, the one that was silent longest is forgotten.
_SOURCES = 16


@dataclass(frozen=True)
class Command:
    """One command.

    Attributes:
        value: [rad] or [N].
        by_force: it is a force.
        source: who asks; ANONYMOUS without a name.
        stamp: when it was asked [ns]; None: the message carries no time.
        age: since then [s].
        counter: of the source's commands; None: none.
    """

    value: float
    by_force: bool = False
    source: str = ANONYMOUS
    stamp: int | None = None
    age: float = 0.0
    counter: int | None = None


@dataclass
class _Source:
    """What is known of one source: since when it speaks without a pause, and stamp and counter of
    its last word and of the one before."""

    since: float
    seen: float
    last: tuple[int | None, int | None] = (None, None)
    before: tuple[int | None, int | None] | None = None


class CommandArbiter:
    """Judges commands and follows one source.

    Who comes first is obeyed as long as it speaks; another one, which has been speaking all the
    while, takes its place when it falls silent. Requests that are too high or too low are taken
    at the range's end: who asks too much is not silent. Of several sources without a name none
    can be preferred: the highest request of the last `command_timeout` counts, so that no single
    message releases the brake.

    A stamp or counter that does not advance is a repetition. One that is far ahead of its
    source's others is a stranger's in the source's name, or a flaw: what advances over the one
    before it is taken, so that no single message makes repetitions of all that follow.

    Args:
        note: called with a cause and the time when a command shows one.

    Attributes:
        settings: timeouts, steps, `command_source`.
        rivals: more than one node publishes commands without a name.
        source: who is obeyed; None: nobody yet.
        spoke_at: when it spoke last [s].
        conflict_at: when a command of someone else was refused last [s].
    """

    def __init__(self, settings: SupervisorSettings, note: Callable[[Cause, float], None]) -> None:
        self.settings = settings
        self._note = note
        self.rivals = False
        # Of nameless sources: when which angle was asked for, as an angle and as a force.
        self._wanted: dict[bool, tuple[float, float]] = {}
        self.reset(0.0)

    def reset(self, now: float) -> None:
        """Forget all sources."""
        self.source: str | None = None
        self.spoke_at = now
        self.conflict_at = -math.inf
        self._sources: dict[str, _Source] = {}
        self._last: dict[bool, float] = {}
        self._recent: deque[tuple[float, bool, float]] = deque()

    def clock_was_set(self) -> None:
        """The clock that stamps are held against went backwards: those of before say nothing of
        what is new."""
        for known in self._sources.values():
            known.last, known.before = (None, known.last[1]), None

    @property
    def window(self) -> float:
        """A source that is silent for longer is gone [s]."""
        return self.settings.command_timeout or _SILENT

    def steady(self, now: float) -> bool:
        """Whether the source that is obeyed has been speaking for a whole window."""
        known = self._sources.get(self.source) if self.source is not None else None
        return (known is not None and now - known.seen <= self.window
                and known.seen - known.since >= self.window)

    def successor(self, now: float) -> bool:
        """The source has fallen silent: obey another one that has been speaking, if any."""
        window = self.window
        for name, known in self._sources.items():
            if (name != self.source and now - known.seen <= window
                    and known.seen - known.since >= window and self._may(name)):
                self.source, self.spoke_at = name, known.seen
                return True
        return False

    def judge(self, now: float, command: Command, low: float, high: float) -> float | None:
        """Return the value to follow, within `low` and `high`; None: the last one stands."""
        value = command.value
        if not abs(value) < LARGEST:
            self._note(Cause.COMMAND_NOT_FINITE, now)
            return None
        if not self._in_time(now, command):
            return None
        if not self._speaks(now, command):
            self.conflict_at = now
            self._note(Cause.COMMAND_CONFLICT, now)
            return None
        settings = self.settings
        if not low <= value <= high:
            self._note(Cause.COMMAND_OUT_OF_RANGE, now)
            value = min(max(value, low), high)
        before = self._last.get(command.by_force)
        largest = (settings.largest_force_step if command.by_force
                   else settings.largest_command_step)
        if before is not None and abs(value - before) > largest:
            self._note(Cause.COMMAND_JUMP, now)
        self._last[command.by_force] = value
        if self.rivals and command.source == ANONYMOUS:
            value = self._highest(now, command.by_force, value)
        else:
            self._recent.clear()
        return value

    def _may(self, source: str) -> bool:
        wanted = self.settings.command_source
        return not wanted or source == wanted

    def _in_time(self, now: float, command: Command) -> bool:
        """Whether a stamped command is neither late nor a repetition; remember its source."""
        known = self._sources.get(command.source)
        window = self.window
        if command.stamp is not None and abs(command.age) > window:
            self._note(Cause.COMMAND_LATE, now)
            return False
        # After a pause a source may count anew.
        mark = (command.stamp, command.counter)
        counts = known is not None and now - known.seen <= window
        advances = known is None or _advances(mark, known.last, counts)
        if known is not None and not advances and (
                known.before is None or not _advances(mark, known.before, counts)
                or _equals(mark, known.last, counts)):
            self._note(Cause.COMMAND_REPEATED, now)
            return False
        if known is None:
            if len(self._sources) >= _SOURCES:
                silent = min(self._sources, key=lambda name: self._sources[name].seen)
                del self._sources[silent]
            known = self._sources[command.source] = _Source(now, now)
        elif now - known.seen > window:
            known.since = now
        if advances:
            known.before = known.last
        known.seen, known.last = now, mark
        return True

    def _speaks(self, now: float, command: Command) -> bool:
        """Whether the command's source is the one that is obeyed."""
        source = command.source
        if not self._may(source):
            return False
        if self.source is None or (
                source != self.source and now - self.spoke_at > self.window):
            self.source = source
        if source != self.source:
            return False
        self.spoke_at = now
        return True

    def asks_for_less(self, now: float, by_force: bool, angle: float) -> bool:
        """Whether, of two nameless sources, one of which asks for angles and the other for forces,
        the other one asks for more than this `angle` [rad]."""
        self._wanted[by_force] = (now, angle)
        other = self._wanted.get(not by_force)
        return other is not None and now - other[0] <= self.window and other[1] > angle

    def _highest(self, now: float, by_force: bool, value: float) -> float:
        recent = self._recent
        recent.append((now, by_force, value))
        while now - recent[0][0] > self.window or len(recent) > 1000:
            recent.popleft()
        return max(entry[2] for entry in recent if entry[1] == by_force)


def _advances(mark: tuple[int | None, int | None], last: tuple[int | None, int | None],
              counts: bool) -> bool:
    """Whether stamp and, if it `counts`, counter are beyond the last ones; what there is none of
    holds nobody up."""
    return not any(new is not None and old is not None and new <= old
                   for new, old in zip(mark[:2 if counts else 1], last, strict=False))


def _equals(mark: tuple[int | None, int | None], last: tuple[int | None, int | None],
            counts: bool) -> bool:
    """Whether stamp or, if it `counts`, counter are the last ones."""
    return any(new is not None and new == old
               for new, old in zip(mark[:2 if counts else 1], last, strict=False))
