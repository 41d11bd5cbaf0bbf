# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Force taxels against three simulated devices: contacts, slip, wrench, drift, dead taxels, calibration."""
import time
from dataclasses import replace

import numpy as np
import pytest
import yaml
from geometry_msgs.msg import Wrench, WrenchStamped

from tactile_driver.force_taxels import TaxelFrame
from tactile_driver.force_taxels.messages import taxels_to_message
from tactile_driver.force_taxels.sources import simulated_frame
from tactile_driver.nodes.messages.conversions import header_of, vector
from tactile_driver.recordings.writer import write_messages
from tactile_driver.simulation.force_taxels.device import DEVICES
from tactile_driver.simulation.force_taxels.scene import VECTOR_SCENES, Key, VectorScene, VectorScript, open_vector_scene
from tactile_perception.core.errors import BadCalibration, BadFrame
from tactile_perception.core.parameter_files import read_parameters
from tactile_perception.force_taxels.estimator import ForceTaxelsEstimator, Response
from tactile_perception.force_taxels.parameters import FORCE_NODE, FORCE_PARAMETERS
from tactile_perception.force_taxels.stage import ForceTaxelsStage
from tactile_perception.force_taxels.tools import calibrate_weights

RATE = 50.0


def frames_of(scene, first_s=1.0):
    """(stamp in s, simulated frame, truth) of a scene."""
    for number in range(scene.frames):
        numbers, truth = scene.render(number / RATE)
        stamp = first_s + number / RATE
        yield stamp, simulated_frame(scene.shape, numbers, round(1e9 * stamp)), truth


def response_of(device):
    """What the maker of a simulated device says, without the irregularities of the specimen."""
    across, along = DEVICES[device][1].units
    return Response(np.diag(1 / np.array([across, across, along])))


def played(scene, response, edit=lambda stamp, frame: frame):
    """(time in s, result, truth) of each frame of a scene; the estimator."""
    estimator, found = ForceTaxelsEstimator(response), []
    for stamp, frame, truth in frames_of(scene):
        frame = edit(stamp, frame)
        result = estimator.process(frame.positions, frame.forces, frame.normals, stamp)
        assert (result is None) == (stamp < 2.0), 'nothing is known in the first second'
        found += [(stamp - 1.0, result, truth)] if result else []
    return found, estimator


def pressed(device, depth=8e-4, seconds=2.0, **more):
    """A ball that presses the middle of a device from 2 s on."""
    keys = (Key(0.0), Key(2.0), Key(2.3, depth=depth), Key(2.3 + seconds, depth=depth), Key(2.5 + seconds), Key(4.0 + seconds))
    return VectorScene(VectorScript(device, 'ball', keys), RATE, 11, **more)


@pytest.fixture(scope='module', params=DEVICES)
def pressing(request):
    device, specimen = request.param, replace(DEVICES[request.param][1], dead=0)
    return played(pressed(device, specimen=specimen), response_of(device))[0]


def test_a_press_is_one_contact_at_its_position_with_its_force(pressing):
    held = [(result, truth) for now, result, truth in pressing if 2.6 < now < 4.2]
    assert all(len(result.contacts) == 1 for result, _ in held)
    assert len({result.contacts[0].id for result, _ in held}) == 1
    away = [np.linalg.norm((result.contacts[0].position - truth.contacts[0].position)[:2]) for result, truth in held]
    force = [result.contacts[0].force / truth.contacts[0].force - 1 for result, truth in held]
    assert np.median(away) < 1e-3 and abs(np.median(force)) < 0.06
    assert all(result.contacts[0].normal @ truth.contacts[0].normal > 0.98 for result, truth in held)


def test_nothing_is_reported_untouched(pressing):
    for now, result, _ in pressing:
        if 1.1 < now < 1.9 or now > 5.2:
            assert not result.contacts and result.region.area == 0 and not result.wrench.any()


