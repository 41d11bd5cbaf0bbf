// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/marker_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactile {

void follow_markers(const SeenTracks& tracks, const FollowedBy& by, UntouchedMarkers& rest) {
    const auto markers = static_cast<std::int64_t>(rest.area.size());
    for (std::int64_t i = 0; i < tracks.count; ++i) {
        const double *uv = tracks.uv + 2 * i, *duv = tracks.duv + 2 * i;
        const std::int64_t k = tracks.id[i];
        if (k < 0 || k >= markers || !std::isfinite(duv[0]) || !std::isfinite(duv[1])) continue;
        double* known = &rest.uv[2 * k];
        double &area = rest.area[k], &frames = rest.frames[k];
        bool same = true;
        for (int axis = 0; axis < 2; ++axis) {
            const double place = uv[axis] - duv[axis];
            same = same && std::abs(place - known[axis]) <= by.moved;  // NaN counts as changed
            known[axis] = place;
        }
        if (!same) frames = 0;
        if (!(std::max(std::abs(duv[0]), std::abs(duv[1])) <= by.still)) continue;
        frames = std::min(frames + 1, by.frames);
        area = frames == 1 ? tracks.area[i] : area + (tracks.area[i] - area) / frames;
    }
}

FieldArrays make_field(const SeenTracks& tracks, const ApparentMarkers& apparent, const double* untouched_area, std::int64_t markers) {
    const auto unknown = [markers](int columns) {
        return std::vector<double>(static_cast<std::size_t>(columns * markers), std::numeric_limits<double>::quiet_NaN());
    };
    FieldArrays field{unknown(2), unknown(2), unknown(1), unknown(3), unknown(1), unknown(2), unknown(2), unknown(1)};
    for (std::int64_t i = 0; i < tracks.count; ++i) {
        const std::int64_t k = tracks.id[i];
        const double *now = apparent.now + 3 * i, *rest = apparent.rest + 3 * i;
        for (int axis = 0; axis < 2; ++axis) {
            field.rest[2 * k + axis] = rest[axis], field.shift[2 * k + axis] = now[axis] - rest[axis];
            field.uv[2 * k + axis] = tracks.uv[2 * i + axis], field.duv[2 * k + axis] = tracks.duv[2 * i + axis];
        }
        std::copy_n(apparent.eye + apparent.stride * i, 3, &field.eye[3 * k]);
        field.sigma[k] = apparent.sigma[i] * apparent.metres_per_px;
        field.area[k] = tracks.area[i];
        const double growth = std::log(tracks.area[i] / untouched_area[k] * (now[2] / rest[2]));
        field.growth[k] = std::isfinite(growth) ? growth : std::numeric_limits<double>::quiet_NaN();
    }
    return field;
}

}  // namespace tactile
