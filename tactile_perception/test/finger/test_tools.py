# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate and process_bag on bags of the simulated finger: the map, honest fall-backs, the same bytes each time; a recording folder
becomes a bag, and the calibrated finger is exact on it."""
import json
from contextlib import redirect_stdout

import numpy as np
import pytest
import yaml

from tactile_driver.frame import SampleBlock
from tactile_driver.nodes.messages.conversions import header_of, voltages_message
from tactile_driver.nodes.messages.ground_truth import TouchNumbers, contacts_message
from tactile_driver.recordings.reader import BagReader
from tactile_driver.recordings.serialization import decode, encode
from tactile_driver.recordings.writer import BagWriter
from tactile_driver.simulation.psd_scene import open_psd_scene
from tactile_perception.core.errors import BadRecording
from tactile_perception.finger.model import read_psd
from tactile_perception.finger.tools import PsdRecording, read_recording
from tactile_perception.tools import calibrate, process_bag
from tactile_perception.tools.convert import command as convert_recording

pytestmark = pytest.mark.full


def write_psd(path, name, begin=0, end=None, truth_every=1):
    """Samples begin to end of a scene at 1 kHz with their truth, and path.yaml beside it."""
    scene, numbers = open_psd_scene(name, 1000.0), TouchNumbers()
    counts, truth = scene.play(0, scene.samples)
    volts = (counts * (5 / 4096)).astype(np.float32)

    def write(topic, stamp, message):
        type_name, data = encode(message)
        writer.write(f'/finger/{topic}', type_name, stamp, data)
    with BagWriter(path) as writer:
        for first in range(begin, end or len(volts), 20):
            stamp = 10**9 + first * 1_000_000
            write('voltages', stamp, voltages_message(SampleBlock(volts[first:first + 20], stamp, 1e-3), 'finger'))
            last = min(first + 20, len(volts))
            changes = np.flatnonzero(np.diff(truth.touching[first:last])) + 1 + first
            for k in sorted({*range(first, last, truth_every), *changes.tolist()}):
                touches, at = truth.touches(k), 10**9 + k * 1_000_000
                write('ground_truth/contacts', at, contacts_message(touches, numbers.assign(touches), header_of(at, 'finger')))
    path.with_name(path.name + '.yaml').write_text(yaml.safe_dump({'/**': {'ros__parameters': {'sensor_type': 'psd_finger'}}}))


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('psd')
    write_psd(folder / 'calibration', 'calibration', truth_every=20)
    write_psd(folder / 'taps', 'taps', end=2000)
    return folder


@pytest.fixture(scope='module')
def calibrated(bags):
    """The calibration file; what calibrate printed is in finger.txt."""
    words = [str(bags / 'calibration'), '--params', str(bags / 'calibration.yaml'), '--output', str(bags / 'finger.yaml')]
    with (bags / 'finger.txt').open('w') as shown, redirect_stdout(shown):
        assert calibrate.main(words) == 0
    return bags / 'finger.yaml'


def contacts_of(bag):
    with BagReader(bag) as reader:
        return [decode(m.data, m.type_name) for m in reader.messages({'/finger/contacts'})]


def process(bags, calibrated, output):
    words = [str(bags / 'taps'), str(output), '--params', str(bags / 'taps.yaml'), '--calibration', str(calibrated)]
    assert process_bag.main(words) == 0
    return contacts_of(output)


def test_a_model_is_fitted_and_reported(calibrated):
    model, shown = read_psd(calibrated), calibrated.with_suffix('.txt').read_text()
    assert model.smooth is not None and model.force is not None
    assert '107 positions, 0 to 70 degrees' in shown and 'cross-validation error of the map' in shown and 'force, cross-validation' in shown


def test_contacts_come_under_the_stamps_of_their_samples(bags, calibrated, tmp_path):
    found = process(bags, calibrated, tmp_path / 'a')
    stamps = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in found])
    assert (np.diff(stamps) > 0).all()
    whole = set(stamps.tolist()) & {10**9 + k * 20_000_000 + 9_500_000 for k in range(100)}
    assert 80 <= len(whole) <= 82  # but the reference, and begin and end of 5 presses, which may fall between two blocks
    begins = [s for s, before, m in zip(stamps[1:], found, found[1:]) if m.contacts and not before.contacts]
    assert len(begins) == 5 and {m.contacts[0].id for m in found if m.contacts} == {1, 2, 3, 4, 5}
    first = 10**9 + int(np.flatnonzero(read_recording(bags / 'taps', '').touching)[0]) * 1_000_000
    end = (begins[0] // 20_000_000 + 1) * 20_000_000  # of the block: its last samples are those of the contact, and the stamp their mean
    assert abs(2 * begins[0] - end + 1_000_000 - first) <= 2_000_000


@pytest.mark.parametrize(('begin', 'end', 'reason'), [(0, 400, 'no usable press'), (700, 900, 'untouched')])
def test_what_cannot_determine_a_model_is_refused(tmp_path, capsys, begin, end, reason):
    write_psd(tmp_path / 'bag', 'calibration', begin=begin, end=end)
    words = [str(tmp_path / 'bag'), '--params', str(tmp_path / 'bag.yaml'), '--output', str(tmp_path / 'out.yaml')]
    assert calibrate.main(words) == 1
    assert reason in capsys.readouterr().err


@pytest.fixture
def folder(tmp_path):
    """Thirty samples; the stage reports another position than the true one."""
    phase = np.repeat([0, 1, 2], 10)
    touching = phase == 2
    normal = np.where(touching[:, None], [0.6, 0, 0.8], np.nan)
    label = np.where(np.arange(30) == 25, 0.5, np.nan)
    path = tmp_path / 'rec'
    path.mkdir()
    (path / 'meta.json').write_text(json.dumps({'sensor': 'psd_finger', 'R_s_m': 0.016}))
    np.savez(path / 'input.npz', t=np.arange(30) * 1e-3, volts=np.full((30, 4), 0.5), label_phi=label, label_theta=label)
    np.savez(path / 'truth.npz', phase=phase, normal=normal, force_N=touching * 2.0, indentation_mm=touching * 0.2,
             n_contacts=touching.astype(int))
    return path


def test_a_folder_becomes_a_bag(folder, tmp_path):
    assert convert_recording.main([str(folder), str(tmp_path / 'bag'), '--namespace', 'finger']) == 0
    assert 'sensor_type: psd_finger' in (tmp_path / 'bag.yaml').read_text()
    found = read_recording(tmp_path / 'bag', 'finger')
    assert found.volts.shape == (30, 4) and found.touching.tolist() == [False] * 20 + [True] * 10
    expected = [np.cos(0.5) * np.sin(0.5), np.sin(0.5) ** 2, np.cos(0.5)]
    assert found.normal[25] == pytest.approx(expected, abs=1e-6)
    assert (found.force[25], found.depth[25]) == pytest.approx((2.0, 2e-4))


def test_a_broken_folder_is_refused(folder):
    (folder / 'truth.npz').write_bytes(b'nothing')
    with pytest.raises(BadRecording, match='rec'):
        PsdRecording(folder)
