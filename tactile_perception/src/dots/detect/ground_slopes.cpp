// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Slopes of the ground from the fitted grounds of neighbouring dots: a slope fitted within each dot's own small patch would cost up to half
// of the position's accuracy.
#include "dots/detect/ground_slopes.hpp"

#include <algorithm>

namespace tactile {
namespace {

constexpr double DARK = 0.2;       // grey levels: a darker ground gets slope zero. Chosen
constexpr double FEWEST = 3.5;     // dots of a plane: four
constexpr double FLATTEST = 0.02;  // cells^4, determinant of the dots' second moments per dot: less is a line of dots. Chosen

// Sums over dots of 1, u, v, ground, uu, uv, vv, u ground, v ground.
using Sums = std::array<double, 9>;

// The least-squares plane through the dots that were summed; u and v in cells.
GroundSlope plane(const Sums& sums, double cell) {
    if (sums[0] < FEWEST) return {};
    const double n = sums[0], u = sums[1] / n, v = sums[2] / n, ground = sums[3] / n;
    const double uu = sums[4] - n * u * u, uv = sums[5] - n * u * v, vv = sums[6] - n * v * v;
    const double ug = sums[7] - n * u * ground, vg = sums[8] - n * v * ground, determinant = uu * vv - uv * uv;
    if (!(determinant > FLATTEST * n * n && ground > DARK)) return {};
    const double scale = 1 / (determinant * ground * cell);
    return {(vv * ug - uv * vg) * scale, (uu * vg - uv * ug) * scale};
}

}  // namespace

std::vector<GroundSlope> ground_slopes(const std::vector<DotFit>& dots, const std::vector<double>& grounds,
                                       const std::vector<std::uint8_t>& used, double cell) {
    // the pixel of a dot is inside the image, which bounds the number of cells
    std::ptrdiff_t columns = 1, rows = 1;
    const auto index = [cell](std::ptrdiff_t pixel) { return static_cast<std::ptrdiff_t>(static_cast<double>(pixel) / cell) + 1; };
    for (const DotFit& dot : dots) columns = std::max(columns, index(dot.column) + 2), rows = std::max(rows, index(dot.row) + 2);
    const auto cell_of = [&](const DotFit& dot) { return index(dot.row) * columns + index(dot.column); };
    std::vector<Sums> cells(columns * rows, Sums{});  // with a margin
    for (std::size_t i = 0; i < dots.size(); ++i) {
        if (!used[i]) continue;
        // from the middle of the image, so that differences of sums stay exact enough
        const double u = dots[i].u() / cell - static_cast<double>(columns) / 2, v = dots[i].v() / cell - static_cast<double>(rows) / 2,
                     g = grounds[i];
        const Sums terms = {1, u, v, g, u * u, u * v, v * v, u * g, v * g};
        Sums& sums = cells[cell_of(dots[i])];
        for (std::size_t k = 0; k < terms.size(); ++k) sums[k] += terms[k];
    }
    std::vector<GroundSlope> slopes(dots.size());
    for (std::size_t i = 0; i < dots.size(); ++i) {
        if (!used[i]) continue;
        Sums around{};
        const std::ptrdiff_t middle = cell_of(dots[i]);
        for (const std::ptrdiff_t row : {middle - columns, middle, middle + columns}) {
            for (std::ptrdiff_t at = row - 1; at <= row + 1; ++at) {
                for (std::size_t k = 0; k < around.size(); ++k) around[k] += cells[at][k];
            }
        }
        slopes[i] = plane(around, cell);
    }
    return slopes;
}

}  // namespace tactile
