// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/roll.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/pseudo_inverse.hpp"
#include "taxel/constants.hpp"

namespace tactile::taxel {
namespace {

constexpr double NEGLIGIBLE = 1e-9;  // of the largest eigenvalue: rounding

// Log odds that there is no traction, against one anywhere between 0 and most, given an observed traction with noise sigma; 0 where no
// traction is possible.
double odds_of_none(double traction, double most, double sigma) {
    if (!(most > 0)) return 0;
    most /= sigma;
    const double seen = std::min(std::max(traction / sigma, TAXEL.min_traction_sigmas), most);  // one above most is evidence for traction
    const double some = std::sqrt(M_PI / 2) * (std::erfc(-seen * M_SQRT1_2) - std::erfc((most - seen) * M_SQRT1_2)) / most;
    return -0.5 * seen * seen - std::log(some);
}

// Log odds of a face that is curved along a direction, against one that may be curved or flat, from pressure (rows, columns) where
// touched; sigma: of the variance of pressure over that of the area.
double odds_of_curved(const float* pressure, const std::uint8_t* touched, const ShearPad& pad, const Eigen::Vector2d& direction,
                      double sigma) {
    std::vector<double> positions, loads;
    double sum = 0, load = 0, moment = 0;
    for (std::ptrdiff_t k = 0; k < pad.rows * pad.columns; ++k) {
        if (!touched[k]) continue;
        positions.push_back(direction.dot(Eigen::Vector2d(static_cast<double>(k % pad.columns), static_cast<double>(k / pad.columns))));
        loads.push_back(std::max(pressure[k], 0.0f));
        sum += positions.back(), load += loads.back(), moment += positions.back() * loads.back();
    }
    double area = 0, loaded = 0;  // variances
    for (std::size_t k = 0; k < positions.size(); ++k) {
        const double by_area = positions[k] - sum / static_cast<double>(positions.size()), by_load = positions[k] - moment / load;
        area += by_area * by_area / static_cast<double>(positions.size());
        loaded += by_load * by_load * loads[k] / load;
    }
    if (!(load * area > 0)) return 0;
    const double spread = loaded / area, off = spread - TAXEL.curved_spread, flat = spread - TAXEL.flat_spread;
    const double exponent = (off * off - flat * flat) / (2 * sigma * sigma);
    return -(std::max(exponent, 0.0) + std::log1p(std::exp(-std::abs(exponent))));
}

}  // namespace

void RollWatch::rest(const float* pressure, std::ptrdiff_t size, bool same_load, double stamp) {
    if (before_.empty() || !same_load) {
        before_.assign(pressure, pressure + size);
        frames_ = 0, rested_ = -std::numeric_limits<double>::infinity();
    }
    estimator_.resize(4, 0);
    near_ = true;
    ++frames_;
    newest_ = std::max(1 / static_cast<double>(frames_), std::min((stamp - rested_) / TAXEL.rest_s, 1.0));
    rested_ = stamp;
    for (std::ptrdiff_t k = 0; k < size; ++k) before_[k] += (pressure[k] - before_[k]) * static_cast<float>(newest_);
}

std::vector<double> RollWatch::within_box(const float* values, std::ptrdiff_t columns) const {
    std::vector<double> found;
    for (std::ptrdiff_t r = box_.top; r < box_.bottom; ++r)
        found.insert(found.end(), values + r * columns + box_.left, values + r * columns + box_.right);
    return found;
}

bool RollWatch::follow(const SurfaceShear& shear, const float* pressure, double sigma, const std::uint8_t* touched,
                       const Eigen::Vector2d& pulled, double mean) {
    const ShearPad& pad = shear.pad();
    if (std::min(pad.rows, pad.columns) < TAXEL.min_side || before_.empty()) return false;
    if (estimator_.cols() == 0) {
        fit(shear, touched);
        pulled_ = pulled, odds_ = 0;
    }
    const std::vector<double> now = within_box(pressure, pad.columns), then = within_box(before_.data(), pad.columns);
    const auto size = static_cast<Eigen::Index>(now.size());
    const Eigen::Vector4d found =
        estimator_ * (Eigen::Map<const Eigen::VectorXd>(now.data(), size) - Eigen::Map<const Eigen::VectorXd>(then.data(), size));
    const double distance = found.head<2>().norm();
    near_ = near_ && distance < limits_.key_moved;  // beyond that distance the object keeps its state
    if (near_ && distance > 0) {
        const Eigen::Vector2d along = found.head<2>() / distance;
        const double most = std::min(pad.friction - pulled_.dot(along), TAXEL.max_stiffening * pad.stiffness * pad.pitch * distance / mean);
        const double noise = std::hypot(noise_ * sigma, limits_.traction * distance);
        odds_ = odds_of_none(found.tail<2>().dot(along), most, noise) + odds_of_curved(pressure, touched, pad, along, limits_.curved);
    }
    return odds_ > 0;
}

// Least squares by the picture before the motion: its slopes, the pressure of an even traction, turn, growth, load.
void RollWatch::fit(const SurfaceShear& shear, const std::uint8_t* touched) {
    const ShearPad& pad = shear.pad();
    const std::ptrdiff_t plane = pad.rows * pad.columns;
    const Box inside = box_around(touched, pad.rows, pad.columns);
    box_ = inside.grown(static_cast<std::ptrdiff_t>(std::ceil(TAXEL.surroundings * pad.thickness)), pad.rows, pad.columns);
    double load = 0, count = 0, middle_row = 0, middle_column = 0;
    for (std::ptrdiff_t k = 0; k < plane; ++k) {
        if (!touched[k]) continue;
        load += before_[k], ++count;
        middle_row += static_cast<double>(k / pad.columns), middle_column += static_cast<double>(k % pad.columns);
    }
    middle_row /= count, middle_column /= count;
    std::vector<float> even(plane), traction(2 * plane);
    for (std::ptrdiff_t k = 0; k < plane; ++k) even[k] = touched[k] ? static_cast<float>(load / count) : 0;
    blur(even, pad.rows, pad.columns, TAXEL.slope_width, Outside::replicated);
    std::vector<double> of_traction[2];
    for (int axis : {0, 1}) {
        std::fill(traction.begin(), traction.end(), 0.0f);
        std::copy(even.begin(), even.end(), traction.begin() + axis * plane);
        of_traction[axis] = within_box(shear.pressure_of(traction.data()).data(), pad.columns);
    }
    const std::vector<double> before = within_box(before_.data(), pad.columns);
    std::vector<float> smooth(before.begin(), before.end());
    blur(smooth, box_.rows(), box_.columns(), TAXEL.slope_width, Outside::replicated);
    const auto size = static_cast<Eigen::Index>(smooth.size());
    Eigen::Matrix<double, 7, Eigen::Dynamic> terms(7, size);
    const auto slope = [&](std::ptrdiff_t at, std::ptrdiff_t low, std::ptrdiff_t high, std::ptrdiff_t k, std::ptrdiff_t stride) {
        const std::ptrdiff_t before_it = at > low ? 1 : 0, behind_it = at + 1 < high ? 1 : 0;
        return (smooth[k + behind_it * stride] - smooth[k - before_it * stride]) / static_cast<float>(before_it + behind_it);
    };
    for (std::ptrdiff_t r = box_.top, k = 0; r < box_.bottom; ++r) {
        for (std::ptrdiff_t c = box_.left; c < box_.right; ++c, ++k) {
            const double down = slope(r, box_.top, box_.bottom, k, box_.columns()), across = slope(c, box_.left, box_.right, k, 1);
            terms.col(k) << -across, -down, of_traction[0][k], of_traction[1][k],
                (static_cast<double>(r) - middle_row) * across - (static_cast<double>(c) - middle_column) * down, std::hypot(across, down),
                before[k];
        }
    }
    using Products = Eigen::Matrix<double, 7, 7>;
    estimator_ = pseudo_inverse<Products>(terms * terms.transpose(), NEGLIGIBLE).topRows<4>() * terms;
    noise_ = std::sqrt(estimator_.bottomRows<2>().rowwise().squaredNorm().maxCoeff() * (1 + newest_));
}

}  // namespace tactile::taxel
