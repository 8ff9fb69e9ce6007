# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Units as tables write them: `phi [deg]`, `I (A)`, `M/Nm`, `n in 1/min`, `pos_deg`."""

from __future__ import annotations

from dataclasses import dataclass
import math
import re
import unicodedata

from engb_core.errors import InputError

__all__ = ['Unit', 'UNITS', 'named', 'parse_title', 'unit_of', 'units_of']


@dataclass(frozen=True)
class Unit:
    """A unit: what it measures, and what one of it is in SI units (°C for a temperature)."""

    quantity: str       # time, angle, length, speed, linear speed, torque, force, current, …
    factor: float
    offset: float = 0.0


_TURN = 2.0 * math.pi
_MINUTE = _TURN / 60.0
_POUND = 4.4482216152605

# Unit by the spelling that remains after `_folded`; the first of a quantity is the one in SI.
UNITS: dict[str, Unit] = {
    's': Unit('time', 1.0), 'sec': Unit('time', 1.0), 'secs': Unit('time', 1.0),
    'second': Unit('time', 1.0), 'seconds': Unit('time', 1.0), 'sekunden': Unit('time', 1.0),
    'ms': Unit('time', 1e-3), 'msec': Unit('time', 1e-3), 'millis': Unit('time', 1e-3),
    'us': Unit('time', 1e-6), 'usec': Unit('time', 1e-6), 'micros': Unit('time', 1e-6),
    'ns': Unit('time', 1e-9), 'nsec': Unit('time', 1e-9), 'nanos': Unit('time', 1e-9),
    'min': Unit('time', 60.0), 'h': Unit('time', 3600.0),
    'rad': Unit('angle', 1.0), 'radian': Unit('angle', 1.0), 'radians': Unit('angle', 1.0),
    'mrad': Unit('angle', 1e-3),
    'deg': Unit('angle', math.radians(1.0)), '°': Unit('angle', math.radians(1.0)),
    'degree': Unit('angle', math.radians(1.0)), 'degrees': Unit('angle', math.radians(1.0)),
    'grad': Unit('angle', math.radians(1.0)), 'mdeg': Unit('angle', math.radians(1e-3)),
    'gon': Unit('angle', _TURN / 400.0),
    'rev': Unit('angle', _TURN), 'revs': Unit('angle', _TURN), 'revolution': Unit('angle', _TURN),
    'revolutions': Unit('angle', _TURN), 'turn': Unit('angle', _TURN),
    'turns': Unit('angle', _TURN), 'rot': Unit('angle', _TURN),
    'rotations': Unit('angle', _TURN), 'umdr': Unit('angle', _TURN),
    'umdrehungen': Unit('angle', _TURN),
    'm': Unit('length', 1.0), 'mm': Unit('length', 1e-3), 'cm': Unit('length', 1e-2),
    'um': Unit('length', 1e-6), 'inch': Unit('length', 0.0254),
    'rad/s': Unit('speed', 1.0), 'rad/sec': Unit('speed', 1.0),
    'deg/s': Unit('speed', math.radians(1.0)), '°/s': Unit('speed', math.radians(1.0)),
    'deg/sec': Unit('speed', math.radians(1.0)), 'grad/s': Unit('speed', math.radians(1.0)),
    'rpm': Unit('speed', _MINUTE), '1/min': Unit('speed', _MINUTE),
    'n/min': Unit('speed', _MINUTE), 'u/min': Unit('speed', _MINUTE),
    'rev/min': Unit('speed', _MINUTE), 'r/min': Unit('speed', _MINUTE),
    'min-1': Unit('speed', _MINUTE), 'upm': Unit('speed', _MINUTE),
    'rev/s': Unit('speed', _TURN), 'rps': Unit('speed', _TURN), 'turns/s': Unit('speed', _TURN),
    'krpm': Unit('speed', 1e3 * _MINUTE),
    'm/s': Unit('linear speed', 1.0), 'mm/s': Unit('linear speed', 1e-3),
    'cm/s': Unit('linear speed', 1e-2), 'm/min': Unit('linear speed', 1.0 / 60.0),
    'nm': Unit('torque', 1.0), 'newtonmeter': Unit('torque', 1.0), 'mnm': Unit('torque', 1e-3),
    'knm': Unit('torque', 1e3), 'ncm': Unit('torque', 1e-2), 'nmm': Unit('torque', 1e-3),
    'unm': Unit('torque', 1e-6), 'cnm': Unit('torque', 1e-2),
    'lbfin': Unit('torque', _POUND * 0.0254), 'lbin': Unit('torque', _POUND * 0.0254),
    'lbfft': Unit('torque', _POUND * 0.3048), 'lbft': Unit('torque', _POUND * 0.3048),
    'ftlb': Unit('torque', _POUND * 0.3048), 'inlb': Unit('torque', _POUND * 0.0254),
    'ozin': Unit('torque', _POUND / 16.0 * 0.0254), 'kgcm': Unit('torque', 0.0980665),
    'kgfcm': Unit('torque', 0.0980665),
    'n': Unit('force', 1.0), 'newton': Unit('force', 1.0), 'kn': Unit('force', 1e3),
    'mn': Unit('force', 1e-3), 'lbf': Unit('force', _POUND), 'kgf': Unit('force', 9.80665),
    'a': Unit('current', 1.0), 'amp': Unit('current', 1.0), 'amps': Unit('current', 1.0),
    'ampere': Unit('current', 1.0), 'amperes': Unit('current', 1.0), 'aeff': Unit('current', 1.0),
    'arms': Unit('current', 1.0), 'apk': Unit('current', 1.0), 'adc': Unit('current', 1.0),
    'ma': Unit('current', 1e-3), 'ka': Unit('current', 1e3), 'ua': Unit('current', 1e-6),
    '°c': Unit('temperature', 1.0), 'degc': Unit('temperature', 1.0),
    'celsius': Unit('temperature', 1.0), 'k': Unit('temperature', 1.0, -273.15),
    'kelvin': Unit('temperature', 1.0, -273.15),
    '°f': Unit('temperature', 5.0 / 9.0, -160.0 / 9.0),
    'degf': Unit('temperature', 5.0 / 9.0, -160.0 / 9.0),
    'count': Unit('counts', 1.0), 'counts': Unit('counts', 1.0), 'cnt': Unit('counts', 1.0),
    'inc': Unit('counts', 1.0), 'incs': Unit('counts', 1.0), 'inkr': Unit('counts', 1.0),
    'tick': Unit('counts', 1.0), 'ticks': Unit('counts', 1.0), 'lsb': Unit('counts', 1.0),
    'v': Unit('voltage', 1.0), 'volt': Unit('voltage', 1.0), 'mv': Unit('voltage', 1e-3),
    '%': Unit('share', 1e-2), 'percent': Unit('share', 1e-2), 'hz': Unit('frequency', 1.0),
    'w': Unit('power', 1.0), 'kw': Unit('power', 1e3), 'bar': Unit('pressure', 1e5),
    '-': Unit('none', 1.0), '1': Unit('none', 1.0),
}
# The same in other languages; what is one word in several stands once.
_ELSEWHERE = {
    's': 'segundos secondes secondi segundo sekund с сек 秒 초', 'ms': 'мс 毫秒 ミリ秒',
    'us': 'мкс 微秒', 'rad': 'рад 弧度 라디안',
    'deg': 'grado grados gradi graus grau graden grader stopnie stopni stupně degrés degré град '
           '度 도',
    'rev': 'tr tour tours vuelta vueltas giro giri volta voltas omw obr ot varv об '
           '圈 转 轉 転 回転',
    'rpm': 'tr/min giri/min obr/min ot/min varv/min omw/min об/мин 转/分 转/分钟 転/分',
    'rad/s': 'рад/с 弧度/秒', 'deg/s': 'град/с 度/秒', 'm': 'м', 'mm': 'мм 毫米',
    'inch': 'in inches', 'nm': 'нм 牛米 牛顿米', 'mnm': 'мнм 毫牛米', 'n': 'н 牛 牛顿',
    'a': 'а amperios ampères 安 安培', 'ma': 'ма 毫安',
}
UNITS.update({word: UNITS[own] for own, words in _ELSEWHERE.items() for word in words.split()})
# Written in one case only: `n` is a speed or a number, no newton.
_CASED = {'n': 'N', 'mn': 'mN', 'kn': 'kN', 'a': 'A', 'ma': 'mA', 'k': 'K', 'v': 'V', 'h': 'h',
          'w': 'W', 'н': 'Н', 'а': 'А', 'ма': 'мА'}
