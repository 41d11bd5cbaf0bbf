# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_driver.nodes.messages.conversions import instants


def test_truth_is_told_at_the_first_sample_and_where_it_changes():
    assert instants(np.array([0, 0, 1, 1, 2, 0])) == [0, 2, 4, 5]
    assert instants(np.array([1])) == [0]
