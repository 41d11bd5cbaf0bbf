# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.markers.regression.gaussian_process import MirrorGP, mirror_groups

RNG = np.random.default_rng(2)


def odd_along_x(at):
    return np.sin(1.5 * at[..., 0]) * (1 + 0.3 * at[..., 1]**2) * (1 + at[..., 2])


@pytest.fixture(scope='module')
def process():
    inputs = np.column_stack([RNG.uniform(0, 1.3, 60), RNG.uniform(0, 1.3, 60), RNG.uniform(0, 1.5, 60)])
    return MirrorGP(inputs, odd_along_x(inputs) + RNG.normal(0, 0.01, 60), np.zeros(60), (-1, 1))


def test_a_function_with_that_parity_is_told_on_all_four_sides(process):
    at = np.column_stack([RNG.uniform(-1, 1, (40, 2)), RNG.uniform(0.2, 1.3, 40)])
    off = np.array([process(x) for x in at]) - odd_along_x(at)
    assert np.sqrt(np.mean(off**2)) < 0.03
    assert process(np.array([0.0, 0.4, 0.7])) == pytest.approx(0.0, abs=1e-9)


def test_its_sigma_is_honest_and_grows_outside(process):
    at = np.column_stack([RNG.uniform(-1.2, 1.2, (200, 2)), RNG.uniform(0.1, 1.4, 200)])
    squares = [(process(x) - odd_along_x(x) + RNG.normal(0, 0.01))**2 / process.sigma(x)**2 for x in at]
    assert 0.5 < np.mean(squares) < 1.5
    assert process.sigma(np.array([4.0, 0.0, 0.5])) > 5 * process.sigma(np.array([0.6, 0.6, 0.7]))


def test_what_is_left_out_is_told_as_a_process_without_it_tells_it(process):
    groups = np.repeat(np.arange(12), 5)
    errors, sigmas = process.left_out(groups)
    without = groups != 3
    other = MirrorGP(process.inputs[without], process.values[without] / process.scale, process.noise[without], (-1, 1), process.hyper)
    other.scale = 1.0
    told = [MirrorGP.__call__(_same_scale(process, without), x) for x in process.inputs[~without]]
    assert process.values[~without] - told == pytest.approx(errors[~without], abs=1e-6)
    assert (sigmas > 0).all()


def _same_scale(process, keep):
    """The process without some of its points, its scale kept."""
    ratio = process.scale / np.sqrt(np.mean(process.values[keep]**2))
    hyper = process.hyper + np.append(np.zeros(3), np.log([ratio, ratio]))
    return MirrorGP(process.inputs[keep], process.values[keep], process.noise[keep], process.parity, hyper)


def test_numbers_come_back(process):
    again = MirrorGP.from_numbers(process.numbers())
    assert again(np.array([0.3, -0.2, 0.5])) == pytest.approx(process(np.array([0.3, -0.2, 0.5])), rel=1e-9)


def test_mirror_images_are_one_group():
    assert len(set(mirror_groups(np.array([[1, 2], [-1, 2], [1, -2.0003]]) * 1e-2))) == 1
    assert len(set(mirror_groups(np.array([[1, 2], [2, 1.0]]) * 1e-2))) == 2
