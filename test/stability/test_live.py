# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Bad input to running node processes is logged once and counted on /diagnostics; no node ends, and the next good frame is processed."""
import os
import signal
import subprocess
import sys
import time

import pytest

rclpy = pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

import numpy as np  # noqa: E402
import yaml  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from rcl_interfaces.msg import Log  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from sensor_msgs.msg import CameraInfo, Image  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from tactile_driver.nodes.runtime.run import make_room_for_images  # noqa: E402
from tactile_msgs.msg import ContactRegion, Contacts  # noqa: E402
from tactile_perception.nodes.messages.conversions import camera_info_message  # noqa: E402
from tactile_perception.parameters.touchpad import DOT_PARAMETERS, REGION_PARAMETERS  # noqa: E402

pytestmark = pytest.mark.ros
NODES = ('dot_tracker_node', 'contact_region_node')


class Rig:
    """Both processing nodes as processes, images published to them, results, log and diagnostics kept."""

    def __init__(self, pad, folder):
        self.pad, self.count, self.last = pad, 0, {}
        environment = {**os.environ, 'OMP_NUM_THREADS': '1'}
        known = {p.name for p in (*DOT_PARAMETERS, *REGION_PARAMETERS)}
        values = {name: value for name, value in pad.values().items() if name in known and name != 'calibration'}
        (folder / 'params.yaml').write_text(yaml.safe_dump({'/**': {'ros__parameters': values}}))
        self.processes = [subprocess.Popen(
            [sys.executable, '-m', f'tactile_perception.nodes.{name}', '--ros-args', '--params-file', str(folder / 'params.yaml')],
            cwd=folder, env=environment, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for name in NODES]
        make_room_for_images()
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = Node('rig', context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.regions, self.contacts, self.said = [], [], []
        self.node.create_subscription(ContactRegion, 'contact_region', self.regions.append, 10)
        self.node.create_subscription(Contacts, 'contacts', self.contacts.append, 10)
        self.node.create_subscription(Log, '/rosout', self._log, 50)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._diagnose, 10)
        self.images = self.node.create_publisher(Image, 'image_raw', 10)
        self.infos = self.node.create_publisher(CameraInfo, 'camera_info', 10)

    def _log(self, message):
        if message.level >= 40:
            self.said.append(message.msg)

    def _diagnose(self, message):
        for status in message.status:
            self.last[status.name.split(':')[0].split('/')[-1]] = (status, {v.key: v.value for v in status.values})

    def comes(self, condition, seconds):
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.02)
        return condition()

    def until(self, condition, seconds=40.0):
        assert self.comes(condition, seconds), (self.said, {k: v[1] for k, v in self.last.items()})

    def send(self, image, spoil=None, info=True):
        self.count += 1
        stamp = time.time_ns()
        header = header_of(stamp, 'pad')
        message = image_to_message(Frame(image, stamp, 'bgr8'), '', header)
        if spoil:
            spoil(message)
        if info:
            self.infos.publish(camera_info_message(self.pad.info, header))
        self.images.publish(message)

    def good(self, image):
        """Send a good frame and wait for its region; again, where the nodes have not found each other yet."""
        before = len(self.regions)
        for _ in range(8):
            self.send(image)
            if self.comes(lambda: len(self.regions) > before, 5.0):
                break
        self.until(lambda: len(self.regions) > before)
        self.until(lambda: len(self.contacts) >= len(self.regions))
        return self.regions[-1], self.contacts[-1]

    def refuse(self, image, spoil):
        """Send a bad frame until it is counted: images travel best effort."""
        before = self.refused()
        for _ in range(8):
            self.send(image, spoil)
            if self.comes(lambda: self.refused() > before, 4.0):
                return
        raise AssertionError(f'not counted: {self.last}')

    def refused(self):
        return int(self.last.get('dot_tracker_node', (None, {}))[1].get('refused frames', 0))

    def close(self):
        codes = []
        for process in self.processes:
            os.killpg(process.pid, signal.SIGINT)
        for process in self.processes:
            codes.append(process.wait(timeout=20))
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)
        return codes


def cut(message):
    message.data = message.data[:5000]


def another_encoding(message):
    message.encoding = 'nv12'


def test_bad_frames_to_running_nodes(pad, tmp_path):
    rig = Rig(pad, tmp_path)
    try:
        rig.until(lambda: rig.images.get_subscription_count() == 1 and rig.infos.get_subscription_count() == 2)
        region, contacts = rig.good(pad.rest[0])
        assert region.area == 0 and not contacts.contacts and len(region.dot_id) > 515
        rig.comes(lambda: False, 1.0)  # waits for a second region, if the first frame had to be sent twice
        known = len(rig.regions)
        black = np.zeros_like(pad.rest[0])
        bad = ((black, None), (black, None), (black + 255, None), (pad.rest[1], cut), (pad.rest[1], another_encoding),
               (pad.rest[1][:400].copy(), None))
        for image, spoil in bad:
            rig.refuse(image, spoil)
        status = rig.last['dot_tracker_node'][0]
        assert status.level == b'\x02' and 'camera_info' in status.message
        assert len([text for text in rig.said if 'refused' in text]) == 1, 'said once, not for each frame'
        assert len(rig.regions) == known, 'nothing is published for a frame that cannot be used'
        rig.comes(lambda: False, 1.2)  # a second without a refusal, after which the next one is said again
        region, contacts = rig.good(pad.pressed)
        assert len(contacts.contacts) == 1 and abs(contacts.contacts[0].depth - pad.truth.contacts[0].depth) < 0.4e-3
        rig.until(lambda: rig.last['dot_tracker_node'][0].level != b'\x02')
        rig.refuse(black, None)
        rig.until(lambda: len([text for text in rig.said if 'refused' in text]) == 2)
        assert all(process.poll() is None for process in rig.processes)
    finally:
        codes = rig.close()
    assert codes == [0, 0]
