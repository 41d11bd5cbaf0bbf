# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tracks of dots between frames that are far apart: no dot is taken for its neighbour."""
import os
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from tactile_perception._core.dots import continuous
from tactile_perception.common.dots import Dots
from tactile_perception.core.errors import BadFrame
from tactile_perception.dots.detect import Detector, DotDetector
from tactile_perception.dots.links import Linker
from tactile_perception.dots.pattern import PatternNumbers
from tactile_perception.dots.tracker import DotTracker

RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', ''))
IMAGE = np.zeros((480, 640), np.uint8)


def dots(uv):
    return Dots(uv, np.full(len(uv), 30.0), np.full(len(uv), 0.05))


def view(rng, is_hexagonal):
    """(N, 2) px of a regular pattern in an oblique view through a lens, and its spacing, px."""
    rows, columns = rng.integers(6, 14, 2)
    row, column = np.divmod(np.arange(rows * columns), columns)
    p = np.stack([column + 0.5 * is_hexagonal * (row % 2), row * (0.866 if is_hexagonal else 1.0)], axis=1)
    p, tilt = p - p.mean(axis=0), np.eye(3)
    tilt[:2, :2] += rng.normal(0, 0.08, (2, 2))
    tilt[2, :2] = rng.uniform(-0.03, 0.03, 2)
    p = np.column_stack([p, np.ones(len(p))]) @ tilt.T
    p = p[:, :2] / p[:, 2:]
    spacing = rng.uniform(12, 40)
    return spacing * p * (1 + rng.uniform(-0.003, 0.003) * (p**2).sum(axis=1, keepdims=True)), spacing


def test_a_speck_that_leaves_its_neighbours_step_by_step_loses_its_number():
    uv, linker = 20.0 * np.stack(np.divmod(np.arange(48), 8), axis=1) + 40, Linker()
    for k in range(8):
        id = linker.update(dots(uv + 2.0 * k * (np.arange(48) == 20)[:, None] * [0, 1]), 0.03 * k, (300, 300))
        assert (np.delete(id, 20) == np.delete(np.arange(48), 20)).all()
        assert id[20] == (20 if k <= 4 else -1)
    assert linker.lost > 0


@pytest.mark.parametrize('stretch', [0.0, 0.2])
def test_dots_that_jump_are_left_out_and_their_neighbours_are_not(stretch):
    rng = np.random.default_rng(7)
    first = 20.0 * np.stack(np.divmod(np.arange(80), 10), axis=1) + rng.normal(0, 1, (80, 2))
    now = (1 + stretch) * first + [70, -30]  # all of them move, by more than their spacing
    assert continuous(first, now).all()
    jumping = np.array([0, 33, 34, 57])
    now[jumping] += [[0, 15], [15, 0], [15, 0], [-11, -11]]
    np.testing.assert_array_equal(np.flatnonzero(~continuous(first, now)), jumping)


@pytest.mark.parametrize('count', [0, 1, 3])
def test_a_few_dots_are_compared_with_none(count):
    assert continuous(np.eye(3)[:count, :2], 1e3 * np.eye(3)[:count, 1:]).tolist() == [True] * count


