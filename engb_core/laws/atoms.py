# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What laws are made of: the shapes that machines put into a torque, and where they act.

The list follows what machines do, not any recording: lubrication (drag that peaks or levels off
over speed, films that thin with heat, friction after rest), wear (places of the stroke), heat (of
losses, with slow relaxation), electronics (gains that depend on sign, size or heat of the effort,
delays), sensors (errors per revolution), structure (stops, springs, gears, cables, screws,
inertia over the angle), environment (time, temperature), the brake's own disc and pad.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
import itertools
import math

from engb_core.laws.forms import Atom, BASE_UNITS, Form, Scales, Slot
from engb_core.laws.grammar import Call, parse

__all__ = ['LONGEST_DELAY', 'factors_for', 'first_forms', 'limits_of', 'mirrors_of',
           'onset_forms']

# A wave is told from a trend where the stroke holds three of its periods.
LEAST_PERIODS = 3.0
# Below, down to this, a wave may still be meant, at the price of one parameter more.
FEWEST_PERIODS = 0.5
# Orders are tried at steps of a quarter of a period over the stroke.
ORDER_STEP = 0.25
MOST_ORDERS = 160
# Periods per revolution that a sensor's interpolation may have.
MOST_TURNS = 48
LONGEST_DELAY = 0.1         # s


def _positions(s: Scales) -> list[Atom]:
    """Places of the stroke: stops, springs, kinks, worn zones, waves of screw, gear, sensor."""
    u = s.angle
    found = [Atom('line', 'position', (), ((u, 1),))]
    for part in (0.06, 0.14, 0.25, 0.4, 0.55, 0.7, 0.82, 0.92):
        place = Slot(u, s.low + part * s.stroke, s.low - 0.1 * s.stroke, s.high + 0.1 * s.stroke)
        wide = Slot(u, 0.03 * s.stroke, 0.002 * s.stroke, 0.5 * s.stroke, True)
        found += [Atom('hinge', 'positive(position - {0})', (place,), ((u, 1),)),
                  Atom('hinge', 'positive({0} - position)', (place,), ((u, 1),)),
                  Atom('hinge2', 'positive(position - {0})**2', (place,), ((u, 2),)),
                  Atom('hinge2', 'positive({0} - position)**2', (place,), ((u, 2),)),
                  Atom('zone', 'step(position - {0}, {1})', (place, wide)),
                  Atom('zone', 'step({0} - position, {1})', (place, wide)),
                  Atom('spot', 'bell(position - {0}, {1})', (place, wide)),
                  Atom('spot', 'bell(position - {0}, {1})',
                       (place, replace(wide, start=0.1 * s.stroke))),
                  Atom('detent', '(position - {0}) / {1} * bell(position - {0}, {1})',
                       (place, wide))]
    if u == 'rad':
        found += [_turn(times) for times in (1, 2)]
    return found + list(_waves(s))


def _turn(times: int) -> Atom:
    """A shaft's own order needs no free number."""
    order = '' if times == 1 else f'{times} * '
    return Atom('turn', f'sin({order}position + {{0}})', (Slot('rad', 0.0, -20.0, 20.0),),
                phase=True)


