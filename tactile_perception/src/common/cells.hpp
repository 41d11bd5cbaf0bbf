// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace tactile {

// Finite positions (count, 2), at least one, in square cells, about one in each; they are not copied.
class Cells {
 public:
    Cells(const double* positions, std::ptrdiff_t count) : at_(positions), member_(static_cast<std::size_t>(count)) {
        for (int axis = 0; axis < 2; ++axis) low_[axis] = high_[axis] = at_[axis];
        for (std::ptrdiff_t i = 0; i < 2 * count; ++i)
            low_[i % 2] = std::min(low_[i % 2], at_[i]), high_[i % 2] = std::max(high_[i % 2], at_[i]);
        side_ = std::max(std::max(high_[0] - low_[0], high_[1] - low_[1]) / std::sqrt(static_cast<double>(count)), 1e-6);
        for (int axis = 0; axis < 2; ++axis) count_[axis] = static_cast<std::ptrdiff_t>((high_[axis] - low_[axis]) / side_) + 1;
        begin_.assign(static_cast<std::size_t>(count_[0] * count_[1] + 1), 0);
        for (std::ptrdiff_t i = 0; i < count; ++i) ++begin_[cell(i) + 1];
        std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
        std::vector<std::ptrdiff_t> next(begin_);
        for (std::ptrdiff_t i = 0; i < count; ++i) member_[static_cast<std::size_t>(next[cell(i)]++)] = i;
    }
    double side() const { return side_; }

    // From (u, v) to the rectangle around all positions, and to its farthest corner.
    std::array<double, 2> distances(double u, double v) const {
        const double across = std::max({low_[0] - u, u - high_[0], 0.0}), down = std::max({low_[1] - v, v - high_[1], 0.0});
        return {std::hypot(across, down), std::hypot(std::max(u - low_[0], high_[0] - u), std::max(v - low_[1], high_[1] - v))};
    }

    // Calls visit(index, squared distance) for every position within radius of (u, v).
    template <class Visit>
    void within(double u, double v, double radius, Visit visit) const {
        const auto [left, right] = range(u, radius, 0);
        const auto [top, bottom] = range(v, radius, 1);
        if (left >= right) return;
        for (std::ptrdiff_t row = top; row < bottom; ++row) {
            const std::ptrdiff_t* first = begin_.data() + row * count_[0];
            for (std::ptrdiff_t k = first[left]; k < first[right]; ++k) {
                const std::ptrdiff_t i = member_[static_cast<std::size_t>(k)];
                const double across = at_[2 * i] - u, down = at_[2 * i + 1] - v, square = across * across + down * down;
                if (square < radius * radius) visit(i, square);
            }
        }
    }

 private:
    std::size_t cell(std::ptrdiff_t i) const {
        const auto index = [&](int axis) {
            return std::min(static_cast<std::ptrdiff_t>((at_[2 * i + axis] - low_[axis]) / side_), count_[axis] - 1);
        };
        return static_cast<std::size_t>(index(1) * count_[0] + index(0));
    }
    std::array<std::ptrdiff_t, 2> range(double middle, double radius, int axis) const {
        const double most = static_cast<double>(count_[axis]), from = (middle - radius - low_[axis]) / side_;
        const double to = (middle + radius - low_[axis]) / side_ + 1;
        return {static_cast<std::ptrdiff_t>(std::clamp(from, 0.0, most)), static_cast<std::ptrdiff_t>(std::clamp(to, 0.0, most))};
    }
    const double* at_;
    double low_[2], high_[2], side_;
    std::ptrdiff_t count_[2];
    std::vector<std::ptrdiff_t> begin_, member_;
};

}  // namespace tactile
