// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The light of a PSD finger as one state space: what the room sends, what the object shades of it, and what the object sends.
//
// The sums of the outputs are offset + light - shade * room + noise. The offset drifts, mostly along the room's light, and jumps when a
// lamp is switched: a Kalman filter. The light comes from nothing, from an object that is near or touches, or from a source that is not
// known yet. Three facts distinguish a jump from an object. An object's light grows while it approaches, because the cover reflects before
// it touches (Maekawa et al., section 6.3); a lamp's is constant. A lamp has the centroid of the room, an object its own. No object sends
// negative light. Four outputs hold one number more than light and position, the cross term, which is known for a single contact: what is
// missing there is shaded.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "finger/touch.hpp"

namespace tactile::finger {

// The sums of the untouched outputs, V, and their drift: a Kalman filter.
class Offset {
 public:
    // Starts at a level with a covariance; fastest: V/s, fastest drift of its total.
    void start(const Eigen::Vector4d& level, const Eigen::Matrix4d& spread, double fastest);
    // Adds a change with a covariance; the drift is unknown afterwards.
    void jump(const Eigen::Vector4d& change, const Eigen::Matrix4d& spread);
    // Extrapolates by a time, s.
    void predict(double seconds);
    // Predicts by the seconds, and corrects by a measured mean over them: the level plus above, with a covariance.
    void correct(const Eigen::Vector4d& above, const Eigen::Matrix4d& noise, double seconds);

    Eigen::Vector4d level() const { return state_.head<4>(); }
    Eigen::Matrix4d spread() const { return spread_.topLeftCorner<4, 4>(); }

 private:
    Eigen::Matrix<double, 8, 1> state_ = Eigen::Matrix<double, 8, 1>::Zero();   // level, and drift per s
    Eigen::Matrix<double, 8, 8> spread_ = Eigen::Matrix<double, 8, 8>::Zero();  // covariance
    Eigen::Matrix4d drift_ = Eigen::Matrix4d::Zero(), rate_ = drift_;           // V^2/s^2, of a drift not known; V^2/s^3, of its changes
};

// The ambient light of a finger, and whether something touches it, from its samples in order.
class Light {
 public:
    // seconds: duration of the untouched state at the start; fastest: V/s, drift of its total; threshold: V, of the total, for the
    // published method (section 5), with a constant offset; NaN for contact by noise and calibration.
    Light(double seconds, double fastest, double threshold) : seconds_(seconds), fastest_(fastest), threshold_(threshold) {}
    // Measures the untouched state again; nothing touches.
    void reset();
    // Samples are missing: those before them do not show whether light grows or rests.
    void interrupt();
    // Ends the contact.
    void release();
    // Adds a sample, outputs in V, period in s; returns its sums net of the offset, V, or nothing while the untouched state is measured.
    std::optional<Eigen::Vector4d> add(const Eigen::Vector4d& volts, double period, const FingerModel& model);
    bool touching() const { return touching_; }
    // Corrects the last sums (4, N), V, where they are in contact, for shaded and changed light of the room.
    void hold(Eigen::Ref<Eigen::Matrix4Xd> sums, const std::uint8_t* contact, const std::uint8_t* saturated, double period,
              const FingerModel& model);

    bool ready() const { return ready_; }
    Eigen::Vector4d offset() const { return unmix(offset_.level()); }                 // V, of the outputs
    double sigma() const { return std::sqrt(noise_(TOTAL, TOTAL)); }                  // V, standard deviation of the total at rest
    double uncertainty() const { return std::sqrt(offset_.spread()(TOTAL, TOTAL)); }  // V, of the total of the offset
    LightErrors errors() const;

 private:
    enum State { NOTHING, WATCHED, NEAR };  // an onset is watched until it is known to be an object's or a lamp's

    void measure();
    bool watch(const Eigen::Vector4d& sums, double period);
    void begin(const FingerModel& model);
    void follow(const Eigen::Vector4d& sums, double period);
    void update(double seconds);
    void end_bin(double period, const FingerModel& model);
    void judge_rest(const Eigen::Vector4d& light, double sigma);
    void measure_shade(const Eigen::Vector4d& light, double seconds, const FingerModel& model);
    bool of_room(const Eigen::Vector4d& change, double sigma) const;
    bool of_contact(const Eigen::Vector4d& change, double sigma) const;
    double shade_known() const;
    Eigen::Vector4d shaded(double shade) const;
    void clear_bin();

    double seconds_, fastest_, threshold_;
    bool ready_ = false, touching_ = false;
    std::vector<Eigen::Vector4d> taken_;  // sums, V, while the untouched state is measured
    double have_s_ = 0;
    Offset offset_;
    Eigen::Matrix4d noise_ = Eigen::Matrix4d::Zero();

    State state_ = NOTHING;
    double last_ = 0, recent_ = 0, seen_ = 0;  // totals: the last one, and a recent mean; samples since an interruption
    double first_ = 0, watched_ = 0;           // total at an onset; samples since
    Eigen::Vector4d early_, late_;             // mean sums in the first half of that time, and in the second

    Eigen::Vector4d sum_ = Eigen::Vector4d::Zero();  // of the samples of the present bin
    Eigen::Matrix4d square_ = Eigen::Matrix4d::Zero();
    double count_ = 0;
    double flat_s_ = 0, flat_at_ = 0;                           // duration, s, and total, V, of constant light without contact
    double unseen_s_ = 0, ahead_s_ = 0;                         // s in contact; of them, s by which the offset is not predicted yet
    double apart_s_ = std::numeric_limits<double>::infinity();  // s since the last contact
    bool leaves_ = false;                                       // the object of the last contact may still be near

    Eigen::Vector4d room_ = Eigen::Vector4d::Zero(),
                    beyond_ = room_;                  // room's light at the onset of contact, and its excess over that of the calibration
    double shade_ = 0, gained_ = 0;                   // shaded share beyond the expected one; information on it
    double since_s_ = 0, restless_s_ = 0;             // since the onset of contact, and since the last rest
    std::vector<Eigen::Vector4d> bins_;               // mean light of the last bins
    std::optional<Eigen::Vector4d> rest_;             // light of the object at its last rest
    Eigen::Vector4d doubtful_ = room_, now_ = room_;  // changes that may be a lamp's: at the last rest, and in the last samples
};

}  // namespace tactile::finger
