// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/region_contact.hpp"

#include <algorithm>
#include <vector>

namespace tactile {
namespace {

double normal_force(const RegionDots& dots, Vec3 normal) {
    std::vector<std::uint8_t> near(dots.grid.size());
    for (std::ptrdiff_t i = 0; i < dots.count; ++i) {
        if (dots.inside[i]) around(dots.grid, dots.id[i], [&](std::ptrdiff_t j) { near[j] = 1; });
    }
    Vec3 total{0, 0, 0};
    for (std::ptrdiff_t i = 0; i < dots.count; ++i) {
        if (near[dots.id[i]]) total = total + vec3_at(dots.force, i);
    }
    return std::max(-dot(normal, total), 0.0);
}

}  // namespace

RegionContact region_contact(const RegionDots& dots, const RegionShape& region, const Nodes& wide, const RestCap& rest, double sigma) {
    std::vector<double> points;
    for (std::ptrdiff_t i = 0; i < dots.count; ++i) {
        if (dots.inside[i]) points.insert(points.end(), dots.places + 3 * i, dots.places + 3 * i + 3);
    }
    const auto count = static_cast<std::ptrdiff_t>(points.size() / 3);
    const double depth = contact_depth(points.data(), count, rest, region.pitch);
    return {contact_point(points.data(), count, region, wide, sigma), depth < 0 ? 0.0 : depth,
            dots.force ? normal_force(dots, region.normal) : NAN};
}

}  // namespace tactile