def test_the_wrench_is_that_of_the_object_within_its_stated_error(pressing):
    held = [(result, truth) for now, result, truth in pressing if 2.6 < now < 4.2]
    error = np.array([result.wrench - truth.wrench for result, truth in held])
    size = np.linalg.norm(held[0][1].wrench[:3])
    assert np.sqrt(np.mean(np.sum(error[:, :3]**2, axis=1))) < 0.06 * size
    scaled = [e[:3] @ np.linalg.solve(result.wrench_covariance[:3, :3], e[:3]) / 3 for e, (result, _) in zip(error, held)]
    assert np.mean(scaled) < 4
    region = held[-1][0].region
    assert len(region.outlines) == 1 and region.area > 0 and np.isfinite(region.outlines[0]).all()


@pytest.mark.parametrize('device', DEVICES)
def test_an_object_that_is_dragged_slips_and_one_that_is_held_does_not(device):
    found, estimator = played(open_vector_scene(f'{device}_demo', RATE, 5), response_of(device))
    for now, result, truth in found:
        if 2.3 < now < 2.6 or 3.3 < now < 3.6 or 5.0 < now < 5.2:  # pressed, sheared and held, held after the drag
            assert result.slip.state == 0 and not (result.region.dot_state == 2).any(), now
            assert result.slip.linear.tolist() == [0, 0, 0]
    dragged = [result.slip.slipping_fraction > 0.5 for now, result, truth in found if 4.0 < now < 4.6 and truth.slipping_fraction > 0.9]
    assert np.mean(dragged) > 0.55  # 0.62 to 0.73 on six seeds
    during = next(result for now, result, _ in found if now > 4.4 and result.slip.state)
    assert np.isnan(during.slip.linear).all() and len(during.slip.x) > 0 and during.slip.confidence > 0.5
    assert abs(estimator.slip.friction - 0.6) < 4 * estimator.slip.friction_sigma + 0.1


def test_before_anything_has_slipped_friction_is_unknown():
    found, estimator = played(pressed('uskin'), response_of('uskin'))
    assert estimator.slip.friction_sigma > 0.3
    assert sum(result.slip.state > 0 for _, result, _ in found) <= 0.01 * len(found)


def test_drift_is_followed_while_nothing_touches_and_a_lasting_press_is_kept():
    specimen = replace(DEVICES['uskin'][1], dead=0)
    found, _ = played(pressed('uskin', seconds=20.0, specimen=specimen), response_of('uskin'))
    held = [(result, truth) for now, result, truth in found if 20.0 < now < 22.2]
    assert held and all(len(result.contacts) == 1 for result, _ in held)
    errors = np.array([result.wrench[2] - truth.wrench[2] for result, truth in held])
    sigma = np.array([np.sqrt(result.wrench_covariance[2, 2]) for result, _ in held])
    assert np.abs(errors / sigma).mean() < 2
    scene = VectorScene(VectorScript('uskin', 'ball', (Key(0.0), Key(40.0))), RATE, 3, replace(specimen, drift=0.003))
    assert sum(bool(result.contacts) for _, result, _ in played(scene, response_of('uskin'))[0]) <= 2  # of 2000 frames


def test_dead_taxels_are_found_and_left_out():
    scene = pressed('uskin', specimen=replace(DEVICES['uskin'][1], dead=2))
    dead = set(scene.electronics.dead.tolist())

    def edit(_stamp, frame):
        rng = np.random.default_rng(round(_stamp * 1000))
        loud = frame.forces.copy()
        loud[15] += rng.normal(0, 2000.0, 3)
        return replace(frame, forces=loud)
    found, estimator = played(scene, response_of('uskin'), edit)
    assert set(np.flatnonzero(~estimator.baseline.alive).tolist()) == dead | {15}
    assert str(min(dead)) in estimator.warning
    for _, result, _ in found:
        for contact in result.contacts:
            assert not contact.members[sorted(dead)].any()


