# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A law as an engineer reads it: one line with units and standard errors, and what does so."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from engb_core.laws.grammar import coordinates_of, parse, printed, with_values
from engb_core.laws.judgement import depends_on, Found
from engb_core.laws.law_search import Candidate
from engb_core.laws.line import Line, line_of

__all__ = ['formula_of', 'said_line', 'said_names', 'statement_of', 'told_as']

_SAYS = {'torque': 'A torque that', 'friction_gain': 'The friction changes by a part that',
         'load_gain': 'The load torque changes by a part that',
         'effort_gain': 'The torque for a given effort changes by a part that',
         'inertia': 'An inertia that', 'position_shift': 'The measured position is off by what',
         'position_delay': 'The position is measured late, by a delay that',
         'load_shift': 'The load is met elsewhere, by what',
         'delay': 'Torque and motion are apart by a delay that'}
_COORDINATES = {'position': 'the position', 'motor_angle': 'the motor angle',
                'velocity': 'the speed', 'direction': 'the direction of motion',
                'acceleration': 'the acceleration', 'load': 'the load', 'effort': 'the effort',
                'time': 'time', 'disc_speed': 'the disc speed', 'disc_angle': 'the disc angle',
                'pad_temperature': 'the pad temperature', 'heat': 'heat',
                'since_reversal': 'the way or time since the last reversal',
                'time_at_rest': 'the time at rest', 'distance': 'the distance travelled'}
# What a machine does so, by kind of factor and by where it acts.
_CAUSES = {
    'wave': 'a screw, gear or guide whose error repeats along the stroke',
    'slow wave': 'a lever, crank or guide whose shape changes along the stroke',
    'turn': 'an eccentric, bent or unbalanced part that turns with the shaft',
    'hinge': 'a stop or spring that is met at one place of the stroke',
    'hinge2': 'a bumper that stiffens from one place of the stroke on',
    'zone': 'something that is touched in one part of the stroke only',
    'spot': 'a dent, worn or tight place of the stroke',
    'detent': 'a detent or a dent of one place, which pulls towards it or away',
    'band': 'a part that shakes or a film that breaks down at one speed',
    'film': 'a lubricant film that carries by speed over pressure',
    'film in time': 'a lubricant film that takes time to build up and to break down',
    'load rate': 'a part that damps while it is pressed together or let go',
    'effort offset': 'a dead band of the amplifier, or dry friction before the gear',
    'effort stop': 'a current sensor or motor that keeps some of its magnetism, or a gear that '
                   'bends before it turns',
    'power': 'a supply that sags under power',
    'lag power': 'a supply that has not yet recovered from the power that was drawn',
    'lag effort': 'a supply that has not yet recovered from the current that was drawn',
    'voltage': 'a supply with less voltage than resistance and back-EMF ask for',
    'picked up': 'a part with play that is picked up after some way',
    'let go': 'a lip, brush or part with play that a reversal turns over after some way',
    'load stop': 'a joint that bends under load before it slips',
    'load drag': 'a joint that bends under load before it slips',
    'run in': 'a part that runs in along its way',
    'set': 'a part that keeps the mark of the highest load',
    'peak': 'a lubricant or a touching part whose drag peaks at one speed',
    'level': 'a drag that levels off over speed',
    'slow': 'a lubricant film that builds up with speed',
    'fast': 'churning or windage above one speed',
    'speed2': 'churning or windage', 'stop': 'a cable, seal or spring that bends before it slips',
    'drag': 'a cable, seal or brush that bends before it slips',
    'fresh in time': 'a film or layer that a reversal breaks and that builds up again in time',
    'disc turn': 'a disc whose thickness or run changes along its turn',
    'rested': 'a seal or contact that settles while it rests',
    'effort sign': 'a current sensor or amplifier whose gain differs with the sign',
    'effort': 'a motor or amplifier whose gain changes with the current',
    'effort2': 'a motor that saturates', 'effort hinge': 'a motor or supply that saturates',
    'effort limit': 'a drive or supply that gives no more than a limit, whatever is asked of it',
    'small effort': 'a dead band or offset of the amplifier',
    'disc': 'the disc and its bearing', 'disc slow': 'pad friction that falls with disc speed',
    'disc level': 'pad friction that levels off over disc speed',
    'temperature': 'heat of the pad', 'temperature hinge': 'heat of the pad beyond one limit',
    'settling': 'a part that runs in or warms up', 'time': 'a slow drift',
    'heat effort': 'the heat of the motor',
    'fresh': 'a part that is pushed along after a reversal',
    'distance': 'wear or smearing along the way', 'load step': 'a part that engages under load',
    'load hinge': 'a part that yields from one load on',
}


