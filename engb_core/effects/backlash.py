# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Lost motion between motor and load: the gap is crossed where the transmitted torque
changes sign, with the load decoupled meanwhile."""

from collections.abc import Mapping
from dataclasses import replace
import itertools
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
from engb_core.physics.compiled import effect_function, Numbers
from engb_core.physics.dry_friction import friction_beyond, slowed_rate

# Flanks as stiff as sampled motion can tell, without a bounce: the impact itself is over within a
# sample or two.
_RIGID = {'flank_frequency': 80.0, 'flank_damping': 1.0, 'gives': 0.0, 'load_stays': 0.0}
# Place in the parameters.
_LOAD_STAYS = 8
# Part of what a rigid flank passes on below which nothing is left of an impact.
_AT_REST = 1e-9


@effect_function
def _shift(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    # state: 0 how far the load is ahead of the motor (0…gap: free), 1 the rate of that,
    # 2 the last velocity of the motor; with a load that stays, how far it is ahead of the middle
    # of the gap
    if sample[TIME] <= 0.0:
        state[0] = 0.0
        state[1] = 0.0
    elif parameters[_LOAD_STAYS] != 0.0:
        half = 0.5 * parameters[0]
        state[0] = min(max(state[0] - sample[VELOCITY] * sample[TIME_STEP], -half), half)
    return state[0]


@effect_function
def _torque(parameters: Numbers, state: Numbers, sample: Numbers) -> float:
    if parameters[_LOAD_STAYS] != 0.0:
        return 0.0
    gap = parameters[0]
    inertia = parameters[1] * sample[INERTIA]
    friction = friction_beyond(sample[COULOMB], sample[LEVEL], parameters[2], parameters[3])
    load = sample[LOAD]
    drag = parameters[4] * sample[VISCOUS]
    acceleration = sample[ACCELERATION]
    motor, saturation = sample[VELOCITY], sample[SATURATION]
    step = sample[TIME_STEP]
    # Flanks: springs and dampers, in steps that are short against their period.
    locked = 2.0 * math.pi * parameters[5]
    stiffness = inertia * locked ** 2
    damping = 2.0 * parameters[6] * inertia * locked
    gives = parameters[7] != 0.0
    if sample[TIME] <= 0.0 or gap <= 0.0:
        # A load that has to be held back lies at the far flank.
        held = inertia * acceleration + load + drag * motor + friction * sample[DIRECTION]
        state[0] = gap if held < 0.0 else 0.0
        if gives:
            state[0] -= held / stiffness
        state[2] = motor
        return 0.0
    drive = (motor - state[2]) / step
    # What moves the load with the motor; a rigid flank gives it at once, not after some give.
    together = 0.0 if gives else (inertia * drive + load + drag * motor
                                  + friction * sample[DIRECTION])
    ahead, rate = state[0], state[1]
    if rate == 0.0 and (ahead == 0.0 and together > 0.0 or ahead == gap and together < 0.0):
        # It lies at a flank, at rest against it, and stays there.
        state[2] = motor
        return inertia * (drive - acceleration)
    parts = int(math.ceil(step * locked / 0.25))
    short = step / parts
    # Divisions take longer than all else here.
    lightness = 1.0 / inertia
    passed = 0.0
    most = short * friction * lightness
    for part in range(1, parts + 1):
        speed = state[2] + part * short * drive
        contact = 0.0
        if ahead <= 0.0:
            contact = max(together - stiffness * ahead - damping * rate, 0.0)
        elif ahead >= gap:
            contact = min(together - stiffness * (ahead - gap) - damping * rate, 0.0)
        rate += short * ((contact - load - drag * (motor + rate)) * lightness - drive)
        if contact != 0.0 and not gives:
            # It goes with the motor, and so does its friction, which fades at low speed.
            rate -= most * sample[DIRECTION]
        else:
            rate = slowed_rate(rate, speed, most, saturation)
        ahead += short * rate
        passed += contact
    passed /= parts
    flank = 0.0 if together > 0.0 else gap
    if stiffness * abs(ahead - flank) + damping * abs(rate) < _AT_REST * abs(together):
        # What is left of the impact is nothing.
        ahead, rate = flank, 0.0
    state[0], state[1], state[2] = ahead, rate, motor
    # Rigid, what is beyond is part of inertia, load and friction; what is added is the rest.
    return (passed - inertia * acceleration - load - drag * motor
            - friction * sample[DIRECTION])


def _statement(p: Mapping[str, float]) -> str:
    text = (f"There are {p['gap']:.3g} rad of lost motion between motor and load; the gap is "
            'crossed where the transmitted torque changes sign')
    if p['load_stays']:
        return (f"There are {p['gap']:.3g} rad of lost motion on the way to the load, which stays "
                'where it is until a reversal has crossed them.')
    if not p['gives']:
        return f'{text}.'
    return (f"{text}, and the flanks give: against a motor that is held the load rings at "
            f"{p['flank_frequency']:.3g} Hz.")


def _elastic_starts(p: Mapping[str, float]) -> list[dict[str, float]]:
    """Return where elastic flanks may begin: part of what a rigid gap takes for lost motion is how
    far they give; where they bounce, a rigid one is found too small."""
    rigid = {name: p[name] for name in ('inertia_fraction', 'friction_fraction',
                                        'loaded_friction_fraction', 'viscous_fraction')}
    return [{**rigid, 'gap': part * p['gap'], 'flank_frequency': frequency,
             'flank_damping': damping}
            for part, frequency, damping in itertools.product(
                (0.5, 0.8, 1.0, 1.4), (12.0, 18.0, 27.0, 40.0, 60.0), (0.1, 0.5))]


_RIGID_GAP = Effect(
    id='backlash',
    title='Backlash',
    parameters=(
        Parameter('gap', 'rad', 1e-3, 20.0, none=0.0,
                  starts=(0.015, 0.03, 0.06, 0.11, 0.18, 0.28, 0.44, 0.7, 1.1, 1.6, 2.4, 3.7,
                          5.5, 8.0),
                  logarithmic=True),
        Parameter('inertia_fraction', '-', 0.01, 0.9, starts=(0.18, 0.35)),
        # Of the constant friction, and of what load adds: the two need not sit on one side.
        Parameter('friction_fraction', '-', 0.0, 1.0, starts=(0.0, 0.4, 0.7)),
        Parameter('loaded_friction_fraction', '-', 0.0, 1.0, starts=(0.3,)),
        Parameter('viscous_fraction', '-', 0.0, 1.0, starts=(0.0, 0.3), default=0.0),
    ),
    stages={'shift': _shift, 'torque': _torque},
    equation='load free while |θ_load − θ| < gap/2; coupled again when the gap is crossed',
    reference='Nordin and Gutman, Automatica 38 (2002) 1633',
    statement=_statement,
    reveals='since_reversal',
    picture='backlash',
    seen='Behind a reversal the load is gone for a moment and comes back with a knock.',
    confused='presliding friction, a shifted contact',
    measure='reversals of several amplitudes, under load and free',
    # What the flanks do at the edge of the band is a resonance's, too.
    apart=('drivetrain_resonance',),
    multimodal=True,
    constants=(('flank_frequency', 'Hz'), ('flank_damping', '-'), ('gives', '-'),
               ('load_stays', '-')),
    defaults=_RIGID,
    set_constants=lambda scene: _RIGID,
)
# A shaft that twists under load before its gap is crossed, and rings against its flank.
_ELASTIC = replace(
    _RIGID_GAP,
    parameters=(
        *_RIGID_GAP.parameters,
        Parameter('flank_frequency', 'Hz', 2.0, 80.0, logarithmic=True, starts=(24.0,)),
        Parameter('flank_damping', '-', 0.005, 1.0, logarithmic=True, starts=(0.1,))),
    constants=(('gives', '-'), ('load_stays', '-')), set_constants=lambda scene: {'gives': 1.0},
    begins=_elastic_starts)
# A light load that its own friction holds, or a spring on a screw that holds itself: its position
# follows by the play operator, and so does its torque.
_LOAD_STAYS_WHERE_IT_IS = {'inertia_fraction': 0.01, 'friction_fraction': 0.0,
                           'loaded_friction_fraction': 0.0, 'viscous_fraction': 0.0,
                           **_RIGID, 'load_stays': 1.0}
_PLAY = replace(
    _RIGID_GAP, parameters=_RIGID_GAP.parameters[:1],
    constants=tuple((entry.name, entry.unit) for entry in _RIGID_GAP.parameters[1:])
    + _RIGID_GAP.constants, set_constants=lambda scene: _LOAD_STAYS_WHERE_IT_IS,
    applies=lambda scene: scene.largest_load > 0, multimodal=False)

EFFECT = replace(_RIGID_GAP, forms=(_PLAY,), richer=(_ELASTIC,))
