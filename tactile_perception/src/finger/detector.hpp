// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The position sensitive detector: sums of its outputs, the centroid of its light (Maekawa et al., eq 1), and what is calibrated by
// centroid.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "common/fields.hpp"

namespace tactile::finger {

constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();

// The sums of four outputs x1, y1, x2, y2: differences along x and along y, the numerators of eq 1, the total, its denominator, and the
// cross term.
enum Sum { X, Y, TOTAL, CROSS };

inline Eigen::Vector4d mix(const Eigen::Vector4d& outputs) {
    const double x1 = outputs[0], y1 = outputs[1], x2 = outputs[2], y2 = outputs[3];
    return {(y1 + x2) - (x1 + y2), (x2 + y2) - (x1 + y1), (x1 + y1) + (x2 + y2), (x1 + x2) - (y1 + y2)};
}

// The outputs that have these sums.
inline Eigen::Vector4d unmix(const Eigen::Vector4d& sums) {
    const double x = sums[X], y = sums[Y], total = sums[TOTAL], cross = sums[CROSS];
    return {(total - x - y + cross) / 4, (total + x - y - cross) / 4, (total + x + y + cross) / 4, (total - x + y - cross) / 4};
}

// Eq 1 without its offset, half widths, clipped to the detector, which noise of weak light may exceed. NaN without light.
inline Eigen::Vector2d centroid(const Eigen::Vector4d& sums) {
    const auto along = [&](Sum axis) { return std::min(std::max(sums[axis] / sums[TOTAL], -1.0), 1.0); };
    return {along(X), along(Y)};
}

// What is tabulated by centroid, in the order of tactile_perception/finger/model.py; NORMAL and BEND are vectors.
enum Channel : std::ptrdiff_t { NORMAL, DEVIATION = 3, INSIDE, LEVEL, CROSS_PART, FORCE, DEPTH, LIGHT, BEND, CHANNELS = 13 };

// The cover shows a share of a contact's motion late, with one time constant.
struct Creep {
    double share = 0.04, seconds = 0.03;  // of a soft silicone
    bool measured = false;
    TACTILE_FIELDS(share, seconds)
};

// One calibrated finger.
struct FingerModel {
    std::vector<double> table;               // (nodes, nodes, CHANNELS) on a grid over -1 to 1 half widths, rows along y
    std::ptrdiff_t nodes;                    // along each axis, 2 or more
    Eigen::Matrix<double, 2, 8> load_terms;  // coefficients of log N and log m; NaN where not calibrated
    double cross_volts;                      // V, standard deviation of the cross term of a single contact
    Eigen::Vector4d room;                    // V, untouched outputs at the calibration; NaN where not known
    Creep creep;
    TACTILE_FIELDS(table, load_terms, cross_volts)
};

// The cell of the model's table that holds a centroid, which is clipped to the square and not NaN; bilinear between its nodes.
class Cell {
 public:
    Cell(const FingerModel& model, const Eigen::Vector2d& at) : right_(CHANNELS), up_(CHANNELS * model.nodes) {
        const std::ptrdiff_t column = locate(at.x(), model.nodes, s_), row = locate(at.y(), model.nodes, t_);
        node_ = model.table.data() + row * up_ + column * right_;
    }

    double value(std::ptrdiff_t channel) const { return (1 - t_) * along_x(channel, 0) + t_ * along_x(channel, up_); }
    Eigen::Vector3d vector(std::ptrdiff_t channel) const { return {value(channel), value(channel + 1), value(channel + 2)}; }
    // Slopes of a vector along x and y, per cell.
    Eigen::Matrix<double, 3, 2> slopes(std::ptrdiff_t channel) const {
        Eigen::Matrix<double, 3, 2> found;
        for (std::ptrdiff_t i = 0, k = channel; i < 3; ++i, ++k) {
            found(i, 0) = (1 - t_) * (node_[right_ + k] - node_[k]) + t_ * (node_[up_ + right_ + k] - node_[up_ + k]);
            found(i, 1) = along_x(k, up_) - along_x(k, 0);
        }
        return found;
    }

 private:
    double along_x(std::ptrdiff_t channel, std::ptrdiff_t row) const {
        return (1 - s_) * node_[row + channel] + s_ * node_[row + right_ + channel];
    }

    static std::ptrdiff_t locate(double at, std::ptrdiff_t nodes, double& within) {
        const double scaled = std::min(std::max(0.5 * (at + 1) * static_cast<double>(nodes - 1), 0.0), static_cast<double>(nodes - 1));
        const std::ptrdiff_t cell = std::min(static_cast<std::ptrdiff_t>(scaled), nodes - 2);
        within = scaled - static_cast<double>(cell);
        return cell;
    }

    const double* node_;
    std::ptrdiff_t right_, up_;  // steps to the neighbouring nodes
    double s_, t_;               // position within the cell, 0 to 1
};

}  // namespace tactile::finger
