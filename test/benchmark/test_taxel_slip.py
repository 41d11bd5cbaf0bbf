# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Real fingers: no slip is reported where nothing slips, and slip is detected with its direction."""
import importlib.util
import os
import sys
from pathlib import Path

import numpy as np
import pytest

SPEC = importlib.util.spec_from_file_location('taxel_slip', Path(__file__).with_name('taxel_slip.py'))
benchmark = importlib.util.module_from_spec(SPEC)
sys.modules['taxel_slip'] = benchmark  # dataclasses look their module up
SPEC.loader.exec_module(benchmark)
FOLDER = Path(os.environ.get('TACTILE_RECORDINGS', 'nowhere'))
needs_recordings = pytest.mark.skipif(not (FOLDER / 'sdh_slip').is_dir(), reason='TACTILE_RECORDINGS names no folder with sdh_slip')


def test_events_are_apart_by_their_pauses():
    t = np.arange(10) * 0.2
    velocities = np.column_stack([np.zeros(10), [0, 1, -2, 0, 0, 0, 0, 3, 0, 0]])
    found = benchmark.events(t, np.array([0, 1, 2, 0, 0, 0, 0, 1, 0, 0]), velocities)
    assert found == [(pytest.approx(0.2), pytest.approx(0.4), -2.0), (pytest.approx(1.4), pytest.approx(1.4), 3.0)]


@needs_recordings
def test_no_slippage_is_quiet_and_slips_go_opposite_ways():
    found = {}
    for name in ('no_slippage', 'slip_up', 'slip_down'):
        for pad in benchmark.read_bag(FOLDER / f'sdh_slip/{name}.bag'):
            if pad.values.max() >= 60:
                found[pad.name] = benchmark.events(pad.t, *benchmark.play(pad))
    assert not any(events for name, events in found.items() if name.startswith('no_slippage'))
    up, down = found['slip_up pad 3'][0], found['slip_down pad 3'][0]
    assert 3.2 < up[0] < 3.7 and up[2] < 0 and 2.0 < down[0] < 3.3 and down[2] > 0
