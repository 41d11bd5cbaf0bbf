# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The compiled part: it takes any array, can be copied, is as it was after an exception, and agrees with SciPy and plain sweeps."""
import copy

import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from scipy import ndimage
from tactile_perception._core import taxel

PRESSURE = np.pad(np.full((9, 12), 3e4, np.float32), 6)
TOUCHED = PRESSURE > 1e4
RULE = {'smooth': 1.0, 'reach': 2, 'least': 100.0, 'share': 0.6, 'ramp': 0.33}
KEY = taxel.Keyframe(PRESSURE, scale=1 / 3e4, steep=0.08, rim=1, most=250)


def shear(shape=PRESSURE.shape):
    return taxel.SurfaceShear(rows=shape[0], columns=shape[1], pitch=1e-3, thickness=2.0, stiffness=5e7)


def path():
    return taxel.Path(window=0.2, reported=0.06, fewest=4, latest=3, least_noise=1e-5, bound=2.5)


def fit_of(key, pressure=PRESSURE, guess=np.zeros(4)):
    found = key.motion(pressure, scale=1 / 3e4, turns=True, guess=guess)
    return found.fit, np.array([found.spread, found.inliers])


#: How a function or class is called here, and an example of each of its arrays.
CALLS = {
    'contact_score': (lambda pressure=PRESSURE, full=TOUCHED: [taxel.contact_score(pressure, full, **RULE)],
                      {'pressure': PRESSURE, 'full': TOUCHED}),
    'outlines': (lambda score=PRESSURE, labels=TOUCHED.astype(np.int32): [taxel.outlines(score, labels, level=1e4, pitch=1e-3).points],
                 {'score': PRESSURE, 'labels': TOUCHED.astype(np.int32)}),
    'hide': (lambda shown=PRESSURE, held=PRESSURE / 2: taxel.hide(shown, held, share=0.5, reach=5.0, relative=0.1),
             {'shown': PRESSURE, 'held': PRESSURE / 2}),
    'add': (lambda pose=np.zeros(3), arm=np.ones(2): [path().add(1.0, pose, arm, 1.0).pose], {'pose': np.zeros(3), 'arm': np.ones(2)}),
    'Keyframe': (lambda pressure=PRESSURE: [taxel.Keyframe(pressure, scale=1 / 3e4, steep=0.08, rim=1, most=250).normal],
                 {'pressure': PRESSURE}),
    'motion': (lambda pressure=PRESSURE, guess=np.zeros(4): fit_of(KEY, pressure, guess), {'pressure': PRESSURE, 'guess': np.zeros(4)}),
    'move': (lambda touched=TOUCHED, pressure=PRESSURE, shift=np.array([1e-4, 0, 0.01]): [
        shear().move(touched, pressure, shift, 0.6)], {'touched': TOUCHED, 'pressure': PRESSURE, 'shift': np.array([1e-4, 0, 0.01])}),
    'pressure_of': (lambda traction=np.stack([PRESSURE, -PRESSURE]): [shear().pressure_of(traction)],
                    {'traction': np.stack([PRESSURE, -PRESSURE])}),
}


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays])
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)


def test_a_copy_goes_on_by_itself_and_an_exception_changes_nothing():
    first, motion = shear(), np.array([1e-4, 0.0, 0.0])
    first.move(TOUCHED, PRESSURE, motion, 0.6)
    force, other = first.force, copy.deepcopy(first)
    other.move(TOUCHED, PRESSURE, motion, 0.6)
    with pytest.raises(ValueError, match='friction'):
        first.move(TOUCHED, PRESSURE, motion, np.nan)
    assert (first.force == force).all() and other.force[0] > 1.5 * force[0]
    for one, again in zip(fit_of(KEY), fit_of(copy.copy(KEY))):
        np.testing.assert_array_equal(one, again)


@pytest.mark.parametrize('shift', [(5e-5, 0.0, 0.0), (3e-4, -2e-4, 0.0), (0.0, 1e-4, 0.05), (0.0, 0.0, 0.0)])
def test_traction_and_slip_are_those_of_many_plain_sweeps(shift):
    touched = np.zeros((20, 24), bool)
    touched[2:18, 2:22] = True  # the box of the contact with its margin is the whole array
    pressure = ndimage.gaussian_filter(3e4 * touched.astype(np.float32), 1.0)
    y, x = 1e-3 * (np.mgrid[:20, :24] - np.array([9.5, 11.5])[:, None, None])
    carried = np.array([shift[0] - shift[2] * y, shift[1] + shift[2] * x]) * touched
    limit = np.maximum(2.2 * pressure - 1.2 * ndimage.gaussian_filter(pressure, 1.0, mode='nearest', truncate=4.0), 0) * touched * 0.5 / 5e7
    found = carried.copy()
    for _ in range(300):
        wide = np.pad(found, ((0, 0), (1, 1), (1, 1)), mode='edge')
        others = 2 * (wide[:, :-2, 1:-1] + wide[:, 2:, 1:-1] + wide[:, 1:-1, :-2] + wide[:, 1:-1, 2:])
        pull = 9 * carried - others
        pull *= np.minimum(limit / (np.hypot(*pull) + 1e-12), 1)
        found = (pull + others) / 9
    state = shear((20, 24))
    slip = state.move(touched, pressure, np.array(shift), 0.5)
    for _ in range(8):  # it goes on where it stopped
        slip = slip + state.move(touched, pressure, np.zeros(3), 0.5)
    np.testing.assert_allclose(slip, (carried - found) * touched, atol=2e-6)
    assert state.force == pytest.approx(pull.sum(axis=(1, 2)) * 5e7 * 1e-6, abs=1e-2)


