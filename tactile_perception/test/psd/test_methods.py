# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pytest
from tactile_driver.parameters.table import defaults

from tactile_perception.errors import BadArgument
from tactile_perception.parameters.psd import PSD_PARAMETERS
from tactile_perception.psd.methods import PSD_METHODS, make_finger
from tactile_perception.psd.model import FingerModel


@pytest.mark.parametrize('name', sorted(PSD_METHODS))
def test_every_method_is_made_of_the_parameters(name):
    finger = make_finger(name, FingerModel(), defaults(PSD_PARAMETERS) | {'radius': 0.02})
    assert finger.settings.radius == 0.02


def test_an_unknown_method_is_answered_with_those_that_exist():
    with pytest.raises(BadArgument, match='map, paper'):
        make_finger('magic', FingerModel(), defaults(PSD_PARAMETERS))
