# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Unusual but usable images, of all kinds of dots, and camera_info that is missing, wrong or changes."""
import copy

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from hypothesis.extra import numpy as arrays
from rig import Chain, contacts, duv, untouched, uv
from scipy.spatial import cKDTree

from tactile_perception import DotOptions, DotTracker, detect_dots, index_dots
from tactile_perception.core.errors import BadArgument, BadFrame, TactileError


def grey(image):
    return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


def noisy(image, level, seed=0):
    return np.clip(np.rint(image + np.random.default_rng(seed).normal(0, level, image.shape)), 0, 255).astype(np.uint8)


def test_grey_images_give_dots_without_places_and_no_contact_is_made_up(pad):
    """Without the water's colour nothing measures how far a dot is, so whether something touches is not known."""
    chain = pad.chain()
    for image in (pad.rest[0], pad.pressed):
        dots = chain.dots(grey(image))
        assert len(dots.id) > 500 and np.isnan(dots.x).all()
        with pytest.raises(BadFrame, match='colour'):
            chain.contact(dots)
    assert np.median(np.linalg.norm(uv(dots) - pad.touched.dot_uv[np.array(dots.id)], axis=1)) < 0.2


def check_press(of, results, allowed, least):
    """The depth of the press, m, and the F1 of the dots that touch."""
    assert max(c.depth for c in contacts(results)) == pytest.approx(of.truth[0].depth, abs=allowed)
    region = results['contact_region']
    there = set(np.flatnonzero(of.touched.dot_state)) & set(results['dots'].id)
    found = set(np.array(region.dot_id)[np.array(region.dot_state) > 0].tolist())
    assert 2 * len(there & found) / (len(there) + len(found)) > least


def test_small_images_work_as_large_ones(small_pad):
    results = small_pad.chain().begun()(small_pad.pressed)
    dots = results['dots']
    xyz = np.column_stack([dots.x, dots.y, dots.z])
    off = np.linalg.norm(xyz - small_pad.touched.dot_xyz[np.array(dots.id)], axis=1)
    assert len(dots.id) > 500 and np.sqrt(np.nanmean(off**2)) < 0.12e-3 and len(contacts(results)) == 1
    check_press(small_pad, results, 0.3e-3, 0.85)


def jpeg(image, sampling):
    options = [cv2.IMWRITE_JPEG_QUALITY, 85, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, sampling]
    return cv2.imdecode(cv2.imencode('.jpg', image, options)[1], cv2.IMREAD_COLOR)


# Change of the image, largest error of depth (m), least contact F1. JPEG with half the colour resolution smears the dots' ink into the
# water around them, so that depth is overestimated by a third. Noise and JPEG: 43 of 49 touched dots are found, and up to 16 around them.
CHANGES = {
    'noise of 4': (lambda image: noisy(image, 4), 0.4e-3, 0.75), 'noise of 8': (lambda image: noisy(image, 8), 0.4e-3, 0.75),
    'half the light': (lambda image: noisy(image * 0.5, 1), 0.4e-3, 0.8),
    'blur': (lambda image: cv2.GaussianBlur(image, (0, 0), 1.0), 0.4e-3, 0.8),
    '3:1 light': (lambda image: (image * np.linspace(1.0, 0.34, image.shape[1])[:, None]).astype(np.uint8), 0.4e-3, 0.8),
    'JPEG': (lambda image: jpeg(image, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444), 0.4e-3, 0.75),
    'JPEG, half the colours': (lambda image: jpeg(image, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420), 1.2e-3, 0.7)}


@pytest.mark.parametrize('name', CHANGES)
def test_a_worse_image_of_a_press_is_still_one(pad, name):
    (change, allowed, least), chain = CHANGES[name], pad.chain()
    for image in pad.rest[:3]:
        assert not contacts(chain(change(image)))
    check_press(pad, chain(change(pad.pressed)), allowed, least)


def test_the_light_goes_down_slowly_and_nothing_touches(pad):
    chain = pad.chain().begun(3)
    for k in range(30):
        assert untouched(chain(np.clip(pad.rest[k % 6] * (1 - 0.01 * k), 0, 255).astype(np.uint8)))


@pytest.fixture(scope='module')
def running(pad):
    return pad.chain().begun()


def blind(pad):
    """A chain without a camera_info."""
    of = copy.copy(pad)
    of.info = None
    return Chain(of, pad.values)


def test_without_camera_info_dots_have_no_3d_positions_and_that_is_reported(pad):
    chain = blind(pad)
    dots = chain.dots(pad.rest[0])
    assert len(dots.id) > 515 and not len(dots.x)
    assert 'no camera_info: dots have no 3D positions' in chain.warning()
    with pytest.raises(BadFrame, match='no usable camera_info'):
        chain.contact(dots)
    chain.look(pad.info)
    assert len(chain(pad.rest[0])['dots'].x) > 515


