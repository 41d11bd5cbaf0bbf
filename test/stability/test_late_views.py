# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A sheet with two cameras of which one comes late: no reference is taken before both views are there, and then touches are found."""
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

from sensor_msgs.msg import CameraInfo  # noqa: E402
from tactile_bringup.installed import share  # noqa: E402
from tactile_driver.frame import Frame  # noqa: E402
from tactile_driver.nodes.messages.conversions import header_of, image_to_message  # noqa: E402
from tactile_driver.simulation.sensors.scenes import open_dual_scene  # noqa: E402
from tactile_driver.stitching.calibration import load_stitching  # noqa: E402
from tactile_driver.stitching.methods import make_stitcher  # noqa: E402
from tactile_perception.errors import BadFrame  # noqa: E402
from tactile_perception.dots.stage import DotStage  # noqa: E402
from tactile_perception.markers.stage import ContactPointStage  # noqa: E402
from tactile_perception.parameters.file import read_parameters  # noqa: E402
from tactile_perception.parameters.markers import POINT_PARAMETERS  # noqa: E402
from tactile_perception.parameters.touchpad import DOT_PARAMETERS  # noqa: E402

pytestmark = pytest.mark.ros
STARTS, RATE, FRAMES = 100, 3.0, 24
WHOLE, LEFT_ALONE, RIGHT_ALONE = range(3)
CALIBRATION = share('calibration', 'areal_dual_sim.yaml')


@pytest.fixture(scope='module')
def pictures():
    """(whole, left view alone, right view alone, whether something touches) of the frames of a scene with presses."""
    scene, stitch = open_dual_scene('areal_dual_demo', RATE, 0), make_stitcher('plane', load_stitching(CALIBRATION)).stitch
    found = []
    for k in range(FRAMES):
        left, right, truth = scene.render(k / RATE)
        found.append((stitch(left, right), stitch(left, None), stitch(None, right), bool(truth.contacts)))
    return found


class Chain:
    """Tracker and contact estimation, which begin anew at each start."""

    def __init__(self):
        params, own = Path(share('params', 'areal_dual_sim.yaml')), {'calibration': CALIBRATION}
        self._dots = DotStage(read_parameters(params, 'dot_tracker_node', DOT_PARAMETERS) | own)
        self._touch = ContactPointStage(read_parameters(params, 'contact_point_node', POINT_PARAMETERS) | own)
        self._stamp_ns = 10**18

    def begin(self, size):
        for stage in (self._dots, self._touch):
            stage.take('camera_info', CameraInfo(width=size[0], height=size[1]))
            stage.reset()

    def touches(self, picture):
        """How many touches are found in a picture. Raises BadFrame where a node refuses it."""
        self._stamp_ns += 33_333_333
        dots = self._dots.process(image_to_message(Frame(picture, 0, 'bgr8'), '', header_of(self._stamp_ns, 'camera')))['dots'][0]
        return len(self._touch.process(dots, ('contacts',))['contacts'][0].contacts)


def test_a_hundred_starts_with_one_view_late(pictures):
    chain, rng, size = Chain(), np.random.default_rng(7), pictures[0][WHOLE].shape[1::-1]
    pressed, wrong = 0, 0
    for _ in range(STARTS):
        chain.begin(size)
        first, late, side = rng.integers(FRAMES), rng.integers(1, 5), rng.choice([LEFT_ALONE, RIGHT_ALONE])
        for k in range(late):
            with pytest.raises(BadFrame, match='one of the two views is black'):
                chain.touches(pictures[(first + k) % FRAMES][side])
        for k in range(late, late + 4):
            picture = pictures[(first + k) % FRAMES]
            wrong += bool(chain.touches(picture[WHOLE])) != picture[-1]
            pressed += picture[-1]
    assert pressed > STARTS / 2 and wrong <= 0.02 * 4 * STARTS


def test_a_view_that_is_lost_later_leaves_the_other_half_at_work(pictures):
    chain = Chain()
    chain.begin(pictures[0][WHOLE].shape[1::-1])
    assert chain.touches(pictures[0][WHOLE]) == chain.touches(pictures[1][LEFT_ALONE]) == 0
