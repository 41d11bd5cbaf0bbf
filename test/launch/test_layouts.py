# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The layouts for Foxglove and PlotJuggler name topics that the launch file publishes, and fields that their messages have."""
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from ament_index_python.packages import get_package_share_directory
from rosidl_runtime_py.utilities import get_message
from waiting import until

LAYOUTS = Path(get_package_share_directory('tactile_bringup'), 'layouts')
NUMBER = re.compile(r'(u?int\d+|float|double|boolean)$')


def foxglove():
    """(topics that are drawn as a whole, [(topic, fields)] of the curves)."""
    layout = json.loads((LAYOUTS / 'foxglove.json').read_text())
    panels = layout['configById']
    placed = set(re.findall(r'\w+!\w+', json.dumps(layout['layout'])))
    assert placed == set(panels), 'a panel has no position, or a position has no panel'
    whole = {topic for panel in panels.values() for topic in (
        *panel.get('topics', ()), *panel.get('imageMode', {}).values(), *filter(None, [panel.get('topicToRender')]))}
    curves = [path['value'] for panel in panels.values() for path in panel.get('paths', ())]
    return whole, [(topic, fields) for topic, _, fields in (curve.partition('.') for curve in curves)]


def plotjuggler():
    curves = [each.get('name') for each in ElementTree.parse(LAYOUTS / 'plotjuggler.xml').iter('curve')]
    split = [re.fullmatch(r'(/\w+/\w+)/(.+)', curve).groups() for curve in curves]
    return set(), [(topic, fields.replace('/', '.')) for topic, fields in split]


@pytest.fixture(scope='module', params=[foxglove, plotjuggler])
def layout(request):
    return request.param()


def test_topics_are_those_of_the_launch_file_and_curves_are_numbers_in_their_messages(layout, ros2, listen):
    whole, curves = layout
    assert len(curves) >= 6
    wanted = whole | {topic for topic, _ in curves}
    ros2('launch', 'tactile_bringup', 'touchpad.launch.py')
    node, found = listen({}).node, {}

    def all_there():
        found.update({topic: kinds[0] for topic, kinds in node.get_topic_names_and_types()})
        return wanted <= found.keys()
    assert until(all_there, patience_s=40), sorted(wanted - found.keys())
    for topic, fields in curves:
        assert is_number(found[topic], fields), f'{topic}: {found[topic]} has no number {fields}'


def is_number(kind, path):
    """Whether a message of this type has a number at a path, as ``contacts[:].depth``."""
    for name in path.split('.'):
        field, entry = re.fullmatch(r'(\w+)(\[.+\])?', name).groups()
        own = '' if NUMBER.match(kind) else get_message(kind).get_fields_and_field_types().get(field, '')
        sequence = re.fullmatch(r'sequence<([\w/]+)(?:, \d+)?>|([\w/]+)\[\d+\]', own)
        if bool(sequence) != bool(entry) or not own:
            return False
        kind = (sequence[1] or sequence[2]) if sequence else own
        kind = kind if '/msg/' in kind or NUMBER.match(kind) else kind.replace('/', '/msg/')
    return bool(NUMBER.match(kind))


@pytest.mark.parametrize('path, wanted', [('contacts[:].depth', True), ('contacts[0].position.x', True), ('contacts.depth', False),
                                          ('contacts[:].depths', False), ('contacts[:].position', False), ('header[0].stamp', False)])
def test_wrong_fields_are_found(path, wanted):
    assert is_number('tactile_msgs/msg/Contacts', path) is wanted
