# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import played
import pytest
from scipy.ndimage import map_coordinates
import yaml
from tactile_perception._core.finger import centroid_covariance
from tactile_perception.calibration.files.format import write_calibration
from tactile_perception.errors import BadCalibration
from tactile_perception.finger.map import (
    MIX, NOMINAL_BETA, TOTAL, EquidistantMap, LightShift, direction, error_angle, fit_light_shift,
    fit_smooth_map, position, trend)
from tactile_perception.finger.model import Creep, FingerFit, FingerModel, psd_file, read_psd
from tactile_perception.finger.parameters import PsdFinger
from tactile_perception.finger.published import fit_equidistant_map, paper_finger

RNG = np.random.default_rng(0)


def test_equation_1():
    x1, y1, x2, y2 = net = np.array([0.4, 0.7, 1.1, 0.3])
    total = net.sum()
    expected = np.array([-x1 + y1 + x2 - y2, -x1 - y1 + x2 + y2]) / total
    assert position((net @ MIX)[None])[0] == pytest.approx(expected)


def test_equal_outputs_are_the_centre_and_no_light_is_nan():
    assert position(np.full((1, 4), 0.3) @ MIX)[0] == pytest.approx([0, 0])
    assert np.isnan(position(np.array([[0.0, 0, 0, 0], [-1.0, 0, 0, 0]]) @ MIX)).all()


def test_the_covariance_is_that_of_many_noisy_samples_and_grows_as_light_falls():
    net, sigma = np.array([0.3, 0.9, 0.5, 0.2]), 0.004
    noisy = net + RNG.normal(0, sigma, (200_000, 4))
    found = np.cov(position(noisy @ MIX).T)
    sums, noise = net @ MIX, sigma**2 * MIX.T @ MIX
    estimate = centroid_covariance(position(sums[None])[0], sums[TOTAL], noise)
    assert estimate == pytest.approx(found, rel=0.05, abs=6e-7)
    weak = centroid_covariance(position(sums[None])[0], sums[TOTAL] / 10, noise)
    assert weak == pytest.approx(100 * centroid_covariance(position(sums[None])[0], sums[TOTAL], noise))


MAP_RNG, SHIFT_RNG = np.random.default_rng(4), np.random.default_rng(3)


def truth(place):
    x, y = place.T
    return np.stack([1.6 * x + 0.3 * x * (x * x + y * y) + 0.02 * np.sin(5 * y), 1.6 * y + 0.02 * np.cos(4 * x)], axis=1)


def scattered(count, reach=0.7):
    place = MAP_RNG.uniform(-reach, reach, (4 * count, 2))
    return place[np.linalg.norm(place, axis=1) < reach][:count]


@pytest.mark.parametrize(('count', 'largest'), [(30, 0.02), (100, 0.008)])
def test_more_contacts_make_less_error(count, largest):
    place, noise = scattered(count), np.full(count, 0.002)
    smooth, left_out = fit_smooth_map(place, truth(place) + MAP_RNG.normal(0, 0.002, (count, 2)), noise)
    inside = scattered(500, 0.6)
    error = np.linalg.norm(smooth.values(inside) - truth(inside), axis=1)
    assert np.sqrt(np.mean(error**2)) < largest
    assert 0.3 < np.sqrt(np.mean(error**2)) / np.sqrt(2 * np.mean(smooth.deviation(inside)**2)) < 1.3
    assert np.sqrt(np.mean(left_out**2)) < 2 * largest


def test_no_oscillation_between_and_beyond_contacts():
    place = scattered(40, 0.4)
    smooth, _ = fit_smooth_map(place, truth(place) + MAP_RNG.normal(0, 0.003, (40, 2)), np.full(40, 0.003), 3)
    line = np.stack([np.linspace(-1, 1, 400), np.zeros(400)], axis=1)
    assert (np.diff(smooth.values(line)[:, 0]) > 0).all()
    assert np.abs(smooth.values(line) - trend(line, 3) @ smooth.slopes).max() < 0.15
    assert smooth.deviation(np.array([[0.95, 0.0]]))[0] > 2 * smooth.deviation(np.array([[0.0, 0.0]]))[0]


