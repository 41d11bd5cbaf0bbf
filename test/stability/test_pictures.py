# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Extreme pictures for the dots: empty, full, one dot, ten thousand dots, twice the size; and grids of a few."""
import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.spatial import cKDTree
from tactile_perception import DotTracker, detect_dots, index_dots
from tactile_perception.errors import BadFrame

ROWS, COLUMNS, SIZE, FINE = 9, 13, (480, 360), 4
METHODS = ('likelihood', 'blobs', 'paper', 'paper_areal')


def grid(rows=ROWS, columns=COLUMNS, pitch=30.0, size=SIZE):
    """(rows * columns, 2) px, in the middle of an image, hardly bent and turned."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    place = np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1) * pitch
    place = place * (1 - 0.03 * np.sum(place**2, axis=1, keepdims=True) / np.sum(place[0]**2))
    turn = np.array([[np.cos(0.03), -np.sin(0.03)], [np.sin(0.03), np.cos(0.03)]])
    return place @ turn.T + np.array(size) / 2


def drawn(uv, diameter, size=SIZE, blur=0.9):
    """uint8 (H, W): bright discs at uv (N, 2) px of a diameter, px, drawn finely, blurred and seen with noise."""
    fine = np.zeros((size[1] * FINE, size[0] * FINE), np.uint8)
    for place in uv:
        centre = np.round(((place + 0.5) * FINE - 0.5) * 256).astype(int)
        cv2.circle(fine, centre.tolist(), round(diameter / 2 * FINE * 256), 255, -1, cv2.LINE_AA, 8)
    shape = cv2.GaussianBlur(cv2.resize(fine, size, interpolation=cv2.INTER_AREA).astype(np.float32), (0, 0), blur) / 255
    return np.clip(np.rint(40 + 140 * shape + np.random.default_rng(0).normal(0, 1, shape.shape)), 0, 255).astype(np.uint8)


UV, SHAPE = grid(), SIZE[::-1]
NOTHING = {
    'black': np.zeros(SHAPE, np.uint8), 'white': np.full(SHAPE, 255, np.uint8), 'grey': np.full(SHAPE, 128, np.uint8),
    'noise': np.random.default_rng(1).integers(0, 256, SHAPE, np.uint8),
    'faint noise': np.random.default_rng(1).integers(100, 110, SHAPE, np.uint8),
    'checkerboard': (np.indices(SHAPE).sum(axis=0) % 2 * 255).astype(np.uint8),
    'stripes': np.tile((np.arange(SIZE[0]) // 10 % 2 * 255).astype(np.uint8), (SIZE[1], 1)),
    'one dot': drawn(UV[58:59], 13.0), 'two dots': drawn(UV[57:59], 13.0), 'one huge dot': drawn(np.array([[240.0, 180.0]]), 300.0),
    'one pixel': cv2.circle(np.zeros(SHAPE, np.uint8), (100, 100), 0, 255),
    'a gradient': np.tile(np.linspace(0, 255, SIZE[0]).astype(np.uint8), (SIZE[1], 1))}


def largest_error(method):
    """px that the worst of many dots may be off."""
    return 0.5 if 'paper' in method else 0.06


@pytest.mark.parametrize('method', METHODS)
def test_a_tracker_refuses_what_is_no_grid_of_dots_and_goes_on(method):
    tracker, good = DotTracker(ROWS, COLUMNS, 'bright', method), drawn(UV, 13.0)
    before = tracker.process(good, 0.0)
    for stamp, (name, picture) in enumerate(NOTHING.items(), 1):
        with pytest.raises(BadFrame):
            tracker.process(picture, stamp)
        after = tracker.process(good, stamp + 0.5)
        assert np.array_equal(after.id, before.id) and len(after) == ROWS * COLUMNS, name
        assert np.abs(after.uv - before.uv).max() < 0.1 and np.abs(after.duv).max() < 0.1, name


@pytest.mark.parametrize('method', METHODS)
def test_one_dot_is_that_dot_or_none_and_twice_as_large_is_at_twice_the_place(method):
    """Pixel (u, v) of the small picture is the middle of four of the large one."""
    try:
        uv = detect_dots(NOTHING['one dot'], 'bright', method).uv
        assert len(uv) <= 1 and (np.abs(uv - UV[58]) < 0.2).all()
    except BadFrame:
        pass
    small = detect_dots(drawn(UV, 13.0), 'bright', method)
    large = detect_dots(drawn(2 * UV + 0.5, 26.0, (2 * SIZE[0], 2 * SIZE[1]), blur=1.8), 'bright', method)
    apart, nearest = cKDTree(large.uv).query(2 * small.uv + 0.5)
    assert len(small) == len(large) == len(UV)
    assert apart.max() < largest_error(method)
    assert np.abs(large.area[nearest] / small.area / 4 - 1).max() < (0.45 if 'cushion' in method else 0.12)


def test_ten_thousand_dots_are_found_and_numbered():
    size = (1900, 1900)
    uv = grid(100, 100, 18.0, size)
    picture, order = drawn(uv, 8.0, size), np.random.default_rng(0).permutation(10_000)
    for method in ('likelihood', 'blobs'):
        dots = detect_dots(picture, 'bright', method)
        assert len(dots) == 10_000 and cKDTree(dots.uv).query(uv)[0].max() < largest_error(method)
    assert np.array_equal(index_dots(uv[order], 100, 100).id, order)


@pytest.mark.parametrize('rows', [2, 3])
def test_grids_of_a_few_dots(rows):
    uv = grid(rows, rows, 60.0)
    assert index_dots(uv[::-1], rows, rows).id.tolist() == list(range(rows * rows))[::-1]
    tracks = DotTracker(rows, rows, 'bright', 'blobs').process(drawn(uv, 13.0), 0.0)
    assert len(tracks) == rows * rows and np.abs(tracks.uv - uv[tracks.id]).max() < 0.1


FEW = settings(derandomize=True, database=None, deadline=None, max_examples=60, suppress_health_check=list(HealthCheck))


@FEW
@given(st.integers(0, 10**6), st.floats(-30, 30), st.floats(-30, 30), st.floats(0.5, 1.0))
def test_numbers_of_a_grid_mind_neither_order_nor_place_nor_size(seed, across, down, size):
    order = np.random.default_rng(seed).permutation(ROWS * COLUMNS)
    uv = (UV[order] - np.array(SIZE) / 2) * size + np.array(SIZE) / 2 + [across, down]
    found = index_dots(uv, ROWS, COLUMNS)
    assert found.certain and np.array_equal(found.id, order)


@FEW
@given(arrays.arrays(float, st.tuples(st.integers(0, 40), st.just(2)), elements=st.one_of(st.floats(), st.floats(0, 500))))
def test_numbers_of_any_places_are_each_given_once(uv):
    found = index_dots(uv, 3, 4).id
    given_ = found[found >= 0]
    assert len(set(given_.tolist())) == len(given_) and (found[~np.isfinite(uv).all(axis=1)] == -1).all()
