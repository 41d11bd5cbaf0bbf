// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Row and column are locally nearly linear in image position. A linear fit to the nearest indexed dots predicts the index of a dot without
// one. A prediction far from a whole number, or with a high leverage, is rejected. This repeats until no dot is added.
#include "dots/index/extrapolate.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace tactile {
namespace {

constexpr std::size_t NEAREST = 8;  // indexed dots in a fit. Chosen
constexpr std::size_t FEWEST = 4;   // of them: one more than a plane has unknowns
constexpr double REACH = 2.9;       // pitches, dots further away are excluded. Chosen
constexpr double LEVERAGES[] = {1.0,
                                3.0};  // largest variance of a prediction per variance of a dot: the second only if the first adds none
constexpr double BENT = 0.15;          // rows, largest RMS residual of a fit. Chosen
constexpr double OFF = 0.25;           // rows, largest distance of a prediction from a whole number. Chosen
constexpr double LAST_OFF = 0.3;       // rows, the same for an indexed dot in the final check. Chosen
constexpr double RIDGE = 1e-6;         // of the normal equations: keeps collinear dots solvable

using Place = std::pair<std::int64_t, std::int64_t>;

struct Prediction {
    bool sure = false;
    double row = 0, column = 0;
};

class Growth {
 public:
    Growth(const double* places, std::ptrdiff_t count, double pitch, std::vector<std::int64_t>& rc, std::vector<std::uint8_t>& member)
        : places_(places), count_(count), pitch_(pitch), rc_(rc), member_(member) {}

    void run() {
        while (std::any_of(std::begin(LEVERAGES), std::end(LEVERAGES), [this](double leverage) { return wave(leverage); })) {
        }
        confirm();
    }

 private:
    // Adds dots that fits of at most this leverage predict; returns whether any were added.
    bool wave(double leverage) {
        if (members() <= NEAREST) return false;
        std::map<Place, int> claims;  // of each node; a dot that has it counts for two
        std::vector<std::pair<std::ptrdiff_t, Place>> said;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            if (member_[i]) claims[{rc_[2 * i], rc_[2 * i + 1]}] += 2;
        }
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            if (member_[i]) continue;
            const Prediction found = predict(i, leverage);
            if (!found.sure || !(off(found, std::rint(found.row), std::rint(found.column)) < OFF)) continue;
            said.push_back({i, {std::llrint(found.row), std::llrint(found.column)}});
            ++claims[said.back().second];
        }
        bool any = false;
        for (const auto& [i, place] : said) {
            if (claims[place] > 1) continue;
            rc_[2 * i] = place.first;
            rc_[2 * i + 1] = place.second;
            member_[i] = 1;
            any = true;
        }
        return any;
    }

    // Keeps members whose indices match the prediction from their neighbours.
    void confirm() {
        if (members() <= NEAREST + 1) return;
        std::vector<std::uint8_t> kept(member_);
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            if (!member_[i]) continue;
            const Prediction found = predict(i, LEVERAGES[1]);
            kept[i] = found.sure && off(found, static_cast<double>(rc_[2 * i]), static_cast<double>(rc_[2 * i + 1])) < LAST_OFF;
        }
        member_ = kept;
    }

    std::size_t members() const { return static_cast<std::size_t>(std::count(member_.begin(), member_.end(), 1)); }

    static double off(const Prediction& found, double row, double column) {
        return std::max(std::abs(found.row - row), std::abs(found.column - column));
    }

    // The nearest members within reach of dot i, itself excepted, nearest first.
    void find_near(std::ptrdiff_t i) {
        near_.clear();
        const double u = places_[2 * i], v = places_[2 * i + 1], reach = REACH * pitch_;
        for (std::ptrdiff_t j = 0; j < count_; ++j) {
            const double across = places_[2 * j] - u, down = places_[2 * j + 1] - v;
            if (std::abs(across) >= reach || std::abs(down) >= reach || !member_[j] || j == i) continue;
            const double square = across * across + down * down;
            if (square < reach * reach) near_.push_back({square, j});
        }
        const std::size_t kept = std::min(near_.size(), NEAREST);
        std::partial_sort(near_.begin(), near_.begin() + static_cast<std::ptrdiff_t>(kept), near_.end());
        near_.resize(kept);
    }

    // Row and column at dot i by a plane through its neighbours' indices, relative to the nearest one's, which the ridge hardly biases.
    Prediction predict(std::ptrdiff_t i, double leverage) {
        find_near(i);
        if (near_.size() < FEWEST) return {};
        const std::int64_t* origin = &rc_[2 * near_[0].second];
        double n = RIDGE, x = 0, y = 0, xx = RIDGE, xy = 0, yy = RIDGE, sums[2][3] = {};
        for (const auto& [square, j] : near_) {
            const double across = (places_[2 * j] - places_[2 * i]) / pitch_, down = (places_[2 * j + 1] - places_[2 * i + 1]) / pitch_;
            n += 1, x += across, y += down, xx += across * across, xy += across * down, yy += down * down;
            for (int axis = 0; axis < 2; ++axis) {
                const auto value = static_cast<double>(rc_[2 * j + axis] - origin[axis]);
                sums[axis][0] += value, sums[axis][1] += value * across, sums[axis][2] += value * down;
            }
        }
        // the inverse of the symmetric matrix [n x y; x xx xy; y xy yy] by its cofactors
        const double a = xx * yy - xy * xy, b = xy * y - x * yy, c = x * xy - xx * y, inverse = 1 / (n * a + x * b + y * c);
        const double d = n * yy - y * y, e = x * y - n * xy, f = n * xx - x * x;
        double fit[2][3];
        for (int axis = 0; axis < 2; ++axis) {
            const double* sum = sums[axis];
            fit[axis][0] = (a * sum[0] + b * sum[1] + c * sum[2]) * inverse;
            fit[axis][1] = (b * sum[0] + d * sum[1] + e * sum[2]) * inverse;
            fit[axis][2] = (c * sum[0] + e * sum[1] + f * sum[2]) * inverse;
        }
        const bool sure = a * inverse < leverage && residual(i, fit) < 2 * BENT * BENT;
        return {sure, fit[0][0] + static_cast<double>(origin[0]), fit[1][0] + static_cast<double>(origin[1])};
    }

    // Squared residuals of both planes over the degrees of freedom.
    double residual(std::ptrdiff_t i, const double (&fit)[2][3]) const {
        double squares = 0;
        for (const auto& [square, j] : near_) {
            const double across = (places_[2 * j] - places_[2 * i]) / pitch_, down = (places_[2 * j + 1] - places_[2 * i + 1]) / pitch_;
            for (int axis = 0; axis < 2; ++axis) {
                const auto value = static_cast<double>(rc_[2 * j + axis] - rc_[2 * near_[0].second + axis]);
                const double rest = fit[axis][0] + fit[axis][1] * across + fit[axis][2] * down - value;
                squares += rest * rest;
            }
        }
        return squares / std::max(static_cast<double>(near_.size()) - 3, 1.0);
    }

    const double* places_;
    const std::ptrdiff_t count_;
    const double pitch_;
    std::vector<std::int64_t>& rc_;
    std::vector<std::uint8_t>& member_;
    std::vector<std::pair<double, std::ptrdiff_t>> near_;  // squared distance and index
};

}  // namespace

void extrapolate_indices(const double* places, std::ptrdiff_t count, double pitch, std::vector<std::int64_t>& rc,
                         std::vector<std::uint8_t>& member) {
    Growth(places, count, pitch, rc, member).run();
}

}  // namespace tactile
