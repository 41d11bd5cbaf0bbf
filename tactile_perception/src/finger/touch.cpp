// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/touch.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tactile::finger {
namespace {

constexpr double CROSS_LIMIT = 6;   // standard deviations of the cross term for one contact; more are several contacts. Chosen
constexpr double LARGEST_LOG = 50;  // keeps exp finite
constexpr double DARK = 1e-6;       // V, least light of which a logarithm is taken
constexpr double SURE = 0.3;  // of the creep that is taken off, its standard deviation. Chosen: a position may lag by another share than
                              // light
constexpr double SLIGHT =
    0.01;  // of the covariance: a smaller square of the creep is left alone. Chosen: a tenth of the standard deviation

Eigen::Matrix3d across(const Eigen::Vector3d& normal) {
    return Eigen::Matrix3d::Identity() - normal * normal.transpose();
}

// Light over that of a typical contact at its place, less 1 and at most 1 in size.
double relative_light(const Cell& cell, double total) {
    return std::min(std::max(total / cell.value(LIGHT) - 1, -1.0), 1.0);
}

// Covariance of a centroid: of the mean's noise; of light of the room that is taken off wrongly, which moves it towards or away from the
// room's centroid; and what it would move by without the light that may be a lamp's.
Eigen::Matrix2d place_spread(const MeanLight& mean, const Eigen::Vector2d& place, const LightErrors& errors) {
    Eigen::Matrix2d found = centroid_covariance(place, mean.sums[TOTAL], errors.noise) / static_cast<double>(mean.used);
    const Eigen::Vector2d room = centroid(errors.room);
    if (!room.hasNaN()) {
        const Eigen::Vector2d moved = errors.room_volts / mean.sums[TOTAL] * (room - place);
        found += moved * moved.transpose();
    }
    const Eigen::Vector4d without_lamp = mean.sums - errors.lamp;
    if (without_lamp[TOTAL] > 0) {
        const Eigen::Vector2d moved = centroid(without_lamp) - place;
        found += moved * moved.transpose();
    }
    return found;
}

// Load, N or m, of light, V, at a place whose part of the logarithm is known (finger/model.py); NaN where not calibrated.
double load(const FingerModel& model, int which, double at_place, const Eigen::Vector2d& place, double light) {
    const auto terms = model.load_terms.row(which);
    const double log = std::log(std::max(light, DARK)), square = place.squaredNorm();
    const double whole = at_place + (terms[1] + terms[7] * square + terms[2] * log) * log;
    return std::isnan(whole) ? UNKNOWN : std::exp(std::min(whole, LARGEST_LOG));
}

}  // namespace

Eigen::Matrix2d centroid_covariance(const Eigen::Vector2d& place, double total, const Eigen::Matrix4d& noise) {
    const double x = place.x(), y = place.y(), square = total * total, tt = noise(TOTAL, TOTAL);
    const double xy = (noise(X, Y) - x * noise(Y, TOTAL) - y * noise(X, TOTAL) + x * y * tt) / square;
    Eigen::Matrix2d found;
    found << (noise(X, X) - 2 * x * noise(X, TOTAL) + x * x * tt) / square, xy, xy,
        (noise(Y, Y) - 2 * y * noise(Y, TOTAL) + y * y * tt) / square;
    return found;
}

Touch estimate_touch(const MeanLight& mean, const LightErrors& errors, const FingerModel& model, double radius) {
    Touch found;
    const double total = mean.sums[TOTAL];
    const Eigen::Vector2d place = centroid(mean.sums);
    if (mean.saturated) found.flags |= SATURATED;
    if (errors.stuck && mean.used > 0) found.flags |= AMBIGUOUS;
    if (errors.stuck || !(total > 0) || place.hasNaN()) return found;
    const Cell cell(model, place);
    const double relative = relative_light(cell, total), deviation = cell.value(DEVIATION);
    const Eigen::Vector3d direction = cell.vector(NORMAL) + relative * cell.vector(BEND);
    const double length = direction.norm(), cells = 0.5 * static_cast<double>(model.nodes - 1);
    found.normal = direction / length;
    found.position = radius * found.normal;
    const Eigen::Matrix3d along = across(found.normal);
    const Eigen::Matrix<double, 3, 2> slopes = along * (cells / length * (cell.slopes(NORMAL) + relative * cell.slopes(BEND)));
    const Eigen::Matrix3d of_place = slopes * place_spread(mean, place, errors) * slopes.transpose();
    found.covariance = radius * radius * (of_place + deviation * deviation * along);
    if (cell.value(INSIDE) < 0.5 || place.cwiseAbs().maxCoeff() >= 1) found.flags |= OUT_OF_RANGE;
    const double apart = mean.sums[CROSS] - cell.value(CROSS_PART) * total;
    const double noise = std::sqrt(errors.noise(CROSS, CROSS) / static_cast<double>(mean.used));
    if (std::abs(apart) > CROSS_LIMIT * std::hypot(noise, model.cross_volts)) found.flags |= AMBIGUOUS;
    found.force = load(model, 0, cell.value(FORCE), place, total);
    found.depth = load(model, 1, cell.value(DEPTH), place, total);
    return found;
}

void CreepCorrection::correct(Touch& touch, double at_s, double radius) {
    const Eigen::Vector3d found = without_creep(touch.id, touch.normal, at_s);
    double away = radius * (found - touch.normal).norm();
    if (!(away * away > SLIGHT * touch.covariance.trace())) return;
    if (creep_.measured) {
        touch.normal = found.normalized();
        touch.position = radius * touch.normal;
        away *= SURE;
    }
    const Eigen::Matrix3d along = across(touch.normal);  // the covariance stays along the surface where the normal has moved
    touch.covariance = (along * touch.covariance * along + away * away * along).eval();
}

// The normal without the creep, not of unit length; NaN for one that is NaN. The contact's first normal, and the first one after the clock
// was set back, comes back as it is. Between two results the contact moves at constant speed.
Eigen::Vector3d CreepCorrection::without_creep(std::int64_t id, const Eigen::Vector3d& normal, double at_s) {
    if (!normal.allFinite()) return normal;
    const double seconds = at_s - at_s_;
    if (id != id_ || !(seconds > 0)) {
        last_ = normal;
        past_.setZero();
        weight_ = 0;
    } else {
        const double share = creep_.share, steps = seconds / creep_.seconds, fade = std::exp(-steps), mean = -std::expm1(-steps) / steps;
        weight_ = 1 - (1 - weight_) * fade;
        const double scale = 1 / (1 - share * mean), shown = scale * (1 - share + share * weight_);
        const Eigen::Vector3d known = fade * past_ + (mean - fade) * last_;
        last_ = shown * normal - scale * share * known;
        past_ = known + (1 - mean) * last_;
    }
    id_ = id;
    at_s_ = at_s;
    return last_;
}

}  // namespace tactile::finger
