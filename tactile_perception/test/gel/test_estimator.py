# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contacts of a gel against a simulated one, whose layer is of finite elements and whose friction is Coulomb's; its own layer."""
import copy

import numpy as np
import pytest
from pressed_gel import CENTRE, FOCAL, pressed_gel

from tactile_driver.simulation.gel.elements import Material, Response
from tactile_perception.common.dots import DotTracks
from tactile_perception.common.estimates import AT_EDGE, GROSS, INCIPIENT, NONE
from tactile_perception.core.errors import BadArgument, BadFrame, TactileError
from tactile_perception.layer.estimator import GelEstimator
from tactile_perception.layer.layer import DiscLoads, Layer

UNTOUCHED = 10  # frames


def estimator_of(gel, rng, noise=0.05, **changes):
    """An estimator that has seen the untouched gel, in which it must find nothing."""
    estimator = GelEstimator(gel.parameters | changes, CENTRE, FOCAL)
    for frame in range(UNTOUCHED):
        result = estimator.process(gel.tracks(None, rng, noise), 0.04 * frame)
        assert not result.contacts and result.region.area == 0 and not result.region.dot_state.any()
    return estimator


def errors(gel, rng, noise=0.05, **changes):
    """Of each state: of the middle, m, of normal and shear force, N, their stated deviations, and the true force, N."""
    estimator, found = estimator_of(gel, rng, noise, **changes), []
    for k, state in enumerate(gel.states):
        result = estimator.process(gel.tracks(state, rng, noise), 1.0 + k)
        contact, = result.contacts
        true = state.force.sum(axis=0)
        assert contact.force == pytest.approx(-result.wrench[2])
        off = result.wrench[:3] - true
        found.append((np.linalg.norm(contact.position[:2] - state.middle), off, result.force_sigma, true))
    return [np.array(values) for values in zip(*found)]


#: Gels, balls and motions at random; none was used while the estimator was made.
@pytest.mark.parametrize('seed', [101, 102, 103, 104])
def test_position_shear_and_normal_force_of_a_ball_are_accurate(seed):
    rng = np.random.default_rng(seed)
    angle, length = rng.uniform(0, 2 * np.pi), rng.uniform(0.2e-3, 0.7e-3)
    thickness = rng.uniform(3e-3, 6e-3)
    gel = pressed_gel(rng, thickness=thickness, poisson=rng.uniform(0.46, 0.49), radius=rng.uniform(4e-3, 9e-3),
                      friction=rng.uniform(0.2, 0.9), depth=rng.uniform(0.1, 0.2) * thickness, middle=rng.uniform(-2.5e-3, 2.5e-3, 2),
                      displacement=(length * np.cos(angle), length * np.sin(angle)), grid=bool(seed % 2))
    middle, off, sigma, true = errors(gel, rng)
    press, shear = -true[:, 2], np.hypot(*true[:, :2].T)
    assert (middle < 0.3e-3).all()
    assert (np.abs(off[:, 2]) < 0.1 * press).all()
    assert (np.hypot(*off[1:, :2].T) < 0.1 * shear[1:]).all() and (np.hypot(*off[0, :2]) < 0.02 * press[0]).all()
    assert np.sqrt(np.mean((off[:, 2] / sigma[:, 2])**2)) < 3, 'the stated error is about the true one'


@pytest.mark.parametrize(('changes', 'noise', 'middle', 'force'), [
    ({'pitch': 0.75e-3}, 0.05, 0.2e-3, 0.1), ({'pitch': 3e-3}, 0.05, 0.4e-3, 0.15), ({}, 0.15, 0.3e-3, 0.15)])
def test_other_pitches_and_more_noise_degrade_it_mildly(changes, noise, middle, force):
    rng = np.random.default_rng(7)
    gel = pressed_gel(rng, middle=(1e-3, 0.7e-3), displacement=(3e-4, 0.0), **changes)
    off_middle, off, _, true = errors(gel, rng, noise)
    assert (off_middle < middle).all() and (np.linalg.norm(off, axis=1) < force * np.linalg.norm(true, axis=1)).all()


