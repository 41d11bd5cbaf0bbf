# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The finger's stage on messages: what it refuses, when it is reset, and what it reports."""
import numpy as np
import pytest

from tactile_driver.frame import SampleBlock
from tactile_driver.nodes.messages.conversions import header_of, voltages_message
from tactile_driver.parameters.table import defaults
from tactile_driver.simulation.psd_scene import open_psd_scene
from tactile_msgs.msg import PsdVoltages
from tactile_perception.core.errors import BadFrame, ClockSetBack
from tactile_perception.finger.stage import FingerStage

BATCH = 10


@pytest.fixture
def stage():
    return FingerStage(defaults(FingerStage.parameters))


@pytest.fixture(scope='module')
def blocks():
    counts, _ = open_psd_scene('taps', 1000.0).play(0, 700)
    volts = (counts * (5 / 4096)).astype(np.float32)
    return [voltages_message(SampleBlock(volts[k:k + BATCH], 10**9 + k * 1_000_000, 1e-3), 'finger') for k in range(0, 700, BATCH)]


@pytest.mark.parametrize(('change', 'reason'), [
    ({'sample_period': 0.0}, 'sample_period'), ({'sample_period': float('nan')}, 'sample_period'), ({'voltages': [1e7] * 8}, 'beyond'),
    ({'voltages': [1.0] * 7}, 'a sample has four'),
    ({'header': header_of((2**31 - 1) * 10**9, 'f')}, 'largest stamp')])
def test_what_cannot_be_samples_is_refused(stage, change, reason):
    with pytest.raises(BadFrame, match=reason):
        stage.process(PsdVoltages(**{'header': header_of(10**9, 'f'), 'sample_period': 1e-3, 'voltages': [1.0] * 8} | change))


def test_a_single_sample_of_unknown_rate_waits_for_the_next(stage):
    def single(k):
        return PsdVoltages(header=header_of(10**9 + k * 1_000_000, 'f'), sample_period=float('nan'), voltages=[0.1] * 4)
    with pytest.raises(BadFrame, match='single sample'):
        stage.process(single(0))
    for k in range(1, 202):
        found = stage.process(single(k))
    assert len(found['contacts']) == 1


def test_a_recording_that_restarts_resets_the_stage(stage, blocks):
    for block in blocks:
        stage.process(block)
    assert stage.health()[1]['reference'] == 'in order'
    for block in blocks[:2]:
        with pytest.raises(ClockSetBack):
            stage.process(block)
    assert stage.process(blocks[2]) == {'contacts': []} and stage.health()[1]['reference'] == 'being taken'


def test_a_stuck_output_is_reported_and_a_new_reference_taken(stage, blocks):
    for block in blocks[:30]:
        volts = np.reshape(block.voltages, (-1, 4)).copy()
        volts[:, 2] = 0.2
        stage.process(PsdVoltages(header=block.header, sample_period=block.sample_period, voltages=volts.ravel()))
    assert 'x2' in stage.health()[0]
    stage.set_reference()
    assert stage.health()[1]['reference'] == 'being taken'


@pytest.mark.parametrize(('samples', 'period', 'covered'), [(5, 0.001, 5_000_000), (5, 0.0, 0), (5, float('nan'), 0), (5, float('inf'), 0),
                                                            (0, 0.001, 0), (5, -1.0, 0)])
def test_a_block_covers_the_time_of_its_samples(stage, samples, period, covered):
    assert stage.covered_ns(PsdVoltages(sample_period=period, voltages=[1.0] * 4 * samples)) == covered
