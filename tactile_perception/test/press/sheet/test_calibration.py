# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
from sheet_scenes import field_of, pressed
from tactile_perception.errors import BadCalibration
from tactile_perception.press.sheet.calibration import fit_numbers
from tactile_perception.press.sheet.mechanics import SheetMaterial
from tactile_perception.press.sheet.library import LibraryPlan
from tactile_perception.press.presses import Presses


PLAN = LibraryPlan((0.030, 0.0225), 7.5e-3, 7e-3, n=5, levels=5, substeps=2)
PLACES = [(0.0, 0.0), (0.014, 0.009), (-0.014, 0.009), (0.002, -0.010)]


def presses(radius=6e-3, material=SheetMaterial(1.045, 3e-7, 0.4), depths=(6e-3, 3e-3), places=PLACES):
    at = [(*place, depth) for place in places for depth in depths]
    fields = tuple(field_of(pressed(*where, radius, material), 1e-6, 1e-3, seed) for seed, where in enumerate(at))
    at = np.array(at)
    return Presses(fields, at * [1, 1, -1], at[:, 2])


@pytest.mark.full
def test_the_numbers_of_another_sheet_and_tip_are_found():
    numbers = fit_numbers(presses(places=PLACES[:2]), PLAN)
    assert numbers.radius == pytest.approx(6e-3, rel=0.05)
    assert numbers.material.prestretch - 1 == pytest.approx(0.045, rel=0.12)
    assert numbers.material.friction == pytest.approx(0.4, rel=0.2)
    assert np.abs(numbers.camera_centres.shifts).max() < 1e-4


def test_presses_at_the_clamp_alone_are_refused():
    with pytest.raises(BadCalibration, match='farther from the clamp'):
        fit_numbers(presses(places=[(0.022, 0.0)]).select(np.array([True, False])), LibraryPlan((0.026, 0.0225), 7.5e-3, 7e-3))
