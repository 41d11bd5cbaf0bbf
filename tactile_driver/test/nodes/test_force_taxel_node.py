# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""force_taxel_node: arrays of another driver's topic become clouds; wrong ones are counted and named."""
import numpy as np
import pytest
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float32MultiArray
from waiting import until

from tactile_driver.errors import BadArgument
from tactile_driver.force_taxels.messages import taxels_of_message
from tactile_driver.force_taxels.node import ForceTaxelNode


@pytest.fixture
def layout(tmp_path):
    path = tmp_path / 'layout.yaml'
    path.write_text('patches: [{rows: 2, columns: 2, pitch: 0.004}]')
    return str(path)


def test_arrays_of_another_drivers_topic_become_clouds_and_wrong_ones_are_named(driven, layout):
    one = driven(ForceTaxelNode, source='topics', topic='/foreign/skin', layout=layout, frame_id='skin')
    publisher, clouds = one.node.create_publisher(Float32MultiArray, '/foreign/skin', 10), one.collect('taxels', PointCloud2)

    def arrived():
        publisher.publish(Float32MultiArray(data=[float(k) for k in range(12)]))
        return clouds
    assert until(arrived, one.executor)
    assert clouds[0].header.frame_id == 'skin'
    positions, forces, normals = taxels_of_message(clouds[0])
    assert np.allclose(forces[1], [3, 4, -5]) and np.allclose(normals, [0, 0, 1]) and np.allclose(positions[0], [-0.002, -0.002, 0])
    publisher.publish(Float32MultiArray(data=[0.0] * 9))
    assert 'has 9 numbers; the layout has 4 taxels' in one.reported(lambda status: 'numbers' in status.message).message


@pytest.mark.parametrize(('values', 'text'), [({'topic': '/foreign/skin', 'layout': ''}, 'layout: source topics needs the file'),
                                              ({'topic': ''}, 'topic: source topics needs the name')])
def test_a_topic_without_a_layout_or_a_name_is_refused(driven, layout, values, text):
    node = driven(ForceTaxelNode, scene='demo').node
    with pytest.raises(BadArgument, match=text):
        node.open_source({'source': 'topics', 'layout': layout, 'rate': 0.0, 'loop': False, 'frame_id': 'skin', **values})
