# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A model as C: its plant with all effects and laws, and its feedforward.

The functions are those that simulate here, translated (translate.py). What is written is C99
that needs nothing but <math.h>: no heap, no recursion, no data that is shared between plants.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from engb_core.effects import base
from engb_core.effects.base import Effect, SAMPLE_SIZE, STAGES, STATE_SIZE
from engb_core.export.expressions import number
from engb_core.export.kinds import Array, LONG, REAL, TABLE
from engb_core.export.translate import helpers_of, Translator
from engb_core.model import Model
from engb_core.physics import nominal_torque
from engb_core.physics.compiled import PARAMETER_SIZE
from engb_core.physics.nominal_torque import (
    load_friction_gain,
    N_AMPLITUDE,
    N_PHASE,
    N_TERMS,
    NOMINAL_SIZE,
)
from engb_core.physics.plant import effects_of, Physics, physics_of
from engb_core.physics.simulation import (
    acted_reference,
    advance_steps,
    INNER_STEP,
    loop_effort,
    loop_of,
    LOOP_SIZE,
    recorded_effort,
)

__all__ = ['CModel', 'Quantity', 'c_model', 'feedforward_header']

# The controller's numbers, with units of a revolute joint, in the order of `loop_of`.
_LOOP = (('controller.proportional', 'N.m/rad'), ('controller.integral', 'N.m/(rad.s)'),
         ('controller.derivative', 'N.m.s/rad'), ('controller.effort_limit', 'N.m'),
         ('controller.cycle', 's'))
# What the nominal vector holds, in its order, with units of a revolute joint.
_NOMINAL = (('motor.inertia', 'kg.m2'), ('motor.viscous_friction', 'N.m.s/rad'),
            ('friction.coulomb', 'N.m'), ('friction.load_gain', '1'),
            ('friction.load_curvature', '1'), ('friction.reference_load', 'N.m'),
            ('friction.saturation_velocity', 'rad/s'), ('load_torque.contact_angle', 'rad'))
