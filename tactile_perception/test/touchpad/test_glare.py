# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Glare on a known pad is found, its colour and size are learnt, and its share tells from the shape and the brightness; a pad without has
none. The lobes, their colours and the gain here are numbers of the tests alone."""
import numpy as np
import pytest
from tactile_perception.touchpad.water import GlaringPad, learn_glare, no_glare, smooth_light, LightPath

SIDE = 40
PATH = LightPath(-0.005, -0.038, 0.018, 0.2, (0.0, 0.0, -0.04))


def rays_of(side=SIDE):
    """Unit rays (N, 3) over an image."""
    y, x = np.meshgrid(*[np.linspace(-0.35, 0.35, side)] * 2, indexing='ij')
    out = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def scattered(rays):
    """Smooth ln(light) with fall-off to the corners and a slope."""
    x, y = (rays[:, :2] / rays[:, 2:]).T
    return 5.2 - 0.9 * (x * x + y * y) + 0.1 * x - 1.5 * (x * x + y * y)**2


def lobe(rays, at=0.17, width=0.04, peak=0.14):
    """Share of glare (N,): a ring."""
    x, y = (rays[:, :2] / rays[:, 2:]).T
    return peak * np.exp(-(np.hypot(x, y) - at)**2 / (2 * width**2))


def dyed_at(rays):
    """What water of two absorptions takes from log ratios (N, 2), on paths that grow to a side of the image."""
    return (0.025 + 0.02 * rays[:, :1]) * [60.0, 45.0]


@pytest.mark.parametrize('peak', [0.05, 0.14, 0.4])
def test_smooth_light_is_found_below_glare(peak):
    rays = rays_of()
    share = lobe(rays, peak=peak)
    light = scattered(rays) + np.random.default_rng(0).normal(0, 0.003, len(rays))
    _, excess, bright = smooth_light(rays, light + np.log1p(share))
    assert np.abs(excess - np.log1p(share)).mean() < 0.005
    assert bright[share > 0.03].mean() > 0.95 and bright[share < 1e-4].mean() < 0.02


def test_unknown_brightness_is_left_out():
    rays, light = rays_of(), scattered(rays_of())
    light[::7] = np.nan
    assert np.nanmax(np.abs(smooth_light(rays, light)[1])) < 1e-6
    assert not smooth_light(rays, light)[2][::7].any()


@pytest.mark.parametrize('colour', [(0.5, 0.6), (4.0, 3.0)])
def test_colour_and_size_are_learnt_from_the_untouched_pad(colour):
    rays, rng = rays_of(), np.random.default_rng(1)
    share = lobe(rays)
    tinted = np.log((1 + share[:, None] * colour) / (1 + share)[:, None]) + rng.normal(0, 0.003, (len(rays), 2))
    glare = learn_glare(rays, scattered(rays) + np.log1p(share) + rng.normal(0, 0.003, len(rays)), tinted, dyed_at(rays), 0.01)
    assert not glare.dry and glare.colour == pytest.approx(colour, rel=0.1)
    assert 0.5 * 0.14 < glare.size < 0.14


def test_white_glare_that_does_not_pass_the_water_is_known_by_its_colour_and_stands_out_more_on_long_paths():
    rays, rng = rays_of(), np.random.default_rng(1)
    share, dyed, white = lobe(rays), dyed_at(rays), np.array([1.5, 1.3])
    colour = white * np.exp(dyed)
    tinted = np.log((1 + share[:, None] * colour) / (1 + share)[:, None]) + rng.normal(0, 0.003, (len(rays), 2))
    glare = learn_glare(rays, scattered(rays) + np.log1p(share) + rng.normal(0, 0.003, len(rays)), tinted, dyed, 0.01)
    assert glare.dry and glare.colour == pytest.approx(white, rel=0.1)
    side = 21
    few = rays_of(side)
    pad = GlaringPad(glare, PATH, np.array([60.0, 45.0]), side, side)
    rest = np.array(PATH.centre) + 0.05 * few / few[:, 2:]
    pad.set_rest(rest, np.tile([0.0, 0.0, 1.0], (side * side, 1)))
    far, near = (pad.seen(scattered(few), few, np.arange(side * side), places).colour for places in (rest, rest - [0, 0, 2e-3]))
    change = np.log(far / near)[side * side // 2]
    assert change[0] == pytest.approx(60 / 45 * change[1]) and 0.2 < change[0] < 0.3


def test_a_pad_without_glare_has_none():
    rays, rng = rays_of(), np.random.default_rng(2)
    light = scattered(rays) + rng.normal(0, 0.003, len(rays))
    assert learn_glare(rays, light, rng.normal(0, 0.003, (len(rays), 2)), dyed_at(rays), 0.01) is None


def test_glare_of_unknown_dots_is_unknown():
    seen = no_glare(3)
    assert np.isnan(seen.excess).all() and np.isnan(seen.sigma).all() and len(seen.excess) == 3


@pytest.mark.parametrize('gain', [0.9, 1.0, 1.06])
def test_excess_is_the_glare_of_a_dented_skin_whatever_the_gain(gain):
    side, height = 21, 0.05
    rays, up = rays_of(side), np.tile([0.0, 0.0, 1.0], (side * side, 1))
    rest = np.array(PATH.centre) + height * rays / rays[:, 2:]
    share = lobe(rest - np.array(PATH.centre))
    brightness = scattered(rays) + np.log(PATH.irradiance(rest, up))
    tinted = np.log((1 + share[:, None] * 0.5) / (1 + share)[:, None]) * np.ones(2)
    glare = learn_glare(rays, scattered(rays) + np.log1p(share), tinted, dyed_at(rays), 0.01)
    pad = GlaringPad(glare, PATH, np.zeros(2), side, side)
    pad.set_rest(rest, up)
    dented = rest - [0, 0, 1e-3] * np.exp(-(rest[:, :2]**2).sum(1, keepdims=True) / (2 * 0.004**2))
    moved = dented - np.array(PATH.centre)
    moved /= np.linalg.norm(moved, axis=1, keepdims=True)
    slope = (dented - rest)[:, 2:] * -rest[:, :2] / 0.004**2
    normals = np.concatenate([-slope, np.ones((len(slope), 1))], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    other = lobe(rays, at=0.28)
    brightness = scattered(moved) + np.log(PATH.irradiance(dented, normals)) + np.log1p(other) + np.log(gain)
    seen = pad.seen(brightness, moved, np.arange(side * side), dented)
    inner = np.zeros((side, side), bool)
    inner[1:-1, 1:-1] = True
    off = (seen.excess - np.log1p(other))[inner.ravel()]
    assert np.sqrt(np.mean(off**2)) < 0.01
    assert (seen.sigma > 0).all()
