// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contacts from frame to frame: numbers that stay, and a Kalman filter for each. The model is constant velocity with white acceleration
// (Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 6.2.2).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace tactile::press {

constexpr int MEASURED = 4, STATE = 2 * MEASURED;  // position and depth; and their velocities

// Position and depth of one frame, m, and their covariance.
struct Measurement {
    Eigen::Matrix<double, MEASURED, 1> value;
    Eigen::Matrix<double, MEASURED, MEASURED> covariance;
};

// A contact that is followed: its number; state, m and m/s, and its covariance; consecutive frames without it.
struct Track {
    std::int64_t id;
    Eigen::Matrix<double, STATE, 1> state;
    Eigen::Matrix<double, STATE, STATE> covariance;
    int missed = 0;
};

struct TrackerSettings {
    double acceleration;  // m/s^2, standard deviation
    double gate;          // squared Mahalanobis distance, largest of a measurement that continues a contact
    double speed;         // m/s, standard deviation of a new contact's velocity
    int most_missed;      // consecutive frames after which a contact has ended
};

class ContactTracker {
 public:
    explicit ContactTracker(const TrackerSettings& settings) : settings_(settings) {}

    // Follows the contacts over elapsed s and returns the one of each measurement; a measurement that continues none begins one.
    std::vector<Track> update(const std::vector<Measurement>& measured, double elapsed);

    // Ends all contacts; their numbers are not given again.
    void reset() { tracks_.clear(); }

 private:
    // The track that each measurement continues, -1 for none: one to one, with the least sum of distances.
    std::vector<std::ptrdiff_t> assign(const std::vector<Measurement>& measured) const;

    TrackerSettings settings_;
    std::vector<Track> tracks_;
    std::int64_t next_ = 1;
};

}  // namespace tactile::press
