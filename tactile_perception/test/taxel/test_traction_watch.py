# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from scipy import ndimage
from taxel_pictures import ARRAY, bar, picture
from tactile_perception.taxel.pressure import SoftPad
from tactile_perception.taxel.motion import MotionTracker, SeenPressure, TractionWatch, is_curved

PAD = SoftPad()
LEVEL, NOISE = 4e4, 200.0


def sphere(x0=0.0, y0=0.0, radius=7.0):
    """Pressure under a sphere, as a part of the largest; mm."""
    return lambda x, y: np.maximum(1 - ((x - x0)**2 + (y - y0)**2) / radius**2, 0)


def seen(rng, x, traction, face=bar):
    """Pressure of a face at x (mm), with the pressure that traction along x causes: more before it, less behind.

    traction: over pressure, the same everywhere under a bar; under a sphere the same stress everywhere, up to friction times pressure.
    """
    image = picture(face(x, 0.0), LEVEL)
    pull = traction * image if face is bar else np.minimum(0.5 * traction * LEVEL, 0.6 * image)
    slope = np.gradient(pull.astype(float), axis=1)
    caused = -2.0 * (0.47 * ndimage.gaussian_filter(slope, 1.24) + 0.53 * ndimage.gaussian_filter(slope, 3.7))
    return (image + caused + rng.normal(0, NOISE, image.shape)).astype(np.float32)


def followed(tractions, rested=12, direction=(1.0, 0.0), face=bar):
    """(slides, rolls, sticks) of each frame of a face that moves by 0.04 mm a frame with tractions."""
    rng, watch = np.random.default_rng(0), TractionWatch(ARRAY, PAD, MotionTracker(ARRAY, PAD).shear)
    for k in range(rested):
        watch.rest(seen(rng, 0.0, 0.0, face), True, 0.01 * k)
        watch.release()
    touched = picture(face(), LEVEL) > 0.2 * LEVEL
    return [watch.follow(SeenPressure(seen(rng, 0.04 * (k + 1), traction, face), NOISE), touched, np.array(direction),
                         0.01 * (rested + k)) for k, traction in enumerate(tractions)]


def watched(*args, **more):
    """Frame in which a bar is reported to slide; None where in none."""
    return next((k for k, state in enumerate(followed(*args, **more)) if state[0]), None)


def rolling(*args, **more):
    """Whether a sphere is reported to roll, by frame."""
    return [state[1] for state in followed(*args, face=sphere, **more)]


def test_traction_that_falls_while_the_object_moves_on_is_slip():
    assert watched([0.04, 0.09, 0.13, 0.13, 0.06, 0.05, 0.05]) in (4, 5)


def test_traction_that_grows_is_none():
    assert watched(np.linspace(0.03, 0.4, 10)) is None


def test_nothing_is_reported_without_a_direction():
    assert watched([0.04, 0.09, 0.13, 0.13, 0.06, 0.05, 0.05], direction=(0.0, 0.0)) is None


def test_a_sphere_that_moves_without_traction_rolls_and_one_that_pulls_does_not():
    assert all(rolling(np.zeros(20)))
    assert not any(rolling(np.linspace(0.02, 0.4, 20))[4:])


def test_a_sphere_that_slides_after_it_rolled_is_reported_by_its_traction():
    found = rolling([0.0] * 14 + [0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.35])
    assert all(found[:14]) and not any(found[-3:])


def test_a_small_traction_that_stays_is_friction_and_less_is_what_a_layer_shows_that_lags():
    assert not any(rolling([0.03, 0.06, *[0.1] * 30])[4:])
    assert all(rolling([0.01, *[0.015] * 14])[4:])


def test_a_traction_that_falls_slowly_is_reported_beyond_the_way_for_which_a_picture_holds():
    grows = [*np.linspace(0.05, 0.25, 6), *np.linspace(0.25, 0.35, 10)]
    assert 16 < watched([*grows, *np.linspace(0.35, 0.2, 14)], face=sphere) < 30
    assert watched([*grows, *np.linspace(0.35, 0.6, 14)], face=sphere) is None


def test_a_traction_that_grows_on_after_all_is_of_an_object_that_sticks():
    found = followed([0.04, 0.09, 0.13, 0.13, 0.06, 0.05, 0.05, 0.05, 0.05, *np.linspace(0.1, 0.35, 6)])
    assert any(state[0] for state in found[:9]) and not any(state[2] for state in found[:9])
    assert any(state[2] for state in found[9:])


def test_a_sphere_that_never_rested_and_a_bar_are_not_reported_to_roll():
    assert not any(rolling(np.zeros(10), rested=0))
    assert not any(state[1] for state in followed(np.zeros(10)))


def test_a_cylinder_is_curved_across_its_axis_only():
    image = picture(lambda x, y: np.maximum(1 - x**2 / 36, 0) * (np.abs(y) < 8))
    touched = image > 0.2 * image.max()
    assert is_curved(image, touched, np.array([1.0, 0.0])) and not is_curved(image, touched, np.array([0.0, 1.0]))
    assert not is_curved(0 * image, touched, np.array([1.0, 0.0]))


def test_a_line_of_taxels_tells_nothing():
    found = TractionWatch(ARRAY, PAD, MotionTracker(ARRAY, PAD).shear).follow(
        SeenPressure(np.ones((1, 40), np.float32), NOISE), np.ones((1, 40), bool), np.ones(2), 0.0)
    assert found == (False, False, False)
