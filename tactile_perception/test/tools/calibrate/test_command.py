# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate: a file that makes positions better than the undeformed shape alone does; data that do not determine it are
refused in one line."""
import contextlib
import io
import re

import numpy as np
import pytest
import yaml
from std_msgs.msg import String

from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import encode
from tactile_driver.recordings.writer import BagWriter
from tactile_driver.simulation.sensors.scenes import open_scene
from tactile_perception.common.dots import DotTracks
from tactile_perception.core.parameter_files import read_parameters
from tactile_perception.dots.tracker import make_tracker
from tactile_perception.tools import calibrate as module
from tactile_perception.touchpad.calibration import Press, read_touchpad
from tactile_perception.touchpad.parameters import NODE, TOUCHPAD_PARAMETERS
from tactile_perception.touchpad.positions import DotPositions
from tactile_perception.touchpad.sensor import Touchpad
from tactile_perception.touchpad.tools import select_frames


def run(bag, target, *more):
    return module.main([str(bag), '--params', f'{bag}.yaml', '--output', str(target), *more])


@pytest.fixture(scope='module')
def calibrated(sphere_bag, tmp_path_factory):
    target, said = tmp_path_factory.mktemp('calibration') / 'pad.yaml', io.StringIO()
    with contextlib.redirect_stdout(said):
        assert run(sphere_bag, target, '--sphere-radius', '0.008', '--serial', 'PAD7') == 0
    return target, said.getvalue()


def press_error(sphere_bag, calibration):
    """RMS error, m, of positions in a frame of another scene: with the calibration, or from the undeformed shape alone if that is None."""
    values = read_parameters(f'{sphere_bag}.yaml', NODE, TOUCHPAD_PARAMETERS)
    scene = open_scene('disc_tilt', rate=10.0, seed=1)
    skin = scene.membrane
    values.update({'membrane.shear_stiffness': float(skin.tension), 'membrane.rest_pressure': float(skin.pressure)})
    sensor = Touchpad.from_parameters(values)
    camera = sensor.camera(scene.camera.matrix, scene.camera.distortion)
    tracker = make_tracker(values)
    positions = DotPositions(sensor, camera, read_touchpad(calibration, camera) if calibration else None)
    for k, time in enumerate((0.0, 0.1, 2.6, 2.6, 2.6)):
        seen = scene.render(time)
        tracks = tracker.process(seen.image, 1 + k)
        xyz = positions.locate(seen.image, tracks)
    return float(np.sqrt(np.nanmean(np.sum((xyz - seen.truth.dot_xyz[tracks.id])**2, axis=1))))


@pytest.mark.full
def test_places_are_better_than_from_the_rest_shape_alone(sphere_bag, calibrated):
    with_it, without = press_error(sphere_bag, calibrated[0]), press_error(sphere_bag, None)
    assert with_it < 0.07e-3 and with_it < without


def test_the_file_says_what_was_done(calibrated):
    page = yaml.safe_load(calibrated[0].read_text())
    assert page['sensor'] == 'touchpad' and page['complete'] is True and page['residuals']['presses'] >= 20
    assert page['residuals']['range_rms'] < 0.15e-3 and page['residuals']['held_out_places_range_rms'] < 0.2e-3
    assert page['serial'] == 'PAD7' and page['parameters']['values']['rows'] == 23 and page['outliers'] == []
    shallow, deep = page['calibrated_range']['depth']
    assert shallow == pytest.approx(1.5e-3, abs=0.2e-3) and deep == pytest.approx(4.5e-3, abs=0.2e-3)


def test_the_report_gives_the_numbers_and_where_they_are(calibrated):
    path, said = calibrated
    assert 'presses' in said and 'range residual' in said and f'written: {path}' in said
    picture = path.with_name('pad_residuals.png')
    assert f'plot of the errors: {picture}' in said and picture.stat().st_size > 10_000


def only(source, target, topics, keep):
    """The messages of source on topics for which keep(number of the image) holds, as a bag."""
    stamps = {}
    with BagReader(source) as reader, BagWriter(target) as writer:
        for message in reader.messages():
            number = stamps.setdefault(message.stamp_ns, len(stamps))
            if message.topic.split('/', 2)[2] in topics and keep(number):
                writer.write(message.topic, message.type_name, message.stamp_ns, message.data)
    target.with_name(target.name + '.yaml').write_text(source.with_name(source.name + '.yaml').read_text())
    return target


ALL = ('image_raw', 'camera_info', 'ground_truth/contacts')


@pytest.mark.parametrize('topics, keep, message', [
    (('image_raw', 'camera_info'), lambda k: k < 5, 'no /touchpad/ground_truth/contacts'),
    (ALL, lambda k: k < 3, 'usable presses'),
    (ALL, lambda k: k >= 3, 'no untouched frame'),
    (ALL, lambda k: k < 5, 'at least 3 needed|usable presses'),
    (('image_raw', 'ground_truth/contacts'), lambda k: k < 4, 'no camera_info')])
def test_data_that_cannot_determine_the_model_are_refused(sphere_bag, tmp_path, capsys, topics, keep, message):
    bag = only(sphere_bag, tmp_path / 'some', topics, keep)
    assert run(bag, tmp_path / 'pad.yaml', '--sphere-radius', '0.008') == 1
    lines = [line for line in capsys.readouterr().err.strip().splitlines() if not line.endswith('a second')]  # how far it is, where slow
    assert len(lines) == 1 and lines[0].startswith('calibrate: '), lines
    assert re.search(message, lines[0]), lines
    assert not (tmp_path / 'pad.yaml').exists()


def test_an_even_choice_of_presses():
    tracks = DotTracks(0, 0, np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros((0, 2)))
    image = np.zeros((2, 2, 3), np.uint8)
    rest = [Press(image, tracks) for _ in range(40)]
    touching = [Press(image, tracks, np.zeros(3), 1e-4 * k) for k in range(1, 400)]
    kept = select_frames(rest + touching, max_presses=20)
    depths = [p.depth for p in kept if p.touching]
    assert len(kept) == 30 and min(depths) == pytest.approx(3e-4) and max(depths) == pytest.approx(399e-4)
    assert np.ptp(np.diff(depths)) < 3e-4
    assert select_frames([]) == []


def test_the_serial_number_is_what_the_recording_says_of_its_device(tmp_path):
    with BagWriter(tmp_path / 'bag') as writer:
        for stamp, text in enumerate(('no: yaml: at all', 'source: sim', 'source: device\nserial: 0042A', 'serial: other')):
            writer.write('/pad/description', *encode(String(data=text))[:1], stamp, encode(String(data=text))[1])
    assert module.recorded_serial(tmp_path / 'bag') == '0042A'
    with BagWriter(tmp_path / 'none') as writer:
        writer.write('/pad/other', *encode(String())[:1], 0, encode(String())[1])
    assert module.recorded_serial(tmp_path / 'none') == ''
