# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Loops to disturb, with the plant or with a drive behind a CAN bus: same topics, same tests."""

from engb_ros.live_loop import LiveLoop

# A loaded computer lets processes wait: shorter timeouts would find faults that nobody injected.
STATE_TIMEOUT = 1.5

# A slow rate leaves a loaded computer time; no noise: a drive that lets go shows exactly 0.
BRAKE = {'rate': 200.0, 'effort_noise': 0.0}


def plant(**parameters):
    """Return the plant as a drive."""
    return [('plant', {**BRAKE, **parameters})]


def can_drive(bus):
    """Return emulator and bridge on `bus` as a drive."""
    return [('drive_emulator', {**BRAKE, **bus}), ('can_bridge', bus)]


def closed_loop(runner, probe, drive=None, **controller):
    """Return a loop that is closed."""
    return LiveLoop(runner, probe, drive or plant(), **{
        'state_timeout': STATE_TIMEOUT, 'command_timeout': 2.0, **controller})
