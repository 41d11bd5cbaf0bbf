// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/point_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "common/vectors.hpp"

namespace tactile {
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
