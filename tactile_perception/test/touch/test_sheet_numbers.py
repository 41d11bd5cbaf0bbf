# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math
import pathlib
import sys

import numpy as np
import pytest
import yaml
from tactile_perception.calibration.files import check_numbers
from tactile_perception.errors import BadCalibration
from tactile_perception.touch.sheet_numbers import library_from_numbers, library_numbers, pack, unpack

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from sheet_scenes import library  # noqa: E402


def test_what_is_packed_comes_back():
    values = np.random.default_rng(0).normal(size=(7, 11, 3))
    packed = pack(values)
    assert unpack(packed, values.shape) == pytest.approx(values, abs=np.abs(values).max() / 60000)
    assert all(math.isfinite(number) for number in packed['digits'])


def test_the_library_survives_a_calibration_file():
    numbers = yaml.safe_load(yaml.safe_dump(library_numbers(library())))
    check_numbers(numbers, 'fitted', 'file')
    again = library_from_numbers(numbers)
    fields = [one.fields(np.array([0.01, -0.004]), 5e-3, 0.1) for one in (library(), again)]
    assert np.abs(fields[1] - fields[0])[:, 0].max() < 5e-6
    assert again.plan == library().plan


@pytest.mark.parametrize('broken', [{}, {'half': [0.03, 0.02]}, {'classes': [{}]}])
def test_what_is_no_library_is_refused(broken):
    with pytest.raises(BadCalibration, match='calibrate again'):
        library_from_numbers(broken)


def test_a_shortened_number_is_refused():
    numbers = library_numbers(library())
    numbers['classes'][0]['shapes']['digits'] = numbers['classes'][0]['shapes']['digits'][:2]
    with pytest.raises(BadCalibration, match='calibrate again'):
        library_from_numbers(numbers)
