# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Unusable frames raise a named error and change no state; the next good frame gives the same result as without them."""
import cv2
import numpy as np
import pytest
from tactile_perception.errors import BadFrame

HEIGHT, WIDTH = 480, 640
RNG = np.random.default_rng(0)


def touch_free(result):
    return result.region.area == 0 and not result.contacts and not (result.region.dot_state > 0).any()


def like(pad, value):
    return np.full_like(pad.rest[0], value)


BAD = {
    'black': (lambda pad: like(pad, 0), 'frame is black'),
    'nearly black': (lambda pad: RNG.integers(0, 3, pad.rest[0].shape, np.uint8), 'frame is black'),
    'white': (lambda pad: like(pad, 255), 'frame is white'),
    'constant': (lambda pad: like(pad, 90), 'frame is constant'),
    'dark and noisy': (lambda pad: RNG.integers(0, 9, pad.rest[0].shape, np.uint8), 'no dark dots|dots found'),
    'noise': (lambda pad: RNG.integers(0, 256, pad.rest[0].shape, np.uint8), 'no dark dots|dots found|not indexed'),
    'no dots': (lambda pad: cv2.GaussianBlur(pad.rest[0], (0, 0), 25), 'dots found|no dark dots'),
    'too small': (lambda pad: pad.rest[0][:20, :20].copy(), 'changed its shape|too small'),
    'cut': (lambda pad: pad.rest[0][:400].copy(), 'changed its shape'),
    'half the size': (lambda pad: cv2.resize(pad.rest[0], (320, 240)), 'changed its shape'),
    'turned': (lambda pad: np.rot90(pad.rest[0]).copy(), 'changed its shape'),
    'grey among colour': (lambda pad: cv2.cvtColor(pad.rest[0], cv2.COLOR_BGR2GRAY), 'changed its shape'),
    'four channels': (lambda pad: np.dstack([pad.rest[0], pad.rest[0][..., 0]]), 'changed its shape'),
    'float': (lambda pad: pad.rest[0].astype(float), 'uint8'),
    '16 bit': (lambda pad: pad.rest[0].astype(np.uint16), 'uint8'),
    'empty': (lambda pad: np.zeros((0, 0, 3), np.uint8), 'empty'),
    'nothing': (lambda pad: None, 'empty'),
    'a part of the pattern': (lambda pad: cv2.resize(pad.rest[0][150:330, 200:440], (WIDTH, HEIGHT)), 'not indexed'),
}


@pytest.fixture(scope='module')
def running(pad):
    return pad.chain().begun(pad)


@pytest.mark.parametrize('name', BAD)
def test_a_bad_frame_is_refused_and_leaves_no_trace(pad, running, name):
    make, message = BAD[name]
    before, _ = running(pad.rest[3])
    with pytest.raises(BadFrame, match=message):
        running(make(pad))
    after, result = running(pad.rest[3])
    assert sorted(after.id) == sorted(before.id)
    moved = np.abs(after.uv[np.argsort(after.id)] - before.uv[np.argsort(before.id)])
    assert np.median(moved) < 2e-3 and moved.max() < 0.1, 'the same image gives the same places'
    assert np.abs(after.duv).max() < 0.3 and touch_free(result)


def test_bad_first_frames_are_refused_and_the_first_good_one_begins(pad):
    chain = pad.chain()
    for name in ('black', 'white', 'constant', 'noise', 'no dots', 'float', 'empty', 'nothing', 'a part of the pattern'):
        with pytest.raises(BadFrame):
            chain(BAD[name][0](pad))
    tracks, result = chain(pad.rest[0])
    assert len(tracks) > 515 and touch_free(result)


def test_twenty_bad_frames_in_the_middle_of_a_press(pad):
    chain = pad.chain().begun(pad)
    _, first = chain(pad.pressed)
    refused = 0
    for k in range(20):
        with pytest.raises(BadFrame):
            chain((like(pad, 0), like(pad, 255), BAD['noise'][0](pad))[k % 3])
        refused += 1
    _, second = chain(pad.pressed)
    assert refused == 20 and len(first.contacts) == len(second.contacts) == 1
    assert second.contacts[0].id == first.contacts[0].id
    assert second.contacts[0].depth == pytest.approx(first.contacts[0].depth, abs=0.1e-3)
    assert second.region.area == pytest.approx(first.region.area, rel=0.15)
    truth = pad.truth.contacts[0]
    assert second.contacts[0].depth == pytest.approx(truth.depth, abs=0.3e-3)
    assert second.contacts[0].force == pytest.approx(truth.force, rel=0.15)


