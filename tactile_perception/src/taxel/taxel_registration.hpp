// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace tactile {

// An image of a contact: positive pressure (rows, columns) times scale.
struct Picture {
    const float* pressure;
    std::ptrdiff_t rows, columns;
    float scale;
};

// Edge taxels of an image, from which a motion is told.
struct Edges {
    std::array<double, 16> normal{};  // (4, 4): sum over all edge taxels of the products of their slopes
    std::array<double, 2> middle{};   // row and column, mean of all edge taxels
    double reach = 1;                 // taxels from middle, within which most of them lie
    std::ptrdiff_t count = 0;         // of all
    std::vector<double> place;        // (M, 2) row and column of those that are used, at most `most`
    std::vector<double> value;        // (M,) image there
    std::vector<double> slopes;       // (M, 4) by a shift along columns and rows, by a turn times reach, by growth along the normals
};

// Edge taxels where the slope of the image exceeds steep, 1/taxel, none within rim of the border.
Edges edges_of(const Picture& picture, double steep, std::ptrdiff_t rim, std::ptrdiff_t most);

// The motion of edges in a later image.
struct Registered {
    std::array<double, 4> fit{};  // shift along columns and rows, turn times reach, growth: taxels
    double spread = 0;            // standard deviation of the image's residuals
    double inliers = 0;           // share of the edge taxels whose residual the biweight keeps
};

// Fit of the edges' motion from a first guess; turns: whether a turn is fitted too.
Registered registered(const Picture& picture, const double* place, const double* value, const double* slopes, std::ptrdiff_t count,
                      const std::array<double, 2>& middle, double reach, bool turns, const std::array<double, 4>& guess);

}  // namespace tactile
