# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0

import numpy as np

from tactile_driver.simulation.optics.led_light import Lamps

LAMPS = Lamps(((0.0, 0.0, -0.03),), (100.0,), 0.03, 20.0, (0.5, 1.0, 0.25), exposure=1.0)


def look(lamps, shape):
    up = np.zeros_like(shape)
    up[..., 2] = 1
    return lamps.seen_by(None, 0.8).look(shape.astype(np.float32), up.astype(np.float32), None)


def test_light_falls_off_with_distance_and_slant():
    light, _ = look(LAMPS, np.array([[[0, 0, 0], [0.03, 0, 0], [0, 0, 0.03]]]))
    # squarely at its reach; at 45 degrees and twice the square of the distance; squarely at twice the distance
    expected = 20 + 100 * np.array([1, 0.5 * np.sqrt(0.5), 0.25])
    np.testing.assert_allclose(light[0], expected[:, None] * [0.5, 1.0, 0.25], rtol=1e-5)
