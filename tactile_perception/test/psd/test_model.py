# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_perception._core import place_values
from tactile_perception.psd.model import CROSS, INSIDE, LEVEL, LOADS, NORMAL, FingerModel


def test_without_a_calibration_the_map_is_nominal_and_the_rest_unknown():
    row = place_values(np.array([[0.5, 0.0]]), FingerModel().table)[0]
    assert row[NORMAL] == pytest.approx([np.sin(np.pi / 4), 0, np.cos(np.pi / 4)], abs=1e-4)
    assert np.isnan(row[LEVEL]) and np.isnan(row[CROSS]) and np.isnan(row[LOADS]).all()
    assert FingerModel().load_terms.shape == (2, 8) and np.isnan(FingerModel().load_terms).all()


def test_the_table_is_the_model(model):
    place = np.random.default_rng(0).uniform(-0.4, 0.4, (200, 2))
    rows = place_values(place, model.table)
    normal = rows[:, NORMAL] / np.linalg.norm(rows[:, NORMAL], axis=1, keepdims=True)
    assert np.degrees(np.linalg.norm(normal - model.normals(place), axis=1)).max() < 0.02
    assert rows[:, LEVEL] == pytest.approx(model.levels(place), abs=0.01)
    assert (rows[:, INSIDE] == 1).all()
    assert place_values(np.array([[0.98, 0.98]]), model.table)[0, INSIDE] == 0


def test_the_table_is_made_once():
    model = FingerModel()
    assert model.table is model.table
