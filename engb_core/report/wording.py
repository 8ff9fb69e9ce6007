# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Numbers, units, names and sentences, as a brake engineer would write them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import math

from engb_core.diagnose.constants import STANDS_OUT
from engb_core.diagnose.diagnosis import Diagnosis, ParameterEstimate, Zone
from engb_core.report.text import shorten

__all__ = ['capital', 'coordinate', 'effect_name', 'effect_names', 'enumerate_words', 'estimate',
           'headline', 'largest_change', 'number', 'parameter_name', 'percent', 'probability',
           'quantities', 'quantity', 'scaled', 'zone_range']

NARROW = '\u202f'   # no line break between a number and its unit
MINUS = '\N{MINUS SIGN}'

# Units that take a "milli" where the number is small; the others keep the base unit.
PREFIXED = ('N·m', 'N', 'rad', 'm', 's', 'A')

HYPHENS = {'load dependent': 'load-dependent', 'self energizing': 'self-energizing'}

# Names longer than this are shortened in their middle.
LONGEST = 56

# A name that is more likely wrong than right is told as one.
EVEN = 0.5

PROPER = ('stribeck', 'coulomb', 'dahl', 'hertz', 'masing')

COORDINATES = {
    'load': 'load torque', 'since_reversal': 'travel since the last reversal',
    'time_since_reversal': 'time since the last reversal', 'motor_angle': 'motor angle',
    'screw_angle': 'screw angle', 'disc_angle': 'disc angle', 'disc_speed': 'disc speed',
    'pad_temperature': 'pad temperature', 'direction': 'direction of motion',
    'effort': 'motor torque', 'time': 'time in the recording',
}


def number(value: float, digits: int = 3) -> str:
    """Return `value` to `digits` significant digits: 0.0123, 4.2 × 10⁻⁵, −17."""
    if not math.isfinite(value):
        return '–'
    if value == 0:
        return '0'
    mantissa, power = f'{value:.{digits - 1}e}'.split('e')
    exponent = int(power)
    if exponent < -3 or exponent > 5:
        return f'{_signed(mantissa)}{NARROW}×{NARROW}10{_superscript(exponent)}'
    return _signed(f'{value:.{max(digits - 1 - exponent, 0)}f}')


