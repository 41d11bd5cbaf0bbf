# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.psd.scene import open_psd_scene

from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.parameters.psd import PSD_PARAMETERS
from tactile_perception.pipeline.psd_stage import PsdStage
from tactile_perception.psd.model import FingerModel

VALUES = defaults(PSD_PARAMETERS)


@pytest.fixture(scope='module')
def taps():
    scene = open_psd_scene('taps', 1000.0)
    counts, truth = scene.play(0, 1500)
    return counts * (5 / 4096), truth


def run(stage, volts, batch):
    return [(first + k, touches) for first in range(0, len(volts), batch)
            for k, touches in stage.process(volts[first:first + batch], 1 + 1e-3 * first, 1e-3)]


def test_one_result_a_block_and_one_where_contacts_begin_or_end(taps):
    found = run(PsdStage(FingerModel(), VALUES), taps[0], 50)
    assert [k for k, _ in found if k % 50 == 0] == list(range(200, 1500, 50))
    changes = [k for k, _ in found if k % 50]
    assert len(changes) == 7  # three taps, and the beginning of a fourth
    assert {len(touches) for _, touches in found} == {0, 1}
    assert sorted({t.id for _, touches in found for t in touches}) == [1, 2, 3, 4]


def test_one_result_a_sample(taps):
    found = run(PsdStage(FingerModel(), VALUES | {'results': 'sample'}), taps[0], 50)
    assert [k for k, _ in found] == list(range(200, 1500))


def test_the_filter_smooths_and_covers(taps):
    plain, smooth = (run(PsdStage(FingerModel(), VALUES | {'results': 'sample', 'filter': on}), taps[0], 10) for on in (False, True))
    def scatter(found):
        normals = np.array([t.normal for k, touches in found if 540 < k < 570 for t in touches])
        return np.linalg.norm(np.diff(normals, axis=0), axis=1).mean()
    assert scatter(smooth) < 0.4 * scatter(plain)
    assert [k for k, _ in plain] == [k for k, _ in smooth]


def test_single_samples_of_unknown_rate(taps):
    stage = PsdStage(FingerModel(), VALUES)
    with pytest.raises(BadFrame, match='single sample'):
        stage.process(taps[0][:1], 1.0, float('nan'))
    found = [touches for k in range(1, 600) for _, touches in stage.process(taps[0][k:k + 1], 1 + 1e-3 * k, float('nan'))]
    assert any(found) and len(found) == 399


@pytest.mark.parametrize(('period', 'count'), [(0.0, 5), (-1e-3, 5), (float('nan'), 5), (0.0, 1)])
def test_invalid_periods_are_refused(taps, period, count):
    with pytest.raises(BadFrame, match='sample_period'):
        PsdStage(FingerModel(), VALUES).process(taps[0][:count], 1.0, period)


def test_a_stuck_output_is_reported(taps):
    stage = PsdStage(FingerModel(), VALUES)
    volts = taps[0][:300].copy()
    volts[:, 2] = 0.2
    stage.process(volts, 1.0, 1e-3)
    assert 'x2' in stage.suspicion
    stage.set_reference()
    assert not stage.finger.reference.ready


def test_an_unknown_method():
    with pytest.raises(BadArgument, match='map, paper'):
        PsdStage(FingerModel(), VALUES | {'method': 'magic'})