@pytest.mark.parametrize('motion', [(0.4, -0.3, 0.03, 0.0), (-1.2, 0.8, -0.05, 0.2), (0.0, 0.0, 0.0, 0.0)])
def test_a_motion_is_found(motion):
    def face(row=20.3, column=21.6, turn=0.2, grown=0.0):
        y, x = np.mgrid[:44, :44].astype(float)
        along = np.cos(turn) * (x - column) + np.sin(turn) * (y - row)
        across = np.cos(turn) * (y - row) - np.sin(turn) * (x - column)
        sides = [1 / (1 + np.exp(-2.5 * (half + grown - np.abs(part)))) for half, part in ((9, along), (5, across))]
        return np.float32(3e4) * (sides[0] * sides[1]).astype(np.float32)
    row, column, turn, grown = motion
    key = taxel.Keyframe(face(), scale=1 / 3e4, steep=0.08, rim=2, most=250)
    fit, (_, inliers) = fit_of(key, face(20.3 + row, 21.6 + column, 0.2 + turn, grown))
    about = key.middle - [21.6, 20.3]  # the face turns about its own middle
    assert fit[:2] == pytest.approx(np.array([column, row]) + turn * np.array([-about[1], about[0]]), abs=0.03)
    assert fit[2] / key.reach == pytest.approx(turn, abs=0.004)
    assert fit[3] == pytest.approx(grown, abs=0.05) and inliers > 0.9


def test_nothing_has_no_edges_and_a_guess_without_a_number_stays_one():
    assert taxel.Keyframe(np.zeros((44, 44), np.float32), scale=1.0, steep=0.08, rim=2, most=250).count == 0
    fit, (_, inliers) = fit_of(KEY, guess=np.full(4, np.nan))
    assert np.isnan(fit).any() and inliers == 0


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, -5.0])
def test_what_is_no_pressure_has_scores_of_0_to_1(value):
    image = PRESSURE.copy()
    image[8:11, 3:9] = value
    score = taxel.contact_score(image, np.zeros(image.shape, bool), **RULE)
    assert ((score >= 0) & (score <= 1)).all()
    assert not taxel.contact_score(np.full((9, 9), np.nan, np.float32), np.ones((9, 9), bool), **RULE).any()


def test_the_border_of_a_face_that_is_about_as_curved_as_flat_does_not_jump():
    y, x = np.mgrid[-12:13, -12:13]
    noise = np.random.default_rng(3).normal(0, 1500, y.shape)
    scores = []
    for bend in np.linspace(0, 200, 101):
        face = np.where((abs(x) < 9) & (abs(y) < 6), 3e4 + bend * x * y + noise, 0).astype(np.float32)
        scores.append(taxel.contact_score(face, np.zeros(face.shape, bool), **RULE | {'least': 1e3}))
    assert max(np.abs(b - a).max() for a, b in zip(scores[:-1], scores[1:])) < 0.05


@pytest.mark.parametrize('seed', range(10))
def test_the_velocity_is_that_of_the_longest_line_within_the_bounds_of_all_shorter_ones(seed):
    rng, line = np.random.default_rng(seed), path()
    times = np.cumsum(rng.uniform(0.5, 1.5, 19)) / 100
    poses = np.cumsum(rng.normal(0, 1, 3) * (times[:, None] > times.mean()) / 100, axis=0) + rng.normal(0, 1e-3, (19, 3))
    for time, pose in zip(times, poses):
        found = line.add(time, pose, np.zeros(2), 1.0)
    keep = (times >= times[-1] - 0.2 * (1 + 1e-6)) | (np.arange(19) >= 15)
    times, poses, low, high = times[keep], poses[keep], np.full(3, -np.inf), np.full(3, np.inf)
    bends = np.diff(poses, 2, axis=0)[:-1]
    assert found.noise == pytest.approx(np.median(np.hypot(bends[:, 0], bends[:, 1])) / np.sqrt(12 * np.log(2)))
    for n in range(2, len(times) + 1):
        t = times[-n:] - times[-1]
        pose, velocity = np.linalg.lstsq(np.stack([np.ones(n), t], axis=1), poses[-n:], rcond=None)[0]
        bound = 2.5 * found.noise / np.sqrt(((t - t.mean())**2).sum())
        low, high = np.maximum(low, velocity - bound), np.minimum(high, velocity + bound)
        if (low > high).any():
            break
        expected, used = (pose, velocity), n
    assert found.pose == pytest.approx(expected[0], abs=1e-9) and found.velocity == pytest.approx(expected[1], abs=1e-6)
    assert found.used == used and found.lasting == pytest.approx(times[-1] - times[-used])


def test_a_stop_is_seen_within_two_frames_and_one_frame_has_no_velocity():
    rng, line = np.random.default_rng(0), path()
    first = line.add(0.0, np.array([2e-3, 3e-3, 0.1]), np.zeros(2), 7e-3)
    assert first.used == 1 and not first.velocity.any() and first.sigma > 1e300 and np.isnan(first.reported).all()
    line.reset()
    for k in range(20):
        found = line.add(k / 100, np.array([0.02 * min(k, 17), 0.0, 0.0]) + rng.normal(0, 1e-3, 3) * [1, 1, 0], np.zeros(2), 7e-3)
    assert found.velocity[0] == pytest.approx(0, abs=0.4) and found.went < 0.02
