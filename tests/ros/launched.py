# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""What a launch file of this package starts, as command lines, where `ros2 launch` is not at hand.

Only the part of launch's XML that these files use: arguments, groups, includes, conditions, nodes.
"""

from pathlib import Path
import re
import sys
import xml.etree.ElementTree as ElementTree

import yaml

import engb_ros

PACKAGE = Path(engb_ros.__file__).parent


def launched(name, **given):
    """Return {'/namespace/name': command} of the nodes that a launch file starts."""
    return _nodes(PACKAGE / 'launch' / name, given)


def _nodes(path, given):
    root = ElementTree.parse(path).getroot()
    values = {}

    def fill(text):
        text = text.replace('$(find-pkg-share engb_ros)', str(PACKAGE))
        return re.sub(r'\$\(var (\w+)\)', lambda found: values[found[1]], text)

    for entry in root.findall('arg'):
        values[entry.get('name')] = fill(given.get(entry.get('name'), entry.get('default')))
    found = {}
    for include in root.iter('include'):
        found |= _nodes(fill(include.get('file')), {
            entry.get('name'): fill(entry.get('value')) for entry in include.findall('arg')})
    for node in root.iter('node'):
        if fill(node.get('if', 'true')) != 'true':
            continue
        space, title = f'/{fill(node.get("namespace"))}', node.get('name')
        command = [sys.executable, '-m', 'engb_ros.start', node.get('exec'), '--ros-args',
                   '-r', f'__ns:={space}', '-r', f'__node:={title}']
        for entry in node.findall('param'):   # a later one prevails, as launch_ros passes them on
            if entry.get('from'):
                command += ['--params-file', fill(entry.get('from'))]
            else:
                value = yaml.safe_load(fill(entry.get('value')) or "''")
                command += ['-p', f'{entry.get("name")}:={yaml.safe_dump(value).split()[0]}']
        found[f'{space}/{title}'] = command
    return found
