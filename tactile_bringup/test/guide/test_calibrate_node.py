# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Guided sessions on the simulated stage, unattended, at the pace of this machine: interrupted, gone on with, and calibrated."""
from itertools import chain

import numpy as np
import pytest
from guided_lab import SHARE, Lab
from scipy.spatial.transform import Rotation

from tactile_bringup.hand.description import read_hand
from tactile_bringup.nodes.simulated_stage import MOUNTING
from tactile_bringup.simulate.bags import camera_messages, psd_messages, taxel_messages
from tactile_driver.nodes.messages.ground_truth import TouchNumbers
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode
from tactile_driver.simulation.psd_scene import open_psd_scene
from tactile_driver.simulation.sensors.gel import MATERIAL
from tactile_driver.simulation.sensors.scenes import open_dual_scene, open_scene
from tactile_driver.simulation.taxel.scene import Key, TaxelScene, TaxelScript, open_taxel_scene
from tactile_perception.common.marker_sensor import MARKER_SENSORS
from tactile_perception.core.calibration_file import read_calibration
from tactile_perception.core.sensor_type import SENSOR_TYPES
from tactile_perception.tools.calibrate import main as calibrate

pytestmark = [pytest.mark.full, pytest.mark.slow, pytest.mark.timeout(1200)]


def scene_messages(sensor_type, rounds=1):
    """(stamp in ns, topic, message) of the scene of a session; rounds: how often a camera's is played."""
    if sensor_type == 'psd_finger':
        return psd_messages(open_psd_scene('session', 1000.0), 1000.0, 'palm')
    if sensor_type == 'taxel_array':
        return taxel_messages(open_taxel_scene('session', 20.0), 20.0, 'palm')
    name = 'session' if sensor_type == 'touchpad' else f'{sensor_type}_session'
    scene, numbers = (open_dual_scene if SENSOR_TYPES[sensor_type].stitched else open_scene)(name, 10.0), TouchNumbers()
    return chain.from_iterable(camera_messages(scene, k, numbers, 'palm') for k in range(rounds * scene.frames))


def touches(bag):
    """((N, 3) tips, (N,) depths, (N,) forces) of a bag's ground truth."""
    with BagReader(bag) as reader:
        found = [decode(raw.data, raw.type_name) for raw in reader.messages({'/palm/ground_truth/contacts'})]
    contacts = [message.contacts[0] for message in found if message.contacts]
    assert not found[0].contacts, 'it begins untouched'
    return (np.array([(c.position.x, c.position.y, c.position.z) for c in contacts]), np.array([c.depth for c in contacts]),
            np.array([c.force for c in contacts]))


def error_of(calibration, sensor_type):
    """The error of a calibration at held-out presses: of positions (m), of a finger in rad, of an array's forces relative."""
    names = {'touchpad': 'held_out_places_range_rms', 'psd_finger': 'left_out_mean', 'taxel_array': 'held_out_force_mean'}
    residuals = read_calibration(calibration, sensor_type).residuals
    return residuals['model']['place_mean'] if sensor_type in MARKER_SENSORS else residuals[names[sensor_type]]


def check_calibration(lab, sensor_type, limit=None):
    """The session ends with a calibration about as exact as the one that ships, or within a limit, as where none does."""
    session = lab.session
    lab.close()
    given = ['--params', str(session.params), '--output', str(session.output), *session.sphere]
    assert session.complete and calibrate([*map(str, session.presses.paths), *given]) == 0
    limit = limit or 2 * error_of(f'{SHARE}/calibration/{sensor_type}_sim.yaml', sensor_type)
    found = error_of(session.output, sensor_type)
    print(sensor_type, found, limit)
    assert found < limit


def test_a_session_is_interrupted_goes_on_and_ends_with_a_calibration(tmp_path, capfd):
    messages, truth = scene_messages('areal_single'), []

    def noted():
        for stamp, topic, message in messages:
            if topic == 'ground_truth/contacts' and message.contacts:
                touch = message.contacts[0]
                truth.append([touch.position.x, touch.position.y, touch.position.z, touch.force])
            yield stamp, topic, message
    lab, played = Lab('areal_single', tmp_path / 'palm.yaml'), noted()
    for count in lab.play(played):
        if count == 3:
            break
    kept = lab.session.presses.paths
    lab.close()
    lab = Lab('areal_single', tmp_path / 'palm.yaml')
    assert lab.session.presses.paths == kept
    for _ in lab.play(played):
        pass
    assert lab.session.complete and len(lab.session.presses.paths) == 12
    tips, depths, forces = touches(lab.session.presses.paths[0])
    reported = capfd.readouterr().err
    assert 'without 1 s untouched' in reported and 'never stood still' in reported, 'the scene has such presses'
    nearest = np.array([min(truth, key=lambda true: np.linalg.norm(np.subtract(true[:3], tip))) for tip in tips])  # noqa: B023
    assert np.abs(tips - nearest[:, :3]).max() < 1e-6 and depths == pytest.approx(-tips[:, 2]), 'm; the mounting is known'
    assert np.abs(forces - nearest[:, 3]).max() < 0.1, 'N; noise, and the weight of the tool, are taken off'
    check_calibration(lab, 'areal_single')


