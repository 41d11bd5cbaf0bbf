# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A finger's map from its four outputs to a direction, and its calibration."""
import numpy as np
import played
import pytest
import yaml
from scipy.ndimage import map_coordinates

from tactile_perception._core.finger import centroid_covariance
from tactile_perception.common.geometry import error_angle
from tactile_perception.core.calibration_file import write_calibration
from tactile_perception.core.errors import BadCalibration
from tactile_perception.finger.calibration import Recording, find_presses, fit_creep, fit_finger, fit_load, fit_touch_level
from tactile_perception.finger.constants import FINGER
from tactile_perception.finger.map import (
    MIX,
    TOTAL,
    EquidistantMap,
    LightShift,
    centroid,
    direction,
    fit_equidistant_map,
    fit_light_shift,
    fit_smooth_map,
    level_basis,
    trend,
)
from tactile_perception.finger.model import Creep, FingerFit, FingerModel, features, psd_file, read_psd
from tactile_perception.finger.parameters import PsdFinger
from tactile_perception.published.psd_finger import paper_finger

RNG = np.random.default_rng(0)


def test_equation_1_gives_the_centroid():
    x1, y1, x2, y2 = net = np.array([0.4, 0.7, 1.1, 0.3])
    total = net.sum()
    expected = np.array([-x1 + y1 + x2 - y2, -x1 - y1 + x2 + y2]) / total
    assert centroid((net @ MIX)[None])[0] == pytest.approx(expected)


def test_equal_outputs_are_the_centre_and_no_light_is_nan():
    assert centroid(np.full((1, 4), 0.3) @ MIX)[0] == pytest.approx([0, 0])
    assert np.isnan(centroid(np.array([[0.0, 0, 0, 0], [-1.0, 0, 0, 0]]) @ MIX)).all()


def test_the_covariance_is_that_of_many_noisy_samples_and_grows_as_light_falls():
    net, sigma = np.array([0.3, 0.9, 0.5, 0.2]), 0.004
    noisy = net + RNG.normal(0, sigma, (200_000, 4))
    found = np.cov(centroid(noisy @ MIX).T)
    sums, noise = net @ MIX, sigma**2 * MIX.T @ MIX
    estimate = centroid_covariance(centroid(sums[None])[0], sums[TOTAL], noise)
    assert estimate == pytest.approx(found, rel=0.05, abs=6e-7)
    weak = centroid_covariance(centroid(sums[None])[0], sums[TOTAL] / 10, noise)
    assert weak == pytest.approx(100 * centroid_covariance(centroid(sums[None])[0], sums[TOTAL], noise))


MAP_RNG, SHIFT_RNG = np.random.default_rng(4), np.random.default_rng(3)


def truth(position):
    x, y = position.T
    return np.stack([1.6 * x + 0.3 * x * (x * x + y * y) + 0.02 * np.sin(5 * y), 1.6 * y + 0.02 * np.cos(4 * x)], axis=1)


def scattered(count, reach=0.7):
    position = MAP_RNG.uniform(-reach, reach, (4 * count, 2))
    return position[np.linalg.norm(position, axis=1) < reach][:count]


@pytest.mark.parametrize(('count', 'largest'), [(30, 0.02), (100, 0.008)])
def test_more_contacts_make_less_error(count, largest):
    position, noise = scattered(count), np.full(count, 0.002)
    smooth, left_out = fit_smooth_map(position, truth(position) + MAP_RNG.normal(0, 0.002, (count, 2)), noise)
    inside = scattered(500, 0.6)
    error = np.linalg.norm(smooth.values(inside) - truth(inside), axis=1)
    assert np.sqrt(np.mean(error**2)) < largest
    assert 0.3 < np.sqrt(np.mean(error**2)) / np.sqrt(2 * np.mean(smooth.deviation(inside)**2)) < 1.3
    assert np.sqrt(np.mean(left_out**2)) < 2 * largest


