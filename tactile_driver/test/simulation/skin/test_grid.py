# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.skin.dome import Membrane
from tactile_driver.simulation.skin.sheet import Sheet


@pytest.fixture(params=[lambda: Membrane(nodes=25), lambda: Sheet(0.06, 0.045, 40.0, 1.3, 1e-4, 25)], ids=['dome', 'sheet'])
def skin(request):
    return request.param()


def test_border_is_held_and_the_rest_is_free(skin):
    assert skin.inner.sum() == 23 * 23
    shape = skin.with_rim(skin.rest.reshape(-1, 3)[skin.inner] + [0, 0, 0.001])
    lifted = np.zeros((25, 25))
    lifted[1:-1, 1:-1] = 0.001
    np.testing.assert_allclose(shape - skin.rest, lifted[..., None] * [0, 0, 1], atol=1e-15)


def test_rim_lies_in_its_plane_on_the_skin_s_border(skin):
    rim = skin.rim(120)
    assert len(rim) == 120 and not rim[:, 2].any()
    assert np.abs(np.abs(skin.square_of(rim)).max(axis=1) - 1).max() < 1e-6


def test_area_vectors_sum_to_the_area_over_the_rim(skin):
    corners = skin.rim(4000)[:, :2]
    after = np.roll(corners, -1, axis=0)
    area = 0.5 * (corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]).sum()
    assert skin.area_vectors(skin.rest).sum(axis=0) == pytest.approx([0, 0, area], rel=0.01, abs=1e-9)


def test_volume_is_that_under_a_lifted_skin(skin):
    lifted = skin.rest + [0, 0, 1e-3]
    area = skin.area_vectors(skin.rest)[:, 2].sum()
    assert skin.volume_of(lifted) - skin.volume_of(skin.rest) == pytest.approx(1e-3 * area, rel=1e-9)
