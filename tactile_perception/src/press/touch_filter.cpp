// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Kalman filter with white acceleration (Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 6.2.2);
// updates in Joseph's form, which keeps a covariance symmetric and positive definite despite rounding.
#include "press/touch_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/cholesky.hpp"
#include "dots/index/assignment.hpp"

namespace tactile {
namespace {

constexpr double FARTHEST = 1e3;  // gates: farther counts as so far. Chosen: a sum of distances stays exact

void predict(TouchState& touch, const TouchMotion& motion) {
    const double t = motion.elapsed, square = motion.acceleration * motion.acceleration;
    auto& p = touch.covariance;
    for (int i = 0; i < MEASURED; ++i) touch.state[i] += t * touch.state[MEASURED + i];
    for (int i = 0; i < MEASURED; ++i)
        for (int j = 0; j < STATE; ++j) p[STATE * i + j] += t * p[STATE * (MEASURED + i) + j];
    for (int i = 0; i < STATE; ++i)
        for (int j = 0; j < MEASURED; ++j) p[STATE * i + j] += t * p[STATE * i + MEASURED + j];
    const double place = 0.5 * t * t, speed = t;
    for (int i = 0; i < MEASURED; ++i) {
        p[STATE * i + i] += square * place * place;
        p[STATE * i + MEASURED + i] += square * place * speed;
        p[STATE * (MEASURED + i) + i] += square * place * speed;
        p[STATE * (MEASURED + i) + MEASURED + i] += square * speed * speed;
    }
}

// Cholesky factor of the covariance of a measurement about the prediction; false where it is not positive definite.
bool innovation(const TouchState& touch, const TouchMeasurement& measured, double* factor) {
    for (int i = 0; i < MEASURED; ++i)
        for (int j = 0; j < MEASURED; ++j)
            factor[MEASURED * i + j] = touch.covariance[STATE * i + j] + measured.covariance[MEASURED * i + j];
    return factorise(factor, MEASURED, MEASURED);
}

// Squared Mahalanobis distance of a measurement from the prediction.
double distance(const TouchState& touch, const TouchMeasurement& measured) {
    double factor[MEASURED * MEASURED], off[MEASURED], solved[MEASURED], sum = 0;
    if (!innovation(touch, measured, factor)) return INFINITY;
    for (int i = 0; i < MEASURED; ++i) solved[i] = off[i] = measured.value[i] - touch.state[i];
    substitute(factor, MEASURED, MEASURED, solved);
    for (int i = 0; i < MEASURED; ++i) sum += off[i] * solved[i];
    return std::isfinite(sum) ? sum : INFINITY;
}

void update(TouchState& touch, const TouchMeasurement& measured) {
    double factor[MEASURED * MEASURED], gain[STATE][MEASURED], rest[STATE][STATE], part[STATE][STATE];
    if (!innovation(touch, measured, factor)) return;
    const auto before = touch.covariance;
    for (int i = 0; i < STATE; ++i) {
        for (int j = 0; j < MEASURED; ++j) gain[i][j] = before[STATE * j + i];
        substitute(factor, MEASURED, MEASURED, gain[i]);
    }
    double off[MEASURED];
    for (int j = 0; j < MEASURED; ++j) off[j] = measured.value[j] - touch.state[j];
    for (int i = 0; i < STATE; ++i) {
        for (int j = 0; j < MEASURED; ++j) touch.state[i] += gain[i][j] * off[j];
        for (int j = 0; j < STATE; ++j) rest[i][j] = (i == j ? 1.0 : 0.0) - (j < MEASURED ? gain[i][j] : 0.0);
    }
    for (int i = 0; i < STATE; ++i) {
        for (int j = 0; j < STATE; ++j) {
            part[i][j] = 0;
            for (int k = 0; k < STATE; ++k) part[i][j] += rest[i][k] * before[STATE * k + j];
        }
    }
    for (int i = 0; i < STATE; ++i) {
        double noise[MEASURED] = {};
        for (int j = 0; j < MEASURED; ++j)
            for (int k = 0; k < MEASURED; ++k) noise[j] += gain[i][k] * measured.covariance[MEASURED * k + j];
        for (int j = 0; j < STATE; ++j) {
            double sum = 0;
            for (int k = 0; k < STATE; ++k) sum += part[i][k] * rest[j][k];
            for (int k = 0; k < MEASURED; ++k) sum += noise[k] * gain[j][k];
            touch.covariance[STATE * i + j] = sum;
        }
    }
}

}  // namespace

std::vector<std::ptrdiff_t> follow_touches(std::vector<TouchState>& touches, const std::vector<TouchMeasurement>& measured,
                                           const TouchMotion& motion) {
    const auto rows = static_cast<std::ptrdiff_t>(measured.size()), columns = static_cast<std::ptrdiff_t>(touches.size());
    for (TouchState& touch : touches) predict(touch, motion);
    std::vector<std::ptrdiff_t> continued(measured.size(), -1);
    if (!rows || !columns) return continued;
    std::vector<double> cost(rows * columns);
    const bool turned = rows > columns;  // the assignment wants at most as many rows as columns
    for (std::ptrdiff_t m = 0; m < rows; ++m)
        for (std::ptrdiff_t k = 0; k < columns; ++k)
            cost[turned ? k * rows + m : m * columns + k] = std::min(distance(touches[k], measured[m]), FARTHEST * motion.gate);
    const std::vector<std::ptrdiff_t> other = assign_least(cost, std::min(rows, columns), std::max(rows, columns));
    for (std::size_t n = 0; n < other.size(); ++n) {
        const auto here = static_cast<std::ptrdiff_t>(n);
        const std::ptrdiff_t m = turned ? other[n] : here, k = turned ? here : other[n];
        if (!(cost[turned ? k * rows + m : m * columns + k] <= motion.gate)) continue;
        continued[m] = k;
        update(touches[k], measured[m]);
    }
    return continued;
}

}  // namespace tactile
