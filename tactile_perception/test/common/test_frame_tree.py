# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.common.frame_tree import FrameTree
from tactile_perception.errors import BadFrame

QUARTER = np.sqrt(0.5)
LEFT, STRAIGHT = [0, 0, QUARTER, QUARTER], [0, 0, 0, 1]  # a quarter turn about z, from x to y


def hand():
    """world -> wrist (a metre up, turned left) -> finger (10 cm along the wrist's x); world -> table."""
    tree = FrameTree()
    tree.take('world', 'wrist', LEFT, [0, 0, 1])
    tree.take('wrist', 'finger', STRAIGHT, [0.1, 0, 0])
    tree.take('world', 'table', STRAIGHT, [2, 0, 0])
    return tree


def at(tree, frame, reference, place=(0, 0, 0)):
    rotation, translation = tree.pose(frame, reference)
    return rotation @ place + translation


def test_up_down_and_across():
    tree = hand()
    assert at(tree, 'finger', 'world') == pytest.approx([0, 0.1, 1])
    assert at(tree, 'finger', 'world', (1, 0, 0)) == pytest.approx([0, 1.1, 1])
    assert at(tree, 'world', 'finger', (0, 0.1, 1)) == pytest.approx([0, 0, 0])
    assert at(tree, 'finger', 'table') == pytest.approx([-2, 0.1, 1])
    assert at(tree, 'finger', 'finger', (1, 2, 3)) == pytest.approx([1, 2, 3])


def test_the_newest_counts():
    tree = hand()
    before = tree.changes
    tree.take('world', 'wrist', STRAIGHT, [0, 0, 2])
    assert tree.changes == before + 1 and at(tree, 'finger', 'world') == pytest.approx([0.1, 0, 2])


def test_frames_that_do_not_hang_together():
    tree = hand()
    tree.take('map', 'robot', STRAIGHT, [0, 0, 0])
    assert tree.pose('finger', 'robot') is None and tree.pose('finger', 'nowhere') is None


def test_a_circle_ends():
    tree = FrameTree()
    tree.take('a', 'b', STRAIGHT, [1, 0, 0])
    tree.take('b', 'a', STRAIGHT, [1, 0, 0])
    assert tree.pose('a', 'c') is None


def test_rotations_of_any_length_are_taken_and_others_refused():
    tree = FrameTree()
    tree.take('a', 'b', [0, 0, 3, 3], [0, 0, 0])
    assert at(tree, 'b', 'a', (1, 0, 0)) == pytest.approx([0, 1, 0])
    for quaternion, translation in (([0, 0, 0, 0], [0, 0, 0]), ([0, 0, 0, np.nan], [0, 0, 0]), ([0, 0, 0, 1], [0, np.inf, 0]),
                                    ([0, 0, 1e200, 1e200], [0, 0, 0]), ([1e308] * 4, [0, 0, 0]), ([0, 0, np.inf, 0], [0, 0, 0]),
                                    ([0, 0, 0, 1], [1e300, 0, 0]), ([0, 0, 0, 1], [np.nan, 0, 0])):
        with pytest.raises(BadFrame):
            tree.take('a', 'c', quaternion, translation)
    with pytest.raises(BadFrame):
        tree.take('a', 'a', [0, 0, 0, 1], [0, 0, 0])
