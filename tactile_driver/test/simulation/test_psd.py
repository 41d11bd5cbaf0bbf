# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A simulated finger with a PSD, and a simulated taxel array."""
import numpy as np
import pytest

from tactile_driver.errors import BadArgument
from tactile_driver.simulation.psd_scene import PSD_SCENES, Electronics, FingerSpecimen, open_psd_scene
from tactile_driver.simulation.taxel.pad import FACES, BondedLayer, PadSpecimen, RubberPad
from tactile_driver.simulation.taxel.scene import TAXEL_SCENES, open_taxel_scene
from tactile_driver.simulation.truth import GROSS, INCIPIENT, NO_SLIP


def normals(theta, phi=0.3):
    theta = np.radians(np.atleast_1d(theta))
    return np.stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)], axis=1)


def test_light_rises_with_depth_before_and_after_touch_and_falls_towards_the_rim():
    finger = FingerSpecimen(3)
    depth = np.linspace(0, 4e-4, 60)
    light = finger.light(np.repeat(normals(20), 60, axis=0), depth).sum(1)
    assert light[0] == 0 and (np.diff(light) > 0).all()
    assert 0.15 < finger.light(normals(0), np.array([finger.material.gap]))[0].sum() < 0.4
    rim = finger.light(normals([0, 20, 40, 60, 75]), np.full(5, 3e-4)).sum(1)
    assert (np.diff(rim) < 0).all() and rim[-1] < 0.25 * rim[0]


def test_the_converter_ends_where_the_amplifiers_do():
    rng = np.random.default_rng(0)
    counts = Electronics().counts(np.array([[0.0, 1.0, 4.9, 9.0]] * 2000), rng)
    assert counts.dtype == np.uint16 and counts[:, 3].max() == counts[:, 3].min() == int(4.95 / 5 * 4096)
    assert counts[:, 1].mean() == pytest.approx(819, abs=1.5) and 8 < counts[:, 1].std() < 11


RATE = 1000.0


@pytest.mark.parametrize('name', sorted(PSD_SCENES))
def test_every_scene_plays_with_its_truth(name):
    scene = open_psd_scene(name, 200.0, 1)
    counts, truth = scene.play(0, scene.samples)
    assert counts.shape == (scene.samples, 4) and counts.dtype == np.uint16
    touching = truth.touching > 0
    assert np.isfinite(truth.normal[touching]).all() and np.isnan(truth.normal[~touching]).all()
    assert np.linalg.norm(truth.normal[touching], axis=1) == pytest.approx(1.0)
    assert touching.any() == (name not in ('rest', 'light'))


def test_it_goes_on_from_where_it_was_and_begins_again():
    scene = open_psd_scene('demo', RATE)
    truth = scene.play(0, scene.samples)[1]
    assert np.array_equal(scene.play(scene.samples + 500, 1200)[1].touching, truth.touching[500:1700])
    k = int(np.flatnonzero(truth.touching)[5])
    touch, = truth.touches(k)
    assert np.linalg.norm(touch.position) == pytest.approx(0.016) and touch.force > 0
    assert truth.touches(0) == []


def test_wrong_words():
    with pytest.raises(BadArgument, match='demo, rest, calibration'):
        open_psd_scene('nowhere', RATE)
    with pytest.raises(BadArgument, match='rate'):
        open_psd_scene('demo', 0.0)


PULL, THICKNESS = 5e7, 4.0  # N/m^3; thickness in cells
FREE = np.full((64, 64), 1e9)  # Pa, friction that holds everything


def dragged(limit, wanted, steps=1):
    layer = BondedLayer(limit.shape, THICKNESS, PULL)
    for k in range(1, steps + 1):
        layer.move(wanted * k / steps, limit)
    return layer


def face(half=12):
    limit = np.zeros((64, 64))
    limit[32 - half:32 + half, 32 - half:32 + half] = 1e4
    return limit


def test_shear_waves_are_as_stiff_as_elasticity_says():
    wave = np.zeros((64, 64, 2))
    for length in (16, 8):
        wave[:, :, 0] = 1e-6 * np.cos(2 * np.pi / length * np.arange(64))[:, None]
        middle = dragged(FREE, wave).traction[24:40, 24:40, 0] / wave[24:40, 24:40, 0]
        depth = 2 * np.pi / length * THICKNESS
        assert np.median(middle) == pytest.approx(PULL * depth / np.tanh(depth), rel=0.03)


def test_the_border_of_what_sticks_carries_most_and_the_rubber_around_goes_along():
    layer = dragged(face() * 1e5, np.full((64, 64, 2), [1e-5, 0.0]))
    assert layer.traction[32, 32, 0] == pytest.approx(PULL * 1e-5, rel=0.05) and layer.traction[32, 20, 0] > 2 * layer.traction[32, 32, 0]
    assert np.abs(layer.shift[20:44, 20:44] - [1e-5, 0]).max() < 1e-7
    assert 0.3e-5 < layer.shift[32, 45, 0] < 0.9e-5 and abs(layer.shift[32, 52, 0]) < 1e-6


