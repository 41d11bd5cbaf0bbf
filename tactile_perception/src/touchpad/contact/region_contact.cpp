// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/region_contact.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "touchpad/contact/carried_loads.hpp"

namespace tactile {
namespace {

double normal_force(const RegionDots& dots, Vec3 normal) {
    std::vector<std::int32_t> region(dots.grid.size());
    for (std::ptrdiff_t i = 0; i < dots.count; ++i) region[dots.id[i]] = dots.inside[i] ? 1 : dots.touched[i] ? 2 : 0;
    const NearRegions near = near_regions(dots.grid, std::move(region));
    Vec3 total{0, 0, 0};
    for (std::ptrdiff_t k = 0; k < dots.grid.size(); ++k) {
        if (near.region[k] == 1) total = total + vec3_at(dots.force, k);
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
