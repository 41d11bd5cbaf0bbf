# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Which ground truth belongs to a sensor's raw data, and to which message."""
from types import SimpleNamespace

import pytest
from tactile_driver.recordings.truth import truth_topics, with_truth

CONTACTS = 'tactile_msgs/msg/Contacts'


@pytest.mark.parametrize('raw', ['/left/pad/image_raw', '/left/pad/right/image_raw'])
def test_it_is_beside_the_raw_data_and_of_the_right_type(raw):
    types = {raw: 'sensor_msgs/msg/Image', '/left/pad/ground_truth/contacts': CONTACTS, '/left/pad/ground_truth/slip': CONTACTS,
             '/other/ground_truth/contacts': CONTACTS}
    assert truth_topics(types, raw) == {'/left/pad/ground_truth/contacts': 'contacts'}


def test_each_raw_message_comes_with_the_truth_recorded_after_it():
    order = 't0 i1 t1 u1 i2 i3 t3 other i4'.split()
    names = {'t': '/pad/ground_truth/contacts', 'u': '/pad/ground_truth/wrench', 'i': '/pad/image_raw', 'o': '/pad/other'}
    messages = [SimpleNamespace(topic=names[word[0]], data=word) for word in order]
    found = with_truth(messages, '/pad/image_raw', {names['t']: 'contacts', names['u']: 'wrench'})
    told = [(raw.data, truth and [(name, data) for name, data in truth.messages]) for raw, truth in found]
    first = [('contacts', 't0'), ('contacts', 't1'), ('wrench', 'u1')]
    assert told == [('i1', first), ('i2', None), ('i3', [('contacts', 't3')]), ('i4', None)]