_TOP = '''\
/* Written by `engb export`: do not edit, export the model again.
 *
 * The simulated brake with all effects of its model, and its position loop. Units are SI; angles
 * are motor angles [rad], torques motor-side [N.m] (a prismatic joint: m and N). No heap, no
 * recursion, no shared data: each engb_plant stands for itself. C99; compile with
 * -ffp-contract=off where results have to agree to the last digits with those of engb_core.
 */
'''
_HEADER = '''\
#ifndef ENGB_MODEL_H
#define ENGB_MODEL_H

#define ENGB_NOMINAL_SIZE {nominal}
#define ENGB_COGGING_TERMS {cogging}
#define ENGB_EFFECTS {effects}
#define ENGB_PARAMETER_SIZE {parameters}
#define ENGB_STATE_SIZE {state}
#define ENGB_SAMPLE_SIZE {sample}
#define ENGB_LOOP_SIZE {loop}
#define ENGB_CONTROLLER {controller} /* 1: the model has a controller */

/* Places in engb_plant.sample. */
{places}

/* Places in engb_plant.loop: gains [N.m/rad, N.m/(rad.s), N.m.s/rad], limit of effort [N.m], cycle
 * [s], and what is integrated so far [N.m]. */
#define ENGB_PROPORTIONAL 0
#define ENGB_INTEGRAL 1
#define ENGB_DERIVATIVE 2
#define ENGB_EFFORT_LIMIT 3
#define ENGB_CYCLE 4
#define ENGB_INTEGRATED 5

/* One brake. The numbers of `nominal`, `cogging` (order, amplitude, phase of each wave),
 * `parameters` (a row for each effect) and `loop` may be changed after engb_plant_init. */
typedef struct {{
    double step; /* longest inner step [s] */
    double nominal[ENGB_NOMINAL_SIZE];
    double cogging[{cogging_size}];
    double parameters[{parameters_size}];
    double state[{state_size}];
    double sample[ENGB_SAMPLE_SIZE];
    double loop[ENGB_LOOP_SIZE];
}} engb_plant;

/* Set all numbers to the model's; the motor stands at `position` [rad]. */
void engb_plant_init(engb_plant *plant, double position);

/* Run on for `duration` [s] with `effort` [N.m], the torque that is measured or commanded, held;
 * `disc_speed` [rad/s] and `pad_temperature` [degC] are held too. */
void engb_plant_advance(engb_plant *plant, double effort, double duration, double disc_speed,
                        double pad_temperature);

/* What is recorded of an effort [N.m] that was held for `duration` [s]: called once for each
 * engb_plant_advance, after it, by whoever asks. */
double engb_plant_recorded(engb_plant *plant, double effort, double duration);

/* The set-point [rad] on which the drive acts, for a loop of one's own that runs every `cycle`
 * [s]: called once a cycle with the set-point that the drive is given. */
double engb_plant_acted(engb_plant *plant, double reference, double cycle);

/* The effort [N.m] that the model's controller asks for in its next cycle, to be held over
 * loop[ENGB_CYCLE] [s]: with what it tracks [rad], how fast that moves [rad/s], and the
 * feedforward torque [N.m]. It finds the set-point on which the drive acts itself. Without a
 * controller in the model its gains are 0. */
double engb_plant_loop(engb_plant *plant, double reference, double reference_velocity,
                       double reference_effort);

#endif
'''
_PLANT = '''\
void engb_plant_init(engb_plant *plant, double position)
{{
    (void)memset(plant, 0, sizeof *plant);
    plant->step = {step};
    (void)memcpy(plant->nominal, engb_nominal, sizeof engb_nominal);
    (void)memcpy(plant->cogging, engb_cogging, sizeof engb_cogging);
    (void)memcpy(plant->parameters, engb_parameters, sizeof engb_parameters);
    (void)memcpy(plant->loop, engb_loop, sizeof engb_loop);
    plant->sample[ENGB_POSITION] = position;
    plant->sample[ENGB_PAD_TEMPERATURE] = 20.0;
}}

void engb_plant_advance(engb_plant *plant, double effort, double duration, double disc_speed,
                        double pad_temperature)
{{
    const long steps = engb_max_long(1, (long)ceil((duration / plant->step) - 1e-9));
    const double inner = duration / (double)steps;
    /* A difference of times is a step but for its last digits, which impacts would magnify. */
    plant->sample[ENGB_TIME_STEP] =
        (fabs(inner - plant->step) < (1e-9 * plant->step)) ? plant->step : inner;
    plant->sample[ENGB_DISC_SPEED] = disc_speed;
    plant->sample[ENGB_PAD_TEMPERATURE] = pad_temperature;
    {advance}(plant->nominal, plant->cogging, engb_bounds, engb_owner, plant->parameters,
        plant->state, plant->sample, isfinite(effort) ? effort : 0.0, steps);
}}

double engb_plant_recorded(engb_plant *plant, double effort, double duration)
{{
    return {recorded}(engb_bounds, engb_owner, plant->parameters, plant->state, plant->sample,
        effort, duration);
}}

double engb_plant_acted(engb_plant *plant, double reference, double cycle)
{{
    return {acted}(engb_bounds, engb_owner, plant->parameters, plant->state, plant->sample,
        reference, cycle);
}}

double engb_plant_loop(engb_plant *plant, double reference, double reference_velocity,
                       double reference_effort)
{{
    return {loop}(engb_bounds, engb_owner, plant->parameters, plant->state, plant->sample,
        plant->loop, reference, reference_velocity, reference_effort);
}}
'''


@dataclass(frozen=True)
class Quantity:
    """A number of the model that may be changed from outside.

    Attributes:
        name: such as 'motor.inertia' or 'stribeck_friction.breakaway_ratio'.
        unit: SI, '1' for none.
        array: member of engb_plant that holds it.
        index: its place there.
        value: what the model says [`unit`].
    """

    name: str
    unit: str
    array: str
    index: int
    value: float