def test_the_region_covers_the_contact():
    rng = np.random.default_rng(8)
    gel = pressed_gel(rng, middle=(-1e-3, 0.5e-3), depth=1e-3)
    result = estimator_of(gel, rng).process(gel.tracks(gel.states[0], rng), 1.0)
    radius = np.sqrt(len(gel.states[0].positions) * gel.contact.cell**2 / np.pi)
    assert result.region.area == pytest.approx(np.pi * radius**2, rel=0.3)
    away = np.linalg.norm(gel.dots - gel.states[0].middle, axis=1)
    inside = result.region.dot_state > 0
    assert inside[away < 0.6 * radius].all() and not inside[away > 1.4 * radius].any()
    assert np.hypot(*(result.region.centroid[:2] - gel.states[0].middle)) < 0.3e-3
    outline, = result.region.outlines
    assert np.linalg.norm(outline[:, :2] - gel.states[0].middle, axis=1) == pytest.approx(radius, rel=0.35)


def test_without_a_modulus_no_force_is_reported_but_the_rest():
    rng = np.random.default_rng(9)
    gel = pressed_gel(rng)
    result = estimator_of(gel, rng, **{'gel.young_modulus': 0.0}).process(gel.tracks(gel.states[0], rng), 1.0)
    contact, = result.contacts
    assert np.isnan(result.wrench).all() and np.isnan(contact.force) and np.isnan(result.force_sigma).all()
    assert result.region.area > 0 and np.hypot(*contact.position[:2]) < 0.3e-3
    assert contact.depth == pytest.approx(gel.states[0].depth, rel=0.2) and contact.position[2] == -contact.depth


@pytest.mark.parametrize('friction', [0.25, 0.8])
def test_the_slipping_fraction_of_a_ball_is_accurate(friction):
    rng = np.random.default_rng(12)
    gel = pressed_gel(rng, friction=friction, displacement=(6e-4, -2e-4))
    estimator, states = estimator_of(gel, rng), gel.states
    slips = [estimator.process(gel.tracks(state, rng), 1.0 + k).slip for k, state in enumerate(states)]
    assert [slip.slipping_fraction for slip in slips] == pytest.approx([state.slides.mean() for state in states], abs=0.12)
    assert [slip.state for slip in slips] == ([NONE, INCIPIENT, GROSS] if friction < 0.5 else [NONE, INCIPIENT, INCIPIENT])
    assert (slips[0].linear == 0).all() and np.isnan(slips[-1].linear).all(), 'how fast is not known'
    free = estimator.process(gel.tracks(None, rng), 9.0).slip
    assert free.state == NONE and np.isnan(free.slipping_fraction)
    assert estimator_of(gel, rng, **{'gel.friction': 0.0}).process(gel.tracks(states[0], rng), 1.0).slip is None


@pytest.mark.full
def test_a_contact_keeps_its_id_and_reports_the_edge():
    rng = np.random.default_rng(10)
    gel = pressed_gel(rng, middle=(5e-3, 0.0), displacement=(4e-3, 0.0))
    estimator = estimator_of(gel, rng)
    results = [estimator.process(gel.tracks(state, rng), 1.0 + k) for k, state in enumerate(gel.states)]
    assert [[contact.id for contact in result.contacts] for result in results] == [[1]] * 3
    assert [bool(result.contacts[0].flags & AT_EDGE) for result in results] == [False, True, True]
    assert not estimator.process(gel.tracks(None, rng), 9.0).contacts


@pytest.mark.parametrize(('share', 'touches'), [(0.07, False), (0.25, True)])
def test_a_fading_imprint_is_a_contact_only_if_it_is_strong_or_persists(share, touches):
    rng = np.random.default_rng(14)
    gel = pressed_gel(rng, depth=1e-3)
    estimator, pressed = estimator_of(gel, rng), gel.tracks(gel.states[0], rng)
    assert estimator.process(pressed, 1.0).contacts
    left = copy.deepcopy(pressed)
    left.uv, left.duv = pressed.rest_uv + share * pressed.duv, share * pressed.duv
    assert bool(estimator.process(left, 1.5).contacts) == touches
    assert estimator.process(left, 60.0).contacts, 'a minute later it is a touch'


