# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of taxel arrays become bags; calibrate and process_bag reach on them what they should."""
import json
import os
from pathlib import Path

import numpy as np
import pytest
import yaml
from tactile_perception.errors import BadRecording
from tactile_perception.tools import calibrate, process_bag
from tactile_perception.tools.convert import command as convert_recording
from tactile_perception.tools.convert.taxel import TaxelRecording

RECORDINGS = Path(os.environ.get('TACTILE_RECORDINGS', 'nowhere'))
needs_simulated = pytest.mark.skipif(not (RECORDINGS / 'simulated/tac_cal_flat').is_dir(),
                                     reason='TACTILE_RECORDINGS names no folder with simulated/tac_cal_flat')
needs_weights = pytest.mark.skipif(not (RECORDINGS / 'dsa_slip/weights').is_dir(),
                                   reason='TACTILE_RECORDINGS names no folder with dsa_slip/weights')


def weights_file(path, letters='ABCDEFGH'):
    """Imprints of a sensor whose values are 100 a newton, spread over four taxels."""
    arrays = {}
    for k, letter in enumerate('ABCDEFGH'):
        if letter in letters:
            values = np.zeros((20, 6, 5), np.uint16)
            values[5:, 2:4, 1:3] = 100 * (0.2 + 0.1 * k) * 9.81 / 4
            arrays |= {letter + '1': values, letter + '1_t_ms': 10**12 + 30 * np.arange(20)}
    np.savez(path, **arrays)


def test_imprints_of_weights_calibrate_the_sensor(tmp_path, capsys):
    weights_file(tmp_path / 'w.npz')
    assert convert_recording.main([str(tmp_path / 'w.npz'), str(tmp_path / 'bag')]) == 0
    params = tmp_path / 'bag.yaml'
    values = yaml.safe_load(params.read_text())['/**']['ros__parameters']
    assert (values['rows'], values['columns'], values['sensor_type']) == (6, 5, 'taxel_array')
    assert calibrate.main([str(tmp_path / 'bag'), '--params', str(params), '--output', str(tmp_path / 'c.yaml')]) == 0
    reported = capsys.readouterr().out
    assert '8 loads, 1.96 to 8.83 N' in reported
    assert float(reported.split('held-out loads: error ')[1].split('%')[0]) < 3
    assert process_bag.main([str(tmp_path / 'bag'), str(tmp_path / 'out'), '--params', str(params), '--calibration',
                             str(tmp_path / 'c.yaml')]) == 0


def test_one_weight_is_refused(tmp_path, capsys):
    weights_file(tmp_path / 'w.npz', 'A')
    convert_recording.main([str(tmp_path / 'w.npz'), str(tmp_path / 'bag')])
    assert calibrate.main([str(tmp_path / 'bag'), '--params', str(tmp_path / 'bag.yaml'), '--output', str(tmp_path / 'c.yaml')]) == 1
    assert 'at least 3' in capsys.readouterr().err and not (tmp_path / 'c.yaml').exists()


def test_broken_recordings(tmp_path):
    (tmp_path / 'meta.json').write_text(json.dumps({'sensor': 'taxel_array'}))
    (tmp_path / 'x.npz').write_text('no')
    for path in (tmp_path, tmp_path / 'x.npz', tmp_path / 'none.npz'):
        with pytest.raises(BadRecording):
            TaxelRecording(path)


@needs_simulated
def test_a_simulated_recording_as_a_bag():
    recording = TaxelRecording(RECORDINGS / 'simulated/tac_static_ring')
    topics = [topic for _, topic, _ in recording.messages('pad')]
    assert topics.count('image_raw') == len(recording) == 80 and topics.count('ground_truth/wrench') == 80
    assert recording.parameters()['pad.friction'] == pytest.approx(0.6)


@needs_weights
@pytest.mark.parametrize('name, most', [('operating', 5.0), ('room', 8.0)])
@pytest.mark.full
def test_real_weights_held_out(name, most, tmp_path, capsys):
    convert_recording.main([str(RECORDINGS / f'dsa_slip/weights/{name}.npz'), str(tmp_path / 'bag')])
    assert calibrate.main([str(tmp_path / 'bag'), '--params', str(tmp_path / 'bag.yaml'), '--output', str(tmp_path / 'c.yaml')]) == 0
    assert float(capsys.readouterr().out.split('held-out loads: error ')[1].split('%')[0]) < most