@dataclass(frozen=True)
class CModel:
    """A model as C.

    Attributes:
        header: engb_model.h.
        source: engb_model.c.
        quantities: numbers that may be changed.
        beside: what is not in it, a sentence each.
    """

    header: str
    source: str
    quantities: tuple[Quantity, ...]
    beside: tuple[str, ...]


def c_model(model: Model) -> CModel:
    """Return the simulated brake as C.

    Args:
        model: with its effects and laws.

    Raises:
        InputError: an effect holds Python that does not become C; the message names the line.
    """
    effects = effects_of(model)
    physics = physics_of(model, effects, inverse=False)
    rows = max(len(effects), 1)
    translator = Translator(_constant_names())
    functions = [translator.function(
        function.definition, (Array(PARAMETER_SIZE), Array(STATE_SIZE), Array(SAMPLE_SIZE)),
        writes=('state', 'sample')).name
        for stage in STAGES for function, _ in physics.stages[stage]]
    acting = (TABLE, Array(physics.bounds.size, item=LONG), Array(len(functions), item=LONG),
              Array(rows, PARAMETER_SIZE), Array(rows, STATE_SIZE), Array(SAMPLE_SIZE))
    written_to = ('state', 'sample')
    advance = translator.function(advance_steps, (
        Array(NOMINAL_SIZE), Array(physics.cogging.shape[0], 3), *acting, REAL, LONG), written_to)
    recorded = translator.function(recorded_effort, (*acting, REAL, REAL), written_to)
    acted = translator.function(acted_reference, (*acting, REAL, REAL), written_to)
    loop = translator.function(loop_effort, (*acting, Array(LOOP_SIZE), REAL, REAL, REAL),
                               (*written_to, 'loop'))
    header = _TOP + _HEADER.format(
        nominal=NOMINAL_SIZE, cogging=physics.cogging.shape[0], effects=len(effects),
        parameters=PARAMETER_SIZE, state=STATE_SIZE, sample=SAMPLE_SIZE, loop=LOOP_SIZE,
        # One more than are used: C has no arrays of nothing.
        cogging_size=3 * physics.cogging.shape[0] + 1,
        parameters_size=(len(effects) + 1) * PARAMETER_SIZE,
        state_size=(len(effects) + 1) * STATE_SIZE,
        controller=int(model.controller is not None),
        places='\n'.join(f'#define ENGB_{name} {place}' for name, place in _PLACES))
    parts = [_TOP, '#include "engb_model.h"\n\n#include <math.h>\n#include <stdlib.h>\n'
                   '#include <string.h>\n']
    nominal = [f'#define ENGB_{name} {place}' for name, place in _NOMINAL_PLACES]
    parts.append('\n'.join(['/* Places in engb_plant.nominal. */', *nominal, '']))
    plant_text = _PLANT.format(step=number(INNER_STEP), advance=advance.name, acted=acted.name,
                               recorded=recorded.name, loop=loop.name)
    parts += ['\n'.join(_tables(model, physics, functions)),
              helpers_of('\n'.join([*translator.functions.values(), plant_text])),
              '\n'.join(translator.structures.values()),
              'typedef double (*engb_function)(const double *parameters, double *state, '
              'double *sample);\n']
    # The table stands between the functions in it and the ones that call by it.
    written = list(translator.functions.values())
    own = [index for index, name in enumerate(translator.functions) if name in functions]
    first = max(own, default=-1) + 1
    names = ', '.join(functions) or '0'
    parts += [*written[:first],
              f'static const engb_function engb_functions[{max(len(functions), 1)}] = {{{names}}};'
              '\n', *written[first:], plant_text]
    quantities = tuple(_quantities(model, effects, physics))
    return CModel(header, '\n'.join(part for part in parts if part), quantities,
                  tuple(_beside(effects)))


