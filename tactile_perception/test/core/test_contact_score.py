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


def height_over_face(xyz, member, up, neighbours):
    """Heights (rows, columns), m, of all dots above a paraboloid through the members (rows, columns) bool."""
    up = up / np.linalg.norm(up)
    along = np.array([up[2], 0, -up[0]]) / np.hypot(up[0], up[2])
    local = (xyz - xyz[member].mean(axis=0)) @ np.array([along, np.cross(up, along), up]).T
    x, y = np.moveaxis(local[..., :2] / np.abs(local[member][:, :2]).max(), -1, 0)
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    some, weight = terms[member], np.clip((neighbours - 3) / 5, 0.05, 1)**2
    for _ in range(4):
        fit = np.linalg.solve(some.T @ (weight[:, None] * some) + 1e-6 * np.eye(6), some.T @ (weight * local[member][:, 2]))
        left = local[..., 2] - terms @ fit
        off = left[member] / max(1.4826 * np.sort(np.abs(left[member]))[len(some) // 2], 1e-5)
        weight = np.where(off > 0, 1 / (1 + off**2)**2, 1 / (1 + off**2 / 4))
    return left


def on_face(height, xyz, loaded, load, place):
    """How surely the dot at place (2,), with free ones beside it, lies on the face."""
    row, column = place
    rise = 0.0
    for r, c in np.ndindex(loaded.shape):
        if max(abs(r - row), abs(c - column)) == 1 and not loaded[r, c]:
            rise = max(rise, (height[r, c] - height[row, column]) / np.linalg.norm(xyz[r, c] - xyz[row, column]))
    largest = PITCH * (0.04 * (1 + max(0.0, 1 - rise / 0.2)) + 0.12 * load[row, column] * rise)
    return np.clip(1 - height[row, column] / (2 * largest), 0, 1)


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
        height = height_over_face(xyz, member, normal[member].sum(axis=0), beside(loaded.astype(float))[member])
        for place in np.argwhere(member & (beside(1.0 - loaded) > 0)):
            share[tuple(place)] = min(share[tuple(place)], on_face(height, xyz, loaded, load, place))
    over = share > 0.5
    large = (load >= min(1.5, load.max())) & (load + beside(load) > 1.5)
    return np.where(over & (beside(over.astype(float)) == 0) & ~large, 0.5, share)


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


@pytest.mark.parametrize('carried, touches', [(1.0, False), (2.2, True)])
def test_of_dots_as_high_above_the_face_the_heavy_one_touches_its_rounded_edge(carried, touches):
    xyz, normal = scene()
    load = np.zeros((12, 12))
    load[3:9, 2:10], load[3, 2:10] = 1.0, carried
    xyz[3] += 0.1 * PITCH * normal[3]
    xyz[:3] += (0.1 + 0.35 * np.arange(3, 0, -1)[:, None, None]) * PITCH * normal[:3]
    found = score(load, xyz, normal)
    assert found[4:9, 2:10].min() > 0.5 and ((found[3, 2:10] > 0.5) == touches).all()


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


def test_one_dot_touches_where_load_is_left_with_that_around_it():
    """Not with the loads that an error of its range makes, which add to nothing."""
    load = np.zeros((9, 9))
    load[4, 4] = 2.6
    assert (score(load, *scene((9, 9))) > 0.5).sum() == 1
    load[3:6, 3:6] -= np.where(load[3:6, 3:6] > 0, 0, 2.6 / 8)
    assert score(load, *scene((9, 9))).max() == 0.5


def test_one_dot_touches_lightly_where_no_other_carries_more():
    load = np.zeros((9, 9))
    load[3:6, 3:6], load[4, 4] = 0.2, 0.6
    assert (score(load, *scene((9, 9))) > 0.5).sum() == 1
    load[7, 7] = 0.9
    assert score(load, *scene((9, 9))).max() == 0.5


def test_of_two_rows_under_an_edge_the_one_with_less_than_its_half_is_free():
    load = np.zeros((8, 12))
    load[3, 2:10], load[4, 2:10] = 4.0, 1.8
    found = score(load, *scene((8, 12)))
    assert found[3, 3:9].min() > 0.9 and found[4, 3:9].max() < 0.5
