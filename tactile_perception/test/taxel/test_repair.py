# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from taxel_pictures import bar, picture
from tactile_perception.errors import BadArgument
from tactile_perception.taxel.pressure import DeadTaxels, TaxelArray, fill


def test_gap_is_filled_from_its_neighbours():
    values = np.fromfunction(lambda r, c: 2 * r + 3 * c, (9, 9)).astype(np.float32)
    dead = np.zeros((9, 9), bool)
    dead[4] = True
    broken = np.where(dead, np.float32(77), values)
    assert fill(broken, dead)[4, 1:-1] == pytest.approx(values[4, 1:-1], abs=1e-4)


def test_all_dead_is_zero():
    assert not fill(np.ones((3, 3), np.float32), np.ones((3, 3), bool)).any()


def test_silent_row_through_a_contact_is_found_and_repaired():
    image = picture(bar())
    broken = image.copy()
    broken[21] = 0
    dead = DeadTaxels(np.zeros((44, 44), bool))
    for _ in range(12):
        repaired = dead.repaired(broken.copy(), 0.5)
    assert dead.dead[21, 15:29].all() and not np.delete(dead.dead, 21, axis=0).any()
    assert repaired[21, 15:29] == pytest.approx(image[21, 15:29], rel=0.02)


def test_healthy_contact_has_no_dead_taxel():
    dead = DeadTaxels(np.zeros((44, 44), bool))
    rng = np.random.default_rng(1)
    for _ in range(30):
        dead.repaired(picture(bar()) + rng.normal(0, 0.7, (44, 44)).astype(np.float32), 0.7)
    assert not dead.dead.any()


def test_nan_is_filled():
    image = picture(bar())
    image[20, 20] = np.nan
    assert DeadTaxels(np.zeros((44, 44), bool)).repaired(image, 0.5)[20, 20] == pytest.approx(60, rel=0.02)


def test_number_of_no_taxel():
    with pytest.raises(BadArgument, match='0 to 11'):
        TaxelArray(3, 4, 1e-3).dead([12])