_PLACES = tuple((name, getattr(base, name)) for name in (
    'TIME_STEP', 'TIME', 'POSITION', 'VELOCITY', 'ACCELERATION', 'DISC_SPEED', 'DISC_ANGLE',
    'PAD_TEMPERATURE', 'SHIFT', 'LOAD', 'LEVEL', 'DIRECTION', 'EFFORT', 'INERTIA', 'VISCOUS',
    'COULOMB', 'LOAD_GAIN', 'TORQUE', 'REFERENCE'))
_NOMINAL_PLACES = tuple((name, value) for name, value in vars(nominal_torque).items()
                        if name.startswith('N_'))


def _constant_names() -> dict[tuple[str, float], str]:
    return {(name, value): f'ENGB_{name}' for name, value in (*_PLACES, *_NOMINAL_PLACES)}


def _tables(model: Model, physics: Physics, functions: list[str]) -> Iterator[str]:
    """Yield the numbers of the model as constant arrays."""
    arrays = {'nominal': (REAL, physics.nominal), 'cogging': (REAL, physics.cogging.ravel()),
              'parameters': (REAL, physics.parameters.ravel()),
              'loop': (REAL, loop_of(model.controller) if model.controller is not None
                       else np.zeros(LOOP_SIZE))}
    yield '/* The numbers of the model. */'
    for name, (kind, values) in arrays.items():
        text = ', '.join(number(value) for value in values) or '0.0'
        yield f'static const {kind} engb_{name}[{max(values.size, 1)}] = {{{_wrapped(text)}}};'
    yield '/* Where each stage of the balance begins among the functions; whose they are. */'
    bounds = ', '.join(str(one) for one in physics.bounds)
    yield f'static const long engb_bounds[{physics.bounds.size}] = {{{bounds}}};'
    owner = ', '.join(str(one) for one in physics.owner) or '0'
    yield f'static const long engb_owner[{max(len(functions), 1)}] = {{{owner}}};\n'


def _wrapped(text: str) -> str:
    import textwrap
    return '\n'.join(textwrap.wrap(text, 92, initial_indent='\n    ', subsequent_indent='    '))


def _quantities(model: Model, effects: list[tuple[Effect, list[float]]],
                physics: Physics) -> Iterator[Quantity]:
    for index, (name, unit) in enumerate(_NOMINAL):
        if name == 'load_torque.contact_angle' and model.load_torque.contact_angle is None:
            continue
        yield Quantity(name, unit, 'nominal', index, float(physics.nominal[index]))
    if model.load_torque.form == 'sinusoid':
        yield Quantity('load_torque.amplitude', 'N.m', 'nominal', N_AMPLITUDE,
                       model.load_torque.amplitude)
        yield Quantity('load_torque.phase', 'rad', 'nominal', N_PHASE,
                       model.load_torque.phase)
    else:
        for power, value in enumerate(model.load_torque.coefficients):
            yield Quantity(f'load_torque.coefficients[{power}]', '1', 'nominal',
                           N_TERMS + 1 + power, value)
    if model.controller is not None:
        for index, value in enumerate(loop_of(model.controller)[:len(_LOOP)]):
            yield Quantity(*_LOOP[index], 'loop', index, float(value))
    for row, wave in enumerate(model.cogging):
        for column, (name, unit) in enumerate((('order', '1'), ('amplitude', 'N.m'),
                                               ('phase', 'rad'))):
            yield Quantity(f'cogging[{row}].{name}', unit, 'cogging', 3 * row + column,
                           float(getattr(wave, name)))
    for row, (effect, values) in enumerate(effects):
        times = sum(one.id == effect.id for one, _ in effects[:row])
        title = effect.id if not times else f'{effect.id}_{times + 1}'
        named = [(entry.name, entry.unit) for entry in effect.parameters]
        if effect.written is None:      # a law's constants are its program
            named += effect.constants
        for place, (name, unit) in enumerate(named):
            yield Quantity(f'{title}.{name}', unit.replace('·', '.').replace('-', '1')
                           .replace('²', '2').replace('°C', 'degC'), 'parameters',
                           row * PARAMETER_SIZE + place, values[place])


