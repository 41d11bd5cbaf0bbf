# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import pathlib

import numpy as np
import pytest
from tactile_bringup.visualization.rviz.sensor_shape import shape_of

PARAMS = pathlib.Path(__file__).resolve().parents[3] / 'params'


@pytest.mark.parametrize(('name', 'half', 'height', 'reach'), [
    ('touchpad', (0.01874, 0.01874), 0.013, 0.015), ('areal_single', (0.030, 0.0225), 0.0, 0.0225),
    ('areal_dual', (0.0665, 0.0455), 0.0, 0.041),
    ('air_cushion', (0.15, 0.15), 0.12, 0.0775), ('psd_finger', (0.016, 0.016), 0.016, 0.008), ('taxel_array', (0.022, 0.022), 0.0, 0.015)])
def test_sizes_are_those_of_the_parameter_file(name, half, height, reach):
    shape = shape_of((PARAMS / f'{name}.yaml').read_text())
    assert shape.half == pytest.approx(half, abs=1e-4) and (shape.height, shape.reach) == pytest.approx((height, reach))
    assert np.ptp(shape.corners(), axis=0) == pytest.approx([2 * half[0], 2 * half[1], height], abs=2e-4)
    assert shape.arrow_ends()[:, 2].max() == pytest.approx(height + reach)


def test_arrows_on_a_dome_stand_on_its_slope():
    shape = shape_of((PARAMS / 'air_cushion.yaml').read_text())
    centre = np.array([0.0, 0.0, shape.height - shape.radius])
    assert np.linalg.norm(shape.arrow_ends() - centre, axis=1) == pytest.approx(shape.radius + shape.reach)
    assert len(shape.outermost()) == 8 + len(shape.arrow_ends())
