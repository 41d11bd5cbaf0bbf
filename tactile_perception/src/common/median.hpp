// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace tactile {

constexpr double SIGMA_PER_MAD = 1.4826;  // standard deviation of normal errors over their median absolute deviation

// Median of values, the mean of both middle ones of an even number; values must not be empty or NaN.
inline double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return values.size() % 2 ? *middle : (*middle + *std::max_element(values.begin(), middle)) / 2;
}

// The element of values at this index of their sorted order; values must not be NaN.
inline double smallest(std::vector<double> values, std::ptrdiff_t at) {
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return values[at];
}

}  // namespace tactile