def _sensors(s: Scales) -> list[Atom]:
    """What a position sensor does: off centre, interpolating, late, loosely coupled."""
    u = s.angle
    found = [Atom('line', 'position', (), ((u, 1),))]
    if u == 'rad':
        found += [_turn(times) for times in range(1, MOST_TURNS + 1)]
    found += list(_waves(s, MOST_ORDERS // 2))
    for part in (0.006, 0.025):
        way = Slot(u, part * s.stroke, 5e-4 * s.stroke, s.stroke, True)
        found.append(Atom('stop', 'stop(position, {0})', (way,)))
    return found


def _contacts(s: Scales) -> list[Atom]:
    """What moves the place at which the load is met: heat, wear, bending, lost motion, a mark
    that stays."""
    if s.load <= 0.0:
        return []
    slow = [atom for atom in _memories(s)
            if atom.kind.startswith(('heat ', 'distance', 'run in', 'set', 'stop'))
            or atom.kind == 'lag load']
    return slow + _loads(s)[:2] + _times(s) + _discs(s)


def _waves(s: Scales, count: int = MOST_ORDERS) -> Iterator[Atom]:
    step = ORDER_STEP * 2.0 * math.pi / s.stroke
    order = FEWEST_PERIODS * 2.0 * math.pi / s.stroke
    # As fine as samples of the fastest motion can tell; on a motor shaft a tooth at most.
    most = min(math.pi / max(s.speed * s.sampling, 1e-12), order + count * step)
    while order <= most:
        yield _wave_at(s, order)
        order += step
    # Higher ones are too many to be tried: of a drive behind a gear, which the joint's own slow
    # motion shows, those that stand out.
    yield from (_wave_at(s, entry) for entry in s.orders if entry > most)


def _wave_at(s: Scales, order: float) -> Atom:
    step = ORDER_STEP * 2.0 * math.pi / s.stroke
    few = order < LEAST_PERIODS * 2.0 * math.pi / s.stroke
    return Atom('slow wave' if few else 'wave', 'sin({0} * position + {1})',
                (Slot(f'1/{s.angle}', order, order - step, order + step),
                 Slot('rad', 0.0, -20.0, 20.0)), phase=True)


def _speeds(s: Scales) -> list[Atom]:
    """Lubrication and drag: rising, falling, levelling off, peaking."""
    u = ((f'{s.angle}/s', 1),)
    found = [Atom('speed', 'velocity', (), u), Atom('speed', 'abs(velocity)', (), u),
             Atom('speed2', 'velocity * abs(velocity)', (), ((f'{s.angle}/s', 2),)),
             Atom('speed2', 'velocity**2', (), ((f'{s.angle}/s', 2),)),
             Atom('root', 'sqrt(velocity)', (), ((f'{s.angle}/s', 0.5),))]
    for part in (0.04, 0.12, 0.35):
        width = Slot(f'{s.angle}/s', part * s.speed, 0.003 * s.speed, 3.0 * s.speed, True)
        found += [Atom('level', 'tanh(velocity / {0})', (width,)),
                  Atom('peak', 'peak(velocity / {0})', (width,)),
                  Atom('slow', 'exp(-abs(velocity) / {0})', (width,)),
                  Atom('fast', 'positive(abs(velocity) - {0})', (width,), u)]
    for part in (0.15, 0.35, 0.7):
        found.append(Atom('band', 'bell(abs(velocity) - {0}, {1})', (
            Slot(f'{s.angle}/s', part * s.speed, 0.0, s.speed),
            Slot(f'{s.angle}/s', 0.1 * s.speed, 0.01 * s.speed, s.speed, True))))
    return found


def _loads(s: Scales) -> list[Atom]:
    if s.load <= 0.0:
        return []
    u = (('N·m', 1),)
    found = [Atom('load', 'load', (), u), Atom('load', 'abs(load)', (), u),
             Atom('load2', 'load**2', (), (('N·m', 2),)),
             Atom('load root', 'sqrt(abs(load))', (), (('N·m', 0.5),)),
             # What is pressed together and let go is damped, too.
             Atom('load rate', 'rate(load)', (), (('N·m/s', 1),))]
    for part in (0.1, 0.3, 0.6):
        level = Slot('N·m', part * s.load, -0.2 * s.load, 1.2 * s.load)
        found += [Atom('load hinge', 'positive(load - {0})', (level,), u),
                  Atom('load step', 'step(load - {0}, {1})',
                       (level, Slot('N·m', 0.03 * s.load, 2e-3 * s.load, 0.5 * s.load, True)))]
        # A film carries by speed over pressure (Hersey's number).
        film = Slot(f'{s.angle}/s/(N·m)', part * s.speed / s.load,
                    0.003 * s.speed / s.load, 30.0 * s.speed / s.load, True)
        found.append(Atom('film', 'exp(-abs(velocity) / ({0} * abs(load)))', (film,)))
    return found


def _efforts(s: Scales) -> list[Atom]:
    """Electronics: gains that depend on sign and size of the model's own effort."""
    u, lost = (('N·m', 1),), (('N·m', -1),)
    found = [Atom('effort', 'abs(effort)', (), u), Atom('effort', 'effort', (), u),
             Atom('effort2', 'effort**2', (), (('N·m', 2),))]
    found.append(Atom('power', 'positive(effort * velocity)', (),
                      (('N·m', 1), (f'{s.angle}/s', 1))))
    # Resistance and back-EMF ask for a voltage; what a supply lacks of it is lost as torque.
    for share, part in itertools.product((0.3, 1.0), (0.5, 0.8)):
        most = s.effort * (1.0 + share)
        emf = Slot(f'N·m/({s.angle}/s)', share * s.effort / s.speed, 0.0, 5.0 * s.effort / s.speed)
        lacks = 'positive(abs(effort + {0} * velocity) - {1})'
        limit = Slot('N·m', part * most, 0.05 * s.effort, 5.0 * s.effort)
        found += [Atom('voltage', lacks, (emf, limit), u),
                  Atom('voltage', f'{lacks} / abs(effort)', (emf, limit))]
    width = Slot('N·m', 0.03 * s.effort, 1e-3 * s.effort, s.effort, True)
    found.append(Atom('effort sign', 'tanh(effort / {0})', (width,)))
    for part in (0.2, 0.5):
        level = Slot('N·m', part * s.effort, 0.0, s.effort)
        found.append(Atom('effort hinge', 'positive(abs(effort) - {0})', (level,), u))
    for part in (0.5, 0.8):
        # What is asked beyond a level is given to a part only; to none by a size of −1.
        found.append(Atom('effort limit', 'positive(abs(effort) - {0}) / abs(effort)',
                          (Slot('N·m', part * s.effort, 0.05 * s.effort, s.effort),)))
    for part in (0.05, 0.2):
        wide = replace(width, start=part * s.effort)
        found += [Atom('small effort', 'bell(effort, {0})', (wide,)),
                  # What is lost or added whatever the size: a dead band, dry friction before the
                  # gear; and with another sign on the way back: magnets, bent flanks.
                  Atom('effort offset', 'tanh(effort / {0}) / effort', (wide,), lost),
                  Atom('effort stop', 'stop(effort, {0}) / effort', (wide,), lost)]
    return found


def _times(s: Scales) -> list[Atom]:
    found = [Atom('time', 'time', (), (('s', 1),))]
    for part in (0.08, 0.3):
        settling = Slot('s', part * s.duration, 0.02 * s.duration, 5.0 * s.duration, True)
        found.append(Atom('settling', 'exp(-time / {0})', (settling,)))
    return found


def _memories(s: Scales) -> list[Atom]:
    """What goes before: heat, relaxation, lost motion, ageing, renewal by travel."""
    u = s.angle
    speed = f'{u}/s'
    found = []
    sources = [('abs(velocity)', ((speed, 1),)), ('velocity', ((speed, 1),)),
               ('velocity**2', ((speed, 2),)), ('direction', ())]
    if s.load > 0.0:
        sources += [('load', (('N·m', 1),)), ('abs(load * velocity)', (('N·m', 1), (speed, 1)))]
        if s.pulls_both_ways:
            sources.append(('abs(load)', (('N·m', 1),)))
        if s.disc:
            sources.append(('abs(load * disc_speed)', (('N·m', 1), ('rad/s', 1))))
    for source, unit in sources:
        for part in (0.002, 0.008, 0.03, 0.12):
            settling = Slot('s', max(part * s.duration, 3.0 * s.sampling), 2.0 * s.sampling,
                            3.0 * s.duration, True)
            found.append(Atom(f'lag {source}', f'lag({source}, {{0}})', (settling,), unit))
        if source not in ('velocity', 'direction'):
            for part in (0.15, 0.6):
                found.append(Atom(f'heat {source}', f'heat({source}, {{0}})',
                                  (Slot('s', part * s.duration, 0.03 * s.duration,
                                        10.0 * s.duration, True),), unit))
    for part in (0.006, 0.025, 0.1):
        way = Slot(u, part * s.stroke, 5e-4 * s.stroke, s.stroke, True)
        found += [Atom('stop', 'stop(position, {0})', (way,)),
                  Atom('drag', 'drag(position, {0})', (way,)),
                  Atom('fresh', 'exp(-since_reversal / {0})', (way,))]
        found.append(Atom('picked up', 'step(since_reversal - {0}, {1})',
                          (way, replace(way, start=0.2 * way.start))))
        if s.load > 0.0:
            found.append(Atom('travel load', 'travel_lag(load, {0})', (way,), (('N·m', 1),)))
            width = Slot('N·m', part * s.load, 1e-3 * s.load, s.load, True)
            found += [Atom('load stop', 'stop(load, {0})', (width,)),
                      Atom('load drag', 'drag(load, {0})', (width,))]
    for part in (0.15, 0.4):
        # A film needs time to build up, once it is fast enough, and to break down.
        found.append(Atom('film in time', 'lag(step(abs(velocity) - {0}, {1}), {2})', (
            Slot(speed, part * s.speed, 0.0, s.speed),
            Slot(speed, 0.03 * s.speed, 0.003 * s.speed, 0.5 * s.speed, True),
            Slot('s', max(0.008 * s.duration, 3.0 * s.sampling), 2.0 * s.sampling,
                 3.0 * s.duration, True))))
    # Contacts age within a fraction of a second or of minutes, and are renewed within a grain's
    # way or a seal's.
    found += [Atom('rested', 'rested({0}, {1})',
                   (Slot('s', first, 1e-3, 100.0, True),
                    Slot(u, part * s.stroke, 1e-3 * s.stroke, s.stroke, True)))
              for first in (0.05, 0.5) for part in (0.004, 0.03, 0.12)]
    # What a reversal breaks builds up again in time: a film, a charge, a layer that is dragged
    # along.
    found += [Atom('fresh in time', 'exp(-time_since_reversal / {0})', (
        Slot('s', first, 3.0 * s.sampling, s.duration, True),)) for first in (0.1, 0.5, 2.5)]
    found.append(Atom('distance', 'distance', (), ((u, 1),)))
    for part in (2.0, 20.0):
        found.append(Atom('run in', 'exp(-distance / {0})',
                          (Slot(u, part * s.stroke, 0.2 * s.stroke, 1e3 * s.stroke, True),)))
    if s.load > 0.0:
        # What was pressed once keeps the mark, for good or until it has recovered.
        for part in (0.1, 10.0):
            found.append(Atom('set', 'highest(load, {0})', (
                Slot('s', part * s.duration, 0.02 * s.duration, 100.0 * s.duration, True),),
                (('N·m', 1),)))
    return found


def _effort_memories(s: Scales) -> list[Atom]:
    """What effort leaves behind: a warm winding, a supply that has not yet recovered."""
    found = [Atom('heat effort', 'heat(effort**2, {0})',
                  (Slot('s', part * s.duration, 0.03 * s.duration, 10.0 * s.duration, True),),
                  (('N·m', 2),)) for part in (0.1, 0.4, 1.5)]
    power = (('N·m', 1), (f'{s.angle}/s', 1))
    for part in (0.004, 0.015, 0.06):
        settling = Slot('s', max(part * s.duration, 3.0 * s.sampling), 2.0 * s.sampling,
                        3.0 * s.duration, True)
        found += [Atom('lag power', 'lag(positive(effort * velocity), {0})', (settling,), power),
                  Atom('lag effort', 'lag(abs(effort), {0})', (settling,), (('N·m', 1),))]
    return found


def _discs(s: Scales) -> list[Atom]:
    found = []
    if s.disc:
        u = (('rad/s', 1),)
        found += [Atom('disc', 'disc_speed', (), u), Atom('disc', 'abs(disc_speed)', (), u)]
        for part in (0.1, 0.4):
            width = Slot('rad/s', part * s.disc, 0.005 * s.disc, 3.0 * s.disc, True)
            found += [Atom('disc slow', 'exp(-abs(disc_speed) / {0})', (width,)),
                      Atom('disc level', 'tanh(disc_speed / {0})', (width,))]
        # Thickness, slots, a hub that wobbles: harmonics of the disc's own turn.
        found += [Atom('disc turn', f'sin({times} * disc_angle + {{0}})',
                       (Slot('rad', 0.0, -20.0, 20.0),), phase=True) for times in (1, 2, 3, 4)]
    if s.temperature is not None and s.temperature[1] - s.temperature[0] > 1.0:
        low, high = s.temperature
        # About the middle, where the model's own numbers hold: else these had to move along.
        found.append(Atom('temperature', f'(pad_temperature - {0.5 * (low + high):.3g})', (),
                          (('°C', 1),)))
        found.append(Atom('temperature hinge', 'positive(pad_temperature - {0})',
                          (Slot('°C', 0.5 * (low + high), low, high),), (('°C', 1),)))
    return found


_DIRECTION = Atom('direction', 'direction')
# Friction has its direction already; an inertia, a sensor and a delay know none.
_WITHOUT_DIRECTION = ('friction_gain', 'inertia', 'position_shift', 'delay', 'position_delay',
                      'load_shift')


def _modulators(s: Scales) -> list[Atom]:
    """What a shape is multiplied by, to begin with."""
    speed = ((f'{s.angle}/s', 1),)
    found = [_DIRECTION, Atom('speed', 'velocity', (), speed)]
    if s.load > 0.0:
        found += [Atom('load', 'load', (), (('N·m', 1),)),
                  Atom('load', 'abs(load)', (), (('N·m', 1),))]
    return found


def _shapes(s: Scales, acts_as: str) -> list[Atom]:
    """Return the factors that a law acting there may have."""
    if acts_as == 'inertia':
        return _positions(s)
    if acts_as == 'position_shift':
        return _sensors(s)
    if acts_as == 'load_shift':
        return _contacts(s)
    if acts_as in ('delay', 'position_delay'):
        size = Slot('N·m', 0.3 * s.load, 0.0, 20.0 * s.load)
        more = [Atom('load and more', '(abs(load) + {0})', (size,), (('N·m', 1),))]
        plain = [atom for atom in (*_speeds(s), *_positions(s)) if atom.kind in ('speed', 'line')]
        loads = [atom for atom in _loads(s) if atom.kind != 'load rate']
        return [*(more if s.load > 0.0 else []), *loads,
                *(_efforts(s) if acts_as == 'delay' else []), *plain, *_times(s),
                *_discs(s)]
    found = _positions(s) + _speeds(s) + _loads(s) + _times(s) + _memories(s) + _discs(s)
    if acts_as == 'torque':
        found += [Atom('acceleration', 'acceleration', (), ((f'{s.angle}/s²', 1),)),
                  Atom('acceleration', 'abs(acceleration)', (), ((f'{s.angle}/s²', 1),))]
    if acts_as == 'effort_gain':
        found += _efforts(s) + _effort_memories(s)
    return found


def factors_for(s: Scales, form: Form, waves: tuple[float, ...]) -> list[Atom]:
    """Return what may be multiplied to a form, or stand for one of its factors.

    `waves` are orders that the residual shows; a full grid of them would take too long here.
    """
    shapes = [atom for atom in _shapes(s, form.acts_as) if 'wave' not in atom.kind]
    if form.acts_as not in _WITHOUT_DIRECTION:
        shapes.append(_DIRECTION)
    return shapes + [_wave_at(s, order) for order in waves]


def first_forms(s: Scales) -> Iterator[Form]:
    """Yield every single factor wherever it may act, and its products with a modulator."""
    for acts_as in BASE_UNITS:
        shapes = _shapes(s, acts_as)
        for atom in shapes:
            yield Form(acts_as, (atom,))
        if acts_as == 'delay':
            yield Form(acts_as, ())
        if acts_as in _WITHOUT_DIRECTION:
            continue
        yield Form(acts_as, (_DIRECTION,))
        modulators = _modulators(s) if acts_as == 'torque' else [_DIRECTION]
        for modulator in modulators:
            for atom in shapes:
                if atom.text != modulator.text:
                    yield Form(acts_as, (modulator, atom))


def limits_of(form: Form) -> Iterator[Form]:
    """Yield the form with one memory replaced by what it is where its constant is tiny: a lag by
    what it follows, play and bristles by the direction of motion, all else by nothing."""
    for place, atom in enumerate(form.factors):
        if not atom.memory or not atom.slots:
            continue
        call = parse(atom.filled())
        around = (*form.factors[:place], *form.factors[place + 1:])
        if isinstance(call, Call) and call.function in ('lag', 'travel_lag', 'highest'):
            # Its time or way is the last parameter.
            source = atom.text[len(call.function) + 1:atom.text.rindex(', {')]
            yield replace(form, factors=(*around, Atom(source, source, atom.slots[:-1],
                                                       atom.unit)))
        elif isinstance(call, Call) and call.function in ('stop', 'drag'):
            yield replace(form, factors=(*around, _DIRECTION))
        elif around:
            yield replace(form, factors=around)


# One side of a place or its other one: the load curve, or the friction of the file, takes up the
# difference. What acts until some way is gone is another part than what acts from there on.
_MIRRORED = {
    ('hinge', 'positive(position - {0})'): ('hinge', 'positive({0} - position)'),
    ('hinge2', 'positive(position - {0})**2'): ('hinge2', 'positive({0} - position)**2'),
    ('zone', 'step(position - {0}, {1})'): ('zone', 'step({0} - position, {1})'),
    ('load step', 'step(load - {0}, {1})'): ('load step', 'step({0} - load, {1})'),
    ('picked up', 'step(since_reversal - {0}, {1})'): ('let go',
                                                       'step({0} - since_reversal, {1})')}
_MIRRORS = {**_MIRRORED, **{other: own for own, other in _MIRRORED.items()}}


def mirrors_of(form: Form) -> Iterator[Form]:
    """Yield the form with one shape turned to the other side of its place."""
    for place, atom in enumerate(form.factors):
        other = _MIRRORS.get((atom.kind, atom.text))
        if other is not None:
            yield replace(form, factors=(
                *form.factors[:place], replace(atom, kind=other[0], text=other[1]),
                *form.factors[place + 1:]))


def onset_forms(s: Scales) -> Iterator[Form]:
    """Yield the plainest rivals of a law: something that begins at an instant and stays."""
    for part in [(index + 0.5) / 16.0 for index in range(16)]:
        instant = Slot('s', part * s.duration, 0.0, s.duration)
        width = Slot('s', 2e-3 * s.duration, 1e-3 * s.duration, 0.05 * s.duration, True)
        began = Atom('onset', 'step(time - {0}, {1})', (instant, width))
        yield Form('torque', (began,))
        yield Form('effort_gain', (began,))
        yield Form('friction_gain', (began,))
        for modulator in _modulators(s):
            yield Form('torque', (modulator, began))
