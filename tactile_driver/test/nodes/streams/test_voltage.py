# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_driver.nodes.messages.conversions import instants, voltages_message
from tactile_driver.samples import SampleBlock


def test_a_block_as_a_message():
    volts = np.arange(8, dtype=np.float32).reshape(2, 4)
    message = voltages_message(SampleBlock(volts, 3_000_000_007, 1e-3), 'finger')
    assert list(message.voltages) == list(range(8)) and message.sample_period == 1e-3
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (3, 7, 'finger')


def test_truth_is_told_at_the_first_sample_and_where_it_changes():
    assert instants(np.array([0, 0, 1, 1, 2, 0])) == [0, 2, 4, 5]
    assert instants(np.array([1])) == [0]
