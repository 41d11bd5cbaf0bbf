# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The untouched sensor: how long it stays so, and how it becomes the reference."""
from dataclasses import replace

import numpy as np
import pytest
import rig
from rig import contacts, duv, untouched, uv

from tactile_driver.simulation.optics.light import Lighting
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_driver.simulation.sensors.touchpad import touchpad
from tactile_perception.core.errors import BadFrame

# m, largest errors of position and depth. The dome's depth is 9 % of 34 mm off
LARGEST = {'areal_single': (1e-3, 4e-4), 'areal_dual': (1.5e-3, 2e-4), 'air_cushion': (3e-3, 4e-3)}


def check_right(results, of, position, depth):
    found, = contacts(results)
    assert np.hypot(*(found.position - of.truth[0].position)[:2]) < position
    assert found.depth == pytest.approx(of.truth[0].depth, abs=depth)


@pytest.fixture(params=rig.SHEETS)
def sheet(request):
    return rig.seen(request.param)


def test_a_pressed_reference_of_a_pad_is_usable_until_the_next_one(pad):
    chain = pad.chain()
    dots = chain(pad.pressed)['dots']
    assert len(dots.id) > 515 and np.abs(duv(dots)).max() == 0
    with pytest.raises(BadFrame, match='no dot has a 3D position') as refused:
        chain(pad.rest[0])
    dots, = refused.value.partial['dots']
    assert np.nanmax(np.abs(duv(dots))) > 3
    off = uv(dots) - pad.untouched.dot_uv[np.array(dots.id)]
    assert np.linalg.norm(off, axis=1).max() < 1.5


def test_the_reference_stands_still_while_something_touches(pad):
    """A touch of two minutes is as deep at its end as at its beginning."""
    chain = pad.chain().begun()
    first, = contacts(chain(pad.pressed))
    assert first.depth == pytest.approx(pad.truth[0].depth, abs=3e-4) and first.force == pytest.approx(pad.truth[0].force, rel=0.15)
    for _ in range(12):
        chain.stamp_ns += 100 * rig.STEP_NS
        last, = contacts(chain(pad.pressed))
    assert abs(last.depth - first.depth) < 0.1e-3
    assert untouched(chain(pad.rest[3]))


def test_a_press_on_a_sheet_that_is_there_from_the_start_is_reported_and_ends(sheet):
    """Against the calibrated untouched positions; afterwards against those that are seen."""
    chain = sheet.chain()
    for _ in range(3):
        check_right(chain(sheet.pressed), sheet, *LARGEST[sheet.sensor])
    for image in sheet.rest:
        assert untouched(chain(image))
    check_right(chain(sheet.pressed), sheet, *LARGEST[sheet.sensor])


def test_a_reference_that_is_wrong_and_cannot_be_mended_reports_nothing(sheet):
    """The camera has moved by half a pitch, and something presses from the start; all is well once it does not."""
    pressed, rest, chain = np.roll(sheet.pressed, 15, axis=1), np.roll(sheet.rest[0], 15, axis=1), sheet.chain()
    for _ in range(3):
        with pytest.raises(BadFrame, match='calibrate'):
            chain(pressed)
    assert untouched(chain(rest))
    chain(pressed)  # of two cameras, the first frame of a touch may be withheld
    assert len(contacts(chain(pressed))) == 1


def hidden(dots, keep):
    """The message of dots with only those of which keep (N,) is true."""
    for name in ('id', 'u', 'v', 'du', 'dv', 'area', 'x', 'y', 'z'):
        values = np.array(getattr(dots, name))
        if len(values) == len(keep):
            setattr(dots, name, values[keep].tolist())
    return dots


@pytest.mark.parametrize('share, most', [(0.0, 0), (0.02, 0), (0.5, 1)])
def test_markers_hidden_here_and_there(sheet, share, most):
    chain = sheet.chain().begun()
    dots = chain.dots(sheet.pressed)
    keep = np.random.default_rng(1).random(400)[np.array(dots.id)] < share
    results = chain.contact(hidden(dots, keep))
    assert len(contacts(results)) == most
    if most:
        most = {'areal_single': (1.5e-3, 6e-4), 'areal_dual': (3e-3, 4e-4), 'air_cushion': (9e-3, 4e-3)}
        check_right(results, sheet, *most[sheet.sensor])