def test_a_second_touch_is_found_while_the_first_one_stays():
    first, second = (pressed_gel(np.random.default_rng(15), middle=(x, 0.0), depth=6e-4, radius=3e-3) for x in (-4.5e-3, 4.5e-3))
    rng = np.random.default_rng(16)
    estimator = estimator_of(first, rng)
    tracks, beside = first.tracks(first.states[0], rng), second.tracks(second.states[0], rng)
    for frame in range(3):
        assert len(estimator.process(tracks, 1.0 + 0.04 * frame).contacts) == 1
    both = copy.deepcopy(tracks)
    both.duv = tracks.duv + beside.duv
    both.uv = tracks.rest_uv + both.duv
    for frame in range(3):
        found = estimator.process(both, 2.0 + 0.04 * frame).contacts
    assert sorted(contact.position[0] for contact in found) == pytest.approx([-4.5e-3, 4.5e-3], abs=0.4e-3)


def test_untouched_frames_never_report_a_contact():
    rng = np.random.default_rng(20)
    gel = pressed_gel(rng)
    estimator, tracks = GelEstimator(gel.parameters, CENTRE, FOCAL), gel.tracks(None, rng, noise=0.0)
    for frame in range(20):
        assert not estimator.process(tracks, 0.04 * frame).contacts
    for frame in range(100):  # a gel that moves towards the camera is not pressed, however far
        nearer = gel.tracks(None, rng)
        nearer.duv += 1e-4 * frame * gel.dots / 3e-5
        nearer.uv = nearer.rest_uv + nearer.duv
        assert not estimator.process(nearer, 1.0 + 0.04 * frame).contacts


@pytest.mark.parametrize('seed', [121, 122, 123])
def test_a_still_press_is_one_contact_that_does_not_slip(seed):
    rng = np.random.default_rng(seed)
    aslant = rng.uniform(-2e-4, 2e-4, 2)
    gel = pressed_gel(rng, pitch=2e-3, radius=2.5e-3, depth=6e-4, middle=rng.uniform(-3e-3, 3e-3, 2), displacement=aslant)
    estimator, state = estimator_of(gel, rng), gel.states[-1]
    results = [estimator.process(gel.tracks(state, rng), 1.0 + 0.04 * frame) for frame in range(25)]
    true_area = len(state.positions) * gel.contact.cell**2
    for result in results:
        contact, = result.contacts
        assert result.slip.state == NONE
        assert np.hypot(*(contact.position[:2] - state.middle)) < 0.25e-3
        assert 1 / 1.3 < result.region.area / true_area < 1.3
        assert contact.depth == pytest.approx(state.depth, rel=0.25)
    assert not estimator.process(gel.tracks(None, rng), 2.0).contacts


@pytest.mark.full
def test_the_stated_error_of_a_dragged_contacts_position_is_the_true_one():
    squares = []
    for seed in range(131, 139):
        rng = np.random.default_rng(seed)
        small, angle = seed % 2 == 0, rng.uniform(0, 2 * np.pi)
        gel = pressed_gel(rng, pitch=2e-3 if small else 1.5e-3, radius=2.5e-3 if small else rng.uniform(4e-3, 9e-3),
                          thickness=rng.uniform(3e-3, 6e-3), depth=6e-4, middle=rng.uniform(-2e-3, 2e-3, 2),
                          displacement=0.3e-3 * np.array([np.cos(angle), np.sin(angle)]))
        contact, = estimator_of(gel, rng).process(gel.tracks(gel.states[-1], rng), 1.0).contacts
        error = contact.position[:2] - gel.states[-1].middle
        squares.append(error @ error / np.trace(contact.position_covariance[:2, :2]))
        assert np.hypot(*error) < 0.25e-3
    assert 0.3 < np.mean(squares) < 3.0