def test_no_oscillation_between_and_beyond_contacts():
    position = scattered(40, 0.4)
    smooth, _ = fit_smooth_map(position, truth(position) + MAP_RNG.normal(0, 0.003, (40, 2)), np.full(40, 0.003), 3)
    line = np.stack([np.linspace(-1, 1, 400), np.zeros(400)], axis=1)
    assert (np.diff(smooth.values(line)[:, 0]) > 0).all()
    assert np.abs(smooth.values(line) - trend(line, 3) @ smooth.slopes).max() < 0.15
    assert smooth.deviation(np.array([[0.95, 0.0]]))[0] > 2 * smooth.deviation(np.array([[0.0, 0.0]]))[0]


def presses(count=100, pull=0.1):
    """Places, tangent vectors and light of presses whose light pulls them to the pole by a part."""
    position = SHIFT_RNG.uniform(-0.6, 0.6, (count, 2))
    strength = SHIFT_RNG.uniform(0.6, 1.4, count)
    light = 3 * strength * np.exp(-2 * (position**2).sum(1))
    values = 1.6 * position * (1 - pull * (strength - 1))[:, None] + SHIFT_RNG.normal(0, 0.002, (count, 2))
    return position, values, light, strength


def test_the_shift_of_positions_with_light_is_fitted():
    position, values, light, strength = presses()
    smooth, _ = fit_smooth_map(position, values, np.full(100, 0.002))
    found = fit_light_shift(position, values, light, smooth)
    true = -1.6 * 0.1 * position
    assert np.std(found.bend(position) - true) < 0.15 * np.std(true)
    assert np.std(np.log(found.light(position) * strength / light)) < 0.1


def test_light_without_effect_gives_no_shift():
    position, values, light, _ = presses(pull=0.0)
    smooth, _ = fit_smooth_map(position, values, np.full(100, 0.002))
    assert np.std(fit_light_shift(position, values, light, smooth).bend(position)) < 5e-3


def test_the_shift_is_bounded_beyond_the_calibrated_light():
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
    fit = FingerFit(model, 30, np.zeros(1), np.zeros(1), {'positions': 30}, {'theta': [0.0, 1.0]}, ['few'], np.array([[0, 0, 1.0]]),
                    np.array(['x at 1.0 s']))
    write_calibration(path, psd_file(fit, ['one']))
    return model


def test_a_full_model_is_read_as_written(tmp_path):
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


def test_the_papers_map_alone_is_read_as_written(tmp_path):
    written(tmp_path / 'a.yaml')
    found = read_psd(tmp_path / 'a.yaml')
    assert found.smooth is None and found.level is None and found.room is None and found.creep is None and found.paper.beta == 1.6


