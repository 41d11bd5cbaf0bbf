# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The evaluation by the live benchmarks of sensors on serial ports."""
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

sys.path.insert(0, str(Path(__file__).parent))
import port_live  # noqa: E402
import psd_live  # noqa: E402
import taxel_live  # noqa: E402
from tactile_bringup.nodes.compose import NODES  # noqa: E402

BATCH, PERIOD = 25, 2e-4


def test_losses_latency_cpu_and_memory():
    stamps = [10**9 + k * 5_000_000 for k in range(400) if k != 300]
    results = {s + 2_400_000: s + round((BATCH - 1) * PERIOD * 1e9) + 2_000_000 for s in stamps if s != stamps[250]}
    usage = [(float(t), {'psd_node': (0.1 * t, 80.0 + t)}) for t in range(3)]
    result = port_live.summary(port_live.Record([(s, BATCH, PERIOD) for s in stamps], results, usage), settle=0.5)
    assert result['lost samples'] == BATCH and result['batches without results'] == 1
    assert result['latency ms'] == {str(p): pytest.approx(2.0, abs=1e-3) for p in port_live.PERCENTILES}
    assert result['CPU %'] == {'psd_node': pytest.approx(10)}
    assert result['batches a second'] == pytest.approx(200, rel=0.01)
    assert result['CPU ms a batch']['psd_node'] == pytest.approx(0.5, rel=0.01)
    said = port_live.text(result, 'sample')
    assert '25 samples lost' in said and '| psd_node | 10.0 | 0.50 |' in said


@pytest.mark.parametrize('sensor', [psd_live.finger(5000.0, 0.005), *(taxel_live.array(500.0, size, 'demo') for size in (44, 256))])
def test_sensors_name_what_exists(sensor):
    module = sensor.emulator[0]
    assert (Path(__file__).parents[2] / module.split('.')[0] / Path(*module.split('.')).with_suffix('.py')).is_file()
    assert set(sensor.executables) <= set(NODES)
    assert Path(sensor.values.get('calibration', __file__)).is_file()
    assert sensor.batch(sensor.raw[1]())[0] in (0, 1)