def test_traction_stays_within_friction_and_slip_begins_at_the_border():
    slipping = []
    for displacement in (0.6e-4, 1.2e-4, 3e-4):  # friction over pull is 2e-4 m
        layer = dragged(face(), np.full((64, 64, 2), [displacement, 0.0]), steps=10)
        length = np.hypot(*layer.traction.transpose(2, 0, 1))
        assert (length <= 1e4 * (1 + 1e-6)).all() and not length[face() == 0].any()
        slips = np.abs(layer.shift[20:44, 20:44, 0] - displacement) > 0.02 * displacement
        slipping.append(slips.mean())
        assert slips.all() or slips[0, 0] and not slips[12, 12]
    assert slipping[0] < 0.1 < slipping[1] < 0.6 and slipping[2] == 1


def played(name, rate=25.0, until=None):
    scene = open_taxel_scene(name, rate)
    return [scene.render(k / rate) for k in range(scene.frames if until is None else round(until * rate))]


@pytest.mark.parametrize('name', TAXEL_SCENES)
def test_every_scene_begins_untouched_and_plays(name):
    values, truth = open_taxel_scene(name).render(0.0)
    assert values.shape == (44, 44) and values.dtype == np.uint8 and truth.area == 0 and not truth.wrench.any()


@pytest.mark.full
@pytest.mark.parametrize('name, area, holes, touches', [('disc', 100 * np.pi, 0, 1), ('ring', 108 * np.pi, 1, 1), ('bar', 240, 0, 1),
                                                        ('two_fingers', 72 * np.pi, 0, 2), ('l', 288, 0, 1)])
def test_held_faces_have_their_areas(name, area, holes, touches):
    truth = played(name, until=2.0)[-1][1]
    assert truth.area == pytest.approx(1e-6 * area, rel=0.03)
    assert (len(truth.holes), len(truth.contacts)) == (holes, touches) and truth.slip_state == NO_SLIP
    assert -truth.wrench[2] == pytest.approx(1.4e8 * 3e-4 * truth.area, rel=1e-6)


def test_load_in_the_image_is_the_load_on_the_pad():
    scene = open_taxel_scene('disc', 50.0)
    for k in range(75):
        scene.render(k / 50)
    state = scene.pad.move(scene._face, np.array([0, 0, 0.3]), 3e-4)
    assert scene.pad.felt(state).sum() * 1e-6 == pytest.approx(-scene.pad.force(state)[2], rel=1e-3)


@pytest.mark.full
def test_a_drag_sticks_then_slips_at_the_rim_then_as_a_whole():
    truths = [truth for _, truth in played('demo')]
    states = [truth.slip_state for truth in truths]
    first = [states.index(state) for state in (INCIPIENT, GROSS)]
    assert first[0] < first[1] and max(states[:first[0]]) == NO_SLIP
    gross = truths[first[1] + 5]
    assert 0.4 < np.hypot(*gross.wrench[:2]) / -gross.wrench[2] <= 0.55 and gross.velocity[0] > 0


def test_an_edge_along_the_rows_moves_evenly():
    """A bar turns through the direction of the rows without friction: the picture changes by about as much in each step."""
    pad = RubberPad(PadSpecimen(grip=0.0))
    pictures = [pad.felt(pad.move(FACES['bar'], np.array([0, 0, 0.003 * k + 0.001]), 3e-4)) for k in range(-15, 16)]
    steps = np.abs(np.diff(np.array(pictures), axis=0)).sum(axis=(1, 2))
    assert steps.max() < 2 * np.median(steps) and steps.min() > 0.5 * np.median(steps)


@pytest.mark.full
def test_grip_force_alone_does_not_slip():
    assert {truth.slip_state for _, truth in played('grip')} == {NO_SLIP}


@pytest.mark.full
def test_dead_rows_stay_zero_and_the_same_seed_gives_the_same():
    values = played('dead_rows', until=1.5)[-1][0]
    assert not values[[17, 25]].any() and values[21].max() > 40
    assert (values == played('dead_rows', until=1.5)[-1][0]).all()


def test_wrong_words_of_a_pad():
    with pytest.raises(BadArgument, match='two_fingers'):
        open_taxel_scene('nowhere')
    with pytest.raises(BadArgument, match='more than 0'):
        open_taxel_scene('disc', 0.0)


@pytest.mark.full
def test_a_smooth_object_slips_at_once_and_a_load_that_goes_back_and_forth_does_not():
    states = [truth.slip_state for _, truth in played('smooth', 100.0)]
    assert 0 < states.count(INCIPIENT) <= 4 and states.count(GROSS) > 80
    assert {truth.slip_state for _, truth in played('cycle')} == {NO_SLIP}


@pytest.mark.full
@pytest.mark.parametrize('name, moves', [('roll', 5e-3), ('rock', 0.0)])
def test_tilting_moves_the_contact_without_slip(name, moves):
    truths = [truth for _, truth in played(name) if truth.area > 0]
    assert {truth.slip_state for truth in truths} == {NO_SLIP}
    middles = np.array([truth.centroid[0] for truth in truths])
    assert np.ptp(middles) >= moves and np.ptp([truth.wrench[2] for truth in truths]) > 0.5