@pytest.mark.parametrize('spoil', [lambda f: f.pop('paper'), lambda f: f['smooth'].pop('spot'), lambda f: f['smooth'].update(noise=[1.0]),
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


def positions(phi, theta):
    """Where the paper's own sensor has its light."""
    phi, theta = np.asarray(phi, float), np.asarray(theta, float)
    return TRUE.offset + theta[:, None] / TRUE.beta * np.stack([np.cos(phi), np.sin(phi)], axis=1)


def test_the_pole_and_one_more_contact_give_offset_and_factor():
    phi, theta = [0.0, 2.0], [0.0, 0.5]
    found, notes = fit_equidistant_map(positions(phi, theta), direction(np.array(phi), np.array(theta)))
    assert found.offset == pytest.approx(TRUE.offset) and found.beta == pytest.approx(TRUE.beta) and notes == []
    everywhere = np.array([3.1, -3.1, 0.1]), np.array([1.0, 0.2, 1.5])
    assert error_angle(found.normals(positions(*everywhere)), direction(*everywhere)).max() < 1e-6


def test_assumptions_are_noted():
    found, notes = fit_equidistant_map(positions([0.0], [0.0]), direction(np.zeros(1), np.zeros(1)))
    assert found.beta == FINGER.nominal_beta and 'nominal' in notes[0]
    found, notes = fit_equidistant_map(positions([1.0], [0.5]), direction(np.ones(1), np.full(1, 0.5)))
    assert found.offset.tolist() == [0, 0] and 'assumed' in notes[0]
    phi, theta = np.array([0.1, 2.2, 4.1]), np.array([0.5, 0.6, 0.4])
    found, notes = fit_equidistant_map(positions(phi, theta), direction(phi, theta))
    assert found.offset == pytest.approx(TRUE.offset, abs=1e-6) and 'extrapolated' in notes[0]


def test_calibration_without_contacts_is_refused():
    with pytest.raises(BadCalibration, match='no contact'):
        fit_equidistant_map(np.zeros((0, 2)), np.zeros((0, 3)))


def test_the_papers_offset_is_constant_so_drift_becomes_contact(model):
    volts = played.scene('light')[0]
    found = played.Player(paper_finger(model, 0.2, each_sample=True)).play(volts)
    assert played.contact(found, len(volts)).mean() > 0.2


def fitted(selected, seed=0):
    return fit_finger(find_presses([played.recording('calibration', seed, selected)], 4.9))


def test_a_full_calibration_fits_all_parts_of_the_model(fit):
    assert fit.notes == [] and fit.positions == 107
    assert np.degrees(fit.errors.mean()) < 0.6 < np.degrees(fit.paper_errors.mean())
    assert fit.span['theta'] == pytest.approx([0, np.radians(70)], abs=1e-6)
    assert fit.residuals['force_relative'] < 0.15 and fit.residuals['depth_relative'] < 0.08
    model = fit.model
    assert model.smooth is not None and model.level is not None and model.cross is not None
    assert 0.2 < model.levels(np.zeros((1, 2)))[0] < 1.0


@pytest.mark.parametrize(('selected', 'smooth', 'note'), [
    (slice(0, 3), None, 'too few'), (slice(0, 9), None, 'too few'), (slice(0, 14), 3, 'affine'), (slice(0, None, 4), 5, None)])
def test_with_fewer_positions_it_falls_back_with_a_note(selected, smooth, note):
    fit = fitted(selected)
    terms = None if fit.model.smooth is None else len(fit.model.smooth.slopes)
    assert terms in (smooth, None)
    assert note is None or any(note in line or 'no better' in line for line in fit.notes)


def test_the_light_of_a_contact_shifts_its_position(model):
    """A strong press looks nearer to the pole than it is; at the typical light nothing moves."""
    position = np.array([[0.4, 0.0], [0.0, -0.4]])
    light = model.shift.light(position)
    dim, typical, bright = (np.arccos(model.normals(position, part * light)[:, 2]) for part in (0.5, 1.0, 1.5))
    assert (np.degrees(bright - dim) > 0.3).all()
    assert typical == pytest.approx(np.arccos(model.normals(position)[:, 2]))


def test_presses_are_cut_into_stretches_with_their_loads():
    recording = played.recording('grid')
    presses = find_presses([recording], 4.9)
    segments = presses.segments
    assert len(presses.onsets.level) == 25 and presses.left_out == []
    assert segments.count.max() <= 50 and len(segments.count) > 100
    assert np.sqrt(presses.noise[TOTAL, TOTAL]) == pytest.approx(0.023, rel=0.1)
    assert presses.room == pytest.approx(recording.volts[:100].mean(0), abs=0.01)
    assert np.unique(segments.normal.round(6), axis=0).shape == (25, 3)
    assert (presses.onsets.level < 0.3 * presses.onsets.brightest).all()


def test_late_labels_of_contact_do_no_harm():
    recording = played.recording('grid')
    edges = np.flatnonzero(np.diff(recording.touching.astype(np.int8)))
    late = np.zeros_like(recording.touching)
    for begin, end in zip(edges[::2], edges[1::2]):
        late[begin + 80:end - 80] = True
    known = Recording(recording.volts, played.PERIOD, late, recording.normal, recording.force, recording.depth)
    exact, found = (find_presses([r], 4.9).segments.sums[:, TOTAL].max() for r in (recording, known))
    assert found == pytest.approx(exact, rel=0.01)


def test_unusable_recordings_are_refused():
    recording = played.recording('grid')
    touching = np.ones(len(recording.volts), bool)
    with pytest.raises(BadCalibration, match='untouched'):
        find_presses([Recording(recording.volts, played.PERIOD, touching, recording.normal, recording.force, recording.depth)], 4.9)
    unknown = np.full_like(recording.normal, np.nan)
    with pytest.raises(BadCalibration, match='no usable press'):
        find_presses([Recording(recording.volts, played.PERIOD, recording.touching, unknown, recording.force, recording.depth)], 4.9)


RANDOM = np.random.default_rng(2)
HELD_AT = RANDOM.uniform(-0.6, 0.6, (120, 2))
SQUARE = (HELD_AT**2).sum(1)
FORCE = RANDOM.uniform(0.5, 4.0, 120)
LIGHT = 2.5 * FORCE**0.7 * (1 - 0.8 * SQUARE) * RANDOM.normal(1, 0.01, 120)


def test_force_from_light_and_position():
    fitted, error = fit_load(HELD_AT, LIGHT, FORCE)
    found = np.exp(features(HELD_AT, LIGHT) @ fitted)
    assert np.median(np.abs(found / FORCE - 1)) < 0.03 and error < 0.03


@pytest.mark.parametrize('selected', [slice(0, 5), FORCE < 0.6])
def test_too_few_or_equal_loads_are_refused(selected):
    with pytest.raises(BadCalibration, match='12 are needed'):
        fit_load(HELD_AT[selected], LIGHT[selected], FORCE[selected])


def test_light_at_first_contact_by_position():
    level = 0.3 * (1 - 0.7 * SQUARE)
    fitted, span = fit_touch_level(HELD_AT, level + RANDOM.normal(0, 0.01, 120), 8 * level, 0.02)
    assert level_basis(HELD_AT, len(fitted)) @ fitted == pytest.approx(level, abs=0.015)
    assert 0.1 < span[0] < span[1] < 0.33 and 0.7 < span[2] < 0.9
    few, _ = fit_touch_level(HELD_AT[:3], level[:3], 8 * level[:3], 0.02)
    assert len(few) == 1


@pytest.mark.parametrize('level', [np.full(20, 1.5), np.full(20, 0.0), np.tile([0.05, 0.6], 10)])
def test_onsets_labelled_late_or_at_random_are_refused(level):
    with pytest.raises(BadCalibration, match='onset'):
        fit_touch_level(HELD_AT[:20], level, np.full(20, 2.0), 0.02)


COVER = Creep(0.06, 0.03)


def lights(creep, count=40, noise=0.01, wobble=0.0, seconds=0.25, period=1e-3, seed=0):
    """Lights of presses that rise within 20 ms and rest."""
    rng, times = np.random.default_rng(seed), np.arange(0, seconds, period)
    found = []
    for _ in range(count):
        level = rng.uniform(1, 5)
        load = level * np.clip(times / 0.02, 0, 1) * (1 + wobble * np.sin(2 * np.pi * (rng.uniform(2, 6) * times + rng.uniform())))
        late = np.zeros_like(load)
        for k in range(1, len(load)):
            late[k] = late[k - 1] + (load[k] - late[k - 1]) * period / creep.seconds
        found.append((period, (1 - creep.share) * load + creep.share * late + noise * level * rng.standard_normal(len(load))))
    return found


@pytest.mark.parametrize('creep', [COVER, Creep(0.03, 0.06), Creep(0.04, 0.012)])
def test_creep_is_fitted_to_presses_at_rest(creep):
    found = fit_creep(lights(creep))
    assert found.share == pytest.approx(0.8 * creep.share, rel=0.15) and found.seconds == pytest.approx(creep.seconds, rel=0.2)


@pytest.mark.parametrize('shown', [
    lights(Creep(0.0, 0.03)), lights(COVER, count=5), lights(COVER, seconds=0.06), lights(COVER, wobble=0.1), [],
    [(1e-3, np.full(300, np.nan))] * 9, [(1e-3, np.zeros(300))] * 9, [(1e-3, -np.ones(300))] * 9],
    ids=['none', 'few', 'short', 'by hand', 'nothing', 'unknown', 'dark', 'negative'])
def test_presses_that_show_no_creep_give_none(shown):
    assert fit_creep(shown) is None
