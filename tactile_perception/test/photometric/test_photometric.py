# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A gel without markers, calibrated with a ball as a user does, against the depths of a simulated one, which another ball or a ring
presses."""
import cv2
import numpy as np
import pytest
import yaml

from tactile_driver.frame import Frame
from tactile_driver.nodes.messages.conversions import header_of, image_to_message
from tactile_driver.recordings.writer import write_messages
from tactile_driver.simulation.sensors.photometric_gel import SHADED
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.core.errors import BadCalibration, BadFrame
from tactile_perception.core.parameter_files import read_parameters
from tactile_perception.photometric.calibration import BallFit, Press
from tactile_perception.photometric.circles import CircleSearch
from tactile_perception.photometric.estimator import is_on_flank
from tactile_perception.photometric.observation import Background, to_working_size
from tactile_perception.photometric.parameters import PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS
from tactile_perception.photometric.stage import PhotometricStage
from tactile_perception.photometric.surface import Integrator
from tactile_perception.photometric.tools import calibrate_balls, calibrate_gel

RATE, SEED = 10.0, 5


def messages_of(name):
    scene = open_scene(name, RATE, SEED)
    for number in range(scene.frames):
        seen, stamp = scene.render(number / RATE), round((1 + number / RATE) * 1e9)
        yield stamp, 'image_raw', image_to_message(Frame(seen.image, stamp, 'bgr8'), '', header_of(stamp, 'gel')), seen.truth


@pytest.fixture(scope='module', params=['', '_dots'])
def specimen(request, tmp_path_factory):
    """Values of the parameters of a calibrated gel, without dots and with; the report of calibrate; its scenes."""
    folder = tmp_path_factory.mktemp('photometric')
    params, bag, output = folder / 'gel.yaml', folder / 'presses', folder / 'calibration.yaml'
    params.write_text(yaml.safe_dump({'/**': {'ros__parameters': {'sensor_type': 'photometric_gel', 'gel.scale': SHADED.scale}}}))
    write_messages(bag, '/gel', (frame[:3] for frame in messages_of(f'photometric{request.param}_calib')))
    report = calibrate_balls([bag], params, output, sphere_radius=0.0025)
    values = read_parameters(params, PHOTOMETRIC_NODE, PHOTOMETRIC_PARAMETERS) | {'calibration': str(output)}
    return values, report, folder, 'photometric_dots' if request.param else 'photometric_demo'


def played(values, name):
    """(result, truth) of each frame of a scene."""
    stage = PhotometricStage(values)
    stage.use_frame('gel')
    return [(stage.process(message), truth) for _, _, message, truth in messages_of(name)]


def test_a_ball_of_another_radius_is_one_contact_at_its_position_and_depth(specimen):
    values, _, _, scene = specimen
    errors, depths, sigmas, areas, deep = [], [], [], [], 0
    for found, truth in played(values, scene):
        contacts = found['contacts'][0].contacts
        if truth.contacts and truth.contacts[0].depth > 1e-4:
            deep += 1
            assert len(contacts) == 1
            position, true = contacts[0].position, truth.contacts[0]
            errors.append(np.hypot(position.x - true.position[0], position.y - true.position[1]))
            depths.append(contacts[0].depth - true.depth)
            sigmas.append(np.sqrt(contacts[0].position_covariance[8]))
            areas.append(found['contact_region'][0].area / truth.area)
        elif not truth.contacts:
            assert not contacts
    assert deep >= 9
    assert np.median(errors) < 0.1e-3
    assert np.sqrt(np.mean(np.square(depths))) < 0.05e-3
    assert 0.02 < np.mean(np.square(np.array(depths) / sigmas)) < 2.5  # three presses near the middle; all over the gel: the benchmark
    assert 0.75 < min(areas) and max(areas) < 1.25


def test_the_region_of_a_flat_rod_is_its_end_and_not_the_skin_beside_it(specimen):
    values, _, _, scene = specimen
    areas = [found['contact_region'][0].area / truth.area for found, truth in played(values, 'photometric_stamp') if
             truth.contacts and truth.contacts[0].depth > 3e-4]
    assert len(areas) > 5 and 0.75 < np.median(areas) < 1.3


def test_a_circle_that_is_on_no_ball_is_left_out_of_the_fit():
    scene = open_scene('photometric_calib', RATE, SEED)
    shots = [scene.render(number / RATE) for number in range(scene.frames)]
    background = Background(to_working_size(shots[0].image))
    search, presses = CircleSearch(background.shape), []
    for shot in shots:
        if shot.truth.contacts and shot.truth.contacts[0].depth > 5e-4:
            working = to_working_size(shot.image)
            change, hidden = background.change(working), background.hidden(working)
            presses.append(Press(f'press {len(presses)}', working, change, hidden, search.find(change, hidden)))
    circle = presses[4].circle
    presses[4] = presses[4]._replace(circle=circle._replace(x=(circle.x + 160) % 320))
    fit = BallFit(presses, 0.0025 / (SHADED.scale * 2))
    assert len(fit.left_out) == 1 and fit.left_out[0].startswith('press 4: ') and len(fit.presses) == len(presses) - 1


def test_two_balls_are_two_contacts_and_a_flank_is_none():
    depth, mask = np.zeros((60, 80), np.float32), np.zeros((60, 80), bool)
    y, x = np.mgrid[:60, :80]
    for column, height in ((20, 1.0), (55, 0.4)):
        depth += (height * np.exp(-((x - column)**2 + (y - 30)**2) / 50.0)).astype(np.float32)
    mask[27:34, 52:59] = True
    assert not is_on_flank(depth, mask)
    mask[:], mask[27:34, 26:30] = False, True
    assert is_on_flank(depth, mask)


def test_a_ring_has_a_hole(specimen):
    values, _, _, scene = specimen
    regions = [found['contact_region'][0] for found, truth in played(values, 'photometric_ring') if
               truth.contacts and 3e-4 < truth.contacts[0].depth < 5e-4]  # deeper ones are steeper than the ball of the calibration
    assert regions and all(len(region.outlines) == 1 for region in regions)
    assert np.mean([bool(region.holes) for region in regions]) > 0.5


def test_what_calibrate_reports(specimen):
    _, report, folder, _ = specimen
    assert report.startswith('20 presses of a ball of 2.5 mm radius')
    fitted = yaml.safe_load((folder / 'calibration.yaml').read_text())
    assert fitted['residuals']['depth_rms_mm'] < 0.05 and fitted['residuals']['position_rms_mm'] < 0.15
    assert cv2.imread(str(folder / 'calibration_circles.png')) is not None


def test_an_untouched_gel_has_no_contact_and_the_surface_is_flat(specimen):
    values, _, _, scene = specimen
    frames = played(values, scene)
    for found, truth in frames:
        if not truth.contacts:
            assert not found['contacts'][0].contacts and found['contact_region'][0].area == 0.0


def test_the_same_image_gives_zero(specimen):
    values, _, _, scene = specimen
    stage, (_, _, message, _) = PhotometricStage(values), next(messages_of(scene))
    for number in range(1, 13):
        message.header.stamp.sec = number
        found = stage.process(message)
        assert not found['contacts'][0].contacts
        points = np.frombuffer(bytes(found['points'][0].data), np.float32).reshape(-1, 14)
        assert np.abs(points[:, 2]).max() == 0.0


def test_another_light_than_that_of_the_calibration_is_said(specimen):
    values, _, _, scene = specimen
    stage = PhotometricStage(values)
    _, _, message, _ = next(messages_of(scene))
    stage.process(message)
    assert stage.health()[0] == ''
    stage = PhotometricStage(values)
    pixels = np.frombuffer(bytes(message.data), np.uint8).reshape(480, 640, 3).copy()
    pixels[..., 0] //= 2
    stage.process(image_to_message(Frame(pixels, 1, 'bgr8'), '', message.header))
    assert 'differs' in stage.health()[0] and 'calibrate again' in stage.health()[0]


def test_a_reference_with_a_touch_in_it_is_said(specimen):
    values, _, _, scene = specimen
    stage = PhotometricStage(values)
    stage.process(next(message for *_, message, truth in messages_of(scene) if truth.contacts and truth.contacts[0].depth > 5e-4))
    assert 'touched it there' in stage.health()[0] and 'set_reference' in stage.health()[0]


def test_images_of_another_resolution_are_refused_until_gel_scale_is_that_of_them(specimen):
    values, _, _, scene = specimen
    _, _, message, _ = next(messages_of(scene))
    pixels = np.frombuffer(bytes(message.data), np.uint8).reshape(480, 640, 3)
    half = image_to_message(Frame(np.ascontiguousarray(pixels[::2, ::2]), 1, 'bgr8'), '', message.header)
    with pytest.raises(BadFrame, match='gel.scale'):
        PhotometricStage(values).process(half)
    with pytest.raises(BadFrame, match='640 x 360'):
        PhotometricStage(values).process(image_to_message(Frame(np.ascontiguousarray(pixels[60:-60]), 1, 'bgr8'), '', message.header))
    assert PhotometricStage(values | {'gel.scale': 2 * SHADED.scale}).process(half)


def test_without_a_calibration_nothing_is_estimated_and_the_user_is_told(specimen):
    values, _, _, scene = specimen
    stage = PhotometricStage(values | {'calibration': ''})
    assert stage.process(next(messages_of(scene))[2]) == {}
    assert 'press a ball' in stage.health()[0]


def test_a_grey_image_is_refused(specimen):
    values, _, _, _ = specimen
    with pytest.raises(BadFrame, match='grey'):
        PhotometricStage(values).process(image_to_message(Frame(np.zeros((480, 640), np.uint8), 1, 'mono8'), '', header_of(10**9, 'gel')))


def test_a_calibration_needs_a_radius_and_presses(specimen, tmp_path):
    _, _, folder, _ = specimen
    with pytest.raises(BadCalibration, match='--sphere-radius'):
        calibrate_balls([folder / 'presses'], folder / 'gel.yaml', tmp_path / 'c.yaml')
    with pytest.raises(BadCalibration, match='times the radius of the ball'):
        calibrate_balls([folder / 'presses'], folder / 'gel.yaml', tmp_path / 'c.yaml', sphere_radius=0.0008)
    bag = tmp_path / 'untouched'
    first = [one for one in messages_of('photometric_demo') if not one[3].contacts][:15]
    write_messages(bag, '/gel', (frame[:3] for frame in first))
    with pytest.raises(BadCalibration, match='0 presses'):
        calibrate_balls([bag], folder / 'gel.yaml', tmp_path / 'c.yaml', sphere_radius=0.0025)


def test_slopes_of_a_known_surface_integrate_to_it():
    y, x = np.mgrid[:90, :120]
    surface = 3.0 * np.exp(-((x - 40)**2 + (y - 50)**2) / 200.0)
    slope = np.dstack([np.gradient(surface, axis=1), np.gradient(surface, axis=0)]).astype(np.float32)
    found = Integrator(surface.shape).depth(slope)
    assert np.abs(found - found.min() - surface).max() < 0.05


@pytest.mark.parametrize('centre, radius', [((60.0, 80.0), 20.0), ((200.0, 150.0), 45.0)])
def test_the_circle_of_a_ball_is_found(centre, radius):
    y, x = np.mgrid[:240, :320].astype(np.float32)
    inside = np.hypot(x - centre[0], y - centre[1]) < radius
    change = np.zeros((240, 320, 3), np.float32)
    change[inside] = (np.stack([x - centre[0], y - centre[1], -(x - centre[0])], axis=-1) / radius)[inside]
    change += np.random.default_rng(1).normal(0, 0.1, change.shape).astype(np.float32)
    found = CircleSearch((240, 320)).find(change, np.zeros((240, 320), bool))
    assert np.hypot(found.x - centre[0], found.y - centre[1]) < 2.0 and abs(found.radius / radius - 1) < 0.1


@pytest.fixture(scope='module')
def dragged(specimen):
    """(result, truth) of each frame of a ball that is pressed and dragged over a gel with dots until it slips."""
    return played(specimen[0] | {'gel.markers': True, 'gel.friction': 0.5, 'gel.thickness': 0.004}, 'photometric_shear')


@pytest.mark.parametrize('specimen', ['_dots'], indirect=True)
def test_known_weights_give_the_force_of_other_presses_and_its_error(specimen, tmp_path):
    values, _, _, _ = specimen
    frames = list(messages_of('photometric_shear'))
    params, output = tmp_path / 'gel.yaml', tmp_path / 'calibration.yaml'
    params.write_text(yaml.safe_dump({'/**': {'ros__parameters': {
        'sensor_type': 'photometric_gel', 'gel.scale': SHADED.scale, 'gel.thickness': 0.004, 'calibration': values['calibration']}}}))
    write_messages(tmp_path / 'weight', '/gel', [frame[:3] for frame in frames[:31]])  # up to the end of the press, before the drag
    report = calibrate_gel([tmp_path / 'weight'], params, output, weight=-float(frames[30][3].wrench[2]))
    assert report.startswith('1 loads')
    stage = PhotometricStage(values | {'calibration': str(output), 'gel.thickness': 0.004})
    force = []
    for _, _, message, truth in frames:
        wrench = stage.process(message, ['wrench'])['wrench'][0].wrench
        if truth.contacts and truth.contacts[0].depth > 2e-4:
            force.append((wrench.force.z, truth.wrench[2]))
            assert np.isnan([wrench.force.x, wrench.force.y, wrench.torque.z]).all()
        elif not truth.contacts:
            assert wrench.force.z == 0.0
    found, true = np.array(force).T
    sigma = stage.model.force_error
    assert 0.1 < sigma < 0.2 and (true < 0).all()
    assert np.sqrt(np.mean((found / true - 1)**2)) < 1.5 * sigma
    assert np.isnan(PhotometricStage(values | {'calibration': str(output)}).process(frames[0][2], ['wrench'])['wrench'][0].wrench.force.z)
    with pytest.raises(BadCalibration, match='not both'):
        calibrate_gel([tmp_path / 'weight'], params, output, weight=1.0, sphere_radius=0.002)


@pytest.mark.parametrize('specimen', ['_dots'], indirect=True)
def test_dots_of_a_gel_with_markers_have_their_displacements_and_places_on_the_skin(dragged):
    reference, errors, heights = dragged[0][1].dot_uv, [], []
    for found, truth in dragged:
        dots = found['dots'][0]
        uv, duv = (np.column_stack(pair).astype(float) for pair in ((dots.u, dots.v), (dots.du, dots.dv)))
        dot = ((truth.dot_uv[:, None] - uv)**2).sum(axis=2).argmin(axis=0)
        assert len(set(dot)) == len(uv) >= 100
        errors.append(duv - (truth.dot_uv - reference)[dot])
        heights.append(dots.z - truth.dot_xyz[dot, 2])
    assert max(np.abs(truth.dot_uv - reference).max() for _, truth in dragged) > 25  # px
    assert np.sqrt(np.mean(np.concatenate(errors)**2)) < 0.1
    assert np.sqrt(np.mean(np.concatenate(heights)**2)) < 0.05e-3


@pytest.mark.parametrize('specimen', ['_dots'], indirect=True)
def test_slip_of_a_gel_with_markers(dragged):
    pressed = [(found, truth) for found, truth in dragged if truth.contacts and truth.contacts[0].depth > 8e-4]
    slips = [(found['slip'][0], truth) for found, truth in pressed]
    held = [slip.state for slip, truth in slips if truth.slipping_fraction == 0.0]
    assert len(held) >= 5 and not any(held)
    dragging = [(slip, truth) for slip, truth in slips if 0.0 < truth.slipping_fraction]
    assert np.sqrt(np.mean([(slip.slipping_fraction - truth.slipping_fraction)**2 for slip, truth in dragging])) < 0.15
    assert np.mean([slip.state == truth.slip_state for slip, truth in dragging]) > 0.7
    states = [(np.array(found['contact_region'][0].dot_state), truth.dot_state) for found, truth in pressed]
    assert all(len(state) == len(found['dots'][0].id) for (state, _), (found, _) in zip(states, pressed))
    assert np.mean([abs(np.count_nonzero(state) - np.count_nonzero(true)) for state, true in states]) < 2
    assert np.mean([abs(np.count_nonzero(state == 2) - np.count_nonzero(true == 2)) for state, true in states]) < 3


def test_dots_are_searched_only_while_a_topic_needs_them_and_a_gel_without_markers_publishes_none(specimen):
    values, _, _, scene = specimen
    marked, message = PhotometricStage(values | {'gel.markers': True, 'calibration': ''}), next(messages_of('photometric_shear'))[2]
    assert set(marked.process(message, ['dots', 'points'])) == {'dots'}
    message.header.stamp.sec += 1
    assert not marked.process(message, ['points'])
    assert {'dots', 'slip'}.isdisjoint(PhotometricStage(values).process(next(messages_of(scene))[2]))


def test_printed_dots_are_hidden_and_a_plain_gel_has_none():
    plain, dotted = (Background(to_working_size(open_scene(name, RATE, SEED).render(0.0).image))
                     for name in ('photometric_demo', 'photometric_dots'))
    assert not plain.ink.any() and 0.02 < dotted.ink.mean() < 0.3
