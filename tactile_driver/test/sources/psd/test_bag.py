# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from tactile_driver.errors import BadFrame, BadRecording
from tactile_driver.nodes.messages.conversions import header_of
from tactile_driver.recordings.writer import write_messages
from tactile_driver.sources.bag import PsdBagSource
from tactile_driver.sources.source import EndOfSource
from tactile_msgs.msg import PsdVoltages


def write(path, counts):
    """A bag of messages with so many voltages each."""
    stamps = [5 * 10**9 + 1000 * k for k in range(len(counts))]
    write_messages(path, 'finger', ((stamp, 'voltages', PsdVoltages(header=header_of(stamp, 'finger'), sample_period=2e-4,
                                                                    voltages=list(map(float, range(count)))))
                                    for stamp, count in zip(stamps, counts)))
    return path


def test_voltages_keep_their_stamps(tmp_path):
    source = PsdBagSource(str(write(tmp_path / 'bag', [8, 3, 12])), '', 0.0, False)
    source.open()
    first = source.read()
    assert (first.stamp_ns, first.period_s, first.volts.tolist()) == (5 * 10**9, 2e-4, [[0, 1, 2, 3], [4, 5, 6, 7]])
    with pytest.raises(BadFrame, match='a sample has four'):
        source.read()
    assert source.read().volts.shape == (3, 4)
    with pytest.raises(EndOfSource):
        source.read()


def test_a_topic_without_voltages(tmp_path):
    source = PsdBagSource(str(write(tmp_path / 'bag', [4])), 'image_raw', 0.0, False)
    with pytest.raises(BadRecording, match='voltage topics: /finger/voltages'):
        source.open()
