# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the estimators reach on recordings of other simulations, on real ones and on scenes that nothing was tuned to, as the benchmark's
programs measure it."""
import os
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
import dots
import pins
import pipeline
import psd
import scenes
import taxel
import taxel_slip
import worn_markers
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.dots.tracker import DotTracker
from tactile_perception.errors import BadArgument

RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', 'nowhere'))


def needs(folder):
    return pytest.mark.skipif(not (RECORDINGS / folder).is_dir(), reason=f'TACTILE_RECORDINGS holds no {folder}')


def touchpad(source, calibration=None, methods=('membrane', 'paper'), **more):
    try:
        opened = pipeline.sources.open_source(source, **more)
    except BadArgument as error:
        pytest.skip(str(error))
    scores = pipeline.run(opened, {name: pipeline.METHODS[name] for name in methods}, calibration)
    return {name: score.row() for name, score in scores.items()}


# Least contact F1, sticking F1, slipping F1, region IoU from the rest shape alone; NaN: nothing of that kind happens there.
@pytest.mark.parametrize('name, least', [('tp_rect_drag', (0.95, 0.85, 0.85, 0.87)), ('tp_ring_press', (0.87, 0.85, np.nan, 0.64)),
                                         ('tp_disc_twist', (0.95, 0.85, 0.85, 0.88))])
def test_the_touchpad_on_recordings_from_the_rest_shape_alone(name, least):
    found = touchpad(name)
    ours, papers = found['membrane'], found['paper']
    for key, bound in zip(('contact F1', 'stick F1', 'slip F1', 'IoU'), least):
        assert not ours[key] < bound, (key, ours[key])
    assert ours['contact F1'] > papers['contact F1'] - 0.01 and ours['IoU'] > papers['IoU']
    assert ours['xyz mm'] < 0.08 and ours['false frames'] == ours['refused'] == 0 and ours['missed'] < 2
    assert ours['depth mm'] < 0.1 and ours['force %'] < 5


@pytest.mark.parametrize('name, stick, slip, overlap', [('tp_disc_impact', 0.9, 0.85, 0.9), ('tp_rect_release', 0.95, 0.85, 0.81),
                                                        ('tp_two_spheres', 0.9, 0.8, 0.65)])
def test_the_touchpad_on_recordings_of_an_impact_a_release_and_two_objects(name, stick, slip, overlap):
    found = touchpad(name, methods=['membrane'])['membrane']
    assert found['contact F1'] > 0.88 and found['stick F1'] > stick and not found['slip F1'] < slip and found['IoU'] > overlap
    assert found['xyz mm'] < 0.06 and found['false frames'] == found['refused'] == 0


@pytest.mark.parametrize('name', ['tp_rect_drag', 'tp_disc_twist'])
def test_the_touchpad_on_recordings_when_calibrated(name, tmp_path):
    try:
        calibration = pipeline.sources.calibrate('tp_calib', tmp_path)
    except BadArgument as error:
        pytest.skip(str(error))
    found = touchpad(name, calibration, ['membrane'])['membrane']
    assert found['xyz mm'] < 0.03 and found['depth mm'] < 0.03 and found['force %'] < 5
    assert found['contact F1'] > 0.92 and found['IoU'] > 0.78


def test_nothing_touches_in_the_touchpads_recording_of_noise():
    for row in touchpad('tp_noise').values():
        assert row['false frames'] == 0 and row['refused'] == 0


# Least contact F1 and IoU. Dots that are free but within some micrometres of the object count as free here.
@pytest.mark.parametrize('name, least, overlap', [('ring_press', 0.85, 0.58), ('two_spheres', 0.74, 0.58), ('rectangle_drag', 0.88, 0.76),
                                                  ('glare', 0.84, 0.68), ('noise', 0.84, 0.68)])
def test_the_touchpad_in_our_own_scenes(name, least, overlap):
    found = touchpad(f'scene:{name}', rate=8.0)
    ours, papers = found['membrane'], found['paper']
    assert ours['contact F1'] > max(least, papers['contact F1']) and ours['IoU'] > max(overlap, papers['IoU'])
    assert ours['xyz mm'] < 0.12 and ours['false frames'] == ours['refused'] == 0


def test_each_of_two_objects_sticks_or_slips_by_its_own_motion():
    found = touchpad('scene:two_objects', methods=['membrane'])['membrane']
    assert found['contact F1'] > 0.95 and found['stick F1'] > 0.95 and found['slip F1'] > 0.8 and found['IoU'] > 0.8


@pytest.mark.parametrize('name', scenes.NAMES)
def test_dots_against_the_cramer_rao_bound(name):
    scene, rng = scenes.make_scene(name, 11), np.random.default_rng(11)
    for noise in dots.NOISES:
        detector = dots.DotDetector('dark')
        cells = [dots.score(scene, detector.detect(scene.frame(noise, rng)), noise) for _ in range(3)]
        found = dots.summary({**{key: sum(cell[key] for cell in cells) for key in cells[0]}, 'ms': np.nan})
        assert found['error_over_bound'] < 1.25 and 0.8 < found['normalised_variance'] < 1.25
        assert found['false_per_1000'] <= 1.0 and found['missed_per_1000'] <= (8.0 if name == 'all at once' else 1.0)


@pytest.mark.parametrize('specimen', ['sim:2', pytest.param('recorded', marks=needs('simulated/psd_cal_dense'))])
def test_the_finger_on_specimens_that_nothing_was_tuned_to(specimen):
    (made, models), grid = psd.fingers(specimen), psd.signals(specimen, 'grid')
    rows = {name: psd.accuracy(make(), models[name], grid) for name, make in made.items()}
    error = {name: np.array([r['error'] for r in found if r['theta'] < psd.FARTHEST]) for name, found in rows.items()}
    assert len(error['map']) == 25 and error['map'].mean() < 0.4 and error['map'].max() < 1.2
    assert error['paper'].mean() > 2 * error['map'].mean()
    within = [r for r in rows['map'] if r['theta'] < 46]
    assert max(r['deviation'] for r in within) < 1.5 and all(0.85 < r['deviation'] / r['bound'] < 1.4 for r in within)
    light, taps = (psd.contacts(made['map'](), psd.signals(specimen, name)) for name in ('light', 'taps'))
    assert light['false samples (%)'] == 0.0 and taps['missed'] == 0 and taps['events within a sample (%)'] > 80


def grasp(name):
    """Results of an array in a recording, its description, what is known of the grasp, and the truth."""
    folder = RECORDINGS / 'simulated'
    meta, known, truth = taxel.read(folder / name)
    array, _ = taxel.sensor(meta)
    return taxel.play(folder / name, 'mechanics', taxel.calibrate(folder, array))[0], meta, known, truth


@needs('simulated/tac_cal_flat')
def test_a_grasp_by_an_array_by_its_shape_and_wrench():
    results, meta, known, truth = grasp('tac_wrench_offset')
    shape, wrench = taxel.shape_errors(results, meta, truth), taxel.wrench_errors(results, meta, known, truth)
    assert np.median(shape['area']) < 0.05 and np.median(shape['centroid']) < 0.05 and np.median(shape['orientation']) < 0.2
    assert np.median(shape['overlap']) > 0.9 and np.median(wrench['force']) < 0.015 and np.median(wrench['moment']) < 0.02


@needs('simulated/tac_cal_flat')
def test_slip_on_an_array_is_seen_before_all_slips():
    results, _, _, truth = grasp('tac_incipient_rect')
    states = np.array([result.slip.state for result in results])
    assert not states[truth['slip_fraction'] < 0.045].any()  # 0.05 makes it incipient
    assert np.flatnonzero(states == 1)[0] < np.flatnonzero(truth['slip_state'] == 2)[0]
    assert np.mean(states[truth['slip_state'] == 2] == 2) > 0.7


@needs('sdh_slip')
def test_real_fingers_are_quiet_without_slip_and_slips_go_opposite_ways():
    found = {}
    for name in ('no_slippage', 'slip_up', 'slip_down'):
        for pad in taxel_slip.read_bag(RECORDINGS / f'sdh_slip/{name}.bag'):
            if pad.values.max() >= 60:
                found[pad.name] = taxel_slip.events(pad.t, *taxel_slip.play(pad))
    assert not any(events for name, events in found.items() if name.startswith('no_slippage'))
    up, down = found['slip_up pad 3'][0], found['slip_down pad 3'][0]
    assert 3.2 < up[0] < 3.7 and up[2] < 0 and 2.0 < down[0] < 3.3 and down[2] > 0


@needs('pin_array_127')
def test_all_pins_are_matched_and_tell_depth_and_tilt():
    found = pins.run(RECORDINGS / 'pin_array_127')
    assert np.all(found['matched'] == 127)
    assert found['depth, mm'][0] < 0.08 and found['depth, mm'][1] < 0.2 and found['tilt, deg'][0] < 3.0


def test_worn_markers_of_all_sizes_and_arrangements_are_found():
    scores = [one for _, one in worn_markers.run(9, 4, ('discs',))['discs']]
    row = worn_markers.together(scores).row()
    assert row['recall'] > 0.95 and row['false'] < 0.02 and min(one.row()['recall'] for one in scores) > 0.8
    assert row['rms px'] < 1.2 and 0.5 < row['error over sigma'] < 2


def test_markers_as_printed_are_placed_to_a_tenth_of_a_pixel():
    row = worn_markers.score(worn_markers.photograph(worn_markers.Print(wear=0.0, layout='random'), 50), 'discs').row()
    assert row['recall'] == 1 and row['false'] == 0 and row['rms px'] < 0.1 and 0.5 < row['error over sigma'] < 2


@pytest.mark.parametrize('wear', [0.0, 1.0])
def test_auto_is_as_good_as_the_best(wear):
    sheet = worn_markers.photograph(worn_markers.Print(wear=wear), 60)
    best = min((worn_markers.score(sheet, method).row() for method in ('discs', 'blobs', 'likelihood')),
               key=lambda row: (row['recall'] < 0.9, row['rms px']))
    row = worn_markers.score(sheet, 'auto').row()
    assert row['recall'] >= best['recall'] - 0.03 and row['rms px'] < 1.5 * best['rms px'] + 0.02


@pytest.mark.parametrize('scene, rows, columns, polarity', [('worn_grid', 11, 15, 'bright'), ('worn_hexagonal', 0, 0, 'bright'),
                                                            ('worn_random_dark', 0, 0, 'dark')])
def test_numbers_of_worn_markers_stay_while_a_fingertip_presses(scene, rows, columns, polarity):
    """Each number is one marker's from rest into the press; on a grid it is the right one."""
    film = open_scene(scene, rate=15.0, seed=2)
    assert (film.rows, film.columns) == (rows, columns)
    tracker, owner, seen, true = DotTracker(rows, columns, polarity, 'discs'), {}, 0, 0
    for k in range(22, 46):
        frame = film.render(k / film.rate)
        tracks = tracker.process(frame.image, k / film.rate)
        away = np.hypot(*(tracks.uv[:, None] - frame.truth.dot_uv).transpose(2, 0, 1))
        near = away.min(axis=1) < 8
        for number, marker in zip(tracks.id[near].tolist(), away.argmin(axis=1)[near].tolist()):
            assert owner.setdefault(number, marker) == marker
        seen, true = seen + near.sum(), true + len(frame.truth.dot_uv)
    if rows:
        assert all(number == marker for number, marker in owner.items())
    assert seen > 0.85 * true