def test_an_unknown_thickness_leaves_only_the_depth_unknown():
    rng = np.random.default_rng(21)
    gel = pressed_gel(rng, pitch=2e-3, middle=(1e-3, -5e-4))
    estimator = estimator_of(gel, rng, **{'gel.thickness': 0.0, 'gel.young_modulus': 0.0})
    contact, = estimator.process(gel.tracks(gel.states[0], rng), 1.0).contacts
    assert np.isnan(contact.depth) and np.isnan(contact.position[2])
    assert np.hypot(*(contact.position[:2] - [1e-3, -5e-4])) < 3e-4
    assert 'gel.thickness is not known' in estimator.health()[0] and 'gel.young_modulus is not known' in estimator.health()[0]


def test_lost_hidden_and_wrong_dots_change_little():
    rng = np.random.default_rng(11)
    gel = pressed_gel(rng, middle=(1e-3, 0.0), displacement=(2e-4, 0.0))
    estimator, state = estimator_of(gel, rng), gel.states[-1]
    tracks = gel.tracks(state, rng)
    tracks.duv[::7] = np.nan
    tracks.uv[3] = np.nan
    tracks.uv[50] += [20.0, 5.0]  # another dot's number
    tracks.duv[50] += [20.0, 5.0]
    result = estimator.process(tracks.take(np.arange(len(tracks)) % 5 > 0), 1.0)
    contact, = result.contacts
    assert np.hypot(*(contact.position[:2] - state.middle)) < 0.3e-3
    assert np.linalg.norm(result.wrench[:3] - state.force.sum(axis=0)) < 0.15 * contact.force
    half = tracks.take(gel.dots[tracks.id, 0] > -2e-3)  # the rest of the grid is out of view
    contact, = estimator_of(gel, rng).process(half, 1.0).contacts
    assert np.hypot(*(contact.position[:2] - state.middle)) < 0.5e-3


@pytest.mark.parametrize('count', [0, 1, 5])
def test_too_few_dots_are_refused_and_change_nothing(count):
    rng = np.random.default_rng(12)
    gel = pressed_gel(rng)
    estimator = estimator_of(gel, rng)
    tracks = gel.tracks(gel.states[0], rng)
    with pytest.raises(BadFrame, match='6 are needed'):
        estimator.process(tracks.take(np.arange(count)), 1.0)
    unknown = gel.tracks(gel.states[0], rng)
    unknown.duv[:] = np.nan  # no reference
    with pytest.raises(BadFrame, match='reference'):
        estimator.process(unknown, 1.1)
    assert estimator.process(tracks, 1.2).contacts


def test_dots_on_each_other_are_refused():
    rng = np.random.default_rng(13)
    gel = pressed_gel(rng)
    flat = DotTracks(0, 0, np.arange(9), np.full((9, 2), 50.0), np.ones(9), np.ones(9), np.zeros((9, 2)))
    with pytest.raises(BadFrame, match='coincide'):
        GelEstimator(gel.parameters).process(flat, 0.0)


def test_wrong_parameters_are_refused_by_name():
    gel = pressed_gel(np.random.default_rng(14))
    for changes, name in (({'gel.scale': 0.0}, 'gel.pitch'), ({'gel.dot_depth': 0.01}, 'gel.dot_depth')):
        with pytest.raises(BadArgument, match=name):
            GelEstimator(gel.parameters | changes)


def test_the_scale_follows_from_the_pitch():
    rng = np.random.default_rng(15)
    gel = pressed_gel(rng, middle=(2e-3, 0.0))
    estimator = estimator_of(gel, rng, **{'gel.scale': 0.0, 'gel.pitch': 1.5e-3})
    contact, = estimator.process(gel.tracks(gel.states[0], rng), 1.0).contacts
    assert contact.position[0] == pytest.approx(2e-3, abs=0.3e-3)
    assert contact.force == pytest.approx(-gel.states[0].force[:, 2].sum(), rel=0.1)


