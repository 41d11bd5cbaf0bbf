# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Presses whose error stands out are named by their time; even ones are not.
The picture of the errors is made, whatever is known of them.
Outliers and the picture are reported; that it cannot be written loses no calibration."""
import cv2
import numpy as np
import pytest
from tactile_perception.calibration.residuals import Residuals, draw_residuals, outliers, report_residuals


def made(value):
    value = np.asarray(value, float)
    when = [f'bag at {k}.000 s' for k in range(len(value))]
    return Residuals('depth', 'mm', value, np.zeros((len(value), 2)), ('x (mm)', 'y (mm)'), when)


def test_the_press_that_stands_out_is_named_with_its_error_and_what_is_usual():
    value = np.random.default_rng(0).normal(0, 0.1, 40)
    value[[7, 30]] = 1.9, -2.5
    assert outliers([made(value)]) == ['bag at 30.000 s: depth error 2.5 mm, the median is 0.054 mm',
                                       'bag at 7.000 s: depth error 1.9 mm, the median is 0.054 mm']


def test_nothing_stands_out_of_even_errors_of_few_or_of_unknown_ones():
    assert outliers([made(np.random.default_rng(1).normal(0, 0.1, 200))]) == []
    assert outliers([made([0, 0, 0, 5.0]), made(np.full(9, np.nan)), made([])]) == []
    assert outliers([made([*np.full(9, 0.1), np.nan])]) == []


@pytest.mark.parametrize('value', [np.linspace(0, 1, 9), np.linspace(-1, 1, 9), np.full(9, np.nan), np.zeros(0)])
def test_a_panel_for_each_quantity(tmp_path, value):
    place = np.random.default_rng(0).normal(size=(len(value), 2))
    path = tmp_path / 'residuals.png'
    draw_residuals(path, 'touchpad', [Residuals('depth', 'mm', value, place, ('x (mm)', 'y (mm)'), ())] * 2)
    picture = cv2.imread(str(path))
    assert picture.shape[1] > 800 and picture.shape[0] > 300 and len(np.unique(picture)) > 10


FOUND = [Residuals('depth', 'mm', np.arange(3.0), np.zeros((3, 2)), ('x (mm)', 'y (mm)'), ('a', 'b', 'c'))]


def test_lines_and_the_picture(tmp_path):
    lines = report_residuals(FOUND, ['c: far off'], tmp_path / 'pad.yaml', 'touchpad')
    assert lines == ['outlier: c: far off', f'plot of the errors: {tmp_path / "pad_residuals.png"}']
    assert (tmp_path / 'pad_residuals.png').stat().st_size > 1000


def test_no_picture_is_reported(tmp_path):
    lines = report_residuals(FOUND, [], tmp_path / 'none' / 'pad.yaml', 'touchpad')
    assert len(lines) == 1 and lines[0].startswith('no plot of the errors: ')
