# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The numbers of a stitching: from the plane to a camera and back, to a file and back; nonsense is named."""
import copy

import cv2
import numpy as np
import pytest
import yaml

from tactile_driver.errors import BadArgument
from tactile_driver.stitching.calibration import load_stitching, stitching_from_dict


from stitchings import camera, stitching


def test_a_place_is_seen_where_the_pinhole_model_has_it():
    side = camera(-0.01, 0.03)
    xy = np.random.default_rng(0).uniform(-0.012, 0.012, (50, 2))
    rotation = cv2.Rodrigues(np.array([0.0, 0.0, 0.03]))[0]
    points = np.column_stack([xy, np.zeros(50)])
    wanted = cv2.projectPoints(points, rotation, -rotation @ side.eye, side.matrix, side.distortion)[0].reshape(-1, 2)
    np.testing.assert_allclose(side.project(xy), wanted, atol=1e-9)
    np.testing.assert_allclose(side.place(wanted), xy, atol=1e-8)


def test_the_seam_parts_the_picture_between_the_eyes():
    found = stitching()
    uv = np.array([[0.0, 5.0], [60.0, 30.0], [61.0, 30.0], [120.0, 60.0]])
    assert found.side_of(uv).tolist() == [0, 0, 1, 1]
    np.testing.assert_allclose(found.eyes[found.side_of(uv), 0], [-0.01, -0.01, 0.01, 0.01])
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
    assert not rotation.any() and np.allclose(-translation, found.eyes.mean(axis=0))


def test_an_eye_that_is_not_known_stays_unknown():
    numbers = stitching().to_dict()
    del numbers['left']['eye']
    found = stitching_from_dict(numbers, 'file')
    assert np.isnan(found.left.eye).all() and np.isfinite(found.right.eye).all()
    assert 'eye' not in found.to_dict()['left'] and found.poses() == {}


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


def test_a_missing_side_is_named():
    numbers = stitching().to_dict()
    del numbers['right']
    with pytest.raises(BadArgument, match='file: no right'):
        stitching_from_dict(numbers, 'file')
