# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The moment of the right view, against a membrane under a point load (Fourier series) that two pinhole cameras see at different times."""
import numpy as np
import pytest
from tactile_driver.stitching.calibration import SideView, Stitching
from tactile_perception.press.seam import SeamBalance
from tactile_perception.press.sensor import MarkerSensor

SENSOR = MarkerSensor('areal_dual', 11, 14, (0.0094, 0.0082), (0.133, 0.091))
SIZE, SCALE, ORIGIN = np.array(SENSOR.size), 5000.0, np.array([332.0, 227.0])
EYES = np.array([[-0.029, 0.0, -0.046], [0.029, 0.0, -0.046]])


def view(eye):
    return SideView((480, 640), np.eye(3), np.zeros(5), np.eye(3), eye)


STITCHING = Stitching(view(EYES[0]), view(EYES[1]), (665, 455), SCALE, ORIGIN, 332.5, (400.0, 80.0))
RIGHT = SENSOR.grid()[:, 0] > 0.0


def depth(place, tip):
    """(K,) depth at places (K, 2) of a clamped membrane under a load at tip, spread over 6 mm, scaled to 1 at the tip."""
    m, n = (x.ravel()[:, None] for x in np.meshgrid(np.arange(1, 60), np.arange(1, 60)))
    kx, ky = np.pi * m / SIZE[0], np.pi * n / SIZE[1]
    wave = lambda at: np.sin(kx * (at[:, 0] + SIZE[0] / 2)) * np.sin(ky * (at[:, 1] + SIZE[1] / 2))  # noqa: E731
    load = wave(np.array([tip])) * np.exp(-0.5 * (kx**2 + ky**2) * 0.003**2) / (kx**2 + ky**2)
    return (load * wave(place)).sum(axis=0) / (load * wave(np.array([tip]))).sum()


def seen(deep, noise):
    """Image positions (K, 2), px, of the markers at these depths (K,), m, each from its camera."""
    rest, eye = SENSOR.grid(), EYES[RIGHT.astype(int)]
    apparent = eye[:, :2] + (rest - eye[:, :2]) * (-eye[:, 2] / (-eye[:, 2] - deep))[:, None]
    return apparent * SCALE + ORIGIN + noise.normal(0, 0.03, rest.shape)


def told(tip, left, right, before, seed=0):
    """Ratio and its sigma for tips at these depths, m, at the left, the right and the earlier right exposure."""
    shape, noise = depth(SENSOR.grid(), tip), np.random.default_rng(seed)
    now = seen(np.where(RIGHT, right, left) * shape, noise)
    move = np.where(RIGHT[:, None], now - seen(before * shape, noise), 0.0)
    return SeamBalance(STITCHING, SENSOR).ratio(now, now - (SENSOR.grid() * SCALE + ORIGIN), move)


@pytest.mark.parametrize('tip', [(-0.034, 0.01), (0.003, -0.006), (0.037, 0.012)])
@pytest.mark.parametrize('left, right, before', [(0.001, 0.0018, 0.0), (0.003, 0.003, 0.0015), (0.0, 0.001, 0.0), (0.0005, 0.001, 0.003),
                                                 (0.0025, 0.0015, 0.0), (0.0, 0.0, 0.002)])
def test_the_moment_of_a_press_that_begins_goes_on_or_ends(tip, left, right, before):
    ratio, sigma = told(tip, left, right, before)
    assert ratio == pytest.approx((left - right) / (right - before), abs=0.2) and sigma < 1.0


def test_the_stated_error_is_honest():
    errors = []
    for seed in range(40):
        rng = np.random.default_rng(100 + seed)
        left, right, before = rng.uniform(0, 0.004, 3)
        ratio, sigma = told(rng.uniform(-0.6, 0.6, 2) * SIZE / 2, left, right, before, seed)
        errors.append((ratio - (left - right) / (right - before)) / sigma)
    assert np.percentile(np.abs(errors), 95) < 2.0


def test_without_motion_nothing_is_told():
    now = seen(np.zeros(len(RIGHT)), np.random.default_rng(0))
    ratio, sigma = SeamBalance(STITCHING, SENSOR).ratio(now, now - now, now - now)
    assert np.isnan(ratio) and np.isinf(sigma)


def test_markers_that_are_not_seen_are_done_without():
    shape, noise = depth(SENSOR.grid(), (0.03, 0.0)), np.random.default_rng(1)
    now, before = seen(np.where(RIGHT, 0.002, 0.001) * shape, noise), seen(0.0 * shape, noise)
    duv, move = now - (SENSOR.grid() * SCALE + ORIGIN), np.where(RIGHT[:, None], now - before, 0.0)
    now[[5, 20, 70]] = duv[[5, 20, 70]] = np.nan
    ratio, _ = SeamBalance(STITCHING, SENSOR).ratio(now, duv, move)
    assert ratio == pytest.approx(-0.5, abs=0.15)
