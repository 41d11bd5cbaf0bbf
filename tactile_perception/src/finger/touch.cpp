// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/touch.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "finger/constants.hpp"

namespace tactile::finger {
namespace {

Eigen::Matrix3d across(const Eigen::Vector3d& normal) {
    return Eigen::Matrix3d::Identity() - normal * normal.transpose();
}

// Light over that of a typical contact at its spot, minus 1, clipped to -1 to 1.
double relative_light(const Cell& cell, double total) {
    return std::min(std::max(total / cell.value(LIGHT) - 1, -1.0), 1.0);
}

// Covariance of a spot: the noise of the mean; the error of the room's light, along the line to the room's centroid; and the displacement
// without the light that may be a lamp's.
Eigen::Matrix2d spot_covariance(const MeanLight& mean, const Eigen::Vector2d& spot, const LightErrors& errors) {
    Eigen::Matrix2d found = centroid_covariance(spot, mean.sums[TOTAL], errors.noise) / static_cast<double>(mean.used);
    const Eigen::Vector2d room = centroid(errors.room);
    if (!room.hasNaN()) {
        const Eigen::Vector2d shift = errors.room_volts / mean.sums[TOTAL] * (room - spot);
        found += shift * shift.transpose();
    }
    const Eigen::Vector4d without_lamp = mean.sums - errors.lamp;
    if (without_lamp[TOTAL] > 0) {
        const Eigen::Vector2d shift = centroid(without_lamp) - spot;
        found += shift * shift.transpose();
    }
    return found;
}

// Load, N or m, of light, V, at a spot; at_spot: the part of its logarithm that depends on the spot alone (finger/model.py). NaN where not
// calibrated.
double load(const FingerModel& model, int which, double at_spot, const Eigen::Vector2d& spot, double light) {
    const auto terms = model.load_terms.row(which);
    const double log = std::log(std::max(light, FINGER.min_light)), square = spot.squaredNorm();
    const double whole = at_spot + (terms[1] + terms[7] * square + terms[2] * log) * log;
    return std::isnan(whole) ? UNKNOWN : std::exp(std::min(whole, FINGER.max_log));
}

}  // namespace

Eigen::Matrix2d centroid_covariance(const Eigen::Vector2d& spot, double total, const Eigen::Matrix4d& noise) {
    const double x = spot.x(), y = spot.y(), square = total * total, tt = noise(TOTAL, TOTAL);
    const double xy = (noise(X, Y) - x * noise(Y, TOTAL) - y * noise(X, TOTAL) + x * y * tt) / square;
    Eigen::Matrix2d found;
    found << (noise(X, X) - 2 * x * noise(X, TOTAL) + x * x * tt) / square, xy, xy,
        (noise(Y, Y) - 2 * y * noise(Y, TOTAL) + y * y * tt) / square;
    return found;
}

Touch estimate_touch(const MeanLight& mean, const LightErrors& errors, const FingerModel& model, double radius) {
    Touch found;
    const double total = mean.sums[TOTAL];
    const Eigen::Vector2d spot = centroid(mean.sums);
    if (mean.saturated) found.flags |= SATURATED;
    if (errors.stuck && mean.used > 0) found.flags |= AMBIGUOUS;
    if (errors.stuck || !(total > 0) || spot.hasNaN()) return found;
    const Cell cell(model, spot);
    const double relative = relative_light(cell, total), deviation = cell.value(DEVIATION);
    const Eigen::Vector3d direction = cell.vector(NORMAL) + relative * cell.vector(BEND);
    const double length = direction.norm(), cells = 0.5 * static_cast<double>(model.nodes - 1);
    found.normal = direction / length;
    found.position = radius * found.normal;
    const Eigen::Matrix3d along = across(found.normal);
    const Eigen::Matrix<double, 3, 2> slopes = along * (cells / length * (cell.slopes(NORMAL) + relative * cell.slopes(BEND)));
    const Eigen::Matrix3d of_spot = slopes * spot_covariance(mean, spot, errors) * slopes.transpose();
    found.position_covariance = radius * radius * (of_spot + deviation * deviation * along);
    if (cell.value(INSIDE) < 0.5 || spot.cwiseAbs().maxCoeff() >= 1) found.flags |= OUT_OF_RANGE;
    const double cross_error = mean.sums[CROSS] - cell.value(CROSS_PART) * total;
    const double noise = std::sqrt(errors.noise(CROSS, CROSS) / static_cast<double>(mean.used));
    if (std::abs(cross_error) > FINGER.cross_sigmas * std::hypot(noise, model.cross_volts)) found.flags |= AMBIGUOUS;
    found.force = load(model, 0, cell.value(FORCE), spot, total);
    found.depth = load(model, 1, cell.value(DEPTH), spot, total);
    return found;
}

void CreepCorrection::correct(Touch& touch, double at_s, double radius) {
    const Eigen::Vector3d found = without_creep(touch.id, touch.normal, at_s);
    double lag = radius * (found - touch.normal).norm();
    if (!(lag * lag > FINGER.min_creep * touch.position_covariance.trace())) return;
    if (creep_.measured) {
        touch.normal = found.normalized();
        touch.position = radius * touch.normal;
        lag *= FINGER.creep_error;
    }
    const Eigen::Matrix3d along = across(touch.normal);  // the covariance stays along the surface where the normal has moved
    touch.position_covariance = (along * touch.position_covariance * along + lag * lag * along).eval();
}

// The normal without the creep, not of unit length; NaN for one that is NaN. The first normal of a contact, and the first one after the
// clock was set back, are returned as they are. Between two results the contact moves at constant speed.
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
