// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A face presses with the fluid's pressure up to its edge, at the share s of the way from a touched dot to a free one, and there with the
// edge's load Q. The mesh gives each load to the two dots by the lever: over the pressure, and with half a pitch on the touched dot's other
// side, the touched dot carries L = 1/2 + s - s^2 / 2 + Q (1 - s), the free one M = s^2 / 2 + Q s. Without Q: s^2 - 2 A s + 2 M = 0 with
// A = L + M - 1/2. Noise and blurred ranges move load outwards or inwards: what the next dot beyond the free one carries moves the edge,
// too.
#include "touchpad/contact/edge_places.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactile {
namespace {

constexpr double HALF = 0.5;     // score of the border of a contact
constexpr double BEYOND = 0.25;  // of the way, by which loads place an edge too far inside; chosen on simulated faces, rings and balls
// Of the way, by which a load of the fluid's pressure on the next dot beyond moves the edge outwards; largest such load. Chosen on
// simulated faces, rings, balls and edges: 0.3 to 0.8 are alike.
constexpr double FARTHER = 0.5, LARGEST = 1.0;
constexpr double LEAST = 0.03, MOST = 0.97;  // of the way; chosen: an edge stays between its two dots
constexpr double LIGHTEST = 0.05;            // least A; chosen

// Share of the way from a touched dot to a free one at which the edge lies, from their loads and that of the next dot beyond.
double edge_share(double touched, double free, double next) {
    const double beyond = std::max(0.0, free), both = std::max(LIGHTEST, touched + beyond - 0.5);
    const double share = both - std::sqrt(std::max(0.0, both * both - 2 * beyond)) + BEYOND;
    return std::max(LEAST, std::min(MOST, share + FARTHER * std::max(-LARGEST, std::min(LARGEST, next))));
}

// Distance, pitches, of dot k from the straight edge through the nearest edges on its row and on its column; infinite without any.
double edge_distance(Grid grid, std::ptrdiff_t k, const double* score, const double* load) {
    const std::ptrdiff_t row = k / grid.columns, column = k % grid.columns;
    const bool touched = score[k] > HALF;
    double squares = 0;
    const auto nearest = [&](std::ptrdiff_t place, std::ptrdiff_t count, std::ptrdiff_t step) {
        double distance = std::numeric_limits<double>::infinity();
        const auto at = [&](std::ptrdiff_t away) {  // load of another dot on the line, 0 outside of the grid
            return place + away >= 0 && place + away < count ? load[k + away * step] : 0.0;
        };
        for (const std::ptrdiff_t side : {-1, 1}) {
            if (place + side < 0 || place + side >= count || (score[k + side * step] > HALF) == touched) continue;
            distance = std::min(distance, touched ? edge_share(load[k], at(side), at(2 * side))
                                                  : 1 - edge_share(at(side), load[k], at(-side)));
        }
        squares += 1 / (distance * distance);
    };
    nearest(row, grid.rows, grid.columns);
    nearest(column, grid.columns, 1);
    return 1 / std::sqrt(squares);
}

}  // namespace

std::vector<double> place_edges(Grid grid, const double* score, const double* load) {
    std::vector<double> placed(score, score + grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        const double distance = edge_distance(grid, k, score, load);
        if (!std::isfinite(distance)) continue;
        placed[k] = (score[k] + HALF + (score[k] > HALF ? HALF : -HALF) * std::min(1.0, distance)) / 2;
    }
    return placed;
}

}  // namespace tactile
