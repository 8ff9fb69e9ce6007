# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Units as products of powers: enough to say what a law's amplitude is measured in."""

from __future__ import annotations

__all__ = ['Unit', 'divided', 'written']

# Symbol and power, each symbol once.
Unit = tuple[tuple[str, float], ...]

_POWERS = {1.0: '', 2.0: '²', 3.0: '³', 0.5: '^½'}


def divided(unit: Unit, by: Unit) -> Unit:
    """Return the unit divided by another."""
    powers = dict(unit)
    for symbol, power in by:
        powers[symbol] = powers.get(symbol, 0.0) - power
    return tuple((symbol, power) for symbol, power in powers.items() if power != 0.0)


def written(unit: Unit) -> str:
    """Return the unit as text, '-' for none."""
    above = [_written(symbol, power) for symbol, power in unit if power > 0.0]
    below = [_written(symbol, -power) for symbol, power in unit if power < 0.0]
    if not above and not below:
        return '-'
    if not below:
        return '·'.join(above)
    under = below[0] if len(below) == 1 and '/' not in below[0] else f'({"·".join(below)})'
    return f'{"·".join(above) or "1"}/{under}'


def _written(symbol: str, power: float) -> str:
    raised = _POWERS.get(float(power), f'^{power:g}')
    return f'({symbol}){raised}' if raised and ('/' in symbol or '·' in symbol) \
        else f'{symbol}{raised}'
