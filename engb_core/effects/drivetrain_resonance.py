# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""A compliant drivetrain with inertia and friction beyond it."""

from collections.abc import Mapping
from dataclasses import replace
import math

from engb_core.effects.base import (
    ACCELERATION,
    COULOMB,
    DIRECTION,
    Effect,
    INERTIA,
    LEVEL,
    LOAD,
    Parameter,
    SATURATION,
    TIME,
    TIME_STEP,
    VELOCITY,
    VISCOUS,
)
from engb_core.physics.compiled import compiled, effect_function, Numbers
from engb_core.physics.dry_friction import friction_beyond, slowed_rate

# How torque rises with twist.
LINEAR, HARDENS, SOFT_CENTRE = 0.0, 1.0, 2.0
_LINEAR_SPRING = {'stiffness_change': 0.0, 'stiffness_twist': 1.0, 'spring': LINEAR}


@compiled
def _sprung(parameters: Numbers, twist: float) -> float:
    """Return the twist of a linear spring that gives as much torque: a strain wave gear or a
    spline is stiffer the further it is twisted, or soft up to a certain twist."""
    change, reach = parameters[6], parameters[7]
    if parameters[9] == HARDENS:
        return twist + change * (twist - reach * math.atan(twist / reach))
    if parameters[9] == SOFT_CENTRE:
        return twist - change * reach * math.tanh(twist / reach)
    return twist


# Below that [Hz] hardly any drivetrain resonates: loads swing from hooks and slosh in tanks.
_SWINGS = 2.0


