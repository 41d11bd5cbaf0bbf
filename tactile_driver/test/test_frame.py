# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Frames, calibrations, matrices, names of coordinate frames, lenses; gaps between the stamps of frames."""
from dataclasses import replace

import cv2
import numpy as np
import pytest

from tactile_driver.errors import BadArgument, BadFrame
from tactile_driver.frame import (
    CameraCalibration,
    Frame,
    as_encoding,
    frame_of,
    in_sensor_order,
    load_calibration,
    matrix_frame,
    save_calibration,
)
from tactile_driver.frame_names import optical_frame, sensor_frame, stitched_frame
from tactile_driver.lens import undistorted
from tactile_driver.stamp_gaps import StampGaps

CAMERA_INFO = """
image_width: 640
image_height: 480
camera_name: pad
camera_matrix: {rows: 3, cols: 3, data: [600.0, 0.0, 320.5, 0.0, 601.0, 240.5, 0.0, 0.0, 1.0]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.1, -0.2, 0.0, 0.0, 0.01]}
rectification_matrix: {rows: 3, cols: 3, data: [1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0]}
projection_matrix: {rows: 3, cols: 4, data: [600.0, 0, 320.5, 0, 0, 601.0, 240.5, 0, 0, 0, 1.0, 0]}
"""


@pytest.mark.parametrize(('shape', 'encoding', 'kept'), [((4, 6), 'mono8', (4, 6)), ((4, 6, 1), 'mono8', (4, 6)),
                                                         ((4, 6, 3), 'bgr8', (4, 6, 3)), ((4, 6, 4), 'bgr8', (4, 6, 3))])
def test_what_opencv_decodes_becomes_a_frame(shape, encoding, kept):
    frame = frame_of(np.full(shape, 7, np.uint8), 'here', 5)
    assert (frame.encoding, frame.image.shape, frame.stamp_ns) == (encoding, kept, 5)
    assert (frame.image == 7).all()


@pytest.mark.parametrize('image', [None, np.zeros((0, 3), np.uint8), np.zeros((4, 4), np.uint16), np.zeros((4, 4, 2), np.uint8)])
def test_what_is_no_image_is_a_bad_frame(image):
    with pytest.raises(BadFrame, match='frame 12 of pad.avi'):
        frame_of(image, 'frame 12 of pad.avi', 0)


def test_encodings_are_converted_both_ways():
    grey = Frame(np.full((2, 2), 9, np.uint8), 0, 'mono8')
    assert as_encoding(grey, 'bgr8').tolist() == [[[9, 9, 9]] * 2] * 2
    assert as_encoding(grey, '') is grey.image
    colour = Frame(np.full((2, 2, 3), 9, np.uint8), 0, 'bgr8')
    assert as_encoding(colour, 'mono8').tolist() == [[9, 9], [9, 9]]


def test_a_calibration_is_written_as_it_is_read_and_none_that_is_broken(tmp_path):
    path = tmp_path / 'pad.yaml'
    assert load_calibration('') is None and load_calibration(str(path)) is None, 'not written yet'
    known = CameraCalibration(6, 4, (3.0, 0, 3, 0, 3, 2, 0, 0, 1), (0.1,) * 5, (1.0, 0, 0, 0, 1, 0, 0, 0, 1), (0.0,) * 12, 'plumb_bob')
    save_calibration(f'file://{path}', known)
    assert load_calibration(str(path)) == known
    with pytest.raises(BadArgument, match='camera_matrix'):
        save_calibration(str(path), replace(known, k=(float('nan'),) * 9))
    assert load_calibration(str(path)) == known and [each.name for each in tmp_path.iterdir()] == ['pad.yaml']


def test_calibration_file(tmp_path):
    path = tmp_path / 'pad.yaml'
    path.write_text(CAMERA_INFO)
    loaded = load_calibration(f'file://{path}')
    assert (loaded.width, loaded.height, loaded.k[0], loaded.k[5], loaded.d[1], loaded.p[5]) == (640, 480, 600.0, 240.5, -0.2, 601.0)
    assert loaded.model == 'plumb_bob'


