# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Which channel of a table is what: told by its unit first, then by the words of its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import re

from engb_core.io.tables.table import Channel, Table
from engb_core.io.tables.units import unit_of
from engb_core.io.tables.vocabulary import CURRENT, hits_of, KNOWN, OWN, REFERENCE, title_words

__all__ = ['MEASURED', 'QUANTITIES', 'Roles', 'is_current', 'roles_of']

# What each role may be measured in, the usual one first.
QUANTITIES = {
    'time': ('time',),
    'position': ('angle', 'length', 'counts'),
    'velocity': ('speed', 'linear speed'),
    'effort': ('torque', 'current', 'force'),
    'reference': ('angle', 'length', 'counts'),
    'reference_velocity': ('speed', 'linear speed'),
    'disc_speed': ('speed',),
    'pad_temperature': ('temperature',),
}
MEASURED = ('time', 'position', 'effort')
_LIKE = {'reference': 'position', 'reference_velocity': 'velocity', 'disc_speed': 'velocity'}

_OTHER = frozenset((
    'load', 'output', 'out', 'abtrieb', 'abtriebs', 'lastseitig', 'gear', 'wheel', 'disc', 'disk',
    'scheibe', 'external', 'ext', 'sensor', '负载', '負荷'))
_DISC = frozenset((
    'disc', 'disk', 'scheibe', 'brakedisc', 'rotor', 'wheel', 'rad'))
_PAD = frozenset((
    'pad', 'pads', 'belag', 'lining', 'disc', 'disk', 'brake', 'bremse'))
_NEVER = frozenset((
    'error', 'err', 'fehler', 'diff', 'deviation', 'raw', 'dc', 'bus', 'supply', 'phase', 'limit',
    'max', 'min', 'std', 'acc', 'accel', 'acceleration', 'enable', 'enabled'))
# Direct-axis and phase currents: no measure of the torque.
_NO_TORQUE = re.compile(r'^(i[_ .]?[duvwabc]|id|iu|iv|iw|ia|ib|ic)$')


@dataclass(frozen=True)
class Roles:
    """Role → number of the channel, and where several fit alike, all of them."""

    chosen: dict[str, int]
    unclear: dict[str, tuple[int, ...]]


def roles_of(table: Table, given: Mapping[str, int]) -> Roles:
    """Say which channel is what; `given` (role → number) is not asked again."""
    chosen = dict(given)
    unclear: dict[str, tuple[int, ...]] = {}
    taken = set(given.values())
    for role in QUANTITIES:
        if role in chosen:
            continue
        points = {place: _points(channel, role)
                  for place, channel in enumerate(table.channels) if place not in taken}
        best = max(points.values(), default=0.0)
        if best < _least(role):
            continue
        places = tuple(place for place, value in points.items() if value == best)
        if len(places) > 1 and role in ('position', 'effort'):
            unclear[role] = places
        elif len(places) == 1 or role == 'time':
            # Several clocks are the groups' own: which one is told by the group.
            chosen[role] = places[0]
            taken.add(places[0])
    return Roles(chosen, unclear)


def is_current(channel: Channel) -> bool:
    """Whether a channel's name says that it is a current."""
    words = title_words(channel.short)
    return bool(hits_of(words, CURRENT)) or any(
        len(entry) > 3 and entry in word for word in words for entry in CURRENT)


def _least(role: str) -> float:
    # A word alone names a role; what is optional must be told by word and unit both.
    return 2.0 if role in MEASURED else 5.0


def _points(channel: Channel, role: str) -> float:
    """Return how well a channel fits a role; below 2 it does not."""
    words = title_words(channel.short)
    text = ''.join(words)
    unit = unit_of(channel.unit) if channel.unit else None
    if unit is not None and unit.quantity not in QUANTITIES[role]:
        return 0.0
    demanded = bool(hits_of(words, REFERENCE)) or bool(re.search('soll|target|setpoint', text))
    if (role in ('reference', 'reference_velocity')) != demanded or words & _NEVER:
        return 0.0
    if role == 'disc_speed' and not words & _DISC:
        return 0.0
    if role == 'pad_temperature' and not words & _PAD:
        return 0.0
    if role == 'effort' and _NO_TORQUE.match(channel.short.casefold()):
        return 0.0
    known = KNOWN[_LIKE.get(role, role)]
    hits = hits_of(words, known)
    word = 0.0
    if hits:
        word = 3.0 if any(len(entry) > 2 or not entry.isascii() for entry in hits) else 2.0
    elif any(len(entry) > 3 and entry in text for entry in known):
        word = 2.0
    elif demanded and unit is not None:
        word = 2.0      # a set-point of what its unit says
    if not hits and unit is None and word < 2.0:
        return 0.0
    letters = _letters(channel.short)
    if unit is None and 'T' in letters and role == 'time':
        word = 0.5      # a torque, a temperature or a period, rather
    if role == 'effort' and 'T' in letters:
        word = max(word, 2.0)
    points = word + (4.0 if unit is not None else 0.0)
    if role in ('position', 'velocity', 'effort'):
        points += 0.5 * bool(hits_of(words, OWN)) - 1.5 * bool(hits_of(words, _OTHER))
    return points


def _letters(name: str) -> set[str]:
    return set(re.findall(r'(?<![A-Za-z])[A-Za-z](?![A-Za-z])', name))
