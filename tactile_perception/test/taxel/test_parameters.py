# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_driver.parameters.table import defaults
from tactile_perception.common.geometry import FrameTree
from tactile_perception.errors import BadArgument
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS, grasped_object, taxel_estimator

VALUES = defaults(TAXEL_PARAMETERS)


def test_defaults_are_the_papers_array_and_nothing_is_known_of_the_object():
    estimator = taxel_estimator(VALUES)
    assert estimator.array.shape == (44, 44) and estimator.array.full_scale == 255
    assert np.isnan(estimator.grasped.depth) and np.isnan(estimator.grasped.weight).all()


def test_weight_along_gravity():
    known = grasped_object(VALUES | {'object.weight': 3.0, 'object.gravity': [0.0, 0.0, 0.5], 'object.depth': 1e-3})
    assert known.weight.tolist() == [0, 0, 3] and known.depth == 1e-3


IN_FRAMES = VALUES | {'object.weight': 3.0, 'object.gravity': [0.0, 0.0, -2.0], 'object.gravity_frame': 'world', 'object.depth': 1e-3,
                      'object.centre_of_mass': [0.01, 0.0, 0.0], 'object.centre_of_mass_frame': 'object'}


def test_gravity_and_centre_of_mass_in_frames_of_tf():
    tree = FrameTree()
    tree.take('world', 'pad', [0.5, 0.5, 0.5, 0.5], [0, 0, 1])  # the pad's x along the world's y, y along z, z along x
    tree.take('pad', 'object', [0, 0, np.sqrt(0.5), np.sqrt(0.5)], [0, 0.002, 0])
    known = grasped_object(IN_FRAMES, tree, 'pad')
    assert known.weight == pytest.approx([0, -3, 0]) and known.centre_of_mass == pytest.approx([0, 0.012, 0]) and known.depth == 1e-3


@pytest.mark.parametrize('told', ['object', 'world'])
def test_values_in_an_unknown_frame_are_unknown(told):
    tree = FrameTree()
    tree.take('pad', told, [0, 0, 0, 1], [0, 0, 0])
    known = grasped_object(IN_FRAMES, tree, 'pad')
    assert np.isnan(known.weight).all() and np.isnan(known.centre_of_mass).all() and known.depth == 1e-3


@pytest.mark.parametrize('wrong', [{'object.gravity': [0.0, 0.0, 0.0]}, {'object.gravity': [1.0]}, {'object.centre_of_mass': [0.0]}])
def test_wrong_object(wrong):
    with pytest.raises(BadArgument, match='three numbers'):
        grasped_object(VALUES | wrong)


def test_dead_taxels_reach_the_estimator():
    with pytest.raises(BadArgument, match='dead'):
        taxel_estimator(VALUES | {'dead_taxels': [44 * 44]})


def test_a_sensor_that_is_touched_at_the_start():
    image = np.zeros((44, 44), np.uint8)
    image[10:30, 10:30] = 90
    found = [len(taxel_estimator(VALUES | {'reference.start': start}).process(image, 1.0).contacts) for start in ('first', 'zero')]
    assert found == [0, 1]
