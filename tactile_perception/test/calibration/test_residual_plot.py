# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The picture of the errors is made, whatever is known of them."""
import cv2
import numpy as np
import pytest
from tactile_perception.calibration.residual_plot import draw_residuals, plot_path
from tactile_perception.calibration.residuals import Residuals


@pytest.mark.parametrize('value', [np.linspace(0, 1, 9), np.linspace(-1, 1, 9), np.full(9, np.nan), np.zeros(0)])
def test_a_panel_for_each_quantity(tmp_path, value):
    place = np.random.default_rng(0).normal(size=(len(value), 2))
    path = plot_path(tmp_path / 'my_pad.yaml')
    draw_residuals(path, 'touchpad', [Residuals('depth', 'mm', value, place, ('x (mm)', 'y (mm)'), ())] * 2)
    assert path.name == 'my_pad_residuals.png'
    picture = cv2.imread(str(path))
    assert picture.shape[1] > 800 and picture.shape[0] > 300 and len(np.unique(picture)) > 10


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(OSError):
        draw_residuals(tmp_path / 'none' / 'x.png', '', [Residuals('a', 'b', np.zeros(1), np.zeros((1, 2)), ('x', 'y'), ())])