def test_a_glaring_spot_over_the_touch_makes_up_nothing_far_away():
    of = rig.seen('areal_single')
    chain, image = of.chain().begun(), of.pressed.copy()
    image[180:220, 350:420] = 255
    for contact in contacts(chain(image)):
        assert np.hypot(*(contact.position - of.truth[0].position)[:2]) < 3e-3


def test_starts_of_two_cameras_with_one_late():
    """No reference is taken before both views are there; then touches are found."""
    scene, stitch = rig.open_dual_scene('areal_dual_demo', 3.0), rig.stitcher()
    pictures = []
    for k in range(24):
        left, right, truth = scene.render(k / 3)
        pictures.append((stitch(left, right), stitch(left, None), stitch(None, right), bool(truth.contacts)))
    of, rng = rig.seen('areal_dual'), np.random.default_rng(7)
    pressed = wrong = 0
    for _ in range(20):
        chain, first, late, side = of.chain(), rng.integers(24), rng.integers(1, 5), rng.integers(1, 3)
        for k in range(late):
            with pytest.raises(BadFrame, match='one of the two views is black'):
                chain(pictures[(first + k) % 24][side])
        for k in range(late, late + 4):
            whole, *_, touched = pictures[(first + k) % 24]
            wrong += bool(contacts(chain(whole))) != touched
            pressed += touched
    assert pressed > 10 and wrong <= 2
    chain = of.chain()
    assert untouched(chain(pictures[0][0])) and untouched(chain(pictures[1][1])), 'one view alone, later'


MANY = pytest.mark.slow, pytest.mark.timeout(1200)


def noisy_frames(of, count, level):
    """Untouched frames with noise of so many grey levels beyond the camera's own."""
    rng = np.random.default_rng(6)
    fields = rng.standard_normal((4, *of.rest[0].shape), np.float32)
    for _ in range(count):
        one, other = rng.choice(len(fields), 2, replace=False)
        noise = (fields[one] + np.roll(fields[other], tuple(rng.integers(0, 400, 2)), (0, 1))) * np.float32(level / np.sqrt(2))
        yield np.clip(np.rint(of.rest[rng.integers(0, len(of.rest))] + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('level, count', [(1, 20), (4, 20), pytest.param(3, 1000, marks=MANY)])
@pytest.mark.parametrize('sensor', rig.SENSORS[:4])
def test_no_contact_in_noisy_images(sensor, level, count):
    of = rig.seen(sensor)
    chain = of.chain()
    assert all(untouched(chain(image)) for image in noisy_frames(of, count, level))


def test_no_contact_under_noise_of_a_taxel_array():
    of, rng = rig.seen('taxel_array'), np.random.default_rng(3)
    chain = of.chain()
    for _ in range(300):
        values = of.rest[0] + rng.normal(0, 1.0, of.rest[0].shape)
        assert untouched(chain(np.clip(np.rint(values), 0, 255).astype(np.uint8)))


def false_with_glare(count, seed, lighting=None):
    """Of `count` untouched frames of another specimen with glare, lamps in the window and a drifting gain, those with anything found;
    lighting: another than the scene's."""
    scene = open_scene('glare_rest', rate=30.0, seed=seed)
    if lighting is not None:
        scene._renderer = touchpad(seed, 640, lighting, replace(scene._renderer.imaging, drift_period=40)).renderers[0]
    chain = rig.camera('touchpad', scene=scene, at=0.5).chain()
    return sum(not untouched(chain(scene.render(k / 30).image, rig.FIRST_NS + round(k / 30 * 1e9))) for k in range(count))


WHITE = {'gloss': 700.0, 'gloss_width': 0.01, 'sheen_width': 0.041, 'sheen_water': 0.0}


@pytest.mark.parametrize('seed, count, light', [(11, 40, None), (1, 30, {**WHITE, 'sheen': 0.16}), (3, 30, {**WHITE, 'sheen': 0.2}),
                                                *(pytest.param(seed, 1000, None, marks=MANY) for seed in range(21, 26))])
def test_no_contact_with_glare_white_highlights_and_drift(seed, count, light):
    assert false_with_glare(count, seed, light and Lighting(**light)) == 0
