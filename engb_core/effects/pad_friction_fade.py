"""While the disc turns the load ratio changes with disc speed or pad temperature."""

import math

from engb_core.compiled import effect_function
from engb_core.effects.base import DISC_SPEED, Effect, LOAD, PAD_TEMPERATURE, Parameter

# Part of the highest disc speed from which the disc turns.
TURNING = 0.04


@effect_function
def _load(parameters, state, sample):
    turning = math.tanh(sample[DISC_SPEED] / 0.5)
    if parameters[3] > 0.5:
        progress = (sample[PAD_TEMPERATURE] - parameters[6]) / (parameters[7] - parameters[6])
    else:
        progress = (abs(sample[DISC_SPEED]) - parameters[4]) / (parameters[5] - parameters[4])
    bend = parameters[2]
    if abs(bend) > 1e-3:
        progress = (1.0 - math.exp(-bend * progress)) / (1.0 - math.exp(-bend))
    return sample[LOAD] * (
        1.0 + turning * (parameters[1] - 1.0 + parameters[0] * (progress - 0.5)))


def _ranges(scene):
    low, high = scene.disc_speed_range or (0.0, 1.0)
    fast = max(abs(low), abs(high))
    # A disc that turned both ways also stood.
    slow = max(0.0 if low < 0.0 < high else min(abs(low), abs(high)), TURNING * fast)
    cold, hot = scene.temperature_range or (0.0, 1.0)
    return {'speed_from': slow, 'speed_to': max(fast, slow + 1e-3),
            'temperature_from': cold, 'temperature_to': max(hot, cold + 1e-3)}


EFFECT = Effect(
    id='pad_friction_fade',
    title='Pad friction fade',
    parameters=(
        Parameter('ratio_change', '-', -3.0, 3.0, none=0.0, starts=(-0.1,), form=0.08),
        Parameter('load_ratio', '-', 0.05, 3.0, starts=(0.9,)),
        # Above zero it comes early in the range, below late.
        Parameter('bend', '-', -6.0, 6.0, starts=(-2.0, 2.0), default=0.0),
    ),
    stages={'load': _load},
    equation='T_L = (P + change·(p − ½)) · T_L(θ) while the disc turns, '
             'p = (1 − e^(−bend·x))/(1 − e^(−bend)), x from 0 to 1 over its range',
    reference='chapter 5; Limpert, Brake Design and Safety (2011), fade',
    statement=lambda p: (
        'While the disc turns the load ratio changes by '
        f"{p['ratio_change']:+.3f} over the recorded range of "
        f"{'pad temperature' if p['by_temperature'] > 0.5 else 'disc speed'} (fade)."),
    reveals='disc_speed',
    constants=(('by_temperature', '-'), ('speed_from', 'rad/s'), ('speed_to', 'rad/s'),
               ('temperature_from', '°C'), ('temperature_to', '°C')),
    defaults={'by_temperature': 0.0, 'speed_from': 0.0, 'speed_to': 90.0,
              'temperature_from': 20.0, 'temperature_to': 400.0},
    set_constants=_ranges,
    applies=lambda scene: bool(scene.disc_speed_range) and scene.largest_load > 0,
    variants=({'by_temperature': 0.0}, {'by_temperature': 1.0}),
    contains=('self_energizing',),
)
