# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The kernel taxel_motion (src/taxel/taxel_motion.cpp, src/common/steady_motion.cpp) against lines by least squares and NumPy."""
import numpy as np
import pytest
from tactile_perception._core import taxel_motion

RATE, SIGMA = 100.0, 1e-3
RULE = {'window': 0.2, 'reported': 0.06, 'fewest': 4, 'latest': 3, 'arm': (4e-3, -3e-3), 'reach': 7e-3, 'least': 1e-5, 'bound': 2.5}
NAMES = ('past', 'place', 'velocity', 'reported', 'noise', 'speed', 'sigma', 'lasting', 'used', 'expected', 'went')


def found(past, **more):
    """Results by name, after all frames of a past (N, 4)."""
    return dict(zip(NAMES, taxel_motion(past[:-1], past[-1], **RULE | more)))


def lines(times, places, sigma):
    """Place, velocity, its error, and n, over the last n places, for each n from 2 on."""
    for n in range(2, len(times) + 1):
        t = times[-n:] - times[-1]
        design = np.stack([np.ones(n), t], axis=1)
        place, velocity = np.linalg.lstsq(design, places[-n:], rcond=None)[0]
        yield place, velocity, sigma / np.sqrt(((t - t.mean())**2).sum()), n


def longest(times, places, sigma, bound=2.5):
    """The longest line whose velocity lies within the bounds of all shorter ones."""
    best, low, high = (places[-1], np.zeros(3), np.inf, 1), np.full(3, -np.inf), np.full(3, np.inf)
    for line in lines(times, places, sigma):
        low, high = np.maximum(low, line[1] - bound * line[2]), np.minimum(high, line[1] + bound * line[2])
        if (low > high).any():
            break
        best = line
    return best


def noise_of(places):
    """Standard deviation along x and y by second differences without the last."""
    bend = np.diff(places, 2, axis=0)[:-1]
    return max(np.median(np.hypot(bend[:, 0], bend[:, 1])) / np.sqrt(12 * np.log(2)) if len(bend) else 0, RULE['least'])


def expected(past):
    """The same results, slow and plain."""
    keep = past[:, 0] >= past[-1, 0] - RULE['window'] * (1 + 1e-6)
    keep[-RULE['fewest']:] = True
    past = past[keep]
    times, (x, y), reach = past[:, 0], RULE['arm'], RULE['reach']
    to_contact = np.array([[1, 0, -y], [0, 1, x], [0, 0, reach]])
    places = past[:, 1:] @ to_contact.T
    noise, back = noise_of(places), np.linalg.inv(to_contact)
    place, velocity, sigma, used = longest(times, places, noise)
    speed = np.linalg.norm(velocity)
    latest = RULE['latest'] + 1
    short = len(past) < latest
    recent = past[min(np.argmax(times >= times[-1] - RULE['reported'] * (1 + 1e-6)), max(len(past) - RULE['fewest'], 0)):]
    t = recent[:, 0] - recent[:, 0].mean()
    return {'past': past, 'place': back @ place, 'velocity': back @ velocity, 'noise': noise, 'speed': speed, 'sigma': sigma, 'used': used,
            'reported': t @ recent[:, 1:] / (t @ t) if len(past) >= RULE['fewest'] else np.full(3, np.nan),
            'lasting': times[-1] - times[-used], 'expected': 0 if short else speed * (times[-1] - times[-latest]),
            'went': 0 if short else (places[-1] - places[-latest]) @ velocity / max(speed, 1e-12)}


@pytest.mark.parametrize('seed', range(30))
def test_the_motion_is_that_of_least_squares(seed):
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.5, 1.5, rng.integers(2, 40))) / RATE
    totals = np.cumsum(rng.normal(0, 1, 3) * (times[:, None] > times.mean()) / RATE, axis=0) + rng.normal(0, SIGMA, (len(times), 3))
    past = np.column_stack([times, totals])
    result = found(past)
    for name, value in expected(past).items():
        assert result[name] == pytest.approx(value, rel=1e-6, abs=1e-9, nan_ok=True), name


def test_a_stop_is_seen_within_two_frames_and_a_slow_motion_averaged_over_all():
    times, rng = np.arange(20) / RATE, np.random.default_rng(0)
    noisy = rng.normal(0, SIGMA, (20, 3)) * [1, 1, 0]
    stopped = noisy + np.minimum(np.arange(20), 17)[:, None] * np.array([0.02, 0.0, 0.0])
    result = found(np.column_stack([times, stopped]))
    assert result['velocity'][0] == pytest.approx(0, abs=0.4) and result['went'] < 0.02
    slow = found(np.column_stack([times, noisy + np.arange(20)[:, None] * np.array([1e-4, 0, 0])]))
    assert slow['used'] == 20 and slow['noise'] == pytest.approx(SIGMA, rel=0.4)


def test_one_frame_has_no_velocity():
    result = found(np.array([[1.0, 2e-3, 3e-3, 0.1]]))
    assert result['used'] == 1 and not result['velocity'].any() and result['sigma'] > 1e300 and np.isnan(result['reported']).all()
    assert result['place'] == pytest.approx([2e-3, 3e-3, 0.1]) and result['expected'] == result['went'] == 0


def test_noise_is_a_standard_deviation():
    rng = np.random.default_rng(0)
    past = np.column_stack([np.arange(10_000) / RATE, rng.normal(0, SIGMA, (10_000, 2)), np.zeros(10_000)])
    assert found(past, window=1e3)['noise'] == pytest.approx(SIGMA, rel=0.03)