def test_a_copy_of_the_estimator_gives_the_same_results():
    rng = np.random.default_rng(16)
    gel = pressed_gel(rng)
    estimator, tracks = estimator_of(gel, rng), gel.tracks(gel.states[0], rng)
    twin = copy.deepcopy(estimator)
    np.testing.assert_array_equal(estimator.process(tracks, 1.0).wrench, twin.process(tracks, 1.0).wrench)


@pytest.mark.full
@pytest.mark.filterwarnings('ignore:overflow')
def test_any_numbers_give_a_result_or_a_named_error():
    rng = np.random.default_rng(17)
    gel = pressed_gel(rng)
    refused = 0
    for _ in range(30):
        estimator = GelEstimator(gel.parameters | {'gel.thickness': 10.0**rng.uniform(-4, -1), 'gel.dot_depth': 0.0}, CENTRE, FOCAL)
        tracks = gel.tracks(gel.states[0], rng).take(rng.random(len(gel.dots)) < rng.choice([0.1, 0.5, 1.0]))
        wild = rng.choice([0.0, 1.0, 1e3, 1e6, 1e30, np.nan, np.inf, -7.0], tracks.uv.shape)
        tracks.uv = np.where(rng.random(wild.shape) < rng.choice([0.0, 0.1, 1.0]), wild, tracks.uv)
        tracks.duv = np.where(rng.random(wild.shape) < rng.choice([0.0, 0.1, 1.0]), wild[::-1], tracks.duv)
        try:
            result = estimator.process(tracks, 1.0)
        except TactileError:
            refused += 1
        else:
            assert not np.isinf(result.wrench).any() and len(result.region.dot_id) <= len(tracks)
    assert 3 < refused < 27


RADIUS = 0.3e-3
FAR = np.array([0.0, 0.0, 1e9])  # m, a camera that sees no depth


@pytest.mark.parametrize(('poisson', 'depth'), [(0.48, 0.4e-3), (0.3, 0.0), (0.495, 1e-3)])
def test_displacements_are_those_of_finite_elements(poisson, depth):
    thickness, young = 4e-3, 1e5
    angle = np.array([0.4, 1.3, 2.0, 4.0, 5.5])
    points = np.array([0.8, 1.5, 3.0, 5.0, 8.0])[:, None] * 1e-3 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    truth = Response(Material(thickness, depth, young, poisson), RADIUS).matrix(points, np.zeros((1, 2)), 'dots') * [1, 1, -1]
    shear = DiscLoads(Layer(thickness, poisson, depth), RADIUS, 2e-3)  # even, as that of the finite elements
    press = DiscLoads(Layer(thickness, poisson, depth), RADIUS * np.sqrt(1.25), 2e-3)  # a Hertz disc of the same second moment
    found = np.stack([loads.matrix(points, np.zeros(2), loads.radii[0], FAR) for loads in (shear, press)]) * 2 * (1 + poisson) / young
    np.testing.assert_allclose(found[0, :, :, :2], truth[:, :2, 0, :2], atol=0.01 * np.abs(truth).max())
    np.testing.assert_allclose(found[1, :, :, 2], truth[:, :2, 0, 2], atol=0.01 * np.abs(truth).max())


def test_a_wide_shear_moves_the_layer_as_a_block():
    layer = Layer(2e-3, 0.49, 0.5e-3)
    wave = layer.waves(np.array([1.0]))  # 6 m long
    np.testing.assert_allclose([wave['along'][0], wave['across'][0]], 1.5e-3, rtol=1e-4)  # height of the dots over the shear modulus
    assert abs(wave['pressed_up'][0]) < 2e-3 * 0.03, 'it can hardly be compressed'


@pytest.mark.parametrize('values', [(0.0, 0.4, 0.0), (1e-3, 0.6, 0.0), (1e-3, 0.4, 1e-3), (np.nan, 0.4, 0.0), (1e-3, 0.4, -1e-4)])
def test_impossible_layers_are_refused(values):
    with pytest.raises(BadArgument, match='gel.thickness'):
        Layer(*values)
