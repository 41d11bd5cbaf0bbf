// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Ranges from path lengths: one Newton step on the surface at rest, the surface's normals and curvature from these first ranges, and a
// second Newton step on that surface.
#include "touchpad/optics/water_ranges.hpp"

#include <cmath>
#include <limits>

#include "touchpad/optics/grid_normal.hpp"

namespace tactile {
namespace {

constexpr double NONE = std::numeric_limits<double>::quiet_NaN();
constexpr double BINOMIAL[3] = {0.25, 0.5, 0.25};

// Values on the grid of dots, NaN where a dot is not seen.
struct Grid {
    std::ptrdiff_t rows, columns;
    std::vector<double> values;

    Grid(std::ptrdiff_t rows, std::ptrdiff_t columns) : rows(rows), columns(columns), values(rows * columns, NONE) {}
    double at(std::ptrdiff_t row, std::ptrdiff_t column) const { return values[row * columns + column]; }
    bool inner(std::ptrdiff_t row, std::ptrdiff_t column) const { return row > 0 && column > 0 && row < rows - 1 && column < columns - 1; }
};

// Binomial mean over the known ones of 3 x 3 neighbours.
Grid smooth(const Grid& grid) {
    Grid out(grid.rows, grid.columns);
    for (std::ptrdiff_t row = 0; row < grid.rows; ++row) {
        for (std::ptrdiff_t column = 0; column < grid.columns; ++column) {
            double sum = 0, weight = 0;
            for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(row - 1, 0); r <= std::min(row + 1, grid.rows - 1); ++r) {
                for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(column - 1, 0); c <= std::min(column + 1, grid.columns - 1); ++c) {
                    const double share = BINOMIAL[r - row + 1] * BINOMIAL[c - column + 1], value = grid.at(r, c);
                    if (!std::isfinite(value)) continue;
                    sum += share * value;
                    weight += share;
                }
            }
            if (weight > 0) out.values[row * grid.columns + column] = sum / weight;
        }
    }
    return out;
}

// Discrete Laplacian, per pitch squared; 0 at the grid's border and where a neighbour is missing.
double laplacian(const Grid& grid, std::ptrdiff_t row, std::ptrdiff_t column) {
    if (!grid.inner(row, column)) return 0;
    const double sum = grid.at(row - 1, column) + grid.at(row + 1, column) + grid.at(row, column - 1) + grid.at(row, column + 1) -
                       4 * grid.at(row, column);
    return std::isfinite(sum) ? sum : 0;
}

// The surface through the dots.
class Surface {
 public:
    // ranges: N, m, a first estimate. Only their changes since rest are smoothed, since derivatives amplify noise.
    Surface(const LightPath& path, const SeenDots& dots, const std::vector<double>& ranges)
        : dots_(dots), flat_(dots.rows < 3 || dots.columns < 3), change_(flat_ ? 0 : dots.rows, flat_ ? 0 : dots.columns), places_{} {
        if (flat_) return;
        for (std::ptrdiff_t k = 0; k < dots.count; ++k) change_.values[dots.id[k]] = ranges[k] - dots.rest_ranges[k];
        change_ = smooth(change_);
        places_.assign(3 * change_.values.size(), NONE);
        for (std::ptrdiff_t k = 0; k < dots.count; ++k) {
            const double change = change_.values[dots.id[k]], range = dots.rest_ranges[k] + (std::isfinite(change) ? change : 0);
            store(places_.data(), dots.id[k], path.centre + range * vec3_at(dots.rays, k));
        }
    }

    // Laplacian of the change of the ranges since rest at dot k, m per pitch squared.
    double curvature(std::ptrdiff_t k) const {
        return flat_ ? 0 : laplacian(change_, dots_.id[k] / dots_.columns, dots_.id[k] % dots_.columns);
    }

    // Unit normal, z up, at dot k; that at rest at the border and where a neighbour is missing.
    Vec3 normal(std::ptrdiff_t k) const {
        const Vec3 rest = vec3_at(dots_.rest_normals, k);
        if (flat_ || !change_.inner(dots_.id[k] / dots_.columns, dots_.id[k] % dots_.columns)) return rest;
        return grid_normal(places_.data() + 3 * dots_.id[k], dots_.columns, rest);
    }

 private:
    const SeenDots& dots_;
    bool flat_;
    Grid change_;
    std::vector<double> places_;
};

// One Newton step along a ray from range start to the range at which the path has that length.
Length march(const LightPath& path, double length, Vec3 ray, double start, Vec3 normal) {
    const Vec3 place = path.centre + start * ray;
    const Length here = length_at(path, place.z, ray.z, incidence(path, place, normal, ray));
    return {start + (length - here.metres) / here.slope, here.slope};
}

}  // namespace

WaterRanges water_ranges(const LightPath& path, const SeenDots& dots, const double* lengths, double ring_share) {
    std::vector<double> first(dots.count);
    for (std::ptrdiff_t k = 0; k < dots.count; ++k)
        first[k] = march(path, lengths[k], vec3_at(dots.rays, k), dots.rest_ranges[k], vec3_at(dots.rest_normals, k)).metres;
    const Surface surface(path, dots, first);
    WaterRanges found{std::vector<double>(dots.count), std::vector<double>(dots.count)};
    for (std::ptrdiff_t k = 0; k < dots.count; ++k) {
        const Length second = march(path, lengths[k], vec3_at(dots.rays, k), first[k], surface.normal(k));
        // The mean over a ring of radius r differs from the value at its centre by r^2 / 4 times the Laplacian, to second order.
        found.ranges[k] = second.metres - surface.curvature(k) * ring_share * ring_share / 4;
        found.slopes[k] = second.slope;
    }
    return found;
}

}  // namespace tactile
