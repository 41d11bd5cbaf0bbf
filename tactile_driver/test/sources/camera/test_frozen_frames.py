# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.camera import device as frozen_frames
from tactile_driver.camera.device import FrameWatch

RNG = np.random.default_rng(0)


@pytest.fixture
def watched(monkeypatch):
    """watched(image, s): the remark after an image at a time."""
    now = [100.0]
    monkeypatch.setattr(frozen_frames.time, 'monotonic', lambda: now[0])
    watch = FrameWatch()

    def add(image, seconds):
        now[0] = 100.0 + seconds
        if image is not None:
            watch.add(image)
        return watch.remark
    add.watch = watch
    return add


def picture():
    """Grey with a little noise."""
    return RNG.integers(98, 103, (48, 64, 3), np.uint8)


def test_pictures_with_noise_are_in_order(watched):
    assert {watched(picture(), 0.03 * k) for k in range(100)} == {''}


def test_the_same_picture_again_and_again_is_told_until_another_comes(watched):
    same = picture()
    told = [watched(same, 0.1 * k) for k in range(30)]
    assert told[:10] == [''] * 10 and told[-1].startswith('the camera has repeated one picture for 2.9 s')
    assert watched(picture(), 3.0) == ''


def test_black_pictures_are_told_but_not_the_first_ones_of_a_camera_that_begins(watched):
    dark = [RNG.integers(0, 4, (48, 64), np.uint8) for _ in range(8)]
    told = [watched(image, 0.1 * k) for k, image in enumerate(dark)]
    assert told[:3] == [''] * 3 and 'black' in told[-1]
    assert watched(picture()[:, :, 0], 0.9) == ''


def test_frames_that_nobody_looks_at_are_not_judged(watched):
    same = picture()
    watched(same, 0.0)
    assert watched(same, 1.5) and watched(None, 4.0) == ''
    assert watched(picture(), 60.0) == ''


def test_a_camera_that_is_opened_anew_begins_anew(watched):
    same = picture()
    watched(same, 0.0)
    assert watched(same, 2.0)
    watched.watch.begin()
    assert watched.watch.remark == '' and watched(same, 2.1) == ''
