# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The live benchmark's evaluation of the received messages."""
import importlib.util
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

_SPEC = importlib.util.spec_from_file_location('live_benchmark', Path(__file__).with_name('live.py'))
live = importlib.util.module_from_spec(_SPEC)
sys.modules['live_benchmark'] = live  # dataclasses look their module up
_SPEC.loader.exec_module(live)

PERIOD = 10**8
NODES = ('camera_node', 'dot_tracker_node', 'contact_region_node')


def usage(seconds, megabytes):
    return {name: (seconds, megabytes) for name in NODES}


def record(lost=()):
    """A hundred frames, ten a second, each done 12 ms after its stamp but for the lost ones; half a core, memory from 100 to 110 MB."""
    sent = [(k + 1) * PERIOD for k in range(100)]
    done = [stamp for k, stamp in enumerate(sent) if k not in lost]
    return live.Record(sent, done, [0.012] * len(done), [(float(t), usage(0.5 * t, 100.0 + t)) for t in range(11)])


def test_rate_latency_losses_cpu_and_memory():
    idle = live.Record(usage=[(0.0, usage(0, 90)), (10.0, usage(0.1, 90))])
    result = live.summary(idle, record(lost=(5, 50, 60, 99)), settle=2.0)
    assert result['frames'] == 78 and result['lost'] == 2, 'neither what was lost while settling nor what may be still on its way'
    assert result['rate Hz'] == pytest.approx(10, rel=0.02)
    assert result['latency ms'] == {str(p): pytest.approx(12) for p in live.PERCENTILES}
    assert result['CPU %'] == dict.fromkeys(NODES, pytest.approx(50))
    assert result['CPU % idle'] == dict.fromkeys(NODES, pytest.approx(1))
    assert result['memory MB']['dot_tracker_node'] == {'first': 102, 'last': 110, 'most': 110}
    said = live.text(result)
    assert '78 frames at' in said and '2 lost' in said and '| dot_tracker_node | 50.0 | 1.0 | 102 | 110 | 110 |' in said


def test_nothing_came():
    empty = live.Record(usage=[(0.0, usage(0, 90)), (1.0, usage(0, 90))])
    result = live.summary(empty, empty, settle=2.0)
    assert result['frames'] == result['lost'] == 0 and result['latency ms'] == {}
    assert '0 frames' in live.text(result)


@pytest.mark.parametrize('sensor', live.SENSORS)
def test_parameters_of_each_sensor(sensor):
    page = live.parameters_of(sensor, '', 60.0)
    told = {name: value for section in page.values() for name, value in section['ros__parameters'].items()}
    assert told['source'] == 'sim' and told['rate'] == 60.0
    assert told['scene'] == ('demo' if sensor == 'touchpad' else f'{sensor}_demo')
    assert sensor == 'touchpad' or told['calibration'].endswith(f'{sensor}_sim.yaml')
