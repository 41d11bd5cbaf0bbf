// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The untouched outputs of a PSD finger: offset and noise, measured at the start and tracked while nothing touches.
#pragma once

#include <Eigen/Core>
#include <Eigen/StdVector>
#include <array>
#include <cstddef>
#include <vector>

#include "finger/detector.hpp"

namespace tactile::finger {

// An offset that drifts: Kalman filters of constant drift, one for each of some accelerations, weighted by how well they predict.
//
// A calm room then gives the mean over seconds, a room whose light changes the line through the last samples, and both go on while
// something touches and nothing is measured (multiple models: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking,
// section 11.6). A room whose light changes in strength moves the four outputs together, in a direction that is at first taken from what
// they are, and then from how they change: the dark voltages of the amplifiers do not change with the light. Across that direction they
// rest. The filters are therefore weighted for both apart.
class DriftFilter {
 public:
    // offset: V; variance: V^2, of each output; fastest: V/s, fastest drift of an output.
    DriftFilter(const Eigen::Vector4d& offset, double variance, double fastest);
    // The present offset has that variance, and its drift is not known.
    void restart(double variance);
    // Add a step, V.
    void move(const Eigen::Vector4d& change);
    // Let the offset drift for some seconds.
    void predict(double seconds);
    // The offset was by change, V, higher in the mean of the seconds from now on, with variance, V^2, of each output.
    void correct(const Eigen::Vector4d& change, double variance, double seconds);

    Eigen::Vector4d offset() const;  // V, at the present time
    // V^2, of the offset along the room's light, and of each output's across.
    Eigen::Vector2d variances() const;

 private:
    static constexpr int FILTERS = 2;
    struct Filter {
        Eigen::Vector4d offset, drift;
        Eigen::Matrix2d spread;  // covariance of an output's offset and drift
    };

    void weigh();
    void learn_direction(double seconds);

    double fastest_;
    std::array<Filter, FILTERS> filters_;
    Eigen::Array<double, 2, FILTERS> score_, weights_;  // rows: along the room's light, and across
    Eigen::Vector4d first_, room_, base_, changes_;     // directions: at first, and now; what changes are from; their sum
};

class Reference {
 public:
    // seconds: of the measurement; fastest: V/s, fastest drift of the total. What rises faster is an approaching object.
    Reference(double seconds, double fastest);
    // Measure it again from the next samples.
    void reset();
    // Measure with the first of finite outputs (4, N), V; returns how many it used.
    std::ptrdiff_t measure(const Eigen::Ref<const Eigen::Matrix4Xd>& volts, double period);
    // Track with the sums of an untouched sample; at: the offset that they are relative to.
    void follow(Eigen::Vector4d sums, const Eigen::Vector4d& at, double period);
    // Something touches for so many seconds: the offset stays, and may have drifted when it is seen again.
    void hold(double seconds);
    // A contact begins: samples since the last update may hold light of the object that came near, and count no more.
    void drop() { clear_sums(); }
    // Apply a step of ambient light, V.
    void shift(const Eigen::Vector4d& change);

    bool ready() const { return ready_; }
    const Eigen::Vector4d& offset() const { return offset_; }      // V
    const Eigen::Matrix4d& noise() const { return noise_; }        // V^2, covariance of a sample's sums
    double sigma() const { return sigma_; }                        // V, standard deviation of the total at rest
    double uncertainty() const { return uncertainty_[0]; }         // V, of a sum of the offsets, along the room's light
    double uncertainty_across() const { return uncertainty_[1]; }  // V, the same across it

 private:
    void use_drift();
    void take_noise(const Eigen::Matrix4d& noise);
    void settle();
    void clear_sums();
    void update(double seconds);
    void correct(const Eigen::Vector4d& change, double seconds);
    void step(const Eigen::Vector4d& change, double scatter);
    bool stays(double total, double scatter, double seconds);

    double seconds_, fastest_;
    bool ready_ = false, leaves_ = false;  // leaves: an object may still be near
    std::vector<Eigen::Vector4d> taken_;
    double have_s_ = 0, ahead_s_ = 0, flat_s_ = 0, flat_at_ = 0, unseen_s_ = 0;
    Eigen::Vector4d sum_;
    Eigen::Matrix4d square_, noise_;
    double count_ = 0, sigma_ = 0;
    Eigen::Vector4d offset_;
    Eigen::Vector2d uncertainty_;
    DriftFilter drift_;
};

}  // namespace tactile::finger
