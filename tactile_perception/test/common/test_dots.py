# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
from tactile_perception.common.dots import DotTracks


def test_tracks_of_single_precision_are_kept_in_double():
    uv, xyz = np.float32([[1.5, 2.25], [3.0, 4.0]]), np.float32([[1, 2, 3], [4, 5, 6]])
    tracks = DotTracks(1, 2, np.arange(2), uv, uv[:, 0], uv[:, 1], uv, xyz)
    part = tracks.take(np.array([True, False]))
    for dots in (tracks, part):
        assert all(values.dtype == np.float64 for values in (dots.uv, dots.area, dots.sigma, dots.duv, dots.xyz, dots.rest_uv))
    tracks.xyz = 2 * xyz
    assert tracks.xyz.dtype == np.float64 and (tracks.xyz == 2 * xyz).all() and tracks.id.dtype == np.int64