_COUNTS = re.compile(r'^(\d+(?:\.\d+)?)(?:counts?|cpr|inc|ticks?)?/(?:rev|turn|u)$')


def _folded(text: str) -> str:
    """Return a unit's spelling without what does not matter: dots, blanks, signs of a product."""
    text = unicodedata.normalize('NFKC', text).strip().strip('\'"')
    text = re.sub(r'\bper\b', '/', text)
    text = text.replace('º', '°').replace('˚', '°').replace('μ', 'u').replace('µ', 'u')
    text = re.sub(r'\^?\{?[-−⁻–](?:1|¹)\}?', '-1', text)
    text = re.sub(r'[\s·⋅∙・*×.]', '', text)
    text = re.sub(r'(?<=[A-Za-z])-(?=[A-Za-z])', '', text)
    # rad s-1 is rad/s; min-1 stands alone
    return re.sub(r'^(.*[a-z°])(min|s)-1$', r'\1/\2', text, flags=re.IGNORECASE)


def unit_of(text: str) -> Unit | None:
    """Return the unit that is written so, or None; `4096/rev` is an encoder's counts."""
    folded = _folded(text)
    match = _COUNTS.match(folded.lower())
    if match and float(match[1]) > 1.0:
        return Unit('angle', _TURN / float(match[1]))
    low = folded.lower()
    if low in _CASED and folded != _CASED[low]:
        return None
    return UNITS.get(low)