def test_a_taxel_that_freezes_is_left_out_after_a_while():
    frozen = {}

    def edit(stamp, frame):
        forces = frame.forces.copy()
        if stamp > 3:
            forces[5] = frozen.setdefault(0, forces[5].copy())
        return replace(frame, forces=forces)
    scene = VectorScene(VectorScript('fingertip', 'ball', (Key(0.0), Key(25.0))), RATE, 3, replace(DEVICES['fingertip'][1], dead=0))
    found, estimator = played(scene, response_of('fingertip'), edit)
    assert np.flatnonzero(~estimator.baseline.alive).tolist() == [5] and not any(result.contacts for _, result, _ in found)


def test_a_device_that_repeats_its_readings_shows_no_touch_and_the_same_press():
    rng, scene = np.random.default_rng(2), pressed('uskin', specimen=replace(DEVICES['uskin'][1], dead=0))
    estimator, shown, count = ForceTaxelsEstimator(response_of('uskin')), None, 0
    for stamp, frame, truth in frames_of(scene):
        for part in range(4):  # one taxel of four is read afresh in each frame, as XELA's server shows them
            new = rng.random(16) < 0.25
            shown = frame.forces.copy() if shown is None else np.where(new[:, None], frame.forces, shown)
            result = estimator.process(frame.positions, shown, frame.normals, stamp + part / (4 * RATE))
        count += bool(result and result.contacts) and not truth.contacts
        if 3.6 < stamp < 5.2:
            assert len(result.contacts) == 1 and result.slip.state == 0
    assert count <= 10  # while the last readings are still those of the touch


def test_without_units_contact_and_slip_are_known_and_forces_are_not():
    found, _ = played(pressed('uskin'), None)
    held = [result for now, result, _ in found if 2.6 < now < 4.0]
    assert all(len(result.contacts) == 1 and np.isnan(result.contacts[0].force) and np.isnan(result.wrench).all() for result in held)
    assert np.isnan(held[0].points().force).all() and (held[0].points().state > 0).any()


def test_normals_that_are_not_given_are_those_of_the_surface():
    scene = pressed('fingertip')
    _, frame, _ = next(frames_of(scene))
    estimator = ForceTaxelsEstimator(None)
    estimator.process(frame.positions, frame.forces, None, 1.0)
    assert np.median(np.sum(estimator.taxels.normals * frame.normals, axis=1)) > 0.95


def test_a_frame_without_readings_is_refused_and_one_with_some_is_used():
    scene = pressed('uskin')
    stage = ForceTaxelsStage({'sensor_type': 'force_taxels', 'force_unit': 0.0, 'calibration': ''})
    for stamp, frame, _ in frames_of(scene):
        if stamp > 2.1:
            break
        forces = frame.forces.copy()
        forces[3] = np.nan
        found = stage.process(taxels_to_message(replace(frame, forces=forces), header_of(frame.stamp_ns, 'skin')))
        assert bool(found) == (stamp > 1.99), 'nothing is reported in the first second'
    assert found['contacts'][0].header.frame_id == 'skin' and not found['contacts'][0].contacts
    assert '3' in stage.health()[0] and 'friction' in stage.health()[1]
    with pytest.raises(BadFrame, match='no taxel'):
        nothing = TaxelFrame(frame.positions, frame.normals, np.full(frame.forces.shape, np.nan), frame.stamp_ns + 10**7)
        stage.process(taxels_to_message(nothing, header_of(nothing.stamp_ns, 'skin')))
    message = taxels_to_message(frame, header_of(frame.stamp_ns + 2 * 10**7, 'skin'))
    message.fields = message.fields[:5]
    with pytest.raises(BadFrame, match='fz'):
        stage.process(message)
    stage.set_reference()
    assert not stage.estimator.baseline.is_known