def presses(count=100, pull=0.1):
    """Places, tangent vectors and light of presses whose light pulls them to the pole by a part."""
    place = SHIFT_RNG.uniform(-0.6, 0.6, (count, 2))
    strength = SHIFT_RNG.uniform(0.6, 1.4, count)
    light = 3 * strength * np.exp(-2 * (place**2).sum(1))
    values = 1.6 * place * (1 - pull * (strength - 1))[:, None] + SHIFT_RNG.normal(0, 0.002, (count, 2))
    return place, values, light, strength


def test_the_pull_of_the_light_is_found():
    place, values, light, strength = presses()
    smooth, _ = fit_smooth_map(place, values, np.full(100, 0.002))
    found = fit_light_shift(place, values, light, smooth)
    true = -1.6 * 0.1 * place
    assert np.std(found.bend(place) - true) < 0.15 * np.std(true)
    assert np.std(np.log(found.light(place) * strength / light)) < 0.1


def test_light_that_pulls_nothing_moves_nothing():
    place, values, light, _ = presses(pull=0.0)
    smooth, _ = fit_smooth_map(place, values, np.full(100, 0.002))
    assert np.std(fit_light_shift(place, values, light, smooth).bend(place)) < 5e-3


def test_far_from_calibrated_light_it_is_bounded():
    shift = LightShift(np.array([1.0, 50, 0, 0, 0]), np.ones((4, 2)))
    corner = np.array([[1.0, 1.0], [0, 0]])
    assert np.isfinite(shift.light(corner)).all()
    assert shift.relative(corner, np.array([0.0, 1e9])).tolist() == [-1, 1]


PLACE = np.random.default_rng(0).uniform(-0.7, 0.7, (30, 2))


def test_the_table_holds_the_model_between_its_nodes_too(model):
    nodes = (PLACE[:, ::-1].T + 1) / 2 * (len(model.table) - 1)
    found = np.stack([map_coordinates(model.table[..., axis], nodes, order=1) for axis in range(3)], axis=1)
    assert np.degrees(error_angle(found, model.normals(PLACE))).max() < 0.02


def test_a_table_that_is_none_is_refused(model):
    class Spoilt:
        load_terms, cross_volts, room, creep = model.load_terms, model.cross_volts, model.room, model.creep
        table = model.table[:, :-1]
    with pytest.raises(ValueError, match='^table: '):
        PsdFinger(Spoilt())


def written(path, **numbers):
    model = FingerModel(EquidistantMap(np.array([0.1, -0.2]), 1.6), **numbers)
    fit = FingerFit(model, 30, np.zeros(1), np.zeros(1), {'places': 30}, {'theta': [0.0, 1.0]}, ['few'], np.array([[0, 0, 1.0]]),
                    np.array(['x at 1.0 s']))
    write_calibration(path, psd_file(fit, ['one']))
    return model


def test_a_full_model_there_and_back(tmp_path):
    smooth, _ = fit_smooth_map(PLACE, 1.6 * PLACE, np.full(30, 1e-3))
    shift = LightShift(np.arange(5.0), 0.01 * np.arange(8.0).reshape(4, 2))
    model = written(tmp_path / 'a.yaml', smooth=smooth, shift=shift, level=np.array([0.3, -0.1, 0.0]), level_limits=(0.1, 0.3, 0.7),
                    force=np.arange(8.0), cross=np.arange(6.0), cross_volts=1e-3, room=np.arange(4.0), creep=Creep(0.05, 0.03))
    found = read_psd(tmp_path / 'a.yaml')
    for light in (None, np.full(30, 3.0)):
        assert found.normals(PLACE, light) == pytest.approx(model.normals(PLACE, light), abs=1e-7)
    assert found.levels(PLACE) == pytest.approx(model.levels(PLACE))
    assert found.room.tolist() == [0, 1, 2, 3] and found.creep == Creep(0.05, 0.03)
    assert found.depth is None and found.cross_volts == 1e-3 and found.force.tolist() == list(range(8))
    assert yaml.safe_load((tmp_path / 'a.yaml').read_text())['left_out'] == ['few', 'one']


