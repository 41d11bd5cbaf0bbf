# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Unusual but usable images: grey, small, noisy, blurred, under changing light."""
import cv2
import numpy as np
import pytest
from tactile_perception.errors import BadFrame


def grey(image):
    return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


def noisy(image, level, seed=0):
    return np.clip(np.rint(image + np.random.default_rng(seed).normal(0, level, image.shape)), 0, 255).astype(np.uint8)


def test_grey_images_give_dots_without_places_and_no_contact_is_made_up(pad):
    """Without the water's colour nothing measures how far a dot is, so whether something touches is not known."""
    chain = pad.chain()
    for image, uv in ((pad.rest[0], None), (pad.pressed, pad.truth.dot_uv)):
        chain.stamp += 0.1
        tracks = chain.dots.process(grey(image), chain.stamp)
        assert len(tracks) > 500 and np.isnan(tracks.xyz).all()
        with pytest.raises(BadFrame, match='colour'):
            chain.contact.process(tracks, chain.stamp)
    assert np.median(np.linalg.norm(tracks.uv - uv[tracks.id], axis=1)) < 0.2


def test_small_images_work_as_large_ones(small_pad):
    chain = small_pad.chain().begun(small_pad)
    tracks, result = chain(small_pad.pressed)
    truth = small_pad.truth
    known = np.isfinite(tracks.xyz).all(axis=1)
    off = np.linalg.norm(tracks.xyz[known] - truth.dot_xyz[tracks.id[known]], axis=1)
    assert len(tracks) > 500 and np.sqrt(np.mean(off**2)) < 0.12e-3
    assert len(result.contacts) == 1
    assert result.contacts[0].depth == pytest.approx(truth.contacts[0].depth, abs=0.3e-3)
    there = set(np.flatnonzero(truth.dot_state))
    found = set(result.region.dot_id[result.region.dot_state > 0])
    assert 2 * len(there & found) / (len(there) + len(found)) > 0.85


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
    (change, allowed, least), chain, truth = CHANGES[name], pad.chain(), pad.truth
    for image in pad.rest[:3]:
        _, result = chain(change(image))
        assert not result.contacts
    tracks, result = chain(change(pad.pressed))
    assert len(tracks) > 450
    assert max(c.depth for c in result.contacts) == pytest.approx(truth.contacts[0].depth, abs=allowed)
    there = set(np.flatnonzero(truth.dot_state)) & set(tracks.id)
    found = set(result.region.dot_id[result.region.dot_state > 0])
    assert 2 * len(there & found) / (len(there) + len(found)) > least


def test_the_light_goes_down_slowly_and_nothing_touches(pad):
    chain = pad.chain().begun(pad)
    for k in range(30):
        image = np.clip(pad.rest[k % 6] * (1 - 0.01 * k), 0, 255).astype(np.uint8)
        _, result = chain(image)
        assert not result.contacts and result.region.area == 0
