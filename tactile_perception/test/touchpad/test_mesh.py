# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.touchpad.membrane import GridMesh


def test_a_grid_too_small_is_refused():
    with pytest.raises(BadArgument, match='3 x 3'):
        GridMesh(2, 9)
