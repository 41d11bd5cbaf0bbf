# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_driver.parameters.table import defaults
from tactile_perception.errors import BadArgument
from tactile_perception.taxel.parameters import TAXEL_PARAMETERS, grasped_object, taxel_estimator

VALUES = defaults(TAXEL_PARAMETERS)


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
