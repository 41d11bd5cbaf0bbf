# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.scene.contact_region import find_region
from tactile_driver.simulation.skin.contact import FrictionalContact
from tactile_driver.simulation.skin.dome import Membrane
from tactile_driver.simulation.skin.motion import Key, Motion
from tactile_driver.simulation.skin.tools import tool_named


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=49)


def pressed(membrane, name, depth, x=0.0):
    """State, tool and pose of a tool that was pressed straight down."""
    motion = Motion(tool_named(name), [Key(0, x=x, press=0), Key(0.5, x=x, press=depth)], membrane)
    contact = FrictionalContact(membrane, 0.4)
    for k in range(15):
        state = contact.step(motion.tool, motion.pose(k / 30), motion.pose((k + 1) / 30))
    return state, motion.tool, motion.pose(0.5)


def test_nothing_touches_at_rest(membrane):
    contact = FrictionalContact(membrane, 0.4)
    assert find_region(membrane, contact.state, tool_named('disc'), None) is None


def test_ring_pressed_hard_is_touched_all_round(membrane):
    region = find_region(membrane, *pressed(membrane, 'ring', 0.003))
    assert len(region.outlines) == 1 and len(region.holes) == 1
    outer, inner = (np.hypot(*line[0][:, :2].T) for line in (region.outlines, region.holes))
    assert outer.mean() == pytest.approx(0.0075, abs=0.3e-3) and inner.mean() == pytest.approx(0.0045, abs=0.3e-3)
    assert outer.std() < 0.15e-3 and inner.std() < 0.15e-3
    assert region.area == pytest.approx(np.pi * (0.0075**2 - 0.0045**2), rel=0.15)
    assert region.centroid[:2] == pytest.approx([0, 0], abs=1e-4)
    assert region.normal == pytest.approx([0, 0, 1], abs=0.01)


def test_region_on_a_ball_is_round_about_its_tip(membrane):
    region = find_region(membrane, *pressed(membrane, 'sphere', 0.004))
    radius = np.hypot(*(region.outlines[0][:, :2] - region.centroid[:2]).T)
    assert region.centroid[:2] == pytest.approx([0, 0], abs=1e-4)
    assert radius.std() < 0.2e-3 and 0.003 < radius.mean() < 0.0065
    gap = np.linalg.norm(region.outlines[0] - [0, 0, 0.021 - 0.004], axis=1) - 0.008
    assert np.abs(gap).max() < 60e-6


def test_area_is_what_the_outline_encloses(membrane):
    region = find_region(membrane, *pressed(membrane, 'disc', 0.0025, x=0.002))
    x, y = region.outlines[0][:, 0], region.outlines[0][:, 1]
    enclosed = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    assert region.area == pytest.approx(enclosed, rel=0.03)