@pytest.mark.parametrize(('old', 'new'), [('600.0, 0.0, 320.5', '.nan, 0.0, 320.5'), ('data: [600.0, 0.0', 'data: [0.0, 0.0'),
                                          ('image_width: 640', 'image_width: 0'), ('camera_matrix:', 'matrix:'), ('640', '{')])
def test_a_broken_calibration_file_is_refused(tmp_path, old, new):
    path = tmp_path / 'pad.yaml'
    path.write_text(CAMERA_INFO.replace(old, new, 1))
    with pytest.raises(BadArgument, match=r'camera_info_url.*pad\.yaml'):
        load_calibration(str(path))


def test_a_missing_calibration_file_is_named():
    with pytest.raises(BadArgument, match='/nowhere/pad.yaml'):
        load_calibration('/nowhere/pad.yaml')


def test_the_sensor_frame_is_named_as_the_namespace():
    assert [sensor_frame(space) for space in ('/left/pad', 'left/pad/', '/pad', '/')] == ['left_pad', 'left_pad', 'pad', '']


@pytest.mark.parametrize('view', ['', 'left', 'right'])
def test_the_picture_of_a_view_is_that_of_both(view):
    assert stitched_frame(optical_frame('left_pad', view)) == 'left_pad_camera_optical'


VALUES = np.arange(6, dtype=np.uint8).reshape(2, 3)


@pytest.mark.parametrize('order, expected', [
    ((), [[0, 1, 2], [3, 4, 5]]), (('transposed',), [[0, 3], [1, 4], [2, 5]]), (('flip_rows',), [[3, 4, 5], [0, 1, 2]]),
    (('transposed', 'flip_columns'), [[3, 0], [4, 1], [5, 2]])])
def test_orders(order, expected):
    values = {name: name in order for name in ('transposed', 'flip_rows', 'flip_columns')}
    assert in_sensor_order(VALUES, values).tolist() == expected


def test_eight_bits_stay_and_more_become_sixteen():
    assert matrix_frame(VALUES, (2, 3), 5, 'it').encoding == 'mono8'
    frame = matrix_frame(VALUES.astype(float) * 1000, (0, 0), 5, 'it')
    assert (frame.encoding, frame.image.dtype, frame.image.max(), frame.stamp_ns) == ('mono16', np.uint16, 5000, 5)


@pytest.mark.parametrize('values', [np.zeros((3, 2), np.uint8), np.zeros(6, np.uint8), np.full((2, 3), 0.5), np.full((2, 3), np.nan),
                                    np.full((2, 3), -1), np.full((2, 3), 70000)])
def test_what_is_no_image_is_refused(values):
    with pytest.raises(BadFrame, match='it is skipped'):
        matrix_frame(values, (2, 3), 0, 'the frame')


MATRIX = np.array([[600.0, 0, 320], [0, 605, 240], [0, 0, 1]])
BARREL = np.array([-0.1, 0.02, 1e-4, -2e-4, 0.0])


def appears(plane, distortion):
    still = np.zeros(3)
    return cv2.projectPoints(np.column_stack([plane, np.ones(len(plane))]), still, still, MATRIX, distortion)[0].reshape(-1, 2)


@pytest.mark.parametrize('distortion', [np.zeros(5), BARREL])
def test_what_comes_out_appears_where_it_came_from(distortion):
    uv = np.random.default_rng(0).uniform([0, 0], [640, 480], (50, 2))
    assert np.abs(appears(undistorted(uv, MATRIX, distortion), distortion) - uv).max() < 1e-3


