# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The fit of presses on a dome, against presses that are known."""
import numpy as np
import pytest
from scipy.optimize import least_squares
from tactile_perception import _core

CURVATURE, HEIGHT = 0.15, 0.11
NUMBERS = np.array([CURVATURE, HEIGHT - CURVATURE, np.tan(np.arctan2(np.sqrt(HEIGHT * (2 * CURVATURE - HEIGHT)), CURVATURE - HEIGHT) / 2),
                    0.3, 0.04, 1.5, 0.02, 0.8])  # the last: reach of the mesh's shift, deepest, grading, middle radius, its spread
LEVELS, ORDER, RADII, RINGS, WAVES, EVEN, ODD = 5, 4, 3, 12, 3, 4, 3


def library(seed=0):
    """A library of smooth, made-up presses that fall off towards the rim, and grow with depth."""
    rng = np.random.default_rng(seed)
    edges = np.linspace(0, 1, RINGS + 1)
    fall = (np.cos(np.pi * edges) + 1)[:, None, None] / 2
    level = np.arange(LEVELS + 3)[:, None, None, None, None]
    smaller = 0.3 ** (np.arange(ORDER)[:, None, None] + np.arange(RADII)[:, None])
    even = rng.normal(0, 1, (1, 6, ORDER, RADII, EVEN)) * smaller * level * 1e-3
    even[:, [1, 2, 3, 5]] *= 0.2
    odd = rng.normal(0, 1, (1, 2, ORDER, RADII, ODD)) * smaller * level * 1e-3
    odd[:, 1] *= 0.2
    modes = [rng.normal(0, 1, (count, RINGS + 1, 3, WAVES)) * fall for count in (EVEN, ODD)]
    for of_modes, sine_axes in zip(modes, ([1], [0, 2])):
        of_modes[:, 0, :, 1:] = 0.0
        of_modes[:, :, sine_axes, 0] = 0.0
    tables = {'even_table': even, 'odd_table': odd, 'even_modes': modes[0], 'odd_modes': modes[1]}
    return {'numbers': NUMBERS, 'edges': edges} | {name: table.astype(np.float32) for name, table in tables.items()}


def markers(count=60, seed=1):
    """(K, 3) m: points on the dome, one of them unknown."""
    rng = np.random.default_rng(seed)
    across, turn = 0.1 * np.sqrt(rng.uniform(0, 1, count)), rng.uniform(0, 2 * np.pi, count)
    points = np.column_stack([across * np.cos(turn), across * np.sin(turn), HEIGHT - CURVATURE + np.sqrt(CURVATURE**2 - across**2)])
    points[count // 2] = np.nan
    return points


def pressed(arrays, points, press):
    """(K, 3) m: displacements under one press; test_library.py compares them with the simulated ones."""
    return _core.press_dome(**arrays, points=points, eyes=np.zeros_like(points), presses=np.array([press]))


PRESSES = np.array([[0.03, 0.02, np.log(0.02), 0.4, -0.5, 0.2, -0.3], [-0.04, 0.01, np.log(0.008), -0.7, 0.6, 0.0, 0.1],
                    [0.0, 0.0, np.log(0.03), 0.0, 0.0, 0.3, 0.0]])


def seen_at(places, eye):
    """(K, 2) m, in the plane through the top."""
    return eye[:2] + (places - eye)[:, :2] * ((HEIGHT - eye[2]) / (places - eye)[:, 2])[:, None]


PRIOR = np.array([np.zeros(7), [1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6], [-0.09, -0.09, np.log(1e-5), -1, -1, -2, -2],
                  [0.09, 0.09, np.log(0.04), 1, 1, 2, 2], [0.01, 0.01, 0.5, 0.5, 0.5, 0.3, 0.3]])


ALONE = np.zeros((0, 150))  # no error that markers share


def test_an_error_that_markers_share_is_counted_in_fit_and_covariance():
    """A common shift along x and y, of a standard deviation far above the noise."""
    arrays, points, eye = library(), markers(150), np.array([0.001, -0.002, -0.04])
    press, sigma, common, rng, errors = PRESSES[0], 2e-6, 1e-4, np.random.default_rng(0), []
    true = seen_at(points + pressed(arrays, points, press), eye) - seen_at(points, eye)
    weight = np.where(np.isfinite(true).all(1), sigma**-2, 0.0)
    shared = weight[None] / np.sqrt(weight.sum() + common**-2)  # Woodbury
    for _ in range(40):
        shift = np.nan_to_num(true) + rng.normal(0, sigma, true.shape) + rng.normal(0, common, 2)
        found, covariance, left, squares = _core.fit_dome(
            **arrays, points=points, eyes=np.tile(eye, (len(points), 1)), plane_z=HEIGHT, shift=shift, weight=weight, shared=shared,
            starts=press[None] + [[2e-3, -2e-3, 0.1, 0.1, 0.1, 0.05, 0.05]], prior=PRIOR)
        assert np.isclose(squares, np.sum(weight[:, None] * left**2) - np.sum((shared @ left)**2), rtol=1e-6)
        off = found[0] - press
        errors.append(off @ np.linalg.solve(covariance, off) / 7)
    assert np.isclose(np.mean(errors), 1.0, atol=0.4)


@pytest.mark.parametrize('number, bound', [(4, 0.2), (3, 0.1), (5, 0.1)])
def test_a_number_that_may_go_no_farther_leaves_the_others_at_their_best(number, bound):
    arrays, points, eye = library(), markers(150), np.array([0.001, -0.002, -0.04])
    press = np.abs(PRESSES[0]) * [1, 1, -1, 1, 1, 1, 1]
    shift = np.nan_to_num(seen_at(points + pressed(arrays, points, press), eye) - seen_at(points, eye))
    prior, weight = PRIOR.copy(), np.where(np.isfinite(points).all(1), 1e12, 0.0)
    prior[3, number] = bound
    start = np.minimum(press + [2e-3, -2e-3, 0.1, 0.1, 0.1, 0.05, 0.05], prior[3])
    found = _core.fit_dome(**arrays, points=points, eyes=np.tile(eye, (len(points), 1)), plane_z=HEIGHT, shift=shift, weight=weight,
                           shared=ALONE, starts=start[None], prior=prior)

    def left(numbers):
        seen = np.nan_to_num(seen_at(points + pressed(arrays, points, numbers), eye) - seen_at(points, eye))
        return ((shift - seen) * np.sqrt(weight)[:, None]).ravel()
    best = least_squares(left, start - 1e-6, bounds=(prior[2], prior[3]), x_scale=prior[4], diff_step=1e-3)
    assert found[0][0, number] == pytest.approx(bound, abs=1e-9)
    assert found[3] <= 2 * best.cost * 1.01


def test_what_no_marker_shows_has_no_covariance_of_its_own():
    arrays, points = library(), markers()
    prior = PRIOR.copy()
    prior[1] = 0.0
    unseen = _core.fit_dome(**arrays, points=points, eyes=np.zeros_like(points), plane_z=HEIGHT, shift=np.zeros((len(points), 2)),
                            weight=np.zeros(len(points)), shared=np.zeros((0, len(points))), starts=PRESSES[:1], prior=prior)
    assert np.array_equal(unseen[0], PRESSES[:1]) and np.isnan(unseen[1]).all() and unseen[3] == 0
