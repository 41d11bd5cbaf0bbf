# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What the live benchmark of the finger makes of what it saw."""
import sys
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

sys.path.insert(0, str(Path(__file__).parent))
import psd_live  # noqa: E402

BATCH, PERIOD = 25, 2e-4


def test_losses_latency_cpu_and_memory():
    stamps = [10**9 + k * 5_000_000 for k in range(400) if k != 300]
    contacts = {s: s + round((BATCH - 1) * PERIOD * 1e9) + 2_000_000 for s in stamps if s != stamps[250]}
    usage = [(float(t), {'psd_node': (0.1 * t, 80.0 + t)}) for t in range(3)]
    result = psd_live.summary(psd_live.Record([(s, BATCH, PERIOD) for s in stamps], contacts, usage), settle=0.5)
    assert result['lost samples'] == BATCH and result['batches without contacts'] == 1
    assert result['latency ms'] == {str(p): pytest.approx(2.0, abs=1e-3) for p in psd_live.PERCENTILES}
    assert result['CPU %'] == {'psd_node': pytest.approx(10)}
    assert '25 samples lost' in psd_live.text(result)