def test_what_no_ray_can_reach_is_not_known():
    """With k1 alone the radius r (1 + k1 r^2) is largest at r^2 = -1 / (3 k1)."""
    lens = np.array([-0.1, 0, 0, 0, 0])
    farthest = 2 / 3 * np.sqrt(1 / 0.3)
    at = np.array([[320 + 600 * farthest * share, 240] for share in (0.9, 1.01)])
    known = np.isfinite(undistorted(at, MATRIX, lens)).all(axis=1)
    assert known.tolist() == [True, False]
    nowhere = np.array([[np.nan, 0], [np.inf, 0], [1e30, 1e30]])
    assert np.isnan(undistorted(nowhere, MATRIX, lens)).all() and np.isnan(undistorted(nowhere, MATRIX, BARREL)).all()
    assert np.isfinite(undistorted(nowhere[2:], MATRIX, np.zeros(5))).all()


MS = 1_000_000


def counted(stamps, covered_ns=0):
    gaps = StampGaps('image_raw')
    for stamp in stamps:
        gaps.add(int(stamp), covered_ns)
    return gaps


def stamps_of(rate, count, jitter=0.0, seed=1):
    rng = np.random.default_rng(seed)
    return ((np.arange(count) + jitter * rng.uniform(-1, 1, count)) / rate * 1e9 + 10**18).astype(np.int64)


@pytest.mark.parametrize('rate', [5, 30, 200, 1000])
@pytest.mark.parametrize('jitter', [0.0, 0.1])
def test_of_a_whole_stream_nothing_is_missing(rate, jitter):
    gaps = counted(stamps_of(rate, 500, jitter))
    assert gaps.lost == 0 and gaps.warning == ''


@pytest.mark.parametrize('every', [3, 10, 30])
def test_what_is_left_out_is_counted(every):
    number = np.arange(300)
    assert counted(stamps_of(30, 300)[(number < 10) | (number % every > 0)]).lost == np.count_nonzero(number[10:] % every == 0)


@pytest.mark.parametrize('through', [0.34, 0.8])
@pytest.mark.parametrize('jitter', [0.0, 0.05])
def test_where_most_are_lost_they_are_counted_all_the_same(through, jitter):
    arrived = np.random.default_rng(3).uniform(size=600) < through
    arrived[[0, -1]] = True
    gaps = counted(stamps_of(30, 600, jitter)[arrived])
    assert gaps.lost == pytest.approx(600 - arrived.sum(), rel=0.1)
    assert int(gaps.warning.split(' %')[0]) == pytest.approx(100 * (1 - through), abs=10) and 'of image_raw are missing' in gaps.warning


def test_what_is_lost_while_the_receiver_takes_up_its_work_is_counted_and_no_news():
    gaps = counted(np.delete(stamps_of(30, 60), np.arange(1, 26)))
    assert gaps.lost == 25 and gaps.warning == ''


def test_a_pause_or_stamps_that_go_back_are_no_loss():
    stamps = stamps_of(30, 60)
    paused = stamps + 2_100 * MS + 60 * 34 * MS
    assert counted([*stamps, *paused, *stamps]).lost == 0


def test_nothing_is_missing_from_a_time_when_nobody_listened():
    gaps, stamps = StampGaps('dots'), stamps_of(30, 60)
    for stamp in stamps[:20]:
        gaps.add(int(stamp))
    gaps.reset()
    for stamp in stamps[40:]:
        gaps.add(int(stamp))
    assert gaps.lost == 0


def test_a_camera_that_halves_its_rate_is_followed_within_two_seconds():
    gaps = counted([*stamps_of(30, 200), *(stamps_of(15, 400) + 200 * 34 * MS)])
    assert 0 < gaps.lost < 40 and gaps.warning == '', 'the newest 120 are all right'


def test_samples_in_blocks_of_any_length_are_no_gaps_but_a_missing_block_is():
    gaps, stamp = StampGaps('voltages'), 10**18
    for k in range(300):
        covered = (3 + 4 * (k % 2)) * MS
        if k not in (100, 200):
            gaps.add(stamp, covered)
        stamp += covered
    assert gaps.lost == 2
