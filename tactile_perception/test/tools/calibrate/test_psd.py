# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""calibrate and process_bag on bags of the simulated finger: the map, honest fall-backs, the same bytes each time."""

import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from psd_bags import write_psd  # noqa: E402

from tactile_driver.recordings.reader import BagReader  # noqa: E402
from tactile_driver.recordings.serialization import decode  # noqa: E402
from tactile_perception.calibration.files.psd import read_psd  # noqa: E402
from tactile_perception.tools import process_bag  # noqa: E402
from tactile_perception.tools.calibrate import command as calibrate  # noqa: E402
from tactile_perception.tools.calibrate.psd import read_recording  # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('psd')
    write_psd(folder / 'calibration', 'calibration', truth_every=20)
    write_psd(folder / 'taps', 'taps', end=2000)
    return folder


@pytest.fixture(scope='module')
def calibrated(bags):
    words = [str(bags / 'calibration'), '--params', str(bags / 'calibration.yaml'), '--output', str(bags / 'finger.yaml')]
    assert calibrate.main(words) == 0
    return bags / 'finger.yaml'


def contacts_of(bag):
    with BagReader(bag) as reader:
        return [decode(m.data, m.type_name) for m in reader.messages({'/finger/contacts'})]


def process(bags, calibrated, output):
    words = [str(bags / 'taps'), str(output), '--params', str(bags / 'taps.yaml'), '--calibration', str(calibrated)]
    assert process_bag.main(words) == 0
    return contacts_of(output)


def test_truth_goes_with_the_samples(bags):
    recording = read_recording(bags / 'taps', '')
    assert recording.period_s == 1e-3 and len(recording.volts) == 2000
    assert 100 < recording.touching.sum() < 400
    assert np.linalg.norm(recording.normal[recording.touching], axis=1) == pytest.approx(1.0)


def test_a_model_is_fitted_and_told(bags, calibrated, capsys):
    model = read_psd(calibrated)
    assert model.smooth is not None and model.force is not None
    words = [str(bags / 'calibration'), '--params', str(bags / 'calibration.yaml'), '--output', str(bags / 'again.yaml')]
    assert calibrate.main(words) == 0
    told = capsys.readouterr().out
    assert '107 places, 0 to 70 degrees' in told and 'cross-validation error of the map' in told and 'force, cross-validation' in told


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


def test_the_same_bytes_each_time(bags, calibrated, tmp_path):
    process(bags, calibrated, tmp_path / 'a')
    process(bags, calibrated, tmp_path / 'b')
    one, other = ([(m.topic, m.stamp_ns, m.data) for m in BagReader(tmp_path / name).__enter__().messages()] for name in 'ab')
    assert one == other


@pytest.mark.parametrize(('begin', 'end', 'told'), [(0, 400, 'no usable press'), (700, 900, 'untouched')])
def test_what_cannot_determine_a_model_is_refused(tmp_path, capsys, begin, end, told):
    write_psd(tmp_path / 'bag', 'calibration', begin=begin, end=end)
    words = [str(tmp_path / 'bag'), '--params', str(tmp_path / 'bag.yaml'), '--output', str(tmp_path / 'out.yaml')]
    assert calibrate.main(words) == 1
    assert told in capsys.readouterr().err


def test_the_pole_alone_falls_back_and_says_so(tmp_path, capsys):
    write_psd(tmp_path / 'bag', 'calibration', end=900)
    words = [str(tmp_path / 'bag'), '--params', str(tmp_path / 'bag.yaml'), '--output', str(tmp_path / 'out.yaml')]
    assert calibrate.main(words) == 0
    told = capsys.readouterr().out
    assert 'nominal' in told and 'too few for a map' in told
    assert read_psd(tmp_path / 'out.yaml').smooth is None