def test_a_camera_info_of_zeros_gives_dots_but_no_places_and_no_contact(pad):
    chain = blind(pad)
    chain.look(pad.info, k=np.zeros(9), d=[])
    dots = chain.dots(pad.rest[0])
    assert len(dots.id) > 515 and not len(dots.x)
    with pytest.raises(BadFrame, match='camera'):
        chain.contact(dots)
    chain.look(pad.info)
    assert untouched(chain(pad.rest[1]))


@pytest.mark.parametrize('changes', [
    {'k': np.array([np.nan, 0, 320, 0, 688, 240, 0, 0, 1])}, {'k': np.array([0.0, 0, 320, 0, 688, 240, 0, 0, 1])},
    {'d': [np.nan, 0.0, 0.0, 0.0, 0.0]}, {'distortion_model': 'equidistant'}, {'d': [0.0] * 8}], ids=str)
def test_a_camera_info_that_cannot_be_used_is_refused_and_the_old_one_stays(pad, running, changes):
    with pytest.raises(TactileError, match='camera'):
        running.look(pad.info, **changes)
    assert untouched(running(pad.rest[3]))


def test_a_changed_camera_info_resets(pad):
    """A new reference is taken, so that nothing is compared with the undeformed positions of the other camera."""
    chain = pad.chain().begun(1)
    matrix = np.array(pad.info.k)
    matrix[2] += 1.0
    chain.look(pad.info, k=matrix)
    assert np.abs(duv(chain(pad.rest[1])['dots'])).max() == 0


def test_a_camera_that_changes_its_size_goes_on_with_its_new_camera_info(pad, small_pad):
    chain = pad.chain().begun(1)
    with pytest.raises(BadFrame, match='320 x 240.*640 x 480'):
        chain(small_pad.rest[0])
    assert len(chain(pad.rest[1])['dots'].x) > 515
    chain.look(small_pad.info)
    assert len(chain(small_pad.rest[0])['dots'].x) > 515 and untouched(chain(small_pad.rest[1]))


@pytest.mark.parametrize('match, changes', [('entries', {'u': [1.0]}), ('entries', {'x': [1.0]}), ('grid', {'rows': 5}),
                                            ('3D positions', {'x': [], 'y': [], 'z': []})])
def test_dots_that_cannot_be_used_are_refused(pad, running, match, changes):
    bad = running.dots(pad.rest[3])
    for name, value in changes.items():
        setattr(bad, name, value)
    with pytest.raises(BadFrame, match=match):
        running.contact(bad)
    assert untouched(running(pad.rest[4]))


@pytest.mark.parametrize('changes', [{'rows': 2, 'columns': 2}, {'camera__rotation': [0.0, 0.0]}, {'cap__height': 0.05},
                                     {'cap__curvature_radius': 0.0}, {'reference__frames': 0}, {'membrane__shear_stiffness': float('nan')}])
def test_parameters_that_make_no_sense_are_refused(pad, changes):
    with pytest.raises(BadArgument):
        pad.chain(**changes)


ROWS, COLUMNS, SIZE, FINE = 9, 13, (480, 360), 4
METHODS = ('likelihood', 'blobs', 'paper', 'paper_areal')


def grid(rows=ROWS, columns=COLUMNS, pitch=30.0, size=SIZE):
    """(rows * columns, 2) px, in the middle of an image, hardly bent and turned."""
    row, column = np.divmod(np.arange(rows * columns), columns)
    position = np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1) * pitch
    position = position * (1 - 0.03 * np.sum(position**2, axis=1, keepdims=True) / np.sum(position[0]**2))
    turn = np.array([[np.cos(0.03), -np.sin(0.03)], [np.sin(0.03), np.cos(0.03)]])
    return position @ turn.T + np.array(size) / 2


def drawn(uv, diameter, size=SIZE, blur=0.9):
    """uint8 (H, W): bright discs at uv (N, 2) px of a diameter, px, drawn finely, blurred and seen with noise."""
    fine = np.zeros((size[1] * FINE, size[0] * FINE), np.uint8)
    for position in uv:
        centre = np.round(((position + 0.5) * FINE - 0.5) * 256).astype(int)
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
    tracker, good = DotTracker(DotOptions(ROWS, COLUMNS, 'bright', method)), drawn(UV, 13.0)
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


@pytest.mark.parametrize('rows', [3, 4])
def test_grids_of_a_few_dots(rows):
    uv = grid(rows, rows, 60.0)
    assert index_dots(uv[::-1], rows, rows).id.tolist() == list(range(rows * rows))[::-1]
    tracks = DotTracker(DotOptions(rows, rows, 'bright', 'blobs')).process(drawn(uv, 13.0), 0.0)
    assert len(tracks) == rows * rows and np.abs(tracks.uv - uv[tracks.id]).max() < 0.1


def test_four_dots_are_no_pattern():
    with pytest.raises(BadFrame, match='no pattern of bright dots'):
        DotTracker(DotOptions(2, 2, 'bright', 'blobs')).process(drawn(grid(2, 2, 60.0), 13.0), 0.0)


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
