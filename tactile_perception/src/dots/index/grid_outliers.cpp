// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Rejection of outliers among indexed dots: each step between neighbours on the grid is compared with the mean of the steps around it.
#include "dots/index/grid_outliers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tactile {
namespace {

constexpr std::ptrdiff_t AROUND = 2;  // rows and columns on each side over which steps are averaged. Chosen
constexpr double OUTLIER = 0.6;   // of the mean step, deviation of a step with a wrong index at one end. Chosen: one pitch deviates by 1
constexpr double BESIDE = 0.25;   // of the mean step: a dot is rejected if all of its steps deviate more. Chosen
constexpr double NOTHING = 1e-9;  // px, prevents division by zero

// A step from each dot to the next, px, its sums over the dots around, and the number of steps that are known.
struct Step {
    double u, v, count;
    void add(const Step& other) { u += other.u, v += other.v, count += other.count; }
};

class Outliers {
 public:
    Outliers(std::ptrdiff_t rows, std::ptrdiff_t columns)
        : rows_(rows),
          columns_(columns),
          places_(2 * rows * columns, std::numeric_limits<double>::quiet_NaN()),
          bad_(rows * columns),
          held_(rows * columns) {}

    void run(std::int64_t* id, const double* places, std::ptrdiff_t count) {
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            if (id[i] >= 0) std::copy_n(places + 2 * i, 2, places_.data() + 2 * id[i]);
        }
        compare(1, 0);
        compare(0, 1);
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            if (id[i] >= 0 && (!held_[id[i]] || is_beside_bad(id[i]))) id[i] = -1;
        }
    }

 private:
    // Marks the ends of steps by one row (down) or one column (across) that deviate from those around, or that agree with them.
    void compare(std::ptrdiff_t down, std::ptrdiff_t across) {
        const std::ptrdiff_t next = down * columns_ + across;
        std::vector<Step> steps(rows_ * columns_, Step{0, 0, 0});
        for (std::ptrdiff_t r = 0; r < rows_ - down; ++r) {
            for (std::ptrdiff_t c = 0; c < columns_ - across; ++c) {
                const std::ptrdiff_t k = r * columns_ + c;
                const double u = places_[2 * (k + next)] - places_[2 * k], v = places_[2 * (k + next) + 1] - places_[2 * k + 1];
                if (std::isfinite(u + v)) steps[k] = {u, v, 1};
            }
        }
        const std::vector<Step> sums = sums_around(steps);
        for (std::ptrdiff_t k = 0; k < rows_ * columns_; ++k) {
            if (steps[k].count == 0) continue;
            const double u = sums[k].u / sums[k].count, v = sums[k].v / sums[k].count;
            const double off = std::hypot(steps[k].u - u, steps[k].v - v) / std::max(std::hypot(u, v), NOTHING);
            if (off > OUTLIER) bad_[k] = bad_[k + next] = 1;
            if (off < BESIDE) held_[k] = held_[k + next] = 1;
        }
    }

    // Sums over squares, along the columns and then along the rows.
    std::vector<Step> sums_around(const std::vector<Step>& steps) const {
        std::vector<Step> down(steps.size(), Step{0, 0, 0}), sums = down;
        for (std::ptrdiff_t r = 0; r < rows_; ++r) {
            for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(r - AROUND, 0); k <= std::min(r + AROUND, rows_ - 1); ++k) {
                for (std::ptrdiff_t c = 0; c < columns_; ++c) down[r * columns_ + c].add(steps[k * columns_ + c]);
            }
            for (std::ptrdiff_t c = 0; c < columns_; ++c) {
                const std::ptrdiff_t last = std::min(c + AROUND, columns_ - 1);
                for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(c - AROUND, 0); k <= last; ++k) {
                    sums[r * columns_ + c].add(down[r * columns_ + k]);
                }
            }
        }
        return sums;
    }

    bool is_beside_bad(std::ptrdiff_t id) const {
        const std::ptrdiff_t row = id / columns_, column = id % columns_;
        for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
            for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
                if (bad_[r * columns_ + c]) return true;
            }
        }
        return false;
    }

    const std::ptrdiff_t rows_, columns_;
    std::vector<double> places_;
    std::vector<std::uint8_t> bad_, held_;
};

}  // namespace

void reject_outliers(std::int64_t* id, const double* places, std::ptrdiff_t count, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    Outliers(rows, columns).run(id, places, count);
}

}  // namespace tactile
