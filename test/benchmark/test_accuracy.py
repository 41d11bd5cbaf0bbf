# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the estimators reach on recordings of other simulations, on real ones and on scenes that nothing was tuned to, as `evaluate`
judges."""
import os
from pathlib import Path

import dots
import numpy as np
import parts
import printed_dots
import pytest
import taxel_slip
from judged import Case, calibrated, judge, recorded, recording_folder, report, touchpad_scene

from tactile_bringup import share
from tactile_bringup.simulate.bags import write_scene
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_perception.bags.replay import Replay
from tactile_perception.core.errors import BadArgument
from tactile_perception.gel.tools import calibrate_pins
from tactile_perception.tools.process_bag import process_bag

RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', 'nowhere'))


def needs(folder):
    return pytest.mark.skipif(not (RECORDINGS / folder).is_dir(), reason=f'TACTILE_RECORDINGS holds no {folder}')


def touchpad(folder, name, calibration=None, method='membrane'):
    """A touchpad's recording, or scene:NAME, by a method."""
    try:
        scene = name.removeprefix('scene:')
        case = recorded(folder, name, 'touchpad') if scene == name else touchpad_scene(folder, scene, 8.0)
    except BadArgument as error:
        pytest.skip(str(error))
    return judge([case], calibration, parts.TOUCHPAD_METHODS[method])


def check_touchpad(judged, contact, stick, slip, overlap):
    """Least F1 of contact, sticking and slipping dots, and mean overlap of the regions; NaN: nothing of that kind happens there."""
    found = {**judged.dots_f1(), 'overlap': judged.mean('region_overlap')}
    for reached, least in zip(found.values(), (contact, stick, slip, overlap), strict=True):
        assert not reached < least, found
    assert judged.evaluation.touches.frames['false'] == judged.refused == 0
    assert f"contact {found['contact']:.3f}" in report(judged)


@pytest.mark.parametrize('name, least', [('tp_rect_drag', (0.95, 0.85, 0.85, 0.87)), ('tp_ring_press', (0.87, 0.85, np.nan, 0.64)),
                                         ('tp_disc_twist', (0.95, 0.85, 0.85, 0.88))])
def test_the_touchpad_on_recordings_from_the_rest_shape_alone(tmp_path, name, least):
    ours = touchpad(tmp_path, name)
    check_touchpad(ours, *least)
    papers = touchpad(tmp_path, name, method='paper')
    assert ours.dots_f1()['contact'] > papers.dots_f1()['contact'] - 0.01
    assert ours.mean('region_overlap') > papers.mean('region_overlap')
    assert ours.medians()['depth'] < 0.1 and ours.medians()['force_relative'] < 5


@pytest.mark.parametrize('name, least', [('tp_disc_impact', (0.88, 0.9, 0.85, 0.9)), ('tp_rect_release', (0.88, 0.95, 0.85, 0.81)),
                                         ('tp_two_spheres', (0.75, 0.85, 0.3, 0.65))])  # a dozen dots slip, in the first frames
def test_the_touchpad_on_recordings_of_an_impact_a_release_and_two_objects(tmp_path, name, least):
    check_touchpad(touchpad(tmp_path, name), *least)


@needs('simulated/tp_calib')
def test_the_touchpad_on_a_recording_when_calibrated(tmp_path):
    name = 'tp_rect_drag'
    calibration = calibrated(recorded(tmp_path, 'tp_calib', 'touchpad'), 'touchpad', tmp_path / 'calibration.yaml', sphere_radius=0.008)
    found = touchpad(tmp_path, name, calibration)
    check_touchpad(found, 0.92, 0.85, 0.85, 0.78)
    assert found.medians()['depth'] < 0.03 and found.medians()['force_relative'] < 5
    # the dots' positions in 3D
    process_bag(Replay(tmp_path / name, tmp_path / f'{name}.yaml', calibration), tmp_path / 'out')
    truth, off = np.load(recording_folder(name) / 'truth.npz'), []
    with BagReader(tmp_path / 'out') as reader:
        for k, raw in enumerate(reader.messages({'/touchpad/dots'})):
            message = decode(raw.data, raw.type_name)
            off.append(np.column_stack([message.x, message.y, message.z]) - truth['dot_xyz'][k][np.array(message.id)])
    assert np.sqrt((np.concatenate(off)**2).sum(axis=1).mean()) < 0.03e-3


def test_nothing_touches_in_the_touchpads_recording_of_noise(tmp_path):
    for method in ('membrane', 'paper'):
        found = touchpad(tmp_path, 'tp_noise', method=method)
        assert found.instants > 5 and found.evaluation.touches.frames['false'] == found.refused == 0


