# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from tactile_perception.errors import BadArgument
from tactile_perception.touch.methods import make_method
from tactile_perception.touch.sensor import MARKER_SENSORS


def test_an_unknown_method_is_refused():
    with pytest.raises(BadArgument, match='no touch method'):
        make_method('magic', {}, MARKER_SENSORS['areal_single'])
