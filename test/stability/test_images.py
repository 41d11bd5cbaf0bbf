# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Unusual but usable images: grey, small, noisy, blurred, under changing light."""
import cv2
import numpy as np
import pytest
from rig import contacts, untouched, uv
from tactile_perception.errors import BadFrame


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
