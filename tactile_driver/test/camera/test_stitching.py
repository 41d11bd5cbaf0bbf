# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Stitching of two views: calibration and methods."""

import copy

import cv2
import numpy as np
import pytest
import yaml
from stitchings import camera, stitching, view
from tactile_driver.errors import BadArgument, BadFrame
from tactile_driver.stitching.calibration import load_stitching, stitching_from_dict
from tactile_driver.stitching.methods import MiddleStitcher, make_stitcher


def test_a_place_is_seen_where_the_pinhole_model_has_it():
    side = camera(-0.01, 0.03)
    xy = np.random.default_rng(0).uniform(-0.012, 0.012, (50, 2))
    rotation = cv2.Rodrigues(np.array([0.0, 0.0, 0.03]))[0]
    points = np.column_stack([xy, np.zeros(50)])
    wanted = cv2.projectPoints(points, rotation, -rotation @ side.camera_centre, side.matrix, side.distortion)[0].reshape(-1, 2)
    np.testing.assert_allclose(side.project(xy), wanted, atol=1e-9)
    np.testing.assert_allclose(side.place(wanted), xy, atol=1e-8)


def test_the_seam_parts_the_picture_between_the_camera_centres():
    found = stitching()
    uv = np.array([[0.0, 5.0], [60.0, 30.0], [61.0, 30.0], [120.0, 60.0]])
    assert found.side_of(uv).tolist() == [0, 0, 1, 1]
    np.testing.assert_allclose(found.camera_centres[found.side_of(uv), 0], [-0.01, -0.01, 0.01, 0.01])
    np.testing.assert_allclose(found.place(uv[:2]), [[-0.02, -25e-3 / 3], [0, 0]])


def test_a_file_brings_back_the_numbers(tmp_path):
    wanted = stitching((1.0, 0.8))
    path = tmp_path / 'dual.yaml'
    path.write_text(yaml.safe_dump({'fitted': {'stitching': wanted.to_dict()}}))
    found = load_stitching(str(path))
    assert found.to_dict() == wanted.to_dict() and found.right.gain == 0.8
    np.testing.assert_array_equal(found.left.homography, wanted.left.homography)


def test_the_cameras_are_where_they_see_the_plane_from():
    found = stitching()
    for name, side in (('left', found.left), ('right', found.right)):
        rotation, translation = found.poses()[name]
        xy = np.random.default_rng(1).uniform(-0.01, 0.01, (20, 2))
        seen = cv2.projectPoints(np.column_stack([xy, np.zeros(20)]), rotation, translation, side.matrix, side.distortion)[0].reshape(-1, 2)
        np.testing.assert_allclose(seen, side.project(xy), atol=1e-9)
    rotation, translation = found.poses()['']
    assert not rotation.any() and np.allclose(-translation, found.camera_centres.mean(axis=0))


def test_a_camera_centre_that_is_not_known_stays_unknown():
    numbers = stitching().to_dict()
    del numbers['left']['camera_centre']
    found = stitching_from_dict(numbers, 'file')
    assert np.isnan(found.left.camera_centre).all() and np.isfinite(found.right.camera_centre).all()
    assert 'camera_centre' not in found.to_dict()['left'] and found.poses() == {}


@pytest.mark.parametrize(('path', 'value', 'words'), [
    (('scale',), None, 'file.scale must be one finite'), (('scale',), -5.0, 'scale -5'), (('seam',), 500.0, 'seam 500'),
    (('size',), [0, 5], 'file.size is 0'), (('origin',), [1.0], 'file.origin must be'), (('cut',), [1e4, 3.0], 'cut'),
    (('left', 'matrix'), [[1, 2], [3, 4]], 'file.left.matrix'), (('right', 'gain'), float('nan'), 'file.right.gain'),
    (('left', 'homography'), [[0.0] * 3] * 3, 'regular'), (('right', 'distortion'), 'abc', 'file.right.distortion')])
def test_nonsense_is_named(path, value, words):
    numbers = copy.deepcopy(stitching().to_dict())
    part = numbers
    for name in path[:-1]:
        part = part[name]
    part[path[-1]] = value
    with pytest.raises(BadArgument, match=words):
        stitching_from_dict(numbers, 'file')


@pytest.mark.parametrize('text', ['', 'fitted: 3', '{fitted: {water: 1}}', '\x00'])
def test_a_file_without_a_stitching_is_named(tmp_path, text):
    (tmp_path / 'a.yaml').write_text(text)
    for name in ('a.yaml', 'none.yaml'):
        with pytest.raises(BadArgument, match=f'stitching_path: .*{name} holds no stitching'):
            load_stitching(str(tmp_path / name))


def waves(x, y):
    return 100 + 60 * np.sin(x / 4e-3) + 30 * np.cos(y / 5e-3)


def wanted(found):
    u, v = np.meshgrid(np.arange(found.size[0]), np.arange(found.size[1]))
    return waves(*found.place(np.stack([u, v], axis=-1)).T).reshape(u.shape)


def test_the_plane_appears_at_its_scale_without_a_step_at_the_seam():
    found = stitching((1.0, 0.8))
    left, right = view(found.left, waves), view(found.right, lambda x, y: waves(x, y) / 0.8)
    picture = make_stitcher('plane', found).stitch(left, right)
    inner = slice(5, -5)
    error = picture.astype(float) - wanted(found)
    assert picture.shape == (61, 121) and picture.dtype == np.uint8
    assert np.abs(error[inner, inner]).max() < 2.5 and abs(error[inner, 59:63].mean(0)).max() < 1


@pytest.mark.parametrize('method', ['plane', 'middle'])
def test_the_half_of_a_missing_view_is_black(method):
    found = stitching()
    left, right = (view(side, waves) for side in (found.left, found.right))
    stitcher = make_stitcher(method, found)
    both, one, other = stitcher.stitch(left, right), stitcher.stitch(left, None), stitcher.stitch(None, right)
    first = 61 if method == 'plane' else 78
    assert (one[:, :first] == both[:, :first]).all() and not one[:, first:].any()
    assert (other[:, first:] == both[:, first:]).all() and not other[:, :first].any()


def test_the_middle_cut_puts_columns_side_by_side():
    left, right = np.full((4, 10), 1, np.uint8) * np.arange(10, dtype=np.uint8), np.full((4, 8), 100, np.uint8)
    picture = MiddleStitcher(((10, 4), (8, 4)), (7.4, 2.0)).stitch(left, right)
    assert picture.shape == (4, 13) and picture[0].tolist() == list(range(7)) + [100] * 6


def test_what_cannot_be_stitched_is_named():
    found = stitching()
    stitcher, good = make_stitcher('plane', found), np.zeros((80, 96), np.uint8)
    for left, right, words in ((good[:40], good, 'left image is 96 x 40 px, the stitching is for 96 x 80'), (None, None, 'no image'),
                               (good, np.zeros((80, 96, 3), np.uint8), 'grey one beside a coloured')):
        with pytest.raises(BadFrame, match=words):
            stitcher.stitch(left, right)
    with pytest.raises(BadArgument, match='height'):
        MiddleStitcher(((10, 4), (10, 5)), (5, 5))
    with pytest.raises(BadArgument, match="'blend' is unknown; choose one of plane, middle"):
        make_stitcher('blend', found)
