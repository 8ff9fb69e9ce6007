# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""The tables of docs/integrate.md, made from the code that they describe.

    .venv/bin/python docs/make_integration_tables.py          rewrites docs/integrate.md
"""

from __future__ import annotations

from pathlib import Path
import re
import sys

from engb_core.control.causes import Cause, CAUSES, State, STOPPING
from engb_ros import interface
from engb_ros.interface import SERVICES, Topic, TOPICS
from engb_ros.nodes.parameters import shown_default, shown_range

__all__ = ['filled', 'tables']

PAGE = Path(__file__).resolve().parents[1] / 'docs' / 'integrate.md'

_QOS = {
    'state': 'reliable, depth 10 000; loops read best effort, the newest',
    'command': 'reliable, depth 1; read best effort, the newest',
    'request': 'reliable, depth 1; read best effort, depth 50',
    'status': 'reliable, transient local, depth 1',
}
_STATES = {
    State.READY: 'no fault; holds the angle it found; waits for a command, and for joint '
                 'states where they have stopped',
    State.ENABLED: 'tracks',
    State.DEGRADED: 'tracks, with a cause of severity degraded',
    State.FAULT: 'a fault is latched until ~/clear_faults',
    State.INACTIVE: 'last word of a controller that was deactivated, shut down or stopped: it '
                    'gives no torque and takes no command; its causes are 0',
}


def tables() -> dict[str, str]:
    """Return the tables by name, as Markdown."""
    found = {'topics': _topics(), 'services': _services(), 'states': _states(),
             'causes': _causes(), 'stops': _stops()}
    for name, specs in _node_parameters().items():
        rows = [(f'`{spec.name}`', _shown(spec.default), spec.unit or '-',
                 shown_range(spec) or '-', 'yes' if spec.live else 'no', spec.description)
                for spec in specs]
        found[f'parameters {name}'] = _table(
            ('parameter', 'default', 'unit', 'range', 'live', 'meaning'), rows)
    return found


def filled(text: str) -> str:
    """Return `text` with every `<!-- table NAME -->` … `<!-- end -->` filled in."""
    made = tables()

    def fill(match: re.Match) -> str:
        return f'<!-- table {match[1]} -->\n{made[match[1]]}\n<!-- end -->'

    return re.sub(r'<!-- table (.+?) -->\n.*?<!-- end -->', fill, text, flags=re.DOTALL)


def _node_parameters() -> dict[str, tuple]:
    from engb_ros.nodes.base import AUTOSTART
    from engb_ros.nodes.can_bridge import CanBridgeNode
    from engb_ros.nodes.controller import ControllerNode
    from engb_ros.nodes.disturbance_observer import DisturbanceObserverNode
    from engb_ros.nodes.drive_emulator import DriveEmulatorNode
    from engb_ros.nodes.excitation import ExcitationNode
    from engb_ros.nodes.identifier import IdentifierNode
    from engb_ros.nodes.monitor import MonitorNode
    from engb_ros.nodes.plant import PlantNode
    from engb_ros.nodes.recorder import RecorderNode
    nodes = (ControllerNode, CanBridgeNode, DriveEmulatorNode, PlantNode,
             DisturbanceObserverNode, IdentifierNode, RecorderNode, MonitorNode, ExcitationNode)
    return {node.node_name: (AUTOSTART, *node.parameters) for node in nodes}


def _topics() -> str:
    listed: tuple[Topic, ...] = (*TOPICS, interface.DIAGNOSTICS, interface.CLOCK)
    return _table(('topic', 'type', 'unit', 'QoS', 'meaning'), [
        (f'`{topic.name}`', f'`{topic.type}`', topic.unit or '-', _QOS[topic.kind],
         topic.meaning) for topic in listed])


def _services() -> str:
    return _table(('service', 'type', 'meaning'), [
        (f'`{service.name}`', f'`{service.type}`', service.meaning) for service in SERVICES])


def _states() -> str:
    return _table(('state', 'meaning'), [
        (f'`{state.value}`', _STATES[state]) for state in State])


def _causes() -> str:
    return _table(('bit', 'cause', 'severity', 'meaning', 'reaction'), [
        (str(cause.value.bit_length() - 1), f'`{cause.key}`',
         CAUSES[cause].severity.value, CAUSES[cause].meaning, CAUSES[cause].reaction)
        for cause in Cause])


def _stops() -> str:
    return _table(('parameter', 'default', 'may be', 'why'), [
        (f'`stop_{cause.key}`', f'`{CAUSES[cause].stops[0].value}`',
         ', '.join(stop.value for stop in CAUSES[cause].stops), CAUSES[cause].reason)
        for cause in STOPPING])


def _shown(value: object) -> str:
    shown = shown_default(value)
    return f'`{shown}`' if value and isinstance(value, str) else shown


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ('---',) * len(head), *rows]
    return '\n'.join('| ' + ' | '.join(cell.replace('|', '\\|') for cell in line) + ' |'
                     for line in lines)


def main() -> int:
    """Rewrite the page's tables."""
    PAGE.write_text(filled(PAGE.read_text(encoding='utf-8')), encoding='utf-8')
    return 0


if __name__ == '__main__':
    sys.exit(main())
