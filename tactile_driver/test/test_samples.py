# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np

from tactile_driver.samples import SampleBlock


def test_blocks_may_be_of_any_length():
    assert SampleBlock(np.zeros((3, 4), np.float32), 0, 1e-3).sizes == {}
