// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/contact_tracker.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "dots/links.hpp"

namespace tactile::press {
namespace {

constexpr double FARTHEST = 1e3;  // gates: farther counts as so far, so that a sum of distances stays exact

using Spread = Eigen::Matrix<double, MEASURED, MEASURED>;
using StateMatrix = Eigen::Matrix<double, STATE, STATE>;

void predict(Track& track, double elapsed, double acceleration) {
    StateMatrix step = StateMatrix::Identity();
    step.topRightCorner<MEASURED, MEASURED>().diagonal().setConstant(elapsed);
    Eigen::Matrix<double, STATE, MEASURED> pushed;  // by an acceleration
    pushed << Spread(0.5 * elapsed * elapsed * Spread::Identity()), Spread(elapsed * Spread::Identity());
    track.state = step * track.state;
    track.covariance = (step * track.covariance * step.transpose() + acceleration * acceleration * pushed * pushed.transpose()).eval();
}

// Covariance of a measurement about the prediction.
Eigen::LLT<Spread> innovation(const Track& track, const Measurement& measured) {
    return Eigen::LLT<Spread>(track.covariance.topLeftCorner<MEASURED, MEASURED>() + measured.covariance);
}

// Squared Mahalanobis distance of a measurement from the prediction.
double distance(const Track& track, const Measurement& measured) {
    const Eigen::LLT<Spread> spread = innovation(track, measured);
    const double found = spread.matrixL().solve(measured.value - track.state.head<MEASURED>()).squaredNorm();
    return spread.info() == Eigen::Success && std::isfinite(found) ? found : INFINITY;
}

// In Joseph's form, which keeps the covariance positive definite despite rounding.
void correct(Track& track, const Measurement& measured) {
    const Eigen::LLT<Spread> spread = innovation(track, measured);
    const Eigen::Matrix<double, STATE, MEASURED> gain = spread.solve(track.covariance.topRows<MEASURED>()).transpose();
    StateMatrix rest = StateMatrix::Identity();
    rest.leftCols<MEASURED>() -= gain;
    track.state += gain * (measured.value - track.state.head<MEASURED>());
    track.covariance = (rest * track.covariance * rest.transpose() + gain * measured.covariance * gain.transpose()).eval();
}

}  // namespace

std::vector<std::ptrdiff_t> ContactTracker::assign(const std::vector<Measurement>& measured) const {
    const auto rows = static_cast<std::ptrdiff_t>(measured.size()), columns = static_cast<std::ptrdiff_t>(tracks_.size());
    std::vector<std::ptrdiff_t> continued(measured.size(), -1);
    if (!rows || !columns) return continued;
    std::vector<double> cost(rows * columns);
    const bool turned = rows > columns;  // the assignment wants at most as many rows as columns
    const auto at = [&](std::ptrdiff_t m, std::ptrdiff_t k) { return turned ? k * rows + m : m * columns + k; };
    for (std::ptrdiff_t m = 0; m < rows; ++m)
        for (std::ptrdiff_t k = 0; k < columns; ++k)
            cost[at(m, k)] = std::min(distance(tracks_[k], measured[m]), FARTHEST * settings_.gate);
    const std::vector<std::ptrdiff_t> other = assign_least(cost, std::min(rows, columns), std::max(rows, columns));
    for (std::ptrdiff_t n = 0; n < static_cast<std::ptrdiff_t>(other.size()); ++n) {
        const std::ptrdiff_t m = turned ? other[n] : n, k = turned ? n : other[n];
        if (cost[at(m, k)] <= settings_.gate) continued[m] = k;
    }
    return continued;
}

std::vector<Track> ContactTracker::update(const std::vector<Measurement>& measured, double elapsed) {
    for (Track& track : tracks_) predict(track, elapsed, settings_.acceleration), ++track.missed;
    const std::vector<std::ptrdiff_t> continued = assign(measured);
    std::vector<Track> found;
    for (std::size_t m = 0; m < measured.size(); ++m) {
        if (continued[m] < 0) {
            Track begun{next_++, Eigen::Matrix<double, STATE, 1>::Zero(), settings_.speed * settings_.speed * StateMatrix::Identity()};
            begun.state.head<MEASURED>() = measured[m].value;
            begun.covariance.topLeftCorner<MEASURED, MEASURED>() = measured[m].covariance;
            found.push_back(begun);
            continue;
        }
        Track& track = tracks_[continued[m]];
        correct(track, measured[m]);
        track.missed = 0;
        found.push_back(track);
    }
    std::vector<Track> kept = found;
    std::copy_if(tracks_.begin(), tracks_.end(), std::back_inserter(kept),
                 [&](const Track& track) { return track.missed > 0 && track.missed <= settings_.most_missed; });
    tracks_ = std::move(kept);
    return found;
}

}  // namespace tactile::press
