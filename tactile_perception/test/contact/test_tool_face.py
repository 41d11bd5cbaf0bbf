# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_perception.contact.tool_face import heights_over_face

PITCH = 1.4e-3


def _scene(shape=(12, 12)):
    row, column = np.mgrid[:shape[0], :shape[1]] * PITCH
    xyz = np.stack([column, row, 0.01 + 0.2 * column - 5.0 * row**2], -1)
    normal = np.stack([-0.2 + 0 * row, 10 * row, 1 + 0 * row], -1)
    return xyz, normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def test_dots_on_a_curved_face_lie_on_it_and_those_beyond_the_edge_stand_out():
    xyz, normal = _scene()
    loaded = np.zeros((12, 12), bool)
    loaded[3:9, 2:10] = True
    xyz[3, 2:10] += 0.25e-3 * normal[3, 2:10]
    xyz += np.random.default_rng(0).normal(size=xyz.shape) * 5e-6
    heights = heights_over_face(loaded, xyz, normal)
    assert np.abs(heights[4:9, 2:10]).max() < 60e-6
    assert heights[3, 2:10].min() > 150e-6
    assert np.isnan(heights[~loaded]).all()


def test_a_patch_too_small_for_a_face_is_left_alone():
    xyz, normal = _scene()
    loaded = np.zeros((12, 12), bool)
    loaded[3:5, 3:6] = True
    assert np.isnan(heights_over_face(loaded, xyz, normal)).all()
