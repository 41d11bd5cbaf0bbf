# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest

from tactile_perception.dots.detect.methods import DotDetector
from tactile_perception.dots.tracker import DotTracker
from tactile_perception.dots.warm import SEARCHES, WarmStart
from tactile_perception.errors import BadFrame

ROWS, COLUMNS, PITCH, SHAPE, BUMP = 9, 12, 16.0, (240, 320), 60.0


@pytest.fixture(scope='module')
def printed():
    """Places (N, 2) px, numbers being their indices, and the clean image."""
    row, column = np.divmod(np.arange(ROWS * COLUMNS), COLUMNS)
    uv = np.stack([72.0 + PITCH * column, 56.0 + PITCH * row], 1) + np.random.default_rng(0).uniform(-0.6, 0.6, (ROWS * COLUMNS, 2))
    fine = np.full((SHAPE[0] * 8, SHAPE[1] * 8), 185.0, np.float32)
    for u, v in uv:
        cv2.circle(fine, (round((u + 0.5) * 8 * 16 - 8), round((v + 0.5) * 8 * 16 - 8)), 28 * 16, 55.0, -1, cv2.LINE_8, 4)
    return uv, cv2.resize(cv2.GaussianBlur(fine, (0, 0), 7.0), SHAPE[::-1], interpolation=cv2.INTER_AREA)


def frame(clean, rng, shift=(0, 0), bump=0.0):
    """The image moved by shift, and dragged by bump px in the middle; with noise."""
    y, x = np.mgrid[:SHAPE[0], :SHAPE[1]].astype(np.float32)
    drag = bump * np.exp(-((x - 160) ** 2 + (y - 120) ** 2) / (2 * BUMP**2), dtype=np.float32)
    x, y = (x - drag - shift[0]).astype(np.float32), (y - shift[1]).astype(np.float32)
    moved = cv2.remap(clean, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.clip(np.rint(moved + rng.normal(0, 2, SHAPE)), 0, 255).astype(np.uint8)


def wrong(printed_uv, dots, id, shift, bump):
    """How many numbers are not those of the dots that lie there."""
    uv = dots.uv[id >= 0] - shift
    drag = bump * np.exp(-((uv - [160, 120]) ** 2).sum(1) / (2 * BUMP**2))  # as frame() has it: by where a dot is now
    back = uv - np.stack([drag, 0 * drag], 1)
    nearest = np.hypot(*(printed_uv[:, None] - back).transpose(2, 0, 1)).argmin(0)
    return np.count_nonzero(nearest != id[id >= 0])


def test_the_places_are_those_of_a_search(printed):
    uv, clean = printed
    rng = np.random.default_rng(1)
    tracker, detector, off = DotTracker(ROWS, COLUMNS), DotDetector('dark'), []
    for k in range(2 * SEARCHES):
        image = frame(clean, rng, bump=0.3 * k)
        warm, id = tracker.find(image, k / 60)
        cold = detector.detect(image)
        assert len(id) == len(cold) == len(uv)
        off.append(np.hypot(*(warm.uv[:, None] - cold.uv).transpose(2, 0, 1)).min(1))
    assert np.median(off) < 0.005
    assert np.max(off) < 0.05


def test_no_number_is_wrong_after_jumps_of_up_to_three_pitches(printed):
    uv, clean = printed
    rng = np.random.default_rng(2)
    tracker, count, ways = DotTracker(ROWS, COLUMNS), 0, [0.0, 0.3, 1.0, 2.0, 3.0]
    for k in range(200):
        shift = np.zeros(2)
        shift[rng.integers(2)] = rng.choice([-1, 1]) * rng.choice(ways) * PITCH
        dots, id = tracker.find(frame(clean, rng, shift), k / 60)
        assert wrong(uv, dots, id, shift, 0.0) == 0
        count += len(id)
    assert count >= 0.99 * 200 * len(uv)


def test_no_number_is_wrong_in_drags_of_up_to_two_pitches(printed):
    uv, clean = printed
    rng = np.random.default_rng(3)
    tracker = DotTracker(ROWS, COLUMNS)
    numbered = 0
    for k in range(100):
        bump = rng.choice([0.0, 0.5, 1.0, 1.5, 2.0]) * PITCH * rng.choice([-1, 1])
        try:
            dots, id = tracker.find(frame(clean, rng, bump=bump), k / 60)
        except BadFrame:  # not certain, and said so
            continue
        assert wrong(uv, dots, id, np.zeros(2), bump) == 0
        numbered += len(id)
    assert numbered >= 0.9 * 100 * len(uv)


def test_a_dot_that_was_hidden_is_found_again_at_once(printed):
    uv, clean = printed
    rng = np.random.default_rng(4)
    hidden = clean.copy()
    u, v = np.rint(uv[40]).astype(int)
    hidden[v - 6:v + 7, u - 6:u + 7] = 185.0
    tracker = DotTracker(ROWS, COLUMNS)
    found = [set(tracker.find(frame(image, rng), k / 60)[1].tolist()) for k, image in enumerate((hidden, hidden, clean))]
    assert [40 in ids for ids in found] == [False, False, True]


def test_nothing_is_refound_before_anything_was_found_or_when_half_of_it_is_gone(printed):
    uv, clean = printed
    rng = np.random.default_rng(5)
    detector = DotDetector('dark')
    warm = WarmStart(detector, (ROWS, COLUMNS))
    assert warm.refind(frame(clean, rng)) is None
    dots = detector.detect(frame(clean, rng))
    id = np.hypot(*(dots.uv[:, None] - uv).transpose(2, 0, 1)).argmin(1)
    warm.remember(id, dots.uv, dots.area, PITCH)
    assert len(warm.refind(frame(clean, rng))[1]) == len(uv)
    half = clean.copy()
    half[:, :160] = 185.0
    assert warm.refind(frame(half, rng)) is None
