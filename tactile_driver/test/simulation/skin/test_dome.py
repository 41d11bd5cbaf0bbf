# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from tactile_driver.simulation.skin.dome import Membrane


@pytest.fixture(scope='module')
def membrane():
    return Membrane(nodes=33)


def test_rest_is_a_cap_with_a_clamped_rim(membrane):
    arm = membrane.rest - [0, 0, -0.007]
    np.testing.assert_allclose(np.linalg.norm(arm, axis=-1), 0.020, atol=1e-12)
    border = membrane.rest.reshape(-1, 3)[~membrane.inner]
    np.testing.assert_allclose(border[:, 2], 0, atol=1e-12)
    np.testing.assert_allclose(np.hypot(border[:, 0], border[:, 1]), np.sqrt(0.020**2 - 0.007**2), atol=1e-12)
    assert membrane.rest[16, 16] == pytest.approx([0, 0, 0.013], abs=1e-12)


def test_volume_area_and_pressure_are_the_cap_s(membrane):
    assert membrane.volume == pytest.approx(np.pi * 0.013**2 * (0.060 - 0.013) / 3, rel=0.005)
    assert membrane.node_area.sum() == pytest.approx(2 * np.pi * 0.020 * 0.013, rel=0.005)
    assert membrane.pressure == pytest.approx(2 * 32 / 0.020)
    lift = membrane.area_vectors(membrane.rest).sum(axis=0)
    assert lift == pytest.approx([0, 0, np.pi * (0.020**2 - 0.007**2)], abs=1e-5)


def test_rest_is_in_balance(membrane):
    places = membrane.slack + membrane.give(membrane.pressure * membrane.area_vectors(membrane.rest)[membrane.inner])
    np.testing.assert_allclose(membrane.with_rim(places), membrane.rest, atol=1e-15)


def test_compliance_is_what_the_skin_gives(membrane):
    force = np.zeros((membrane.inner.sum(), 3))
    force[400, 2] = -0.1
    np.testing.assert_allclose(membrane.give(force)[:, 2], -0.1 * membrane.compliance[:, 400], rtol=1e-3, atol=1e-7)
    assert membrane.give(force)[400, 2] < -0.3e-3