@pytest.mark.parametrize('name, least, overlap', [('ring_press', 0.85, 0.58), ('glare', 0.84, 0.68), ('two_objects', 0.95, 0.8)])
def test_the_touchpad_in_our_own_scenes(tmp_path, name, least, overlap):
    found = touchpad(tmp_path, f'scene:{name}')
    check_touchpad(found, least, *((0.75, 0.55) if name == 'two_objects' else (np.nan, np.nan)), overlap)


def test_pins_calibrated_by_the_commands_of_their_page(tmp_path):
    presses, demo, params = tmp_path / 'pins_calib', tmp_path / 'pins_demo', Path(share('params', 'pin_dome.yaml'))
    for bag in (presses, demo):
        write_scene(bag, bag.name, 4.0)
    calibrate_pins([presses], params, tmp_path / 'pins.yaml')
    judged = judge([Case(demo, params)], tmp_path / 'pins.yaml')
    assert judged.medians()['position'] < 0.3 and judged.medians()['depth'] < 0.1  # mm
    frames = judged.evaluation.summary()['frames']
    assert (frames['missed'], frames['false']) == (0, 0)


@pytest.mark.parametrize('name', printed_dots.NAMES)
def test_dots_against_the_cramer_rao_bound(name):
    scene, rng = printed_dots.make_scene(name, 11), np.random.default_rng(11)
    for noise in dots.NOISES:
        detector = dots.DotDetector('dark')
        cells = [dots.score(scene, detector.detect(scene.frame(noise, rng)), noise) for _ in range(3)]
        found = {key: sum(cell[key] for cell in cells) for key in cells[0]}
        assert found['error2'] < 1.25**2 * found['bound2'] and 0.8 < found['normal2'] / found['matched'] < 1.25
        assert found['false'] <= 1e-3 * found['true']
        assert found['true'] - found['matched'] <= (8e-3 if name == 'all at once' else 1e-3) * found['true']


@needs('simulated/psd_cal_dense')
def test_the_finger_on_a_specimen_that_nothing_was_tuned_to(tmp_path):
    presses, grid, light = (recorded(tmp_path, name, 'psd_finger') for name in ('psd_cal_dense', 'psd_grid25', 'psd_nocontact_drift'))
    file = calibrated(presses, 'psd_finger', tmp_path / 'calibration.yaml')
    ours, papers = (judge([grid], file, {'method': method}, parts.in_reach) for method in ('map', 'paper'))
    assert ours.mean('normal', 180 / np.pi) < 1.0 and papers.mean('normal') > 1.2 * ours.mean('normal')
    touches = ours.evaluation.summary()['touches']
    assert touches['there'] >= 25 and touches['never_reported'] == touches['made_up'] == 0 and touches['reported_after_ms']['worst'] < 12
    assert judge([light], file).evaluation.touches.frames['false'] == 0


@pytest.fixture(scope='module')
def pressed_array(tmp_path_factory):
    """The folder, and the calibration of the array of the recordings."""
    folder = tmp_path_factory.mktemp('taxels')
    zero, flat = (recorded(folder, name, 'taxel_array') for name in ('tac_cal_zero', 'tac_cal_flat'))
    return folder, calibrated(flat, 'taxel_array', folder / 'calibration.yaml', [zero.bag])


@needs('simulated/tac_cal_flat')
def test_a_face_on_an_array_by_its_shape_and_force(pressed_array):
    folder, calibration = pressed_array
    middle = judge([recorded(folder, 'tac_static_ring', 'taxel_array')], calibration).medians()
    assert middle['region_overlap'] > 0.85 and middle['region_centroid'] < 0.1 and middle['force_relative'] < 4


@needs('simulated/tac_cal_flat')
def test_slip_on_an_array_is_seen_before_all_slips(pressed_array):
    folder, calibration = pressed_array
    states = []

    def counts(reported, true):
        states.append((true.slip.slipping_fraction, true.slip.state, reported.slip.state))
        return True
    judge([recorded(folder, 'tac_incipient_rect', 'taxel_array')], calibration, counts=counts)
    fraction, true, found = np.array(states).T
    assert not found[fraction < 0.045].any()  # 0.05 makes it incipient
    assert np.flatnonzero(found == 1)[0] < np.flatnonzero(true == 2)[0]
    assert np.mean(found[true == 2] == 2) > 0.65


@needs('sdh_slip')
def test_real_fingers_are_quiet_without_slip_and_slips_go_opposite_ways():
    found = {}
    for name in ('no_slippage', 'slip_up', 'slip_down'):
        for pad in taxel_slip.read_bag(RECORDINGS / f'sdh_slip/{name}.bag'):
            if pad.values.max() >= 60:
                found[pad.name], _ = taxel_slip.events(pad)
    assert not any(events for name, events in found.items() if name.startswith('no_slippage'))
    up, down = found['slip_up pad 3'][0], found['slip_down pad 3'][0]
    assert 3.2 < up[0] < 3.7 and up[2] < 0 and 2.0 < down[0] < 3.3 and down[2] > 0
