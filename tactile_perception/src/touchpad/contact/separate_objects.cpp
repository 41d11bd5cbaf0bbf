// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/separate_objects.hpp"

#include <algorithm>

#include "common/grid.hpp"

namespace tactile {

std::vector<Dots> separate_objects(Grid grid, const std::vector<std::uint8_t>& touched) {
    std::vector<std::uint8_t> wide(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!touched[k]) continue;
        for (std::ptrdiff_t row = k / grid.columns; row <= std::min(k / grid.columns + 1, grid.rows - 1); ++row) {
            for (std::ptrdiff_t c = k % grid.columns; c <= std::min(k % grid.columns + 1, grid.columns - 1); ++c)
                wide[row * grid.columns + c] = 1;
        }
    }
    std::vector<std::int32_t> label;
    std::vector<Dots> objects(components(wide.data(), grid.rows, grid.columns, true, label).size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (touched[k]) objects[label[k] - 1].push_back(k);
    }
    std::stable_sort(objects.begin(), objects.end(), [](const Dots& a, const Dots& b) { return a.size() > b.size(); });
    return objects;
}

std::vector<double> gathered(const double* array, const Dots& dots) {
    std::vector<double> found(3 * dots.size());
    for (std::size_t i = 0; i < dots.size(); ++i) store(found.data(), static_cast<std::ptrdiff_t>(i), vec3_at(array, dots[i]));
    return found;
}

Vec3 region_centre(Grid grid, const Dots& dots, const double* score, const double* places) {
    std::vector<std::uint8_t> near(grid.size());
    for (const std::ptrdiff_t k : dots) around(grid, k, [&](std::ptrdiff_t j) { near[j] = 1; });
    Vec3 sum{0, 0, 0};
    double weight = 0;
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (near[k]) sum = sum + score[k] * vec3_at(places, k), weight += score[k];
    }
    return 1 / weight * sum;
}

}  // namespace tactile
