# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module, of the kernels of a taxel array's regions and motion; see test_border.py."""
import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core

SCORE = np.add.outer(np.linspace(0, 1, 8), np.linspace(-0.4, 0.4, 9)).astype(np.float32)
PRESSURE = np.float32(3e4) * SCORE
TOUCHED, SLIP = SCORE > 0.5, np.stack([SCORE, -SCORE])
PAST, SHARE = np.column_stack([np.arange(9) - 9.0, np.zeros((9, 3))]), np.ones((3, 4, 4), np.float32)

#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'taxel_regions': (lambda score=SCORE, pressure=PRESSURE: _core.taxel_regions(score, pressure, level=0.5, pitch=1e-3, most=5, around=2),
                      {'score': SCORE, 'pressure': PRESSURE}),
    'taxel_follow': (lambda values=SCORE, count=PRESSURE, change=SCORE, touched=TOUCHED: _core.taxel_follow(
        values, count, change, touched, around=3, frames=10, gain=0.1),
                     {'values': SCORE, 'count': PRESSURE, 'change': SCORE, 'touched': TOUCHED}),
    'taxel_responding': (lambda change=SCORE, responded=TOUCHED: _core.taxel_responding(change, responded, pressed=0.1, part=0.5),
                         {'change': SCORE, 'responded': TOUCHED}),
    'taxel_load': (lambda pressure=PRESSURE, touched=TOUCHED: np.array(_core.taxel_load(pressure, touched, around=2)[:3])[None],
                   {'pressure': PRESSURE, 'touched': TOUCHED}),
    'taxel_pressure': (lambda change=SCORE, by_gain=PRESSURE: [_core.taxel_pressure(change, by_gain, scale=(1.0, 2.0, 3.0), knee=0.1)],
                       {'change': SCORE, 'by_gain': PRESSURE}),
    'taxel_undone': (lambda pressure=PRESSURE, last=SCORE, held=SCORE: _core.taxel_undone(
        pressure, last, held, share=0.5, reach=5.0, relative=0.1, crept=0.1, smooth=1.0),
                     {'pressure': PRESSURE, 'last': SCORE, 'held': SCORE}),
    'taxel_spread': (lambda pressure=PRESSURE, touched=TOUCHED, direction=np.ones(2): [
        np.float64(_core.taxel_spread(pressure, touched, direction))], {'pressure': PRESSURE, 'touched': TOUCHED, 'direction': np.ones(2)}),
    'taxel_without_traction': (lambda pressure=PRESSURE, traction=SCORE: [_core.taxel_without_traction(pressure, traction, unit=2.0)],
                               {'pressure': PRESSURE, 'traction': SCORE}),
    'taxel_lagging': (lambda touched=TOUCHED, motion=np.ones(3): [_core.taxel_lagging([SLIP], touched, motion, pitch=1e-3, part=0.1)],
                      {'touched': TOUCHED, 'motion': np.ones(3)}),
    'taxel_lagging of slips': (lambda slips=SLIP: [_core.taxel_lagging([SLIP, slips], TOUCHED, np.ones(3), pitch=1e-3, part=0.1)],
                               {'slips': SLIP}),
    'taxel_motion': (lambda past=PAST, now=np.ones(4): _core.taxel_motion(
        past, now, window=9.0, reported=5.0, fewest=4, latest=3, arm=(0.0, 1.0), reach=1.0, least=0.1, bound=2.5)[:4],
                     {'past': PAST, 'now': np.ones(4)}),
    'taxel_traction_fit': (lambda before=PRESSURE, touched=TOUCHED, spreads=np.ones((2, 2)): _core.taxel_traction_fit(
        before, touched, reach=2, thickness=2.0, spreads=spreads)[:1],
                           {'before': PRESSURE, 'touched': TOUCHED, 'spreads': np.ones((2, 2))}),
    'taxel_traction': (lambda share=SHARE, pressure=PRESSURE, before=SCORE: np.array(_core.taxel_traction(
        share, pressure, before, top=0, left=0))[None], {'share': SHARE, 'pressure': PRESSURE, 'before': SCORE}),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)
