# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import os
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import psd  # noqa: E402

RECORDED = Path(os.environ.get('TACTILE_RECORDINGS', 'nowhere'), 'simulated', 'psd_cal_dense')
NEEDS_IT = pytest.mark.skipif(not RECORDED.is_dir(), reason='TACTILE_RECORDINGS names no folder with psd_cal_dense')
SPECIMENS = ['sim:2', pytest.param('recorded', marks=NEEDS_IT)]


@pytest.mark.parametrize('specimen', SPECIMENS)
def test_the_figures_are_reached_on_specimens_that_nothing_was_tuned_to(specimen):
    made, models = psd.fingers(specimen)
    grid = psd.signals(specimen, 'grid')
    rows = {name: psd.accuracy(make(), models[name], grid) for name, make in made.items()}
    error = {name: np.array([r['error'] for r in found if r['theta'] < psd.FARTHEST]) for name, found in rows.items()}
    assert len(error['map']) == 25
    assert error['map'].mean() < 0.4 and error['map'].max() < 1.2
    assert error['paper'].mean() > 2 * error['map'].mean()
    within = [r for r in rows['map'] if r['theta'] < 46]
    assert max(r['deviation'] for r in within) < 1.5
    assert all(0.85 < r['deviation'] / r['bound'] < 1.4 for r in within)
    light, taps = (psd.contacts(made['map'](), psd.signals(specimen, name)) for name in ('light', 'taps'))
    assert light['false samples (%)'] == 0.0 and taps['missed'] == 0
    assert taps['events within a sample (%)'] > 80


def test_the_page_tells_both_methods():
    page = psd.text('sim:2', psd.run('sim:2'))
    assert '| map | ' in page and '| paper | ' in page and '| paper, light |' in page and '| map, 1000 |' in page
