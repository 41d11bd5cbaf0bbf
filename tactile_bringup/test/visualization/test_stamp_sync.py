# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from tactile_bringup.nodes.drawing_node import StampSync

MS = 1_000_000


class Collected:
    def __init__(self, *expected, patience=3):
        self.expected, self.sets = set(expected), []
        self.sync = StampSync(self.sets.append, lambda: self.expected, patience)

    def add(self, topic, ms):
        self.sync.add(topic, ms * MS, f'{topic}{ms}')


def test_a_set_is_handed_over_when_it_is_complete():
    it = Collected('a', 'b')
    it.add('a', 1)
    assert it.sets == []
    it.add('b', 1)
    assert it.sets == [{'a': 'a1', 'b': 'b1'}]


def test_of_a_stream_with_gaps_only_complete_sets_are_handed_over():
    it = Collected('dots', 'region', 'contacts', patience=8)
    lost = {('region', 3), ('contacts', 4), ('contacts', 5), ('dots', 9), ('region', 12)}
    for k in range(20):  # 5 sets a second; what is computed later arrives later
        for topic, late in (('dots', 0), ('region', 1), ('contacts', 2)):
            if k >= late and (topic, k - late) not in lost:
                it.add(topic, 200 * (k - late))
    assert [found['dots'] for found in it.sets] == [f'dots{200 * k}' for k in range(18) if k not in (3, 4, 5, 9, 12)]
    assert all(len(found) == 3 for found in it.sets)


def test_a_topic_that_has_a_publisher_and_is_silent_is_waited_for_two_seconds_and_again_from_its_next_message():
    it = Collected('dots', 'contacts')
    for k in range(15):
        it.add('dots', 200 * k)
    assert [found['dots'] for found in it.sets] == [f'dots{200 * k}' for k in range(10, 15)]
    it.sets.clear()
    it.add('contacts', 2800)
    it.add('dots', 3000)
    assert it.sets == []
    it.add('contacts', 3000)
    assert it.sets == [{'dots': 'dots3000', 'contacts': 'contacts3000'}]


def test_older_sets_are_let_go_and_late_messages_ignored():
    it = Collected('a', 'b')
    for topic, ms in (('a', 1), ('a', 2), ('b', 2), ('b', 1)):
        it.add(topic, ms)
    assert it.sets == [{'a': 'a2', 'b': 'b2'}]


def test_a_recording_that_begins_anew_is_followed():
    it = Collected('a', 'b')
    for ms in (5000, 5033, 100, 133):
        it.add('a', ms)
        it.add('b', ms)
    assert [s['a'] for s in it.sets] == ['a5000', 'a5033', 'a100', 'a133']


def test_stamps_far_ahead_do_not_keep_others_from_being_completed():
    it = Collected('a', 'b', patience=3)
    for k in range(4):
        it.add('a', 10**9 + k)
    it.sets.clear()
    for ms in (1, 2):
        it.add('a', ms)
        assert it.sets == [], 'its mate is waited for'
        it.add('b', ms)
        assert it.sets.pop() == {'a': f'a{ms}', 'b': f'b{ms}'}