def _beside(effects: list[tuple[Effect, list[float]]]) -> Iterator[str]:
    for effect, _ in effects:
        if not effect.stages:
            yield (f'{effect.id} is when effort and position are stamped, not what the brake or '
                   'its loop does; move one of the columns against the other where they are '
                   'written down')


def feedforward_header(model: Model) -> str:
    """Return engb_feedforward.h: the torque of `control.feedforward.Feedforward`, bit by bit.

    Args:
        model: whose nominal numbers it has; effects are not in it.
    """
    translator = Translator({})
    gain = translator.function(load_friction_gain, (REAL, REAL, REAL, REAL))
    friction, load = model.friction, model.load_torque
    if load.form == 'sinusoid':
        curve = [f'return {number(load.amplitude)} * sin(position + ({number(load.phase)}));']
    else:
        curve = ['double total = 0.0;']
        if load.contact_angle is not None:
            curve += [f'const double closed = position - ({number(load.contact_angle)});',
                      'if (!(closed < 0.0)) {']
        place, indent = ('position', '') if load.contact_angle is None else ('closed', '    ')
        curve += [f'{indent}total = (total * {place}) + ({number(value)});'
                  for value in reversed(load.coefficients)]
        curve += ['}'] * bool(indent) + ['return total;']
    waves = ['total += engb_cogging_torque(position);'] if model.cogging else []
    cogging = [f'total += {number(one.amplitude)} * sin(({number(one.order)} * position) + '
               f'({number(one.phase)}));' for one in model.cogging]
    lines = '\n'.join(f'    {line}' for line in curve)
    return _FEEDFORWARD.format(
        gain=(helpers_of(translator.functions[gain.name]) + translator.functions[gain.name]
              ).replace('static double', 'static inline double'),
        name=gain.name, curve=lines, inertia=number(model.motor.inertia),
        viscous=number(model.motor.viscous_friction), coulomb=number(friction.coulomb),
        load_gain=number(friction.load_gain), curvature=number(friction.load_curvature),
        reference=number(friction.reference_load),
        saturation=number(friction.saturation_velocity),
        cogging='\n'.join(f'    {line}' for line in cogging) or '    (void)position;',
        waves='\n'.join(f'    {line}' for line in waves))


_FEEDFORWARD = '''\
/* Written by `engb export`: do not edit, export the model again.
 *
 * The feedforward torque of equation (27) with load, friction and cogging torque of the model:
 * engb_feedforward(position [rad], velocity [rad/s], acceleration [rad/s2]) in N.m, motor side.
 * Double precision, no heap, no state; the numbers are the model's, the effects that a diagnosis
 * added are not in it. MISRA C:2012 is kept but for rule 15.5 (advisory): a function that is
 * translated from the model's own has as many exits as that.
 */
#ifndef ENGB_FEEDFORWARD_H
#define ENGB_FEEDFORWARD_H

#include <math.h>

{gain}
static inline double engb_load_torque(double position)
{{
{curve}
}}

static inline double engb_friction_torque(double load, double velocity)
{{
    double direction = velocity / {saturation};
    if (direction < -1.0) {{
        direction = -1.0;
    }}
    if (direction > 1.0) {{
        direction = 1.0;
    }}
    return ({coulomb} + ({name}({load_gain}, {curvature}, {reference}, load) * fabs(load)))
           * direction;
}}

static inline double engb_cogging_torque(double position)
{{
    double total = 0.0;
{cogging}
    return total;
}}

static inline double engb_feedforward(double position, double velocity, double acceleration)
{{
    double total = ({inertia} * acceleration) + ({viscous} * velocity);
    const double load = engb_load_torque(position);
    total += load;
    if (velocity != 0.0) {{
        total += engb_friction_torque(load, velocity);
    }}
{waves}
    return total;
}}

#endif
'''
