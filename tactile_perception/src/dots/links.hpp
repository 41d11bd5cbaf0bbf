// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Places that are near each other, and links between two sets of them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace tactile {

constexpr std::size_t MOST_NEIGHBOURS = 32;  // of a position. Derived: distinct dots are a diameter apart, so fewer are in reach

// Pairs of places (count, 2), px, that are within reach, px, of each other along both axes; at most MOST_NEIGHBOURS * count.
std::vector<std::pair<std::int32_t, std::int32_t>> near_pairs(const double* places, std::ptrdiff_t count, double reach);

// The column of each row, one to one, with the least sum of costs (rows, columns); rows <= columns, costs finite.
std::vector<std::ptrdiff_t> assign_least(const std::vector<double>& cost, std::ptrdiff_t rows, std::ptrdiff_t columns);

// Links (place, dot) between places and dots (count, 2), px, that are each other's nearest and closer than gate, sorted by place.
using Link = std::pair<std::ptrdiff_t, std::ptrdiff_t>;
std::vector<Link> link_places(const double* places, std::ptrdiff_t place_count, const double* dots, std::ptrdiff_t dot_count, double gate);

// Tracks of dots of a pattern without a grid, from frame to frame.
class Linker {
 public:
    enum class State : std::uint8_t { NEW, TRACKED, LOST };
    // uv, first: px, last and first position; velocity: px/s; seen: frames in a row; seen_s: stamp of the last one.
    struct Track {
        std::int64_t id;
        Eigen::Vector2d uv, first, velocity;
        std::int64_t seen;
        double seen_s;
        State state;
    };
    // gate: search range, median spacings from the predicted position; confirm: frames in a row before a dot that appears later is reported
    // (NEW until then); keep_s: s that a LOST track is kept.
    Linker(double gate, std::int64_t confirm, double keep_s);
    // Id of each dot at places (count, 2), px, finite; -1 while NEW. Ids are never used again.
    std::vector<std::int64_t> update(const double* places, std::ptrdiff_t count, double stamp_s);
    // Drops all tracks; ids go on.
    void reset() { tracks_.clear(); }

 private:
    std::vector<Link> best_links(const double* places, std::ptrdiff_t count, double stamp_s) const;
    void follow(Track& track, const Eigen::Vector2d& uv, double stamp_s) const;

    double gate_;
    std::int64_t confirm_;
    double keep_s_;
    std::int64_t next_id_ = 0;
    std::vector<Track> tracks_;
};

}  // namespace tactile
