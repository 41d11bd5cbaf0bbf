# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.psd.scene import Act, PsdScene, PsdScript, open_psd_scene

from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.parameters.psd import PSD_PARAMETERS
from tactile_perception.pipeline.psd_stage import ContactSpeed, PsdStage
from tactile_perception.psd.finger import Touch
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


def test_one_result_a_block_and_one_on_either_side_of_an_edge_each_at_the_mean_of_its_samples(taps):
    found = run(PsdStage(FingerModel(), VALUES), taps[0], 50)
    middles = np.array([k for k, _ in found])
    assert (np.diff(middles) > 0).all()
    whole = [k for k in middles if k % 50 == 24.5]
    assert len(whole) == 26 - 7  # three taps, and the beginning of a fourth
    blocks = middles // 50
    for block in np.unique(blocks):
        inside = middles[blocks == block] % 50
        edges = [0.0]
        for k in inside:  # runs of samples that follow each other: a run's middle and its begin tell its end
            edges.append(2 * k - edges[-1] + 1)
        assert edges[-1] == 50
    assert {len(touches) for _, touches in found} == {0, 1}
    assert sorted({t.id for _, touches in found for t in touches}) == [1, 2, 3, 4]


def test_a_moving_contact_is_stamped_with_the_time_at_which_it_is_there():
    way = Act(0.4, 0.6, (0.3, -0.9), (0.3, 0.9), 3.2e-4, 0.02)  # 520 degrees a second: 2.6 in a block
    scene = PsdScene(PsdScript([way], 0.7), 5000.0)
    volts = scene.play(0, scene.samples)[0] * (5 / 4096)
    told = {}
    for results in ('batch', 'sample'):
        stage, told[results] = PsdStage(FingerModel(), VALUES | {'results': results}), []
        for first in range(0, len(volts), 25):
            told[results] += [(first + k, np.arctan2(*touches[0].normal[[0, 2]]))
                              for k, touches in stage.process(volts[first:first + 25], first / 5000, 1 / 5000) if touches]
    blocks, singles = (np.array(found).T for found in told.values())
    inside = (blocks[0] > 2200) & (blocks[0] < 2800)
    smooth = np.convolve(singles[1], np.full(25, 1 / 25), 'same')
    late = blocks[1][inside] - np.interp(blocks[0][inside], singles[0], smooth)
    assert inside.sum() > 20 and abs(np.mean(late)) < np.radians(0.1) and np.abs(late).max() < np.radians(0.6)


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


def touched(x, number=1):
    """A touch at (x, 0, 0), m."""
    return Touch(number, np.array([x, 0, 0]), np.array([0.0, 0, 1]), np.nan, np.nan, np.zeros((3, 3)), 0)


def test_the_speed_of_a_contact_is_that_over_the_least_time():
    speed = ContactSpeed(0.005)
    assert [speed.update(touched(0.2 * t), t) for t in (0.0, 0.001, 0.006, 0.007)] == pytest.approx([0, 0, 0.2, 0.2])
    assert speed.update(touched(0.5, number=2), 0.02) == 0
    assert speed.update(touched(np.nan, number=2), 0.03) == 0 and speed.update(touched(0.5, number=2), 0.04) == 0
    assert speed.update(touched(0.4, number=2), 0.01) == 0, 'the clock was set back'


def test_the_covariance_of_a_contact_that_slides_holds_the_lag_of_the_cover():
    def script(degrees):
        return PsdScript([Act(0.4, 0.6, (0.3, -np.radians(degrees)), (0.3, np.radians(degrees)), 3.2e-4, 0.02)], 0.7)
    spread = []
    for degrees in (0, 50):
        scene, stage = PsdScene(script(degrees), 5000.0), PsdStage(FingerModel(), VALUES)
        volts = scene.play(0, scene.samples)[0] * (5 / 4096)
        touches = [touch for k in range(0, len(volts), 25) for _, some in stage.process(volts[k:k + 25], k / 5000, 1 / 5000)
                   for touch in some if 2400 < k < 2600]
        spread.append(np.mean([np.trace(touch.covariance) for touch in touches]))
    speed = np.linalg.norm(np.diff([touch.position for touch in touches], axis=0), axis=1).mean() / 0.005  # m/s
    assert speed > 0.07 and spread[1] - spread[0] == pytest.approx(2 * (1e-3 * speed)**2, rel=0.1), '1 ms in two directions'


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
