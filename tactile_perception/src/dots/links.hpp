// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"

namespace tactile {

using Positions = Eigen::Matrix2Xd;  // px, a column each

constexpr double FARTHEST = 1e9;  // px, limit: positions beyond it are invalid

// Tracks of dots before a frame. last, predicted, first: positions in their last frame, in this frame at constant velocity, and where they
// began; seen: whether the last frame showed them.
struct TracksBefore {
    Positions last, predicted, first;
    std::vector<std::uint8_t> seen;
};

// dot: of each track, -1 for none; position: of each track, px, of those without a link as their neighbours move; spacing: px, typical
// distance of neighbours; ambiguous: number of tracks without a link that a dot without one may continue.
struct TrackLinks {
    std::vector<std::int32_t> dot;
    std::vector<double> position;
    double spacing = 0;
    std::ptrdiff_t ambiguous = 0;
    TACTILE_FIELDS(dot, position, spacing, ambiguous)
};

// Links at least two tracks with dots. size: px, width and height of the image, whose borders dots may cross unseen.
//
// Each hypothesis about the common motion (constant velocity, none, back to the beginning, or a part of a step to a neighbour) is fitted to
// the dots: mutual nearest neighbours whose displacement is continuous. Its cost in nats counts tracks and dots that it leaves unexplained,
// and its motion. The cheapest hypothesis wins; of its links those remain that no other probable hypothesis contradicts.
TrackLinks link_tracks(const TracksBefore& tracks, const Positions& dots, const Eigen::Vector2d& size);

// Which of dots move from first to now, px, as the median of their neighbours does; those that do not are no neighbours of others. A few
// dots have nothing to be compared with.
std::vector<std::uint8_t> continuous(const Positions& first, const Positions& now);

}  // namespace tactile
