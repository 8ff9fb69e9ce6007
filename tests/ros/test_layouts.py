# Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0
"""Every curve of the layouts is a number that the nodes publish, or are commanded with."""

import json
import re
import xml.etree.ElementTree as ElementTree

from engb_ros.files import config_file, TRUE_BRAKE
from engb_ros.nodes.messages import message_class
from ros.loops import can_drive


def paths():
    """Return (topic, field) of everything that the two layouts show."""
    panels = json.loads(config_file('foxglove_layout.json').read_text(encoding='utf-8'))
    found = []
    for panel in panels['configById'].values():
        for entry in panel.get('paths', []):
            topic, _, field = entry['value'].partition('.')
            found.append((topic, field))
        if 'topicToRender' in panel:
            found.append((panel['topicToRender'], 'status'))
    for curve in ElementTree.parse(config_file('plotjuggler_layout.xml')).iter('curve'):
        space, topic, field = curve.get('name').strip('/').split('/', 2)
        found.append((f'/{space}/{topic}', field.rpartition('/')[2]))   # after the joint's name
    return found


def test_the_nodes_publish_what_the_layouts_show(runner, probe, bus):
    for name, parameters in can_drive(bus):
        runner.start(name, parameters=parameters)
    runner.start('controller', parameters={
        'model': str(TRUE_BRAKE), 'mechanism': str(config_file('mechanism.yaml'))})
    runner.start('disturbance_observer', parameters={'model': str(TRUE_BRAKE)})
    node, shown = probe.node, paths()
    assert len(shown) > 12

    def there():
        known = dict(node.get_topic_names_and_types())
        return all(topic in known and (node.count_publishers(topic) or topic.endswith('_command')
                                       and node.count_subscribers(topic)) for topic, _ in shown)

    runner.wait_until(there, 'all topics of the layouts', timeout=90.0,
                      pause=probe.spin)
    known = dict(node.get_topic_names_and_types())
    for topic, field in shown:
        fields = message_class(known[topic][0]).get_fields_and_field_types()
        assert re.match(r'\w+', field)[0] in fields, (topic, field)
    runner.stop()
