# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The border of the compiled module, of the kernels of a taxel array's regions and motion; see test_border.py."""
import numpy as np
import pytest
from border_checks import check_any_array, check_memory, check_wrong_type
from tactile_perception import _core

SCORE = np.add.outer(np.linspace(0, 1, 8), np.linspace(-0.4, 0.4, 9)).astype(np.float32)
PRESSURE = np.float32(3e4) * SCORE

#: Function of the module: how it is called here, and an example of each of its arrays.
CALLS = {
    'taxel_regions': (lambda score=SCORE, pressure=PRESSURE: _core.taxel_regions(score, pressure, level=0.5, pitch=1e-3, most=5, around=2),
                      {'score': SCORE, 'pressure': PRESSURE}),
    'noise_of_places': (lambda places=np.zeros((9, 3)): [np.float64(_core.noise_of_places(places))], {'places': np.zeros((9, 3))}),
}
ARRAYS = [(function, name) for function, (_, arrays) in CALLS.items() for name in arrays]


@pytest.mark.parametrize('check', [check_any_array, check_wrong_type, check_memory])
@pytest.mark.parametrize('function, name', ARRAYS)
def test_any_array_is_answered_or_refused_by_name_however_it_lies_in_memory(function, name, check):
    check(*CALLS[function], name)
