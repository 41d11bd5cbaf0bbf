// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Ambient light while an object touches a PSD finger: lamps that are switched or dimmed, and the room's light that the object shades.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "finger/detector.hpp"

namespace tactile::finger {

// What is known of the light of a contact.
//
// While something touches, the offset cannot be measured. Three facts replace the measurement. The room's light falls on the whole cover,
// so its centroid on the detector is the offset's, not the contact's. An object that rests keeps its light; a step between two rests whose
// centroid is the room's is a lamp. Four outputs hold one number more than light and position: the cross term, which is known for a single
// contact; what is missing there is the shaded light.
// Light that is left alone when the object goes, and equals what has come suddenly before, is a lamp's, whose centroid was the contact's by
// chance. The calibrated map holds what was shaded of the room then, and nothing shades the dark voltages of the amplifiers: before it is
// measured, a part is expected of what this room has beyond that one.
class HeldLight {
 public:
    // What is known of single samples.
    struct Noise {
        Eigen::Matrix4d sums;  // V^2, covariance
        double cross_volts;    // V, standard deviation of the expected cross term
        double period;         // s between samples
    };

    // A contact begins. offset, calibrated: V, untouched outputs, now and at the calibration.
    void begin(const Eigen::Vector4d& offset, const Eigen::Vector4d& calibrated);
    // Samples are missing: what came before them is no longer compared with what follows.
    void interrupt();
    // Corrects the sums (4, N) of those samples that are in contact for ambient light that changes during it. If a change is certain and
    // lasts, returns what the sums of the untouched outputs have become brighter by.
    std::optional<Eigen::Vector4d> follow(Eigen::Matrix4Xd& sums, const std::vector<std::uint8_t>& contact,
                                          const std::vector<std::uint8_t>& saturated, const FingerModel& model, const Noise& noise);

    // V, sums of the room's light at the contact's begin; 0 before the first contact.
    const Eigen::Vector4d& room() const { return room_; }
    // V, standard deviation of the room's light that the object shades.
    double shaded_volts() const;
    // V, light of the contact that has come or gone suddenly, or just now, and may be a lamp's; 0 without such light. sigma: V, of a
    // sample's total.
    Eigen::Vector4d lamp_volts(double sigma) const;

 private:
    static constexpr int RESTS = 5;  // bins that agree while an object rests. Chosen
    using Bins = std::array<Eigen::Vector4d, RESTS>;

    double known_beforehand() const;
    Eigen::Vector4d shaded(double shade) const;
    Eigen::Vector4d correction(const Eigen::Vector4d& mean, double sigma);
    void measure_shade(const Eigen::Vector4d& light, double seconds, const FingerModel& model, const Noise& noise);
    std::optional<Eigen::Vector4d> end_bin(const FingerModel& model, const Noise& noise);
    std::optional<Eigen::Vector4d> judge_rest(const Eigen::Vector4d& light, double sigma);

    Eigen::Vector4d room_ = Eigen::Vector4d::Zero();       // sums of the untouched outputs before the contact
    Eigen::Vector4d beyond_ = Eigen::Vector4d::Zero();     // of them, what the room of the calibration had not
    double shade_ = 0;                                     // part of the room's light that the object shades beyond the expected
    double gained_ = 0;                                    // information on it, 1 / variance, beyond what is known beforehand
    double since_s_ = 0, restless_s_ = 0;                  // from the contact's begin to the last bin's end; without rest
    std::optional<Eigen::Vector4d> rest_;                  // light of the object when it rested last
    double count_ = 0;                                     // samples in the present bin
    Eigen::Vector4d sum_ = Eigen::Vector4d::Zero();        // of them
    int bins_ = 0;                                         // finished bins, 0 to RESTS
    Bins finished_;                                        // their mean light, the last one at the end
    Eigen::Vector4d doubtful_ = Eigen::Vector4d::Zero();   // sudden changes of the contact's light, which may be a lamp's
    Eigen::Vector4d undecided_ = Eigen::Vector4d::Zero();  // what the last samples have beyond the last rest, which may be a lamp's, too
};

}  // namespace tactile::finger
