# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from tactile_perception.dots.dots import DotTracks
from tactile_perception.errors import BadArgument
from tactile_perception.touch.rest_markers import RestMarkers
from tactile_perception.touch.view import StitchedView

REST = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 30.0], [30.0, 30.0]])
VIEW = StitchedView(1e-4, np.zeros(2), 20.0, np.array([[-0.02, 0.0, -0.05], [0.02, 0.0, -0.05]]))


def tracks(duv, area, id=(0, 1, 2, 3), rest=REST):
    id = np.asarray(id)
    duv = np.broadcast_to(np.asarray(duv, float), (len(id), 2))
    return DotTracks(2, 2, id, rest[id] + duv, np.broadcast_to(np.asarray(area, float), len(id)).copy(), np.full(len(id), np.nan), duv)


def test_growth_is_against_the_mean_untouched_area():
    markers = RestMarkers(4, lambda uv: VIEW)
    for area in (99.0, 101.0, 100.0):
        markers.field(tracks((0.0, 0.0), area))
    field = markers.field(tracks((3.0, 0.0), 150.0))
    assert field.growth == pytest.approx(np.log(1.5))
    assert markers.area == pytest.approx(100.0)  # a displaced marker tells nothing of its untouched area
    assert field.shift == pytest.approx(np.tile([3e-4, 0.0], (4, 1)))


def test_a_marker_never_seen_untouched_has_no_growth_and_one_not_seen_no_place():
    markers = RestMarkers(4, lambda uv: VIEW)
    field = markers.field(tracks((5.0, 0.0), 150.0, id=(0, 2)))
    assert np.isnan(field.growth).all()
    assert field.seen.tolist() == [True, False, True, False]
    assert field.eye[2] == pytest.approx([-0.02, 0.0, -0.05])


def test_the_view_is_made_anew_only_for_a_reference_that_moved_or_new_markers():
    asked = []
    markers = RestMarkers(4, lambda uv: asked.append(uv.copy()) or VIEW)
    markers.field(tracks((0.0, 0.0), 100.0, id=(0, 1, 2)))
    markers.field(tracks((0.1, 0.0), 100.0, id=(0, 1)))
    assert len(asked) == 1
    markers.field(tracks((0.0, 0.0), 100.0))
    assert len(asked) == 2
    assert np.isfinite(asked[-1]).all()
    markers.field(tracks((0.0, 0.0), 120.0, rest=REST + 1.0))
    assert len(asked) == 3
    assert markers.area == pytest.approx(120.0)  # another reference, other areas


def test_numbers_of_another_pattern_are_refused():
    with pytest.raises(BadArgument, match='do not fit'):
        RestMarkers(2, lambda uv: VIEW).field(tracks((0.0, 0.0), 100.0, id=(0, 3)))