@effect_function
def _shift(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # Where the load is by now, if it goes on as it did in the last step.
    if parameters[8] == 0.0 or sample[TIME] <= 0.0:
        return 0.0
    return state[0] + sample[TIME_STEP] * state[1]


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # state: 0 twist e of the inertia beyond, 1 its rate, 2 and 3 the last acceleration and
    # velocity of the motor, 4 the last load. With the motor's motion given, e is a damped
    # oscillator driven by it; solved in steps short enough for its period, so that long samples
    # (inverse dynamics) and short ones (simulation) agree.
    fraction = parameters[0]
    inertia = fraction * sample[INERTIA]
    if inertia <= 0.0:
        return 0.0
    locked = 2.0 * math.pi * parameters[1] * math.sqrt(1.0 - fraction)
    decay = 2.0 * parameters[2] * locked
    loaded = min(max(parameters[3] + parameters[4], 0.0), 1.0)
    friction = friction_beyond(sample[COULOMB], sample[LEVEL], parameters[3], loaded)
    drag = parameters[5] * sample[VISCOUS]
    load = parameters[8] * sample[LOAD]
    acceleration = sample[ACCELERATION]
    motor, saturation = sample[VELOCITY], sample[SATURATION]
    step = sample[TIME_STEP]
    if sample[TIME] <= 0.0:
        held = load + drag * motor + friction * sample[DIRECTION]
        state[0] = -(acceleration + held / inertia) / locked ** 2
        state[1] = 0.0
    else:
        parts = int(math.ceil(step * locked / 0.1))
        short = step / parts
        # Neither damping nor dry friction can overshoot. Divisions take longer than all else here.
        stiffness, lightness, width = locked ** 2, 1.0 / inertia, 1.0 / parts
        slowing = drag * lightness
        lost = 0.5 * short * (decay + slowing)
        kept, left = 1.0 - lost, 1.0 / (1.0 + lost)
        most = short * friction * lightness
        twist, rate = state[0], state[1]
        for part in range(parts):
            # Half a step of the twist before and half behind its rate: of second order in time.
            share = (part + 0.5) * width
            speed = state[3] + share * (motor - state[3])
            drive = state[2] + share * (acceleration - state[2])
            drive += (state[4] + share * (load - state[4])) * lightness + slowing * speed
            twist += 0.5 * short * rate
            rate = left * (rate * kept - short * (drive + stiffness * _sprung(parameters, twist)))
            rate = slowed_rate(rate, speed, most, saturation)
            twist += 0.5 * short * rate
        state[0], state[1] = twist, rate
    state[2] = acceleration
    state[3] = motor
    state[4] = load
    passed = -inertia * (locked ** 2 * _sprung(parameters, state[0]) + decay * state[1])
    # Rigid, what is beyond is part of inertia, load and friction; what is added is the rest.
    return (passed - inertia * acceleration - load - drag * motor
            - friction * sample[DIRECTION])


def _statement(p: Mapping[str, float]) -> str:
    if p['frequency'] < _SWINGS:
        return (f"A part of the load swings at {p['frequency']:.2g} Hz, with "
                f"{p['inertia_fraction'] * 100:.0f} % of the inertia: it hangs or sloshes, or its "
                'drivetrain is very soft.')
    text = (f"A compliant drivetrain resonates at {p['frequency']:.1f} Hz with "
            f"{p['inertia_fraction'] * 100:.0f} % of the inertia beyond it")
    if p['spring'] == HARDENS:
        change = p['stiffness_change']
        if change <= 1.5:
            return f'{text}; it hardens as it is twisted, to {1.0 + change:.1f} times as stiff.'
        twice = p['stiffness_twist'] / math.sqrt(change - 1.0)
        return f'{text}; it hardens: twisted by {twice * 1e3:.0f} mrad it is twice as stiff.'
    if p['spring'] == SOFT_CENTRE:
        return (f"{text}; its centre, some ±{p['stiffness_twist'] * 1e3:.0f} mrad, is softer by "
                f"{p['stiffness_change'] * 100:.0f} %.")
    return f'{text}.'


EFFECT = Effect(
    id='drivetrain_resonance',
    title='Drivetrain resonance',
    parameters=(
        Parameter('inertia_fraction', '-', 0.0, 0.9, none=0.0, starts=(0.25,),
                  default=0.25),
        # From a load that swings from a hook to a stiff shaft.
        Parameter('frequency', 'Hz', 0.2, 100.0,
                  starts=(8.0, 12.0, 17.0, 24.0, 33.0, 46.0, 64.0, 90.0), logarithmic=True,
                  kind='natural_frequency'),
        Parameter('damping_ratio', '-', 0.002, 0.3, starts=(0.03, 0.15), logarithmic=True),
        Parameter('friction_fraction', '-', 0.0, 1.0, starts=(0.15,), default=0.0),
        # How much more there is beyond of the friction that load adds than of the constant part,
        # and what is there of the drag: the three need not sit on one side.
        Parameter('loaded_friction_difference', '-', -1.0, 1.0, starts=(0.0,), default=0.0),
        Parameter('viscous_fraction', '-', 0.0, 1.0, starts=(0.0,), default=0.0),
    ),
    stages={'shift': _shift, 'torque': _torque},
    equation='(1 − ρ)J dω/dt + ρJ (dω/dt + ë) = …, ë + 2ζω_a ė + ω_a² g(e) = −dω/dt − '
             '((μC + (μ + Δ)(F − C)) sat(ω + ė) + βB (ω + ė) + λ T_L(θ + e))/ρJ, '
             'ω_a = ω_r √(1 − ρ); g = e, e + c (e − e_s atan(e/e_s)) (hardens), '
             'or e − c e_s tanh(e/e_s) (soft centre)',
    reference='Ellis and Lorenz, IEEE IAS (2000): resonant load control; Taghirad and Bélanger, '
              'ASME J. Dyn. Syst. 120 (1998): stiffness of harmonic drives',
    statement=_statement,
    reveals='frequency',
    picture='spectrum',
    seen='Torque rings at one frequency after every jolt.',
    confused='noise of the drive, a lag',
    measure='a sweep of small amplitude up to 100 Hz',
    constants=(('stiffness_change', '-'), ('stiffness_twist', 'rad'), ('load_beyond', '-'),
               ('spring', '-')),
    defaults={**_LINEAR_SPRING, 'load_beyond': 0.0},
    set_constants=lambda scene: _LINEAR_SPRING,
    # λ: the load may act on the inertia beyond, and twist the drivetrain, or at the motor.
    variants=({'load_beyond': 1.0}, {'load_beyond': 0.0}),
)


def _with_spring(spring: float, change: Parameter) -> Effect:
    """Return the effect with one of the springs, whose numbers are fitted as well: they keep
    their places, right behind the other parameters."""
    added = (change, Parameter('stiffness_twist', 'rad', 1e-4, 2.0, logarithmic=True,
                                starts=(0.003, 0.01, 0.03, 0.1, 0.3)))
    return replace(
        EFFECT, parameters=(*EFFECT.parameters, *added), constants=EFFECT.constants[len(added):],
        variants=({'load_beyond': 1.0, 'spring': spring},), set_constants=None)


# Tried where a linear shaft leaves much. The frequency is that of small motion where the shaft
# hardens, and that beyond a soft centre.
NONLINEAR = (
    _with_spring(HARDENS, Parameter('stiffness_change', '-', 0.1, 1000.0, logarithmic=True,
                                    starts=(1.0, 10.0, 100.0))),
    _with_spring(SOFT_CENTRE, Parameter('stiffness_change', '-', 0.0, 0.95, starts=(0.5,))))
