# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated gel against what is known of elastic contact, and its scenes."""
import numpy as np
import pytest

from tactile_driver.simulation.gel.contact import GelContact, Indenter
from tactile_driver.simulation.gel.elements import Material
from tactile_driver.simulation.sensors.scenes import open_scene

pytestmark = pytest.mark.full  # each takes seconds of a core

NOWHERE = np.zeros(2)


def test_a_small_ball_on_a_thick_layer_presses_as_hertz_says():
    radius, depth, material = 2e-3, 0.08e-3, Material(8e-3, 1e-3, 1e5, 0.45)
    state = GelContact(material, Indenter(radius), 0.0, cell=0.06e-3).step(NOWHERE, depth, NOWHERE)
    hertz = 4 / 3 * material.young / (1 - material.poisson**2) * np.sqrt(radius) * depth**1.5
    assert -state.force[:, 2].sum() == pytest.approx(hertz, rel=0.08)  # the base, 20 contact radii below, adds some percent
    assert len(state.positions) * 0.06e-3**2 == pytest.approx(np.pi * radius * depth, rel=0.1)


def test_a_thin_layer_resists_more_than_a_thick_one():
    force = [-GelContact(Material(thickness, 0.2e-3, 1e5, 0.48), Indenter(6e-3), 0.3).step(NOWHERE, 0.5e-3, NOWHERE).force[:, 2].sum()
             for thickness in (2e-3, 4e-3, 8e-3)]
    assert force[0] > 1.2 * force[1] > 1.2 * force[2]


def test_friction_holds_and_then_slides():
    contact, displacement, depth = GelContact(Material(4e-3, 0.4e-3, 2e5, 0.48), Indenter(6e-3), 0.4), np.array([0.1e-3, 0.0]), 0.8e-3
    for part in range(1, 6):
        contact.step(NOWHERE, depth * part / 5, NOWHERE)
    shear, slides = [], []
    for k in range(1, 16):
        state = contact.step(k * displacement, depth, (k - 1) * displacement)
        along, press = np.hypot(*state.force[:, :2].T), -state.force[:, 2]
        assert (press > 0).all() and (along <= 0.4 * press * (1 + 1e-6)).all()
        shear.append(state.force[:, 0].sum() / press.sum())
        slides.append(state.slides.mean())
    assert slides[0] < 0.5 and slides[-1] > 0.9  # cells that have just come under the ball do not slide
    assert 0 < shear[0] < 0.2 and shear[-1] == pytest.approx(0.4, rel=0.05)


@pytest.mark.parametrize('name', ['gel_demo', 'gel_random'])
def test_scenes_show_dots_that_move_as_the_truth_says(name):
    scene = open_scene(name, 5.0, seed=1, width=320, height=240)
    truths = [scene.observe(number) for number in range(scene.frames)]
    assert not truths[0].contacts and not truths[-1].contacts and truths[0].wrench.tolist() == [0.0] * 6
    pressed = max(truths, key=lambda truth: -truth.wrench[2])
    assert pressed.wrench[2] < -0.3 and pressed.contacts[0].force == pytest.approx(-pressed.wrench[2])
    moved = np.hypot(*(pressed.dot_uv - truths[0].dot_uv).T)
    far = np.hypot(*(truths[0].dot_xyz[:, :2] - pressed.contacts[0].position[:2]).T) > 8e-3
    assert 1.0 < moved.max() < 15.0 and moved[far].max() < moved.max() / 2
    image = scene.render(0.0).image
    at = np.round(truths[0].dot_uv).astype(int)
    inside = ((at >= 2) & (at < [318, 238])).all(axis=1)
    dark = image[at[inside, 1], at[inside, 0]].mean(axis=1)
    assert image.shape == (240, 320, 3) and (dark < 0.6 * np.median(image)).mean() > 0.95
    again = open_scene(name, 5.0, seed=1, width=320, height=240)
    assert np.array_equal(again.render(0.0).image, image)
