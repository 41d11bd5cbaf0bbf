# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The tables of disc images fit the kernel that reads them, whatever the size of the dots."""
import numpy as np
import pytest

from tactile_perception.dots.detect.disc_model import DiscModel


@pytest.mark.parametrize('smallest, largest, blur', [(0.8, 1.2, 0.3), (1.5, 2.0, 0.5), (3.0, 5.0, 0.8), (9.0, 14.0, 1.5)])
def test_tables_of_dots_of_any_size_have_all_directions_of_the_basis(smallest, largest, blur):
    tables = DiscModel(smallest, largest, blur).tables
    directions = tables['basis'].shape[0]
    assert directions == DiscModel(8.0, 10.0, 1.0).tables['basis'].shape[0]
    assert tables['estimators'].shape[-2:] == (5, directions) and np.isfinite(tables['estimators']).all()
