# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
from tactile_perception.evaluation.evaluation import Instant

from made import contact, region


def test_what_is_touched_where():
    assert Instant().touched is None and np.isnan(Instant().place).all()
    assert Instant(contacts=[], region=region(1e-3, [1])).touched is False
    assert Instant(region=region(1e-3, [1], (2e-3, 0))).touched is True
    assert Instant(region=region(1e-3, [1], (2e-3, 0))).place.tolist() == [2e-3, 0]
    assert Instant(contacts=[contact(np.nan, 0)], region=region(1e-3, [1])).place.tolist() == [0, 0]
    assert Instant(contacts=[contact(3e-3, 1e-3)]).place.tolist() == [3e-3, 1e-3]
