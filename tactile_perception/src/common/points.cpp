// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "common/vectors.hpp"
#include "common/wide.hpp"

namespace tactile {

TACTILE_WIDE bool all_within(const double* values, std::ptrdiff_t count, double most) {
    std::int64_t within = 0;  // counted: a loop without branches
    for (std::ptrdiff_t k = 0; k < count; ++k) within += std::abs(values[k]) <= most;
    return within == count;
}

namespace {

// Slope at place k, number `at` along an axis of count places, step numbers apart.
double slope(const double* values, std::ptrdiff_t k, std::ptrdiff_t step, std::ptrdiff_t at, std::ptrdiff_t count) {
    constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();
    const double before = at > 0 ? values[k] - values[k - step] : UNKNOWN;
    const double after = at + 1 < count ? values[k + step] - values[k] : UNKNOWN;
    if (std::isnan(before) || std::isnan(after)) return std::isnan(before) ? after : before;
    return 0.5 * (before + after);
}

}  // namespace

std::vector<double> grid_normals(const double* places, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    std::vector<double> normals(static_cast<std::size_t>(3 * rows * columns), std::numeric_limits<double>::quiet_NaN());
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        for (std::ptrdiff_t c = 0; c < columns; ++c) {
            const std::ptrdiff_t k = r * columns + c;
            double across[3], down[3];
            for (std::ptrdiff_t axis = 0; axis < 3; ++axis) {
                across[axis] = slope(places, 3 * k + axis, 3, c, columns);
                down[axis] = slope(places, 3 * k + axis, 3 * columns, r, rows);
            }
            const Vec3 normal = cross(vec3_at(across, 0), vec3_at(down, 0));
            const double size = length(normal);
            if (size > 0) store(normals.data(), k, 1 / size * normal);
        }
    }
    return normals;
}

namespace {

constexpr double COINCIDENT = 1e-24;  // m^2: a picometre

std::array<double, 2> mean(const double* values, std::ptrdiff_t count) {
    double x = 0, y = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) x += values[2 * k], y += values[2 * k + 1];
    return {x / static_cast<double>(count), y / static_cast<double>(count)};
}

}  // namespace

PlanarTwist planar_twist(const double* place, const double* velocity, std::ptrdiff_t count, double far) {
    const std::array<double, 2> middle = mean(place, count), drift = mean(velocity, count);
    double spread = 0, product = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        const double x = place[2 * k] - middle[0], y = place[2 * k + 1] - middle[1];
        spread += x * x + y * y;
        product += x * (velocity[2 * k + 1] - drift[1]) - y * (velocity[2 * k] - drift[0]);
    }
    if (!(spread > COINCIDENT && spread < INFINITY)) return {{NAN, NAN}, NAN, {NAN, NAN}};
    const double turn = product / spread, radius = std::sqrt(spread / static_cast<double>(count));
    const std::array<double, 2> linear{drift[0] + turn * middle[1], drift[1] - turn * middle[0]};
    if (std::hypot(drift[0], drift[1]) >= std::abs(turn) * far * radius) return {linear, turn, {NAN, NAN}};
    return {linear, turn, {middle[0] - drift[1] / turn, middle[1] + drift[0] / turn}};
}

namespace {

// A polygon's corners in the plane.
class Polygon {
 public:
    Polygon(const double* corners, std::ptrdiff_t count) : corners_(corners), count_(count) {}

    // Its corners on the convex hull, in their order along the polygon: those of a lower and an upper chain from left to right (Andrew,
    // Another efficient algorithm for convex hulls in two dimensions, 1979).
    std::vector<std::ptrdiff_t> hull() const {
        std::vector<std::ptrdiff_t> order(count_), chain, found;
        std::iota(order.begin(), order.end(), 0);
        std::sort(order.begin(), order.end(),
                  [&](std::ptrdiff_t i, std::ptrdiff_t j) { return std::make_pair(x(i), y(i)) < std::make_pair(x(j), y(j)); });
        for (const double side : {1.0, -1.0}) {
            chain.clear();
            for (const std::ptrdiff_t k : order) {
                while (chain.size() > 1 && !(side * twice_area(chain[chain.size() - 2], chain.back(), k) > 0)) chain.pop_back();
                chain.push_back(k);
            }
            found.insert(found.end(), chain.begin(), chain.end());
        }
        std::sort(found.begin(), found.end());
        found.erase(std::unique(found.begin(), found.end()), found.end());
        return found;
    }

    // Distance of corner k from the line through corners a and b, or from both if they are at one place.
    double distance(std::ptrdiff_t k, std::ptrdiff_t a, std::ptrdiff_t b) const {
        const double side = std::hypot(x(b) - x(a), y(b) - y(a));
        return side > 0 ? std::abs(twice_area(a, b, k)) / side : std::hypot(x(k) - x(a), y(k) - y(a));
    }

 private:
    double x(std::ptrdiff_t k) const { return corners_[2 * k]; }
    double y(std::ptrdiff_t k) const { return corners_[2 * k + 1]; }
    double twice_area(std::ptrdiff_t a, std::ptrdiff_t b, std::ptrdiff_t c) const {
        return (x(b) - x(a)) * (y(c) - y(a)) - (y(b) - y(a)) * (x(c) - x(a));
    }

    const double* corners_;
    const std::ptrdiff_t count_;
};

}  // namespace

// The squared length times the sum of the other two squared extents is the sum of the scatter's 2 x 2 minors.
bool lie_on_a_line(const double* points, std::ptrdiff_t count, double thinnest) {
    Vec3 middle{0, 0, 0};
    for (std::ptrdiff_t k = 0; k < count; ++k) middle = middle + vec3_at(points, k);
    middle = 1 / static_cast<double>(std::max<std::ptrdiff_t>(count, 1)) * middle;
    double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        const Vec3 away = vec3_at(points, k) - middle;
        xx += away.x * away.x, yy += away.y * away.y, zz += away.z * away.z;
        xy += away.x * away.y, yz += away.y * away.z, zx += away.z * away.x;
    }
    const double total = xx + yy + zz, minors = xx * yy + yy * zz + zz * xx - xy * xy - yz * yz - zx * zx;
    return minors <= thinnest * thinnest * total * total;
}

double deepest_notch(const double* corners, std::ptrdiff_t count) {
    if (count < 4) return 0;
    const Polygon polygon(corners, count);
    const std::vector<std::ptrdiff_t> hull = polygon.hull();
    double deepest = 0;
    for (std::size_t side = 0; side < hull.size(); ++side) {
        const bool last = side + 1 == hull.size();
        const std::ptrdiff_t from = hull[side], to = last ? hull[0] : hull[side + 1], end = last ? to + count : to;
        for (std::ptrdiff_t k = from + 1; k < end; ++k) deepest = std::max(deepest, polygon.distance(k % count, from, to));
    }
    return deepest;
}

}  // namespace tactile
