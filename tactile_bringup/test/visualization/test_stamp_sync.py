# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from tactile_bringup.visualization.stamp_sync import StampSync

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


def test_stamps_are_not_mixed():
    it = Collected('a', 'b')
    for topic, ms in (('a', 1), ('a', 2), ('b', 1), ('b', 2)):
        it.add(topic, ms)
    assert it.sets == [{'a': 'a1', 'b': 'b1'}, {'a': 'a2', 'b': 'b2'}]


def test_what_is_absent_is_not_waited_for():
    it = Collected('a')
    it.add('a', 1)
    assert it.sets == [{'a': 'a1'}]


def test_an_incomplete_set_is_handed_over_when_patience_is_over():
    it = Collected('a', 'b', patience=3)
    for ms in range(1, 5):
        it.add('a', ms)
    assert it.sets == [{'a': 'a1'}]


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
