// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contact of an array frame by frame: values in; regions, contacts, slip, wrench and points out.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "common/contact_tracker.hpp"
#include "common/fields.hpp"
#include "taxel/mechanics.hpp"
#include "taxel/signal.hpp"

namespace tactile::taxel {

enum Flag { AT_EDGE = 2, AMBIGUOUS = 4, SATURATED = 8 };
enum PointState : std::uint8_t { NON_CONTACT = 0, STICKING = 1, SLIPPING = 2, UNKNOWN_STATE = 255 };

// The object between two fingers, in the sensor frame; NaN for what is not known. See GraspedObject in wrench.py.
struct Grasped {
    double depth = std::numeric_limits<double>::quiet_NaN();  // m
    Eigen::Vector3d weight = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  // N
    Eigen::Vector3d centre_of_mass = weight;                                                       // m
    bool can_roll = true;
    TACTILE_FIELDS(depth, weight, centre_of_mass, can_roll)
};

// One contact: the fields of ContactEstimate.
struct Contact {
    std::ptrdiff_t id;
    Eigen::Vector3d position;  // m
    double depth, force;       // m, N
    Eigen::Matrix3d position_covariance;
    int flags;
    TACTILE_FIELDS(id, position, depth, force, position_covariance, flags)
};

// Motion of the object over the pad while it slips: fields of SlipEstimate, at the origin; NaN for what is not known.
struct Sliding {
    double slipping_fraction, unseen;  // unseen: see ObjectMotion
    Eigen::Vector3d linear, angular;   // m/s, rad/s
    Eigen::Matrix<double, 6, 6> velocity_covariance;
    Eigen::Vector3d rotation_center;    // m
    std::vector<double> x, y, vx, vy;   // m and m/s, of the slipping taxels
    TACTILE_FIELDS(slipping_fraction, unseen, linear, angular, velocity_covariance, rotation_center, x, y, vx, vy)
};

// Fields of SurfacePoints of all taxels.
struct Points {
    std::vector<double> displacement, force, normal_force;  // (K, 3) m, (K, 3) N, (K) N
    std::vector<std::uint8_t> state;                         // (K)
    TACTILE_FIELDS(displacement, force, normal_force, state)
};

// All results of a frame. Of the region: fields of ContactRegionEstimate, without contact all NaN or none.
struct Found {
    std::vector<std::vector<double>> outlines, holes;  // (M, 3) m
    double area = 0;                                   // m^2
    Eigen::Vector3d centroid, axes;                    // m; full lengths, m, of the ellipse of the same moments, and its direction, rad
    Eigen::Vector3d motion_translation;                // m, of the object since the last frame
    Eigen::Vector4d motion_rotation;                   // quaternion x, y, z, w
    double motion_interval;                            // s
    Eigen::Matrix<double, 6, 6> motion_covariance;
    std::vector<Contact> contacts;
    std::optional<Sliding> sliding;
    Eigen::Matrix<double, 6, 1> wrench;  // N and N m, of the object on the sensor
    std::vector<float> pressure;         // (rows, columns) Pa, if the response is known
    std::ptrdiff_t columns;

    Observation observation;     // the method's
    std::vector<double> normal;  // N, of each region
    TACTILE_FIELDS(outlines, holes, area, centroid, axes, motion_translation, motion_rotation, motion_interval, motion_covariance, contacts,
                   sliding, wrench, pressure)
};

struct EstimatorSettings {
    ShearPad pad;
    double stiffness;  // Pa, pressure under a wide plate over depth / thickness
    bool known;        // whether the response is known
    bool by_depth;     // whether a known depth gives the force even if the response is known
};

// Estimates contact of an array frame by frame. A method of its own takes load, regions, complete instead of process.
class Estimator {
 public:
    Estimator(const EstimatorSettings& settings, SignalSettings signal, const MotionLimits& limits);
    // The next frame is the untouched reference.
    void set_reference();
    // The results of a load, by a model of the pad.
    Found process(Load load);
    // The results of a load whose contacts are at regions; centre: m, of the contact and of its pressure, NaN: that of the regions.
    Found complete(Load load, Observation observation, const Eigen::Vector2d& centre);
    // Displacement, force and state of each taxel in a frame; of a slip that is not located, the state is unknown.
    Points points(const Found& found, bool slips) const;

    Signal signal;
    Grasped grasped{};

 private:
    void add_region(const Observation& observation, double interval, Found& found) const;
    void add_contacts(const Observation& observation, const Load& load, Found& found);
    void add_wrench(const Load& load, const Eigen::Vector2d& centre, Found& found) const;
    Sliding sliding(const Observation& observation) const;
    double normal_force(const Region& region) const;
    Eigen::Vector2d position(std::ptrdiff_t taxel) const;

    EstimatorSettings settings_;
    Mechanics mechanics_;
    ContactTracker tracker_{};
};

}  // namespace tactile::taxel
