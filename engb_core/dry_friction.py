"""Dry friction at the end of a step of time, where it can stop a mass but never turn it back."""

from __future__ import annotations

from engb_core.compiled import compiled

__all__ = ['slowed_rate']


@compiled
def slowed_rate(rate, speed, most):
    """Return a mass' rate against a support after friction has acted on their sum.

    Args:
        rate: of the mass against its support [rad/s].
        speed: of the support [rad/s].
        most: what friction can take away within the step [rad/s].
    """
    beyond = speed + rate
    if beyond > most:
        return rate - most
    if beyond < -most:
        return rate + most
    return -speed
