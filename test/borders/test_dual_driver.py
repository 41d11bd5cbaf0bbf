# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Random images to the dual driver, through pairing and stitching: no defect occurs, and the good pairs after them are published."""
import random
import time

import numpy as np
import pytest

rclpy = pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from fed_nodes import stamp_of  # noqa: E402
from good_messages import BEGIN_NS  # noqa: E402
from random_messages import hostile  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.dual_camera_node import DualCameraNode  # noqa: E402
from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from tactile_driver.nodes.runtime.diagnostics import ERROR  # noqa: E402
from tactile_driver.nodes.runtime.host import Host  # noqa: E402

pytestmark = pytest.mark.ros
_STEP_NS = 10_000_000
_LEVELS = (50, 90)


@pytest.fixture
def driver():
    """The node with source topics, active; found: (stamp, bytes) of each stitched picture."""
    shared, found = {}, []
    node = DualCameraNode(Host(['-r', '__ns:=/dual'], {'source': 'topics', 'autostart': False, 'overlap': 8}, shared))
    shared[node.resolve_topic_name('image_raw')].attach(lambda message, _ns: found.append((stamp_of(message), message.data.tobytes())))
    node.trigger_configure()
    node.trigger_activate()
    yield node, found
    node.destroy_node()


def good_view(side, stamp):
    return image_to_message(Frame(np.full((48, 64), _LEVELS[side], np.uint8), stamp, 'mono8'), '', header_of(stamp, 'areal_dual'))


def send(node, messages):
    """One image on each topic, as from the middleware, and time to work on both."""
    for source, message in zip(node._stream.source._sources, messages):
        source._take(message, 0)
    time.sleep(0.005)


def send_good_pairs(node, found, stamp):
    """Good pairs from a stamp on until three of them are published; the last stamp."""
    end, sent = time.monotonic() + 20.0, set()
    while time.monotonic() < end and sum(each in sent for each, _ in list(found)) < 3:
        stamp += _STEP_NS
        sent.add(stamp)
        send(node, [good_view(side, stamp) for side in (0, 1)])
    return stamp, [data for each, data in list(found) if each in sent]


@pytest.mark.parametrize('count', [300, pytest.param(20_000, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])])
def test_random_images_meet_no_defect_on_the_way_to_the_stitched_picture(driver, count):
    node, found = driver
    rng = random.Random(5)
    stamp, before = send_good_pairs(node, found, BEGIN_NS)
    for _ in range(count):
        stamp += _STEP_NS
        views = [good_view(side, stamp) for side in (0, 1)]
        send(node, [hostile(rng, view) if rng.random() < 0.7 else view for view in views])
    _, after = send_good_pairs(node, found, stamp)
    row = np.repeat(np.array(_LEVELS, np.uint8), 60)  # each view of 64 px loses half of the overlap of 8 px
    assert len(before) >= 3 and len(after) >= 3 and set(before + after) == {np.tile(row, (48, 1)).tobytes()}
    status, health = node._stream.status, node._stream.health()
    assert node._stream.source.corrupt > count / 10 and status.state == 'running' and health.level != ERROR
    assert 'publish' not in node._stream._log._logged
