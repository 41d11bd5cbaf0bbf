# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A guided session on the simulated stage, unattended, at the pace of this machine: interrupted, gone on with, and calibrated."""
import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from ament_index_python.packages import get_package_share_directory  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from sensor_msgs.msg import CameraInfo, Image  # noqa: E402
from tactile_bringup.nodes.calibrate_node import CalibrateNode  # noqa: E402
from tactile_bringup.nodes.simulated_stage import BASE, MOUNTING, PROBE, SimulatedStage  # noqa: E402
from tactile_driver.camera.simulated import pinhole_calibration  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.messages.conversions import calibration_to_message, header_of, image_to_message  # noqa: E402
from tactile_driver.nodes.messages.ground_truth import GroundTruth  # noqa: E402
from tactile_driver.recordings.reader import BagReader  # noqa: E402
from tactile_driver.recordings.serialization import decode  # noqa: E402
from tactile_driver.simulation.sensors.scenes import open_scene  # noqa: E402
from tactile_perception.tools.calibrate.command import main as calibrate  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.full, pytest.mark.slow, pytest.mark.timeout(1200)]
RATE = 10.0
PARAMS = f'{get_package_share_directory("tactile_bringup")}/params/areal_single_sim.yaml'


class Lab:
    """The session's node, the stage and the camera's images, frame by frame; probe: the frame that the session is told."""

    def __init__(self, output, probe=PROBE):
        given = {'probe': probe, 'base': BASE, 'frame_id': 'palm', 'wrench': '/stage/wrench', 'params': PARAMS, 'output': output,
                 'mounting': list(MOUNTING)}
        words = [word for name, value in given.items() for word in ('-p', f'{name}:={value}')]
        rclpy.init(args=['--ros-args', '-r', '__ns:=/palm', *words])
        self.session, self.stage, self.camera = CalibrateNode(), SimulatedStage(), rclpy.create_node('camera')
        self._nodes = self.session, self.stage, self.camera
        self._executor = SingleThreadedExecutor()
        for node in self._nodes:
            self._executor.add_node(node)
        self._images = self.camera.create_publisher(Image, 'image_raw', 10)
        self._infos = self.camera.create_publisher(CameraInfo, 'camera_info', 1)
        self._truth = GroundTruth(self.camera, ('contacts', 'wrench'))
        self.until(lambda: self._images.get_subscription_count() and self._truth.wanted)

    def until(self, condition, most=400):
        for _ in range(most):
            if condition():
                return
            self._executor.spin_once(timeout_sec=0.05)
        raise AssertionError('not in this time')

    def play(self, scene, frames):
        """Play frames of a scene, one at a time, until the session is complete; yields their numbers."""
        camera, handled = scene.camera, self.session.handled
        info = calibration_to_message(pinhole_calibration(camera.matrix, camera.distortion, (camera.width, camera.height)))
        for k in frames:
            frame, header = scene.render(k / RATE), header_of(10**12 + round(1e9 * k / RATE), 'palm')
            info.header = header
            self._infos.publish(info)
            self._truth.publish(frame.truth, 1 / RATE, header)
            self._images.publish(image_to_message(Frame(frame.image, 0, 'bgr8'), '', header))
            handled += 1
            self.until(lambda: self.session.handled == handled)  # noqa: B023
            if self.session.complete:
                return
            yield k

    def close(self):
        self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        rclpy.shutdown()


def touches(bag):
    """((N, 3) tips, (N,) depths, (N,) forces) of a bag's ground truth."""
    with BagReader(bag) as reader:
        found = [decode(raw.data, raw.type_name) for raw in reader.messages({'/palm/ground_truth/contacts'})]
    contacts = [message.contacts[0] for message in found if message.contacts]
    assert not found[0].contacts, 'it begins untouched'
    return (np.array([(c.position.x, c.position.y, c.position.z) for c in contacts]), np.array([c.depth for c in contacts]),
            np.array([c.force for c in contacts]))


def test_a_session_is_interrupted_goes_on_and_ends_with_a_calibration(tmp_path, capfd):
    output, scene = tmp_path / 'palm.yaml', open_scene('areal_single_session', RATE)
    lab, frames, truth = Lab(output), iter(range(scene.frames)), []
    for number in lab.play(scene, frames):
        seen = scene.observe(number).truth
        truth += [np.array([*seen.contacts[0].position[:2], -seen.contacts[0].depth, -seen.wrench[2]])] if seen.contacts else []
        if len(lab.session.bags) == 3:
            break
    kept = lab.session.bags
    lab.close()
    lab = Lab(output)
    assert lab.session.bags == kept
    for _ in lab.play(scene, frames):
        pass
    assert lab.session.complete and len(lab.session.bags) == 12
    bags = lab.session.bags
    lab.close()
    told = capfd.readouterr().err
    assert 'without 1 s untouched' in told and 'never stood still' in told, 'the scene has such presses'
    tips, depths, forces = touches(bags[0])
    nearest = np.array([min(truth, key=lambda true: np.linalg.norm(true[:3] - tip)) for tip in tips])  # noqa: B023
    assert np.abs(tips - nearest[:, :3]).max() < 1e-6 and depths == pytest.approx(-tips[:, 2]), 'm; the mounting is known'
    assert np.abs(forces - nearest[:, 3]).max() < 0.1, 'N; noise, and the weight of the tool, are taken off'
    assert calibrate([*map(str, bags), '--params', PARAMS, '--output', str(output)]) == 0
    print(capfd.readouterr().out)