@pytest.mark.parametrize('stamp, what', [(0.0, 'repeats'), (-5.0, 'goes back'), (np.nan, 'is no number')])
def test_a_stamp_that_does_not_go_on_is_refused(pad, running, stamp, what):
    running(pad.rest[3])
    with pytest.raises(BadFrame, match='stamp'):
        running(pad.rest[3], running.stamp + stamp)
    running.dots.process(pad.rest[4], running.stamp + 0.05)
    _, result = running(pad.rest[3])
    assert result.region.area == 0


def test_a_long_pause_changes_nothing(pad, running):
    chain = running
    chain(pad.rest[2])
    chain.stamp += 3600
    tracks, result = chain(pad.rest[3])
    assert touch_free(result) and np.abs(tracks.duv).max() < 0.3
    _, result = chain(pad.pressed)
    assert len(result.contacts) == 1


@pytest.mark.parametrize('side', ['left', 'right', 'top', 'bottom'])
def test_half_of_the_dots_gone(pad, running, side):
    """What is seen keeps its number or the frame is refused; nothing is said of the dots that are not seen, and no contact made up."""
    chain = running
    chain(pad.rest[2])
    part = {'left': np.s_[:, :WIDTH // 2], 'right': np.s_[:, WIDTH // 2:], 'top': np.s_[:HEIGHT // 2], 'bottom': np.s_[HEIGHT // 2:]}[side]
    half = pad.rest[3].copy()
    half[part] = 12
    try:
        tracks, result = chain(half)
    except BadFrame as error:
        assert 'not indexed' in str(error)
    else:
        true = pad.scene.render(0.3).truth.dot_uv[tracks.id]
        assert 200 < len(tracks) < 320 and np.linalg.norm(tracks.uv - true, axis=1).max() < 2
        assert list(result.region.dot_id) == list(tracks.id) and touch_free(result)
    tracks, result = chain(pad.rest[4])
    assert len(tracks) > 515 and touch_free(result)


def without(pad, image, uv):
    """The image with the dots at uv painted over in the colour around them."""
    image, ground = image.copy(), cv2.GaussianBlur(cv2.dilate(image, np.ones((25, 25))), (0, 0), 4)
    for u, v in uv:
        spot = np.zeros(image.shape[:2], np.uint8)
        cv2.circle(spot, (round(u), round(v)), 8, 1, -1)
        image[spot > 0] = ground[spot > 0]
    return image


@pytest.mark.parametrize('share', [0.05, 0.1])
def test_scattered_dots_gone(pad, running, share):
    """Dots painted over in a pressed frame: those seen keep their numbers, the contact is still there, 0.3 mm of 3 mm deep."""
    running(pad.rest[2])
    gone = np.random.default_rng(2).random(529) < share
    tracks, result = running(without(pad, pad.pressed, pad.truth.dot_uv[gone]))
    assert not gone[tracks.id].mean() > 0.02 and len(tracks) > 529 * (1 - 2 * share)
    assert np.linalg.norm(tracks.uv - pad.truth.dot_uv[tracks.id], axis=1).max() < 3
    assert max(c.depth for c in result.contacts) == pytest.approx(pad.truth.contacts[0].depth, abs=0.3e-3)


def test_half_of_the_dots_gone_here_and_there(pad, running):
    """Too few to tell a row: refused, or those that are numbered are numbered right."""
    running(pad.rest[2])
    gone = np.random.default_rng(3).random(529) < 0.5
    true = pad.scene.render(0.3).truth.dot_uv
    try:
        tracks, _ = running(without(pad, pad.rest[3], true[gone]))
        assert np.linalg.norm(tracks.uv - true[tracks.id], axis=1).max() < 3
    except BadFrame as error:
        assert 'not indexed' in str(error)
    assert touch_free(running(pad.rest[4])[1])


def test_another_pattern_than_configured(pad):
    for rows, columns in ((15, 15), (23, 21), (30, 30)):
        with pytest.raises(BadFrame, match='not indexed'):
            pad.chain(rows=rows, columns=columns)(pad.rest[0])


def test_the_wrong_polarity(pad):
    with pytest.raises(BadFrame, match='polarity'):
        pad.chain(polarity='bright')(pad.rest[0])


def test_stripes_of_a_broken_transfer(pad, running):
    """Rows that repeat, as after a lost packet: refused, or nothing is made up about dots that are seen."""
    chain = running
    torn = pad.rest[3].copy()
    torn[200:280] = torn[200]
    try:
        tracks, result = chain(torn)
        true = pad.scene.render(0.3).truth.dot_uv[tracks.id]
        assert np.mean(np.linalg.norm(tracks.uv - true, axis=1) > 2) < 0.01
    except BadFrame:
        pass
    assert touch_free(chain(pad.rest[4])[1])