@pytest.mark.parametrize('is_cut', [False, True])
@pytest.mark.parametrize('share', [0.3, 0.4, 0.5, 0.6, 0.7])
def test_a_regular_pattern_that_jumps_gives_right_tracks_or_none(share, is_cut):
    """A shift by a share of the spacing, with a press; the image shows all of the pattern or cuts it."""
    right = wrong = shown = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        uv, spacing = view(rng, seed % 3 == 0)
        low, extent = uv.min(axis=0), np.ptp(uv, axis=0)
        size = extent * rng.uniform(0.5, 0.8) if is_cut else extent + 2.5 * spacing
        uv = uv - low + (size - extent) / 2
        angle = rng.uniform(0, 2 * np.pi)
        press = np.exp(-((uv - size / 2)**2).sum(axis=1, keepdims=True) / (2 * (2 * spacing)**2)) * rng.uniform(-0.2, 0.2, 2) * spacing
        linker, first = Linker(), {}
        for k, moved in enumerate((uv, uv, uv + share * spacing * np.array([np.cos(angle), np.sin(angle)]) + press)):
            seen = np.flatnonzero(((moved > 2) & (moved < size - 2)).all(axis=1) & (rng.random(len(uv)) > 0.02))
            id = linker.update(dots(moved[seen] + rng.normal(0, 0.02 * spacing, (len(seen), 2))), 0.03 * k, tuple(size))
            first = dict(zip(id.tolist(), seen.tolist())) if k == 0 else first
        known = np.isin(id, list(first))
        same = np.array([first[i] for i in id[known].tolist()], int) == seen[known]
        right, wrong, shown = right + same.sum(), wrong + (~same).sum(), shown + len(seen)
    assert wrong == 0
    assert right > 0.9 * shown or is_cut


def test_a_jump_that_two_answers_explain_is_said_and_gives_no_number():
    row, column = np.divmod(np.arange(400), 20)
    uv = np.stack([column, row], axis=1) * 32.0 + [16.0, 0.0]
    shifts = (0.0, 0.0, 14.0, 0.5)

    class Shifted(Detector):
        def detect(self, image):
            return dots(uv + [self.shift, 0.0])
    detector = Shifted()
    tracker = DotTracker(detector=detector)
    for k, detector.shift in enumerate(shifts):
        if detector.shift == 14.0:
            with pytest.raises(BadFrame, match='half their spacing.*frame rate'):
                tracker.process(IMAGE, k / 30)
            assert '400 dots not linked, 1 frames' in tracker.jumps
        else:
            tracks = tracker.process(IMAGE, k / 30)
    np.testing.assert_array_equal(tracks.id, np.arange(400))  # it came back, and so do all tracks
    np.testing.assert_allclose(tracks.duv, np.tile([0.5, 0.0], (400, 1)), atol=0.4)


def test_after_a_jump_that_stays_a_new_reference_is_taken_and_said():
    row, column = np.divmod(np.arange(400), 20)
    uv, linker = np.stack([column, row], axis=1) * 32.0 + [16.0, 0.0], Linker()
    assert (linker.update(dots(uv), 0.0, (640, 480)) >= 0).all()
    for stamp_s in np.arange(0.1, 2.0, 0.1):
        assert (linker.update(dots(uv + [14.0, 0.0]), stamp_s, (640, 480)) == -1).all()
    assert linker.update(dots(uv + [14.0, 0.0]), 2.2, (640, 480)).min() >= 400 and linker.restarts == 1


@pytest.mark.skipif(not (RECORDINGS / 'pin_array_127').is_dir(), reason='TACTILE_RECORDINGS holds no pin_array_127')
def test_separate_presses_of_a_real_dome_give_the_numbers_of_a_registration():
    """Each photo is a press of its own: pins move by up to a spacing from one to the next. Registration looks at each photo alone."""
    paths = sorted((RECORDINGS / 'pin_array_127').glob('frame_*.png'), key=lambda path: [int(n) for n in re.findall(r'\d+', path.stem)])
    detector, linker, pattern, first, right, wrong = DotDetector('bright'), Linker(), PatternNumbers(), {}, 0, 0
    for k, path in enumerate(paths[:40]):
        found = detector.detect(cv2.imread(str(path)))
        id, number = linker.update(found, k / 25, (256, 256)), pattern.update(found, 0.0)
        first = dict(zip(id.tolist(), number.tolist())) if k == 0 else first
        both = np.isin(id, list(first)) & (number >= 0)
        same = np.array([first[i] for i in id[both].tolist()], int) == number[both]
        right, wrong = right + same.sum(), wrong + (~same).sum()
    assert wrong <= 0.002 * right and right > 0.95 * 127 * 40
