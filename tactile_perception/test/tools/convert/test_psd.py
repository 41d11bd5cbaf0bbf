# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""A recording folder of a PSD finger becomes a bag, and calibrate and process_bag reach on it what they should."""
import json
import os
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

from tactile_perception.errors import BadRecording  # noqa: E402
from tactile_perception.psd.finger import PsdFinger  # noqa: E402
from tactile_perception.psd.geometry import error_angle  # noqa: E402
from tactile_perception.psd.model_fit import fit_finger  # noqa: E402
from tactile_perception.psd.presses import find_presses  # noqa: E402
from tactile_perception.tools.calibrate.psd import read_recording  # noqa: E402
from tactile_perception.tools.convert import command as convert_recording  # noqa: E402
from tactile_perception.tools.convert.psd import PsdRecording  # noqa: E402

pytestmark = pytest.mark.ros
FOLDER = Path(os.environ.get('TACTILE_RECORDINGS', 'nowhere'), 'simulated')
needs_recordings = pytest.mark.skipif(not (FOLDER / 'psd_grid25').is_dir(), reason='TACTILE_RECORDINGS names no folder with psd_grid25')


@pytest.fixture
def folder(tmp_path):
    """Thirty samples; the stage says another place than the truth."""
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


def test_a_broken_folder(folder):
    (folder / 'truth.npz').write_bytes(b'nothing')
    with pytest.raises(BadRecording, match='rec'):
        PsdRecording(folder)


@needs_recordings
@pytest.mark.full
def test_independent_recordings_are_exact_to_the_rim(tmp_path):
    recordings = {}
    for name in ('psd_cal_dense', 'psd_grid25'):
        assert convert_recording.main([str(FOLDER / name), str(tmp_path / name), '--namespace', 'finger']) == 0
        recordings[name] = read_recording(tmp_path / name, '')
    finger = PsdFinger(fit_finger(find_presses([recordings['psd_cal_dense']], 4.9)).model)
    grid = recordings['psd_grid25']
    samples = finger.process(grid.volts, grid.period_s)
    runs = [run for run in samples.runs() if samples.contact[run].any()]
    held = [slice(run.start + 20, run.stop - 20) for run in runs]
    error = np.degrees([error_angle(finger.touch(samples, r).normal, grid.normal[r.start]) for r in held])
    assert len(error) == 25 and np.mean(error) < 0.4 and np.max(error) < 1.2
    assert (samples.contact != grid.touching).mean() < 0.01
