"""Lost motion between motor and load: the gap is crossed where the transmitted torque
changes sign, with the load decoupled meanwhile."""

from engb_core.compiled import effect_function
from engb_core.effects.base import (
    ACCELERATION,
    COULOMB,
    DIRECTION,
    Effect,
    INERTIA,
    LOAD,
    Parameter,
    TIME,
    TIME_STEP,
    VELOCITY,
)


@effect_function
def _shift(parameters, state, sample):
    # state: 0 displacement of the load from the middle of the gap, 1 load velocity,
    # 2 side in contact (−1: the motor pushes forward, +1: it pulls back, 0: in the gap),
    # 3 time for which the last impact still speaks in the motor's acceleration
    half = 0.5 * parameters[0]
    if sample[TIME] <= 0.0:
        state[0] = -half
        state[1] = 0.0
        state[2] = -1.0
        state[3] = 0.0
    return state[0] + half


@effect_function
def _torque(parameters, state, sample):
    half = 0.5 * parameters[0]
    if half <= 0.0:
        return 0.0
    step = sample[TIME_STEP]
    inertia = parameters[1] * sample[INERTIA]
    friction = parameters[2] * sample[COULOMB]
    motor = sample[VELOCITY]
    load = sample[LOAD]
    if state[2] != 0.0:
        # Torque that the contact must transmit so that the load follows the motor.
        transmitted = inertia * sample[ACCELERATION] + load + friction * sample[DIRECTION]
        state[3] -= step
        if state[3] < 0.0 and transmitted * state[2] > 0.0:
            state[2] = 0.0
            state[1] = motor
        else:
            state[1] = motor
            return 0.0
    # In the gap: the load moves by itself, the motor is freed of it.
    speed = state[1]
    drive = -load
    limit = friction
    if abs(speed) < 1e-9 and abs(drive) <= limit:
        fresh = 0.0
    else:
        sense = speed if abs(speed) > 1e-9 else drive
        resist = limit if sense > 0.0 else -limit
        fresh = speed + step * (drive - resist) / max(inertia, 1e-12)
        if fresh * speed < 0.0 and abs(drive) <= limit:
            fresh = 0.0
    state[0] += step * (0.5 * (speed + fresh) - motor)
    state[1] = fresh
    freed = -(inertia * sample[ACCELERATION] + load + friction * sample[DIRECTION])
    if state[0] <= -half or state[0] >= half:
        state[2] = -1.0 if state[0] <= -half else 1.0
        state[0] = -half if state[0] <= -half else half
        # Contact again: the load takes on the motor's speed within the step.
        freed += inertia * (motor - fresh) / step
        state[1] = motor
        # The impact brakes the motor; that is no torque which would pull the two apart.
        state[3] = 1.5 * step
    return freed


EFFECT = Effect(
    id='backlash',
    title='Backlash',
    parameters=(
        Parameter('gap', 'rad', 1e-3, 20.0, none=0.0,
                  starts=(0.06, 0.12, 0.25, 0.5, 0.8, 1.2, 1.8, 2.7), logarithmic=True,
                  form=0.3),
        Parameter('inertia_fraction', '-', 0.01, 0.9, starts=(0.3,)),
        Parameter('friction_fraction', '-', 0.0, 1.0, starts=(0.3, 0.7)),
    ),
    stages={'shift': _shift, 'torque': _torque},
    equation='load free while |θ_load − θ| < gap/2; coupled again when the gap is crossed',
    reference='Nordin and Gutman, Automatica 38 (2002) 1633',
    statement=lambda p: (
        f"There are {p['gap']:.3g} rad of lost motion between motor and load; the gap is "
        'crossed where the transmitted torque changes sign.'),
    reveals='since_reversal',
)
