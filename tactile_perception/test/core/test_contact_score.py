# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The contact score against the same in NumPy: share of the full load, height above a robustly fitted face, no single dots."""
import cv2
import numpy as np
import pytest
from tactile_perception import _core

PITCH = 1.4e-3


def scene(shape=(12, 12)):
    row, column = np.mgrid[:shape[0], :shape[1]] * PITCH
    xyz = np.stack([column, row, 0.01 + 0.2 * column - 5.0 * row**2], -1)
    normal = np.stack([-0.2 + 0 * row, 10 * row, 1 + 0 * row], -1)
    return xyz, normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def score(load, xyz, normal):
    rows, columns = load.shape
    return _core.contact_score(load.ravel(), xyz.reshape(-1, 3), normal.reshape(-1, 3), rows=rows, columns=columns, pitch=PITCH).reshape(
        load.shape)


def beside(values):
    return cv2.boxFilter(values, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT) - values


def reference(load, xyz, normal):
    carried = np.where(load > 0.5, load, 0.0)
    mean = beside(carried**2) / np.maximum(beside(carried), 1e-9)
    surrounded = beside((load > 0.5).astype(float)) == 8
    inside = (surrounded & (load > 0.5)).astype(float)
    full = np.where(surrounded, 1.0, np.maximum(mean, 1.0))
    share = np.clip(load / np.where(inside + beside(inside) > 0, full, full**1.2), 0, 1)
    loaded = share > 0.5
    count, patches = cv2.connectedComponents(loaded.astype(np.uint8))
    for number in range(1, count):
        member = patches == number
        if member.sum() < 8:
            continue
        up = normal[member].sum(axis=0)
        up /= np.linalg.norm(up)
        along = np.array([up[2], 0, -up[0]]) / np.hypot(up[0], up[2])
        local = (xyz[member] - xyz[member].mean(axis=0)) @ np.array([along, np.cross(up, along), up]).T
        x, y = local[:, :2].T / np.abs(local[:, :2]).max()
        terms, height = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1), local[:, 2]
        weight = np.clip((beside(loaded.astype(float))[member] - 3) / 5, 0.05, 1)**2
        for _ in range(4):
            fit = np.linalg.solve(terms.T @ (weight[:, None] * terms) + 1e-6 * np.eye(6), terms.T @ (weight * height))
            left = height - terms @ fit
            scale = max(1.4826 * np.sort(np.abs(left))[len(left) // 2], 1e-5)
            weight = np.where(left > 0, 1 / (1 + (left / scale)**2)**2, 1 / (1 + (left / scale)**2 / 4))
        share[member] = np.minimum(share[member], np.clip(1 - left / (0.2 * PITCH), 0, 1))
    over = share > 0.5
    return np.where(over & (beside(over.astype(float)) == 0), 0.5, share)


@pytest.mark.parametrize('seed', range(6))
def test_scores_of_random_loads_and_shapes(seed):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(3, 24, 2))
    xyz, normal = scene(shape)
    xyz = xyz + rng.normal(size=xyz.shape) * 40e-6
    load = cv2.GaussianBlur(rng.normal(size=shape), (5, 5), 0) * 4
    np.testing.assert_allclose(score(load, xyz, normal), reference(load, xyz, normal), atol=1e-7)


def test_dots_beyond_the_edge_of_a_curved_face_stand_out():
    xyz, normal = scene()
    load = np.zeros((12, 12))
    load[3:9, 2:10] = 1.0
    xyz[3, 2:10] += 0.25e-3 * normal[3, 2:10]
    found = score(load, xyz + np.random.default_rng(0).normal(size=xyz.shape) * 5e-6, normal)
    assert found[4:9, 2:10].min() > 0.7 and found[3, 2:10].max() < 0.5


def test_full_contact_is_what_the_dots_around_carry():
    load = np.zeros((7, 7))
    load[2:5, 2:5] = 3.0
    load[2:5, 5] = 1.2
    found = score(load, *scene((7, 7)))
    assert found[3, 3] > 0.9 and found[3, 5] == pytest.approx(1.2 / (29.88 / 11.4), abs=1e-9) and found[0, 0] == 0


def test_dots_beside_a_ridge_that_the_mesh_has_loaded_do_not_touch():
    load = np.zeros((9, 9))
    load[3:6, 1:8] = np.array([1.3, 4.3, 1.3])[:, None]
    found = score(load, *scene((9, 9)))
    assert found[4, 1:8].min() > 0.9 and found[[3, 5], 2:7].max() < 0.4


def test_one_dot_alone_is_no_contact_and_what_is_unknown_is_free():
    load = np.zeros((9, 9))
    load[4, 4], load[2, 2] = 1.5, np.nan
    found = score(load, *scene((9, 9)))
    assert found.max() == 0.5 and found[2, 2] == 0


def test_of_two_rows_under_an_edge_the_one_with_less_than_its_half_is_free():
    load = np.zeros((8, 12))
    load[3, 2:10], load[4, 2:10] = 4.0, 1.8
    found = score(load, *scene((8, 12)))
    assert found[3, 3:9].min() > 0.9 and found[4, 3:9].max() < 0.5
