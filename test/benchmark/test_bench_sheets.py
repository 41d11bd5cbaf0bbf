# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')

sys.path.insert(0, str(Path(__file__).parent))
from sheets import KINDS, ROWS, AnySheet, judge  # noqa: E402

from tactile_driver.simulation.skin.tools import tool_named  # noqa: E402


@pytest.mark.parametrize('kind', KINDS)
def test_specimens_differ_and_each_is_the_same_again(kind):
    one, again, other = (AnySheet(kind, seed).build() for seed in (1, 1, 2))
    assert one.skin.tension == again.skin.tension != other.skin.tension
    np.testing.assert_array_equal(one.skin.square_of(one.skin.rest), again.skin.square_of(again.skin.rest))
    assert (one.cameras[0].translation == again.cameras[0].translation).all() and (one.cameras[0].centre != other.cameras[0].centre).any()
    assert one.sensor == kind and len(one.cameras) == len(one.renderers)


@pytest.mark.parametrize('kind', KINDS)
def test_scenes_are_of_the_tips_frictions_and_offsets_of_their_rows(kind):
    sheet = AnySheet(kind, 3)
    for row in ROWS[kind]:
        script, shutters = sheet.scene(row, 5)
        what, _, number = row.partition('_')
        if what == 'shutter':
            assert shutters.offset == pytest.approx(1e-3 * float(number))
        else:
            assert script.friction == float(number or sheet.friction)
        radii = np.array([tool_named(name).tip_radius for name, _ in script.acts]) / sheet.radius
        assert (radii > 0.59).all() and (radii < 2.01).all()
        assert all(np.diff([key.t for key in keys]).min() > 0 for _, keys in script.acts)


def test_touches_are_judged_against_their_own_tips():
    def touch(x, depth):
        return SimpleNamespace(position=np.array([x, 0.0, -depth]), depth=depth, position_covariance=1e-8 * np.eye(3))
    true = SimpleNamespace(contacts=[touch(-0.02, 2e-3), touch(0.02, 3e-3)], wrench=None)
    told = SimpleNamespace(contacts=[touch(0.0201, 3e-3), touch(-0.02, 2.1e-3)], wrench=None)
    single = SimpleNamespace(contacts=[touch(0.01, 1e-3)], wrench=np.ones(6))
    more = SimpleNamespace(contacts=[touch(0.01, 1e-3)], wrench=1.1 * np.ones(6))
    none = SimpleNamespace(contacts=[], wrench=None)
    errors = judge([(0, told, true), (1, single, true), (2, more, single), (3, single, none)], 0.006)
    np.testing.assert_allclose(errors.touches, [[0, 0.1, 1 / 3], [0.1, 0, 1 / 3], [0, 0, 0]], atol=1e-9)
    np.testing.assert_allclose(errors.wrenches, [[0.1, 0.1]])
    assert errors.told == [True, False, True] and errors.beside == 1