def test_the_papers_alone(tmp_path):
    written(tmp_path / 'a.yaml')
    found = read_psd(tmp_path / 'a.yaml')
    assert found.smooth is None and found.level is None and found.room is None and found.creep is None and found.paper.beta == 1.6


@pytest.mark.parametrize('spoil', [lambda f: f.pop('paper'), lambda f: f['smooth'].pop('place'), lambda f: f['smooth'].update(noise=[1.0]),
                                   lambda f: f.update(force=[1.0]), lambda f: f.update(reach='far'), lambda f: f['creep'].update(share=1.0),
                                   lambda f: f['creep'].update(seconds=0.0),
                                   lambda f: f.update(shift={'typical': [1.0] * 5, 'slopes': [[1.0, 2.0]]})])
def test_what_is_missing_or_wrong_is_reported(tmp_path, spoil):
    smooth, _ = fit_smooth_map(PLACE, 1.6 * PLACE, np.full(30, 1e-3))
    written(tmp_path / 'a.yaml', smooth=smooth, creep=Creep(0.05, 0.03))
    page = yaml.safe_load((tmp_path / 'a.yaml').read_text())
    spoil(page['fitted'])
    (tmp_path / 'a.yaml').write_text(yaml.safe_dump(page))
    with pytest.raises(BadCalibration, match='a.yaml'):
        read_psd(tmp_path / 'a.yaml')


TRUE = EquidistantMap(np.array([0.04, -0.02]), 1.7)


def places(phi, theta):
    """Where the paper's own sensor has its light."""
    phi, theta = np.asarray(phi, float), np.asarray(theta, float)
    return TRUE.offset + theta[:, None] / TRUE.beta * np.stack([np.cos(phi), np.sin(phi)], axis=1)


def test_the_pole_and_one_more_contact_give_offset_and_factor():
    phi, theta = [0.0, 2.0], [0.0, 0.5]
    found, notes = fit_equidistant_map(places(phi, theta), direction(np.array(phi), np.array(theta)))
    assert found.offset == pytest.approx(TRUE.offset) and found.beta == pytest.approx(TRUE.beta) and notes == []
    everywhere = np.array([3.1, -3.1, 0.1]), np.array([1.0, 0.2, 1.5])
    assert error_angle(found.normals(places(*everywhere)), direction(*everywhere)).max() < 1e-6


def test_assumptions_are_noted():
    found, notes = fit_equidistant_map(places([0.0], [0.0]), direction(np.zeros(1), np.zeros(1)))
    assert found.beta == NOMINAL_BETA and 'nominal' in notes[0]
    found, notes = fit_equidistant_map(places([1.0], [0.5]), direction(np.ones(1), np.full(1, 0.5)))
    assert found.offset.tolist() == [0, 0] and 'assumed' in notes[0]
    phi, theta = np.array([0.1, 2.2, 4.1]), np.array([0.5, 0.6, 0.4])
    found, notes = fit_equidistant_map(places(phi, theta), direction(phi, theta))
    assert found.offset == pytest.approx(TRUE.offset, abs=1e-6) and 'extrapolated' in notes[0]


def test_without_a_contact():
    with pytest.raises(BadCalibration, match='no contact'):
        fit_equidistant_map(np.zeros((0, 2)), np.zeros((0, 3)))


def test_its_offset_is_constant_so_drift_becomes_contact(model):
    volts = played.scene('light')[0]
    found = played.Player(paper_finger(model, 0.2, each_sample=True)).play(volts)
    assert played.contact(found, len(volts)).mean() > 0.2
