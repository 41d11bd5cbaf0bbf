# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from tactile_perception.common.dots import Dots
from tactile_perception.core.errors import BadArgument, BadFrame
from tactile_perception.dots.detect import Detector
from tactile_perception.dots.reference import Reference
from tactile_perception.dots.tracker import DotOptions, DotTracker

RECORDINGS = os.environ.get('TACTILE_RECORDINGS')
needs_recordings = pytest.mark.skipif(not RECORDINGS, reason='TACTILE_RECORDINGS is not set: recordings are not shipped')
IMAGE = np.zeros((480, 640), np.uint8)


class Given(Detector):
    """A detector that finds what it was given."""

    def __init__(self, uv):
        self.uv = uv

    def detect(self, image):
        return Dots(self.uv, np.full(len(self.uv), 30.0), np.full(len(self.uv), 0.02))


def grid(rows=9, columns=12, pitch=30.0):
    row, column = np.divmod(np.arange(rows * columns), columns)
    return np.stack([column, row], axis=1) * pitch + 90.0


def test_displacements_of_numbered_dots():
    detector = Given(grid())
    tracker = DotTracker(DotOptions(9, 12), detector)
    first = tracker.process(IMAGE, 0.0)
    assert np.abs(first.duv).max() == 0
    detector.uv = (grid() + [45.0, 30.0])[::-1]  # one and a half pitches at once, in another order
    second = tracker.process(IMAGE, 0.02)
    assert sorted(second.id) == list(range(108))
    np.testing.assert_allclose(second.duv, np.tile([45.0, 30.0], (108, 1)))


def test_a_pattern_that_is_no_grid():
    uv = np.random.default_rng(0).permutation(grid())[:70] + np.random.default_rng(1).uniform(-8, 8, (70, 2))
    detector = Given(uv)
    tracker = DotTracker(detector=detector)
    tracker.process(IMAGE, 0.0)
    detector.uv = uv + 4.0
    tracks = tracker.process(IMAGE, 0.02)
    assert (tracks.rows, tracks.columns) == (0, 0)
    np.testing.assert_array_equal(tracks.id, np.arange(70))
    np.testing.assert_allclose(tracks.uv - tracks.rest_uv, tracks.duv)


@pytest.mark.parametrize(('image', 'uv', 'said'), [(IMAGE.astype(float), grid(), 'uint8'), (IMAGE, np.zeros((0, 2)), 'no dots')])
def test_what_cannot_be_used_is_refused(image, uv, said):
    with pytest.raises(BadFrame, match=said):
        DotTracker(DotOptions(9, 12), Given(uv)).process(image, 0.0)


@pytest.mark.parametrize(('arguments', 'text'), [((1, 9), 'rows and columns'), ((9, 12, 'grey'), 'polarity'),
                                                 ((9, 12, 'dark', 'likelihood', 'walk'), 'numbering')])
def test_wrong_arguments(arguments, text):
    with pytest.raises(BadArgument, match=text):
        DotTracker(DotOptions(*arguments))


@needs_recordings
@pytest.mark.parametrize('scene', ['tp_rect_drag', 'tp_disc_twist', 'tp_ring_press', 'tp_calib', 'tp_noise'])
def test_no_wrong_number_on_simulated_recordings(scene):
    folder = Path(RECORDINGS) / 'simulated' / scene
    truth = np.load(folder / 'truth.npz')
    number = truth['dot_rc'] @ [23, 1]
    tracker = DotTracker(DotOptions(23, 23))
    numbered = 0
    for k, path in enumerate(sorted((folder / 'frames').glob('*.webp'))[:20]):
        tracks = tracker.process(cv2.imread(str(path)), float(k))
        distance, true = cKDTree(truth['uv'][k]).query(tracks.uv)
        assert np.all((number[true] == tracks.id)[distance < 2.0])
        numbered += np.sum(distance < 2.0)
    assert numbered >= 0.97 * truth['visible'][: k + 1].sum()
    assert tracker.reference.warning == ''


@needs_recordings
def test_numbers_stay_through_the_press_and_back_on_a_real_sensor():
    video = cv2.VideoCapture(str(Path(RECORDINGS) / 'gelsight_mini' / 'mini_example.avi'))
    tracker, last, counts = DotTracker(DotOptions(7, 10)), {}, []
    for k in range(219):
        tracks = tracker.process(video.read()[1], k / 25)
        now = dict(zip(tracks.id.tolist(), tracks.uv))
        assert all(np.hypot(*(now[id] - last[id])) < 10.0 for id in now.keys() & last.keys())  # a third of the pitch
        last, counts = now, counts + [len(now)]
    assert np.nanmedian(np.linalg.norm(tracks.duv, axis=1)) < 0.7
    assert np.median(counts) >= 64 and counts[148] >= 67  # in the deepest press


@needs_recordings
def test_a_row_that_is_never_seen_in_full_makes_numbers_uncertain_and_tracks_certain():
    """The real gel has an eighth row, which the border cuts: as a grid of eight its rows could be the upper or the lower seven."""
    video = cv2.VideoCapture(str(Path(RECORDINGS) / 'gelsight_mini' / 'mini_example.avi'))
    tracker, strict = DotTracker(DotOptions(8, 10), as_tracks=Reference()), DotTracker(DotOptions(8, 10))
    for k in range(60):
        image = video.read()[1]
        tracks = tracker.process(image, k / 25)
        assert (tracks.rows, tracks.columns) == (0, 0) and '7 of 8 rows' in tracker.unnumbered and 'set rows' in tracker.unnumbered
        assert set(tracks.id.tolist()) <= set(range(70)) and len(tracks) >= 68
    with pytest.raises(BadFrame, match='7 of 8 rows'):
        strict.process(image, 0.0)


@needs_recordings
def test_pins_in_a_hexagonal_array_get_tracks():
    paths = sorted((Path(RECORDINGS) / 'pin_array_127').glob('frame_*.png'), key=lambda p: int(p.stem.split('_')[1]))
    tracker = DotTracker(DotOptions(0, 0, 'bright'))
    first = tracker.process(cv2.imread(str(paths[0])), 0.0)
    kept = []
    for k, path in enumerate(paths[1:40], 1):  # each a press of its own, that moves pins by up to a spacing
        tracks = tracker.process(cv2.imread(str(path)), k / 25)
        assert len(np.unique(tracks.id)) == len(tracks)
        kept.append(np.isin(first.id, tracks.id).sum())
    assert np.median(kept) >= 115


def test_a_pattern_that_is_no_grid_is_registered_by_name():
    uv = grid() + np.random.default_rng(3).uniform(-8, 8, (108, 2))
    order = np.random.default_rng(1).permutation(108)
    detector = Given(uv[order] + [12.0, 5.0])
    tracker = DotTracker(DotOptions(numbering='register', pattern=uv), detector)
    tracks = tracker.process(IMAGE, 0.0)
    np.testing.assert_array_equal(tracks.id, np.arange(108))
    np.testing.assert_array_equal(tracks.uv, uv + [12.0, 5.0])
    detector.uv = uv[:40]
    with pytest.raises(BadFrame, match='match the pattern'):
        tracker.process(IMAGE, 0.1)
    detector.uv = uv
    tracks = tracker.process(IMAGE, 0.2)
    np.testing.assert_allclose(tracks.duv, np.tile([-12.0, -5.0], (108, 1)))
    with pytest.raises(BadArgument, match='numbering'):
        DotTracker(DotOptions(numbering='walk'))
