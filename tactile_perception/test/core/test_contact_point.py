# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact point and depth against NumPy and LAPACK."""
from dataclasses import replace

import contact_point_reference as reference
import numpy as np
import pytest
from cap_with_dots import pad  # noqa: F401
from tactile_perception.touchpad.region import find_contact, find_regions


@pytest.mark.parametrize('seed', range(6))
@pytest.mark.parametrize('kind', ['sphere', 'edge of a sphere', 'disc', 'ring', 'light touch', 'cylinder', 'ellipsoid'])
def test_point_and_depth_are_the_references(pad, kind, seed):  # noqa: F811
    noise, (x, y) = 20e-6, pad.rest[:, :2].T
    dots = {'sphere': lambda: pad.sphere(noise=noise, seed=seed), 'disc': lambda: pad.disc(noise=noise),
            'ring': lambda: pad.ring(noise=noise),
            'edge of a sphere': lambda: pad.sphere(tip=(5e-3, 1e-3, 10e-3), noise=noise, seed=seed),
            'light touch': lambda: pad.sphere(tip=(3e-3, 0, 12.7e-3 - 2e-5 * seed), noise=noise, seed=seed),
            'cylinder': lambda: pad.pressed(np.maximum(np.abs(x - 1e-3) - 3e-3, np.abs(y) - 5e-3), 10.5e-3 + (x - 2e-3)**2 / 16e-3,
                                            noise=noise),
            'ellipsoid': lambda: pad.pressed(np.hypot(x, y) - 4e-3, 10.5e-3 + x**2 / 16e-3 + (y - 1e-3)**2 / 60e-3, noise=noise)}[kind]()
    region = find_regions(dots)[0]
    found = find_contact(dots, region, pad.cap)
    for one, other in zip(found, reference.contact_point(dots, region)):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-10 if one.ndim == 1 else 1e-16)
    assert found.depth == pytest.approx(reference.contact_depth(dots, region, pad.cap), abs=1e-10)


def test_depth_of_nothing_is_unknown(pad):  # noqa: F811
    dots = pad.disc()
    region = find_regions(dots)[0]
    for dots.xyz in (np.ones((529, 3)), np.full((529, 3), np.nan)):
        assert np.isnan(find_contact(dots, region, pad.cap).depth)
    nothing = replace(region, members=np.zeros(529, bool))
    assert np.isnan(find_contact(pad.disc(), nothing, pad.cap).depth)