@pytest.mark.parametrize('sensor_type', ['touchpad', 'areal_dual', 'psd_finger', 'taxel_array', 'air_cushion'])
def test_a_session_of_each_other_type_ends_with_a_calibration(sensor_type, tmp_path):
    lab = Lab(sensor_type, tmp_path / 'palm.yaml', ahead=20 if sensor_type == 'psd_finger' else 5)
    for _ in lab.play(scene_messages(sensor_type)):
        pass
    check_calibration(lab, sensor_type, 1e-4 if sensor_type == 'touchpad' else None)


def test_a_sensor_that_is_not_quite_where_it_is_supposed_is_found_by_touching_it(tmp_path):
    off = np.array([4e-3, -6e-3, 5e-3, 0.05, -0.04, 0.06])
    lab = Lab('areal_single', tmp_path / 'palm.yaml', mounting=(np.array(MOUNTING) + off).tolist(), find='true')
    for count in lab.play(scene_messages('areal_single', rounds=2)):
        if count == 1:
            break
    lab.close()
    text, found = lab.session.mounting_file.read_text(), read_hand(lab.session.mounting_file)
    sensor, = found.sensors
    true, turn = np.array(MOUNTING[:3]), Rotation.from_rotvec(MOUNTING[3:])
    error = np.r_[turn.inv().apply(sensor.xyz - true), (turn.inv() * Rotation.from_quat(sensor.quaternion)).as_rotvec()]
    sigma = np.array([float(word) for word in text.splitlines()[0].replace(',', '').split() if word[:1].isdigit()])
    sigma = np.r_[1e-3 * sigma[:3], np.radians(sigma[3:])]
    print(error, sigma)
    assert (found.frame, sensor.name, sensor.type) == ('stage_base', 'palm', 'areal_single')
    assert (np.abs(error) < 3 * sigma).all() and sigma[2] < 1e-4, 'm'
    tips, depths, _ = touches(lab.session.presses.paths[0])
    assert np.ptp(depths) == pytest.approx(4e-3, abs=1e-4) and depths.min() == pytest.approx(2e-3, abs=3 * sigma[2] + 1e-5)


def test_a_session_with_known_weights_ends_with_a_calibration(tmp_path):
    levels = [1e-4 * k for k in (0.5, 0.8, 1.2, 1.8, 2.6, 4, 2.6, 1.8, 1.2, 0.8, 0.5)]
    steps = [(0.0, -1e-4), (1.5, -1e-4), *((2.0 + 2.0 * k + hold, depth) for k, depth in enumerate(levels) for hold in (0.0, 1.5))]
    steps += [(steps[-1][0] + 0.5, -1e-4), (steps[-1][0] + 7.0, -1e-4)]
    scene = TaxelScene(TaxelScript('edge', tuple(Key(t, -0.05, 0.0, 0.0, depth) for t, depth in steps)), 20.0, 0)
    laid_on = [2.2 + 2.0 * k for k in range(len(levels))] + [steps[-2][0] + 0.2]  # s, when each lies
    weights = [abs(float(scene.render(t + 0.5)[1].wrench[2])) for t in laid_on]
    assert weights[-1] == 0 and max(weights) > 5
    lab, confirmed = Lab('taxel_array', tmp_path / 'mat.yaml', weights=weights, wrench=None, probe=None), 0
    messages = [(stamp, topic, message) for stamp, topic, message in taxel_messages(scene, 20.0, 'palm') if topic == 'image_raw']
    for number, _ in enumerate(lab.play(messages)):
        if confirmed < len(laid_on) and number / 20.0 > laid_on[confirmed]:
            lab.call('next')
            confirmed += 1
    assert confirmed == len(weights)
    check_calibration(lab, 'taxel_array', 0.005)  # where weights lie apart, a load that is left out is less well known


def test_a_session_with_one_known_weight_calibrates_a_gel(tmp_path):
    scene, numbers, rate = open_scene('gel_demo', 10.0), TouchNumbers(), 10.0
    weight, pressed_s, answers = float(-scene.observe(27).wrench[2]), 2.5, []
    messages = (message for k in range(scene.frames) for message in camera_messages(scene, k, numbers, 'palm')
                if message[1] in ('camera_info', 'image_raw'))
    lab = Lab('gel', tmp_path / 'gel.yaml', weights=[weight], wrench=None, probe=None)
    for number, _ in enumerate(lab.play(messages)):
        if not answers and number > 2 * pressed_s * rate:
            answers.append(lab.call('next'))
    session = lab.session
    lab.close()
    assert answers == [f'hold still: {weight:g} N']
    bags = map(str, session.presses.paths)
    assert session.complete and calibrate([*bags, '--params', str(session.params), '--output', str(session.output)]) == 0
    fitted = read_calibration(session.output, 'gel').fitted
    assert fitted['young_modulus'] == pytest.approx(MATERIAL.young, rel=0.1) and fitted['force_sigma'] < 0.2
