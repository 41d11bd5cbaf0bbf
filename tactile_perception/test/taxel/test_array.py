# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.errors import BadArgument, BadFrame
from tactile_perception.taxel.pressure import SoftPad, TaxelArray


def test_origin_is_the_middle_x_along_columns():
    array = TaxelArray(3, 5, 2e-3)
    assert array.x.tolist() == pytest.approx([-4e-3, -2e-3, 0, 2e-3, 4e-3])
    assert array.y.tolist() == pytest.approx([-2e-3, 0, 2e-3])


@pytest.mark.parametrize('values', [np.zeros((4, 4)), np.zeros((3, 5), complex), np.zeros(15)])
def test_frame_of_another_shape_or_type_is_refused(values):
    with pytest.raises(BadFrame):
        TaxelArray(3, 5, 1e-3).frame(values)


def test_infinity_becomes_nan():
    frame = TaxelArray(1, 2, 1e-3).frame(np.array([[np.inf, 1.0]]))
    assert np.isnan(frame[0, 0]) and frame[0, 1] == 1


@pytest.mark.parametrize('wrong', [dict(rows=0), dict(columns=257), dict(pitch=0.0), dict(full_scale=0.0)])
def test_wrong_array(wrong):
    with pytest.raises(BadArgument):
        TaxelArray(**{'rows': 4, 'columns': 4, 'pitch': 1e-3} | wrong)


def test_pad():
    assert SoftPad(thickness=0.002, shear_modulus=1e5).shear_stiffness == pytest.approx(5e7)
    with pytest.raises(BadArgument, match='friction'):
        SoftPad(friction=0.0)