def formula_of(candidate: Candidate, digits: int = 4) -> str:
    """Return the formula with its numbers."""
    return printed(with_values(parse(candidate.form.formula), candidate.values), digits)


def told_as(candidate: Candidate) -> str:
    """Return where a law acts and its formula, by which it is known beside others."""
    return f'{candidate.form.acts_as}: {formula_of(candidate)}'


def said_line(found: Found) -> Line:
    """Return the law as one line with units and standard errors, and what is told below it."""
    form = found.candidate.form
    return line_of(form.acts_as, parse(form.formula), found.parameters)


def said_names(coordinates: Sequence[str]) -> str:
    """Return coordinates as a person lists them."""
    names = [_COORDINATES[name] for name in coordinates]
    return ' and '.join([', '.join(names[:-1]), names[-1]] if len(names) > 1 else names)


def statement_of(found: Found, corrects: Sequence[str] = ()) -> str:
    """Return one or two sentences for a brake engineer.

    Args:
        found: the law.
        corrects: titles of named effects whose form does not fit without it.
    """
    candidate = found.candidate
    acts = candidate.form.acts_as
    # What the place to act brings in need not be told: an inertia takes acceleration, …
    own = coordinates_of(parse(candidate.form.formula))
    after = said_names([name for name in depends_on(candidate)
                        if name in own or name in ('heat', 'time_at_rest')])
    text = f'{_SAYS[acts]} depends on {after}: ' if after else f'{_SAYS[acts]} acts: '
    line = said_line(found)
    if found.settled:
        text += f'{line}.'
    else:
        text = (f'What is left follows {after or "time"} {"roughly " if found.approximate else ""}'
                f'like {line}; the form is not settled.')
    cause = _cause(candidate)
    if cause and not found.approximate:
        text += f' A machine does so with {cause}.'
    if corrects:
        text += f' It corrects the form of {" and ".join(title.lower() for title in corrects)}.'
    text += f' It explains {100.0 * found.explained:.0f} % of what was left.'
    if not found.settled:
        text += f' {_to_settle(found) if found.alternatives else _to_measure(found)}'
    return text


def _cause(candidate: Candidate) -> str:
    if candidate.form.acts_as == 'delay':
        return 'a sensor, filter or bus whose delay is not constant'
    if candidate.form.acts_as == 'position_delay':
        return 'a position sensor whose reading comes late, the more so the larger these are'
    if candidate.form.acts_as == 'position_shift':
        return 'an encoder that is off centre or interpolates wrongly'
    if candidate.form.acts_as == 'load_shift':
        return 'a part that grows with heat, wears or bends, so that contact comes elsewhere'
    for atom in candidate.form.factors:
        if atom.kind in _CAUSES:
            return _CAUSES[atom.kind]
        if atom.kind.startswith('heat '):
            return 'a part that its own losses warm'
        if atom.kind.startswith(('lag ', 'travel ')):
            return 'a part that follows late: something soft, viscous or warm'
    return ''


def _to_settle(found: Found) -> str:
    """Say where the law and its rivals differ most, so that it can be measured."""
    rival = found.alternatives[0]
    where = _where_most(found, found.candidate.fit.predicted - rival.fit.predicted)
    return (f'As well does {formula_of(rival)}; the two differ most at {where}: record more of '
            'that, and beyond it.')


def _to_measure(found: Found) -> str:
    """Say where an approximation misses most, so that its form can be measured."""
    where = _where_most(found, found.candidate.fit.residual)
    return f'It misses most at {where}: record more of that, slower and faster.'


def _where_most(found: Found, here: NDArray[np.float64]) -> str:
    """Return the speeds and the part of the stroke in which values (m,) are largest."""
    motions = [entry.motion for entry in found.fitter.problem.runs]
    grids = [entry.comparison.grid for entry in found.fitter.problem.runs]
    speed, position = (np.concatenate([getattr(motion, name)[grid] for motion, grid in
                                       zip(motions, grids, strict=True)])
                       for name in ('velocity', 'position'))
    rows = np.abs(here) >= np.quantile(np.abs(here), 0.9)
    low, high = np.quantile(np.abs(speed[rows]), [0.1, 0.9])
    first, last = np.quantile(position[rows], [0.1, 0.9])
    angle = 'rad' if found.fitter.problem.scene.joint_type == 'revolute' else 'm'
    return f'{low:.3g} to {high:.3g} {angle}/s between {first:.3g} and {last:.3g} {angle}'