def named(text: str, what: str) -> Unit:
    """Return the unit that a user wrote.

    Raises:
        InputError: it is not known; the message lists those there are.
    """
    unit = unit_of(text)
    if unit is None:
        raise InputError(f'{what}={text}: not a known unit; known: rad, deg, rev, mrad, '
                         '4096/rev (counts of an encoder), m, mm; rad/s, deg/s, rpm, m/s, mm/s; '
                         'N·m, mN·m, N·cm, N, kN, A, mA; s, ms, us, ns; °C, K')
    return unit


def units_of(quantity: str) -> list[str]:
    """Return a few spellings of units of a quantity, to tell a user."""
    shown = {'time': 's ms us ns', 'angle': 'rad deg rev 4096/rev', 'length': 'm mm',
             'speed': 'rad/s deg/s rpm', 'linear speed': 'm/s mm/s', 'torque': 'Nm mNm',
             'force': 'N kN', 'current': 'A mA', 'temperature': '°C K'}
    return shown.get(quantity, '').split()


_BRACKETS = re.compile(r'^(.*?)\s*[\[(<{]\s*([^\[\](){}<>]*?)\s*[\])>}]\s*$')
_IN = re.compile(r'^(.*\S)\s+in\s+(\S+)$', re.IGNORECASE)
_COMMA = re.compile(r'^(.*\S)\s*[,:]\s+(\S+)$')
# At the end of a name they mean motor, slave, input, … rather than a unit; `t_s` is meant.
_SHORT = ('m', 's', 'h', 'K', 'N', 'V', 'W', 'in', 'tr', 'ot', 'tour', 'giri', 'giro', 'volta')
_TIMES = ('t', 'time', 'zeit', 'timestamp')
# Alone they're a displacement, a height and a minimum as well.
_NO_CLOCK = ('s', 'h', 'min')
_TAIL = re.compile(r'^(.*[^\W_])[_. ]+([^\W_]+(?:[/-][^\W_]+)?|°\w*|%)$')


def parse_title(title: str) -> tuple[str, str]:
    """Return a column's name and the unit in its title ('' where it has none).

    Understood are `phi [deg]`, `I (A)`, `M/Nm` as DIN writes it, `n in 1/min`, `angle, deg` and
    `pos_deg`; `n/min` alone is a speed per minute, `millis` alone a time.
    """
    title = ' '.join(title.strip().strip('\'"').split())
    match = _BRACKETS.match(title)
    if match and (match[1] or unit_of(match[2])):
        return match[1].strip(), match[2]
    for pattern in (_IN, _COMMA):
        match = pattern.match(title)
        if match and unit_of(match[2]):
            return match[1], match[2]
    whole = unit_of(title)
    if whole is not None and (whole.quantity == 'speed' or (
            whole.quantity == 'time' and title.casefold() not in _NO_CLOCK)):
        return title, title
    for place in (index for index, letter in enumerate(title) if letter == '/'):
        name, below = title[:place].strip(), title[place + 1:].strip()
        if name and below and unit_of(below) and '/' not in name:
            return name, below
    match = _TAIL.match(title)
    unit = unit_of(match[2]) if match else None
    if match and unit and unit.quantity != 'none' and (
            match[2] not in _SHORT or match[1].casefold().rpartition('_')[2] in _TIMES):
        return match[1], match[2]
    return title, ''
