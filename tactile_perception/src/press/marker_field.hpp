// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Markers seen in one frame (count): ids; positions and displacements (count, 2), px; areas, px^2.
struct SeenTracks {
    std::int64_t count;
    const std::int64_t* id;
    const double *uv, *duv, *area;
};

// Untouched markers of a pattern: positions (K, 2), px, and mean areas (K), px^2, NaN unknown; number of frames in the means (K).
struct UntouchedMarkers {
    std::vector<double> uv, area, frames;
};

struct FollowedBy {
    double moved;   // px: a reference that changed by more is a new one
    double still;   // px: a marker displaced by less counts as untouched
    double frames;  // time constant of the mean area
};

// Updates the untouched markers with those of a frame whose displacement is known; other ids than those of the pattern are left out.
void follow_markers(const SeenTracks& tracks, const FollowedBy& by, UntouchedMarkers& rest);

// Apparent markers: now and untouched (count, 3): x, y, m, in the viewing plane and area of a pixel there, m^2; eyes, m,
// of stride numbers each, 0 where all have one; sigma (count), px, standard deviations of positions.
struct ApparentMarkers {
    const double *now, *rest, *eye;
    std::ptrdiff_t stride;
    const double* sigma;
    double metres_per_px;
};

// A field by marker, see MarkerField in marker_field.py; NaN where a marker is not seen.
struct FieldArrays {
    std::vector<double> rest, shift, growth, eye, sigma, uv, duv, area;
};

// The field of a pattern of markers, to which all ids belong; untouched_area: (markers), px^2.
FieldArrays make_field(const SeenTracks& tracks, const ApparentMarkers& apparent, const double* untouched_area, std::int64_t markers);

}  // namespace tactile