def weights_bag(folder, device, only=None, truth=True, seed=0):
    """A recording of the loads of a device; only: the first so many seconds of a load along one axis."""
    scene, bag = open_vector_scene(f'{device}_weights', RATE, seed), folder / f'{device}_{only}'
    messages = []
    for _, frame, known in frames_of(scene):
        header = header_of(frame.stamp_ns, 'skin')
        messages.append((frame.stamp_ns, 'taxels', taxels_to_message(frame, header)))
        if truth:
            wrench = Wrench(force=vector(known.wrench[:3]), torque=vector(known.wrench[3:]))
            messages.append((frame.stamp_ns, 'ground_truth/wrench', WrenchStamped(header=header, wrench=wrench)))
    if only is not None:
        begin = 1e9 + 1e9 * only * 2.9
        messages = [item for item in messages if begin <= item[0] < begin + 2.9e9]
    write_messages(bag, '/skin', messages)
    return bag


@pytest.mark.parametrize('device', ['uskin', 'fingertip'])
def test_a_calibration_with_weights_gives_the_force(tmp_path, device):
    params, output = tmp_path / 'skin.yaml', tmp_path / 'calibration.yaml'
    params.write_text(yaml.safe_dump({'/**': {'ros__parameters': {'sensor_type': 'force_taxels'}}}))
    report = calibrate_weights([weights_bag(tmp_path, device, seed=11)], params, output)
    assert report.startswith('6 loads of 2.5 to 5 N')
    values = read_parameters(params, FORCE_NODE, FORCE_PARAMETERS) | {'calibration': str(output)}
    assert yaml.safe_load(output.read_text())['residuals']['force_rms_percent'] < 2.0
    stage = ForceTaxelsStage(values)
    forces = []
    for stamp, frame, truth in frames_of(pressed(device, specimen=replace(DEVICES[device][1], dead=0))):
        found = stage.process(taxels_to_message(frame, header_of(frame.stamp_ns, 'skin')), ['wrench'])
        if 2.6 < stamp - 1.0 < 4.2:
            forces.append((found['wrench'][0].wrench.force.z, truth.wrench[2]))
    given, true = np.array(forces).T
    assert abs(np.median(given / true) - 1) < 0.05


def test_one_weight_along_each_axis_is_enough_and_two_are_not(tmp_path):
    params, output = tmp_path / 'skin.yaml', tmp_path / 'calibration.yaml'
    params.write_text(yaml.safe_dump({'/**': {'ros__parameters': {'sensor_type': 'force_taxels'}}}))
    bags = [weights_bag(tmp_path, 'pillars', only=k, truth=False) for k in range(3)]
    with pytest.raises(BadCalibration, match='--weight'):
        calibrate_weights(bags, params, output)
    with pytest.raises(BadCalibration, match='along y'):
        calibrate_weights(bags[:2], params, output, weight=5.0)
    assert '3 loads of 5 to 5 N' in calibrate_weights(bags, params, output, weight=5.0)


def test_a_hundred_taxels_take_little_time():
    y, x = np.mgrid[:10, :10].reshape(2, -1)
    positions, normals = np.column_stack([x, y, 0 * x]) * 0.004, np.tile([0.0, 0.0, 1.0], (100, 1))
    rng, estimator, taken = np.random.default_rng(0), ForceTaxelsEstimator(Response(np.eye(3))), []
    bump = np.exp(-0.5 * ((x - 4.3)**2 + (y - 5.1)**2) / 4)[:, None] * [0.1, 0.05, -0.5]
    for number in range(400):
        forces = rng.normal(0, 0.003, (100, 3)) + (bump if number > 150 else 0)
        begin = time.perf_counter()
        result = estimator.process(positions, forces, normals, 1 + number / 100)
        taken.append(time.perf_counter() - begin)
    assert len(result.contacts) == 1 and np.median(taken[200:]) < 2e-3  # 0.2 ms where the machine is not busy


def test_scenes_have_their_devices():
    assert {f'{device}_{name}' for device in DEVICES for name in ('demo', 'rest', 'weights', 'random')} <= set(VECTOR_SCENES)
