# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""gel_contact_node: from images of the simulated one to messages."""
import numpy as np
import pytest

from tactile_driver.frame import Frame, pinhole_calibration
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.sensors import gel
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_msgs.msg import DotTracks
from tactile_perception.core.errors import BadFrame
from tactile_perception.gel.parameters import GEL_PARAMETERS
from tactile_perception.gel.stage import GelStage

RATE = 5.0


def values_of(**changes):
    distance = gel.GEL.distance - gel.MATERIAL.depth
    return {**defaults(GEL_PARAMETERS), 'rows': gel.GEL.rows, 'columns': gel.GEL.columns,
            'gel.thickness': gel.MATERIAL.thickness, 'gel.dot_depth': gel.MATERIAL.depth, 'gel.young_modulus': gel.MATERIAL.young,
            'gel.poisson_ratio': gel.MATERIAL.poisson, 'camera.translation': [0.0, 0.0, distance]} | changes


@pytest.mark.full
@pytest.mark.parametrize(('scene', 'changes'), [('gel_demo', {}), ('gel_random', {'rows': 0, 'columns': 0})])
def test_images_of_a_gel_become_contacts_and_forces(scene, changes):
    scene = open_scene(scene, RATE, seed=4)
    stage = GelStage(values_of(**changes))
    camera, pressed = scene.camera, 0
    info = calibration_to_message(pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height)))
    stage.take('camera_info', info)
    for number in range(scene.frames):
        seen, stamp = scene.render(number / RATE), round((1 + number / RATE) * 1e9)
        image = image_to_message(Frame(seen.image, stamp, 'bgr8'), '', header_of(stamp, 'gel'))
        results = stage.process(image)
        assert sorted(results) == ['contact_region', 'contacts', 'dots', 'points', 'wrench'], 'slip is not known'
        found, (region,), force = results['contacts'][0].contacts, results['contact_region'], results['wrench'][0].wrench.force
        assert region.header.stamp == image.header.stamp
        true = seen.truth.wrench[:3]
        if not seen.truth.contacts:
            assert not found and region.area == 0 and force.z == 0
        elif -true[2] > 0.1:
            pressed += 1
            (one,), position = found, seen.truth.contacts[0].position
            off = np.array([one.position.x, one.position.y]) - position[:2]
            assert np.hypot(*off) < 0.3e-3
            assert [force.x, force.y, force.z] == pytest.approx(true.tolist(), abs=0.1 * -true[2])
    assert pressed > 10
    warning, values = stage.health()
    assert warning == '' and 'px' in values['noise of dots']


def test_a_gel_of_unknown_modulus_warns():
    stage = GelStage(values_of(**{'gel.young_modulus': 0.0, 'gel.pitch': gel.GEL.pitch, 'input': 'dots'}))
    with pytest.raises(BadFrame):
        stage.process(DotTracks(header=header_of(10**9, 'gel'), rows=9, columns=12))
    assert 'gel.young_modulus' in stage.health()[0]


def test_a_message_with_one_dot_is_refused():
    stage = GelStage(values_of(**{'gel.pitch': gel.GEL.pitch, 'input': 'dots'}))
    alone = DotTracks(header=header_of(10**9, 'gel'), rows=9, columns=12, id=[3], u=[1.0], v=[1.0], area=[4.0], du=[0.0], dv=[0.0])
    with pytest.raises(BadFrame, match='1 dots with a known undeformed position'):
        stage.process(alone)


def test_without_a_scale_it_waits_for_the_camera():
    stage = GelStage(values_of(input='dots'))
    assert stage.waits
    with pytest.raises(BadFrame, match='camera_info'):
        stage.process(DotTracks(header=header_of(10**9, 'gel'), rows=9, columns=12))
