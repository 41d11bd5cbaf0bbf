# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Frames that cannot be used raise a named error and change no state; the next good frame gives the same result as without them."""
import cv2
import numpy as np
import pytest
import rig
from rig import STEP_NS, contacts, duv, untouched, uv

from tactile_perception.core.errors import BadFrame

HEIGHT, WIDTH = 480, 640
RNG = np.random.default_rng(0)


def like(pad, value):
    return np.full_like(pad.rest[0], value)


BAD = {
    'black': (lambda pad: like(pad, 0), 'frame is black'),
    'nearly black': (lambda pad: RNG.integers(0, 3, pad.rest[0].shape, np.uint8), 'frame is black'),
    'white': (lambda pad: like(pad, 255), 'frame is white'),
    'constant': (lambda pad: like(pad, 90), 'frame is constant'),
    'dark and noisy': (lambda pad: RNG.integers(0, 9, pad.rest[0].shape, np.uint8), 'no pattern of dark dots'),
    'noise': (lambda pad: RNG.integers(0, 256, pad.rest[0].shape, np.uint8), 'no pattern of dark dots'),
    'no dots': (lambda pad: cv2.GaussianBlur(pad.rest[0], (0, 0), 25), 'no pattern of dark dots'),
    'cut': (lambda pad: pad.rest[0][:400].copy(), '640 x 400'),
    'half the size': (lambda pad: cv2.resize(pad.rest[0], (320, 240)), '320 x 240'),
    'turned': (lambda pad: np.rot90(pad.rest[0]).copy(), '480 x 640'),
    'grey among colour': (lambda pad: cv2.cvtColor(pad.rest[0], cv2.COLOR_BGR2GRAY), 'changed its shape'),
    'a part of the pattern': (lambda pad: cv2.resize(pad.rest[0][150:330, 200:440], (WIDTH, HEIGHT)), 'not indexed'),
}


@pytest.fixture(scope='module')
def running(pad):
    return pad.chain().begun()


@pytest.mark.parametrize('name', BAD)
def test_a_bad_frame_is_refused_and_leaves_no_trace(pad, running, name):
    make, message = BAD[name]
    before = running(pad.rest[3])['dots']
    with pytest.raises(BadFrame, match=message):
        running(make(pad))
    results = running(pad.rest[3])
    after = results['dots']
    assert sorted(after.id) == sorted(before.id)
    moved = np.abs(uv(after)[np.argsort(after.id)] - uv(before)[np.argsort(before.id)])
    assert np.median(moved) < 2e-3 and moved.max() < 0.1, 'the same image gives the same positions'
    assert np.abs(duv(after)).max() < 0.3 and untouched(results)


def test_bad_first_frames_are_refused_and_the_first_good_one_begins(pad):
    chain = pad.chain()
    for name in ('black', 'white', 'constant', 'noise', 'no dots', 'a part of the pattern'):
        with pytest.raises(BadFrame):
            chain(BAD[name][0](pad))
    results = chain(pad.rest[0])
    assert len(results['dots'].id) > 515 and untouched(results)


@pytest.mark.parametrize('sensor', rig.SENSORS[:4])
def test_bad_frames_in_the_middle_of_a_press(sensor):
    of = rig.seen(sensor)
    chain = of.chain().begun()
    first, = contacts(chain(of.pressed))
    for k in range(4):
        with pytest.raises(BadFrame):
            chain(np.full_like(of.pressed, 255 * (k % 2)))
    second, = contacts(chain(of.pressed))
    assert second.id == first.id and second.depth == pytest.approx(first.depth, abs=3e-4)


