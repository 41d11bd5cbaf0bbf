# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Slow or stalled subscribers: the driver's memory stays constant, other subscribers receive everything, and the newest frames win."""
import signal
import threading
import time

import cv2
import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

import psutil  # noqa: E402
import rclpy  # noqa: E402
from fault_rig import Runner  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.qos import qos_profile_sensor_data  # noqa: E402
from sensor_msgs.msg import Image  # noqa: E402

pytestmark = pytest.mark.ros
RATE, SIZE = 50.0, (320, 240)  # Hz, px: 11 MB/s
SLOW_S, SECONDS = 0.4, 3.0
GROWTH = 12 << 20  # bytes, limit of memory growth; 34 MB are sent within SECONDS
STARTED = 30.0  # s, limit for a start


@pytest.fixture
def video(tmp_path):
    path = tmp_path / 'pad.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), RATE, SIZE)
    for k in range(50):
        writer.write(np.full((SIZE[1], SIZE[0], 3), 4 * k, np.uint8))
    writer.release()
    return path


class Slow:
    """Sleeps over each message; ages: s, of the messages when it gets to them."""

    def __init__(self, topic):
        self._context, self.ages, self._busy = Context(), [], threading.Event()
        rclpy.init(context=self._context)
        node = Node('slow', context=self._context)
        node.create_subscription(Image, topic, self._take, qos_profile_sensor_data)
        self._runner = Runner(node, self._context)

    def _take(self, message):
        stamp = message.header.stamp
        self.ages.append(time.time() - stamp.sec - 1e-9 * stamp.nanosec)
        time.sleep(SLOW_S)

    def close(self):
        self._runner.end()
        self._context.try_shutdown()


def test_no_queue_grows_and_the_newest_frames_win(bench, beside, video, tmp_path):
    space = bench.fresh('pad')
    heard = bench.ear.hear(Image, f'{space}/image_raw', 20)
    camera = bench.zygote.start('tactile_driver.nodes.camera_node', space, source='file', path=video, loop='true')
    stopped = bench.zygote.start('tactile_bringup.nodes.record_node', space, bag=tmp_path / 'bag', patience=0.0)
    slow = Slow(f'{space}/image_raw')
    try:
        bench.until(lambda: len(heard) > 100 and len(slow.ages) > 4 and bench.recorded(space) > 50, STARTED)
        stopped.send(signal.SIGSTOP)
        memory = psutil.Process(camera.pid).memory_info
        begin, before, first = time.monotonic(), memory().rss, len(slow.ages)
        time.sleep(SECONDS)
        grown, ages = memory().rss - before, slow.ages[first:]
        numbers = [h for h in heard if begin < h.at < begin + SECONDS]
        assert grown < GROWTH, f'{grown / 1e6:.1f} MB more'
        assert max(ages) < SLOW_S + 0.6, 'never older than what its own depth of 5 and its own sleep make'
        assert len(numbers) > 0.7 * RATE * SECONDS, 'whoever keeps up gets the frames'
        held = bench.recorded(space)
        stopped.send(signal.SIGCONT)
        back = bench.until(lambda: bench.recorded(space) > held + 20, STARTED) - (begin + SECONDS)
    finally:
        slow.close()
    camera.send(signal.SIGINT)
    stopped.send(signal.SIGINT)
    assert camera.wait() == 0 and stopped.wait() == 0
    bench.report(f'a subscriber stands still, another is slow ({grown / 1e6:.1f} MB more in {SECONDS:g} s, '
                 f'{1e3 * np.median(ages):.0f} ms old what it gets)', 'nothing', back, STARTED)
