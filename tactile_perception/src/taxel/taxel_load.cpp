// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/taxel_load.hpp"

#include <algorithm>
#include <limits>

#include "common/grid.hpp"

namespace tactile {
namespace {

constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();

// Weighted sums of places along a line.
struct Sums {
    double weight = 0, first = 0, second = 0;
    void add(double w, double place) {
        weight += w;
        first += w * place;
        second += w * place * place;
    }
    double variance() const { return (second - first * first / weight) / weight; }
};

}  // namespace

std::array<double, 4> load_of(const float* pressure, const std::uint8_t* touched, std::ptrdiff_t rows, std::ptrdiff_t columns,
                              std::ptrdiff_t around) {
    const std::vector<std::uint8_t> near = spread_mask(touched, rows, columns, around);
    const Box box = box_around(touched, rows, columns).grown(around, rows, columns);
    double sum = 0, down = 0, across = 0, count = 0;
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        double line = 0;
        for (std::ptrdiff_t c = box.left; c < box.right; ++c) {
            if (!near[r * columns + c]) continue;
            const double load = pressure[r * columns + c];
            line += load;
            ++count;
            across += load * static_cast<double>(c);
        }
        sum += line;
        down += line * static_cast<double>(r);
    }
    if (!(sum > 0)) return {sum, UNKNOWN, UNKNOWN, count};
    return {sum, down / sum, across / sum, count};
}

double spread_along(const float* pressure, const std::uint8_t* touched, std::ptrdiff_t rows, std::ptrdiff_t columns,
                    const std::array<double, 2>& direction) {
    const Box box = box_around(touched, rows, columns);
    Sums load, area;  // about the middle of the box: no digits are lost
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        for (std::ptrdiff_t c = box.left; c < box.right; ++c) {
            if (!touched[r * columns + c]) continue;
            const double place = direction[0] * (static_cast<double>(c) - 0.5 * static_cast<double>(box.left + box.right - 1)) +
                                 direction[1] * (static_cast<double>(r) - 0.5 * static_cast<double>(box.top + box.bottom - 1));
            area.add(1, place);
            load.add(std::max(pressure[r * columns + c], 0.0f), place);
        }
    }
    return load.weight > 0 && area.variance() > 0 ? load.variance() / area.variance() : UNKNOWN;
}

std::vector<float> without_traction(const float* pressure, const float* traction, std::ptrdiff_t taxels, float unit) {
    std::vector<float> found(taxels);
    for (std::ptrdiff_t k = 0; k < taxels; ++k) {
        const float bound = pressure[k] > 0 ? pressure[k] : 0, part = traction[k] / unit;
        const float least = part < -bound ? -bound : part;
        found[k] = pressure[k] - (least > bound ? bound : least);
    }
    return found;
}

std::vector<std::uint8_t> lagging(const std::vector<const float*>& slips, const std::uint8_t* touched, std::ptrdiff_t rows,
                                  std::ptrdiff_t columns, double pitch, const Shift& motion, double part) {
    std::vector<std::uint8_t> found(rows * columns);
    const std::ptrdiff_t plane = rows * columns;
    const Box box = box_around(touched, rows, columns);
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        const double along_x = motion.x - motion.turn * ((static_cast<double>(r) - 0.5 * static_cast<double>(rows - 1)) * pitch);
        for (std::ptrdiff_t c = box.left; c < box.right; ++c) {
            const double along_y = motion.y + motion.turn * ((static_cast<double>(c) - 0.5 * static_cast<double>(columns - 1)) * pitch);
            const std::ptrdiff_t at = r * columns + c;
            float x = 0, y = 0;
            for (const float* slip : slips) {
                x += slip[at];
                y += slip[plane + at];
            }
            found[at] = touched[at] && x * x + y * y > part * part * (along_x * along_x + along_y * along_y);
        }
    }
    return found;
}

}  // namespace tactile