@pytest.mark.parametrize('side', ['left', 'right', 'top', 'bottom'])
def test_half_of_the_dots_gone(pad, running, side):
    """What is seen keeps its number or the frame is refused; nothing is reported of the dots that are not seen, and no contact made up."""
    running(pad.rest[2])
    part = {'left': np.s_[:, :WIDTH // 2], 'right': np.s_[:, WIDTH // 2:], 'top': np.s_[:HEIGHT // 2], 'bottom': np.s_[HEIGHT // 2:]}[side]
    half = pad.rest[0].copy()
    half[part] = 12
    try:
        results = running(half)
    except BadFrame as error:
        assert 'not indexed' in str(error)
    else:
        dots = results['dots']
        assert 200 < len(dots.id) < 320 and np.linalg.norm(uv(dots) - pad.untouched.dot_uv[np.array(dots.id)], axis=1).max() < 2
        assert list(results['contact_region'].dot_id) == list(dots.id) and untouched(results)
    results = running(pad.rest[4])
    assert len(results['dots'].id) > 515 and untouched(results)


def without(image, positions):
    """The image with the dots at positions painted over in the colour around them."""
    image, ground = image.copy(), cv2.GaussianBlur(cv2.dilate(image, np.ones((25, 25))), (0, 0), 4)
    for u, v in positions:
        spot = np.zeros(image.shape[:2], np.uint8)
        cv2.circle(spot, (round(u), round(v)), 8, 1, -1)
        image[spot > 0] = ground[spot > 0]
    return image


@pytest.mark.parametrize('share', [0.05, 0.1, 0.5])
def test_scattered_dots_gone(pad, running, share):
    """Dots painted over in a pressed frame: refused where hardly a row is left; else those seen keep their numbers, and the contact."""
    running(pad.rest[2])
    gone, true = np.random.default_rng(2).random(529) < share, pad.touched.dot_uv
    try:
        results = running(without(pad.pressed, true[gone]))
    except BadFrame as error:
        assert share == 0.5 and 'not indexed' in str(error)
    else:
        ids = np.array(results['dots'].id)
        assert np.linalg.norm(uv(results['dots']) - true[ids], axis=1).max() < 3 and not gone[ids].mean() > 0.02
        if share < 0.5:
            assert max(c.depth for c in contacts(results)) == pytest.approx(pad.truth[0].depth, abs=0.3e-3)
    assert untouched(running(pad.rest[4]))


def test_stripes_of_a_broken_transfer(pad, running):
    """Rows that repeat, as after a lost packet: refused, or nothing is made up about dots that are seen."""
    torn = pad.rest[0].copy()
    torn[200:280] = torn[200]
    try:
        dots = running(torn)['dots']
        assert np.mean(np.linalg.norm(uv(dots) - pad.untouched.dot_uv[np.array(dots.id)], axis=1) > 2) < 0.01
    except BadFrame:
        pass
    assert untouched(running(pad.rest[4]))


@pytest.mark.parametrize('changes, message', [({'rows': 15, 'columns': 15}, 'not indexed'), ({'rows': 23, 'columns': 21}, 'not indexed'),
                                              ({'rows': 30, 'columns': 30}, 'not indexed'),
                                              ({'polarity': 'bright'}, 'polarity')])
def test_another_pattern_than_configured(pad, changes, message):
    with pytest.raises(BadFrame, match=message):
        pad.chain(**changes)(pad.rest[0])


@pytest.mark.parametrize('sensor', rig.SENSORS)
def test_stamps_that_do_not_go_on_are_refused_and_leave_no_trace(sensor):
    of = rig.seen(sensor)
    chain, plain = of.chain().begun(), of.chain().begun()
    repeats = [] if sensor == 'psd_finger' else [chain.stamp_ns]  # blocks of samples may share a stamp
    for stamp in (*repeats, chain.stamp_ns - 10**6):
        with pytest.raises(BadFrame, match='stamp'):
            chain(of.pressed, stamp)
        chain.stamp_ns = plain.stamp_ns
    one, other = contacts(chain(of.pressed)), contacts(plain(of.pressed))
    assert len(one) == len(other) == 1 and np.array_equal(one[0].position, other[0].position)


@pytest.mark.parametrize('sensor', rig.SENSORS)
def test_a_pause_of_half_an_hour_changes_nothing(sensor):
    of = rig.seen(sensor)
    chain, plain = of.chain().begun(), of.chain().begun()
    chain.stamp_ns += 18_000 * STEP_NS
    one, other = contacts(chain(of.pressed)), contacts(plain(of.pressed))
    assert len(one) == len(other) == 1 and one[0].position == pytest.approx(other[0].position, abs=2e-4)


@pytest.mark.parametrize('sensor', rig.SENSORS)
def test_a_touch_that_ends_and_comes_again_has_another_number(sensor):
    of = rig.seen(sensor)
    chain = of.chain().begun()
    first, = contacts(chain(of.pressed))
    for raw in of.rest[:6]:
        results = chain(raw)
    assert untouched(results)
    again, = contacts(chain(of.pressed))
    assert again.id > first.id and again.position == pytest.approx(first.position, abs=1e-3)
