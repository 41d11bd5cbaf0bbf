// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The contact of a PSD finger from its samples: position and normal on the hemisphere (Maekawa et al., eqs 1 and 7), force, depth and
// their covariance.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "finger/detector.hpp"

namespace tactile::finger {

enum Flags { OUT_OF_RANGE = 1, AMBIGUOUS = 4, SATURATED = 8 };  // of tactile_msgs/Contact

// One contact.
struct Touch {
    std::int64_t id = 0;                                                               // constant while the contact lasts, from 1 on
    Eigen::Vector3d position = Eigen::Vector3d::Constant(UNKNOWN), normal = position;  // m; unit vector
    double force = UNKNOWN, depth = UNKNOWN;                                           // N, m; NaN where not calibrated
    Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Constant(UNKNOWN);          // m^2
    int flags = 0;                                                                     // sum of Flags
    TACTILE_FIELDS(id, position, normal, force, depth, position_covariance, flags)
};

// The mean of the samples of a contact.
struct MeanLight {
    std::ptrdiff_t samples = 0, used = 0;                       // in contact; of them, those that are not saturated
    Eigen::Vector4d sums = Eigen::Vector4d::Constant(UNKNOWN);  // V, of those used
    bool saturated = false;                                     // an output was saturated in any sample
};

// Noise and ambient light of the outputs, V.
struct LightErrors {
    Eigen::Matrix4d noise;  // V^2, covariance of a sample's sums
    Eigen::Vector4d room;   // light of the room; its error has the same centroid; 0 where it is not known
    double room_volts;      // standard deviation of the total that is subtracted as the room's light
    Eigen::Vector4d lamp;   // part of the contact's light that may be a lamp's
    bool stuck;             // an output has stopped changing
};

// The contact of a mean, on a cover of that radius, m. NaN throughout where its total is not positive or an output is stuck.
Touch estimate_touch(const MeanLight& mean, const LightErrors& errors, const FingerModel& model, double radius);

// Covariance, half widths squared, of a centroid that is measured with that total, V: first-order propagation of eq 1. noise: of the sums,
// V^2.
Eigen::Matrix2d centroid_covariance(const Eigen::Vector2d& spot, double total, const Eigen::Matrix4d& noise);

// Corrects the normals of successive contacts for the creep of the cover.
//
// The cover is a standard linear solid (Zener; Ferry, Viscoelastic Properties of Polymers, chapter 3): it follows a new load at once but
// for a share, which follows with one time constant. A sliding contact is seen at (1 - share) of its position plus a share of the fading
// average over its past: behind the object, and towards the centre of a bent path. The cover is unloaded before a contact, and then bears a
// constant load.
class CreepCorrection {
 public:
    explicit CreepCorrection(const Creep& creep) : creep_(creep) {}
    // Subtracts the creep, where it is calibrated, from a contact at a time, s; else adds the creep of a typical cover to its covariance.
    void correct(Touch& touch, double at_s, double radius);

 private:
    Eigen::Vector3d without_creep(std::int64_t id, const Eigen::Vector3d& normal, double at_s);

    Creep creep_;
    std::int64_t id_ = 0;
    double at_s_ = UNKNOWN, weight_ = 0;                             // of the last normal; of the fading sum
    Eigen::Vector3d last_ = Eigen::Vector3d::Zero(), past_ = last_;  // the last normal without creep; the fading sum of all
};

}  // namespace tactile::finger