def scaled(largest: float, unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which numbers up to `largest` read best."""
    if unit in PREFIXED and 0 < abs(largest) < 0.1 and math.isfinite(largest):
        return (1e3, f'm{unit}') if abs(largest) >= 1e-4 or unit == 'N' else (1e6, f'µ{unit}')
    return 1.0, unit


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with its unit: 21.4 mN·m."""
    factor, name = scaled(value, unit)
    return f'{number(value * factor, digits)}{_unit(name)}'


def quantities(values: Sequence[float], unit: str, digits: int = 3) -> list[str]:
    """Return numbers that are compared, in one unit (written at the last) and equally fine.

    The largest has `digits` significant digits, the others as many decimals, yet two digits at
    least: ['21.3', '4.9 mN·m'].
    """
    sizes = [abs(value) for value in values if math.isfinite(value) and value]
    factor, name = scaled(max(sizes, default=0.0), unit)
    exponents = [math.floor(math.log10(size * factor)) for size in sizes] or [0]
    if not -3 <= max(exponents) <= 5:
        texts = [number(value * factor, digits) for value in values]
    else:
        decimals = min(max(digits - 1 - max(exponents), 1 - min(exponents), 0), 6)
        texts = [_signed(f'{value * factor:.{decimals}f}') if math.isfinite(value) else '–'
                 for value in values]
    return [*texts[:-1], f'{texts[-1]}{_unit(name)}']


def estimate(parameter: ParameterEstimate) -> str:
    """Return value ± standard deviation with as many digits as the deviation supports."""
    value, std = parameter.value, parameter.std
    if std is None or not math.isfinite(std):
        return f'{quantity(value, parameter.unit, 2)} (not determined)'
    factor, unit = scaled(max(abs(value), std), parameter.unit)
    value, std = value * factor, std * factor
    if std < 1e-300 or not math.isfinite(value):
        return f'{number(value, 4)}{_unit(unit)}'
    largest = math.floor(math.log10(max(abs(value), std)))
    # Two digits of the deviation where it begins with 1, 2 or 3, else one, as usual in physics.
    exponent = math.floor(math.log10(std))
    last = exponent - (1 if std / 10.0**exponent < 3.55 else 0)
    if largest < -3 or largest > 5:
        scale = 10.0**-largest
        decimals = min(max(largest - last, 0), 6)
        return (f'({_signed(f"{value * scale:.{decimals}f}")} ± {std * scale:.{decimals}f})'
                f'{NARROW}×{NARROW}10{_superscript(largest)}{_unit(unit)}')
    decimals = min(max(-last, 0), 8)
    return f'{_signed(f"{value:.{decimals}f}")} ± {std:.{decimals}f}{_unit(unit)}'


def percent(share: float) -> str:
    """Return a share as whole percent, "< 1 %" where it is small."""
    if not math.isfinite(share):
        return '–'
    if 0 < share < 0.005:
        return f'<{NARROW}1{NARROW}%'
    return f'{round(100 * share)}{NARROW}%'


def probability(value: float) -> str:
    """Return a probability as percent that never claims certainty."""
    if math.isfinite(value) and value > 0.99:
        return f'>{NARROW}99{NARROW}%'
    return f'<{NARROW}1{NARROW}%' if value < 0.005 else percent(value)


def effect_name(effect: str, *, start: bool = False) -> str:
    """Return a readable name of an effect's id: 'stribeck_friction' gives 'Stribeck friction'."""
    words = [word.capitalize() if word in PROPER else word
             for word in str(effect).replace('_', ' ').split()]
    if words and words[-1] == 'error':
        words = ['wrong', *words[:-1]]
    name = ' '.join(words) or 'unnamed effect'
    for apart, joined in HYPHENS.items():
        name = name.replace(apart, joined)
    name = shorten(name, LONGEST)
    return capital(name) if start else name


def effect_names(effects: Sequence[str], *, start: bool = False) -> str:
    """Return the readable name of a hypothesis; without effects it is 'nothing missing'."""
    if not effects:
        return capital('nothing missing') if start else 'nothing missing'
    names = enumerate_words([effect_name(effect) for effect in effects])
    return capital(names) if start else names


def parameter_name(name: str) -> str:
    """Return a readable name of a parameter."""
    words = str(name).replace('_', ' ').replace('.', ' ').split()
    return capital(shorten(' '.join(word.capitalize() if word in PROPER else word
                                    for word in words), LONGEST))


def coordinate(name: str) -> str:
    """Return a readable name of a coordinate."""
    return COORDINATES.get(name, shorten(str(name).replace('_', ' '), LONGEST))


def zone_range(zone: Zone) -> str:
    """Return 'velocity −2 to 2 rad/s'; directions are named."""
    if zone.variable == 'direction' and (zone.begin >= 0) != (zone.end <= 0):
        return 'applying' if zone.begin >= 0 else 'releasing'
    unit = _unit(zone.unit)
    name = coordinate(zone.variable)
    if math.isfinite(zone.begin) and math.isfinite(zone.end):
        begin, end = quantities((zone.begin, zone.end), zone.unit)
        return f'{name} {_short(begin)} to {_short(end)}'
    if math.isfinite(zone.end):
        return f'{name} below {_short(number(zone.end))}{unit}'
    if math.isfinite(zone.begin):
        return f'{name} above {_short(number(zone.begin))}{unit}'
    return name


def enumerate_words(words: Iterable[str], last: str = 'and') -> str:
    """Return 'a, b and c'."""
    items = list(words)
    if len(items) < 2:
        return ''.join(items)
    return f'{", ".join(items[:-1])} {last} {items[-1]}'


def capital(text: str) -> str:
    """Return `text` with its first letter as a capital."""
    return text[:1].upper() + text[1:]


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict as one sentence without a full stop."""
    effects = diagnosis.effects
    if diagnosis.verdict == 'consistent':
        return 'The model agrees with the recordings' + (
            ', but for when samples were taken' if diagnosis.corrects else '')
    if diagnosis.verdict == 'explained' and not effects:
        return 'Other numbers in the model explain the mismatch'
    if diagnosis.unexplained is not None and diagnosis.unexplained.load_is_absent:
        return 'The model file has no load, and the machine has one'
    if diagnosis.verdict == 'unexplained' or not effects:
        return 'I don’t know what this is' + _dependence(diagnosis)
    names = enumerate_words([effect_name(entry.effect) for entry in effects])
    verb = 'explains' if len(effects) == 1 else 'explain'
    rivals = [entry.alternatives[0][0] for entry in effects
              if entry.alternatives and entry.alternatives[0][1] > 0.1]
    if rivals and len(effects) == 1:
        names = f'{names}, or possibly {effect_name(rivals[0])},'
    start = f'Most likely {names}' if rivals else capital(names)
    if min(entry.probability for entry in effects) < EVEN:
        verb = f'might {verb.removesuffix("s")}'
        start = start.replace('Most likely', 'Perhaps') if rivals else capital(names)
    if diagnosis.verdict == 'explained':
        return f'{start} {verb} the mismatch'
    share = min(sum(entry.share for entry in effects), 1.0)
    if share > 0.995:
        return f'{start} {verb} most of the mismatch; something else remains'
    return f'{start} {verb} {percent(share)} of the mismatch; the rest has another cause'


def largest_change(diagnosis: Diagnosis) -> str:
    """Return which nominal number the refit has changed by the largest factor, and from what to
    what, of those that the data tell from what they were; or that none is: the end of a clause."""
    told = [entry for entry in diagnosis.evidence.nominal
            if entry.std is not None and min(entry.before, entry.after) > 0.0
            and abs(entry.after - entry.before) > STANDS_OUT * entry.std]
    if not told:
        return ', and none of them stands out as the one that is off'
    most = max(told, key=lambda entry: abs(math.log(entry.after / entry.before)))
    before, after = quantities((most.before, most.after), most.unit)
    return f', most of all: {parameter_name(most.name)}, {before} → {after}'


def _dependence(diagnosis: Diagnosis) -> str:
    left = diagnosis.unexplained
    if left is None or not left.depends_on:
        return '; the mismatch is real, but nothing I know fits it'
    return f'; it depends on {enumerate_words(coordinate(name) for name in left.depends_on)}'


def _unit(unit: str) -> str:
    return '' if unit in ('', '-') else f'{NARROW}{shorten(unit, 24)}'


def _signed(text: str) -> str:
    return text.replace('-', MINUS)


def _short(text: str) -> str:
    """Leave out zeros after the decimal point: a range's ends are chosen, not measured."""
    value, separator, unit = text.partition(NARROW)
    if '.' in value:
        value = value.rstrip('0').rstrip('.')
    return f'{value}{separator}{unit}'


def _superscript(value: int) -> str:
    return str(value).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))
