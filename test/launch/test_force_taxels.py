# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force taxels as a user starts them: a simulated device, and a table of a device with its layout."""
import numpy as np
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import Image, PointCloud2
from visualization_msgs.msg import MarkerArray

from tactile_driver.nodes.messages.conversions import stamp_ns_of
from tactile_driver.simulation.force_taxels.scene import open_vector_scene
from tactile_msgs.msg import ContactRegion, Contacts, Slip

RESULTS = {'contacts': Contacts, 'contact_region': ContactRegion, 'slip': Slip, 'wrench': WrenchStamped, 'points': PointCloud2,
           'taxels': PointCloud2, 'markers': MarkerArray, 'image_annotated': Image, 'ground_truth/wrench': WrenchStamped}


def test_a_simulated_device_reports_its_force(ros2, listen):
    launched = ros2('launch', 'tactile_bringup', 'force_taxels.launch.py', 'namespace:=hand/skin', 'rate:=50')
    ear = listen({f'/hand/skin/{name}': kind for name, kind in RESULTS.items()})
    wrench, true = (ear.heard[f'/hand/skin/{name}'] for name in ('wrench', 'ground_truth/wrench'))

    def pressed():
        return sum(abs(message.wrench.force.z) > 0.5 for message in list(wrench)) > 40 and all(ear.heard.values())
    assert ear.wait_for(pressed, 120), launched.log
    assert launched.interrupt() == 0, launched.log
    assert launched.complaints == [], launched.log
    known = {stamp_ns_of(message.header): message.wrench.force.z for message in list(true)}
    pairs = np.array([(message.wrench.force.z, known[stamp_ns_of(message.header)]) for message in list(wrench)
                      if stamp_ns_of(message.header) in known and abs(message.wrench.force.z) > 0.5])
    assert len(pairs) > 20 and abs(np.median(pairs[:, 0] / pairs[:, 1]) - 1) < 0.1
    assert {message.header.frame_id for message in list(wrench)} == {'hand_skin'}


def test_a_table_with_a_layout_is_recorded_with_its_contacts(ros2, tmp_path):
    scene = open_vector_scene('uskin_demo', 50.0, 2)
    numbers = np.array([scene.render(number / 50.0)[0].ravel() for number in range(150)])
    np.savetxt(tmp_path / 'log.csv', np.column_stack([np.arange(150) / 50.0, numbers]), delimiter=',')
    (tmp_path / 'layout.yaml').write_text('patches: [{rows: 4, columns: 4, pitch: 0.0047}]')
    launched = ros2('launch', 'tactile_bringup', 'force_taxels.launch.py', 'source:=file', 'path:=log.csv', 'layout:=layout.yaml',
                    'record:=bag')
    assert launched.wait(120) == 0, launched.log
    assert 'not calibrated' in launched.log
    from tactile_driver.recordings.reader import BagReader
    from tactile_driver.recordings.serialization import decode
    with BagReader(tmp_path / 'bag') as bag:
        found = [decode(raw.data, raw.type_name) for raw in bag.messages({'/force_taxels/contacts'})]
    assert sum(len(message.contacts) == 1 for message in found) > 10
