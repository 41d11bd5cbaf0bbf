// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Velocity of an object along its path, and how probable it is that it moves.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <utility>
#include <vector>

namespace tactile::taxel {

// How an object's motion is found. Times in s, lengths in m.
struct PathRule {
    double window;              // longest stretch of a steady motion
    double least_noise, bound;  // of a position at least; standard deviations by which velocities of ever longer stretches may differ
    double creep, slip_speed;   // m/s, spread of a component of the velocity without slip and with it
    double odds;                // of a motion against none in a frame, before it is seen
};

// Motion of an object in the last of its frames, at the origin: m, m, rad and per s, NaN before the noise is known. Paths are those of the
// contact's middle along x and y, and of its edges by the turn, m.
struct PathMotion {
    Eigen::Vector3d pose;            // without noise
    Eigen::Vector3d velocity;        // over the steady stretch
    Eigen::Vector3d velocity_sigma;  // m/s, of its paths, by noise
    Eigen::Vector3d hidden;          // over the same stretch, velocity of the picture's motion that is not attributed to the object
    Eigen::Vector3d bend;            // velocity in the second half of the stretch without that in the first
    Eigen::Vector3d bend_sigma;      // m/s, of its paths, by noise
    double probability = 0;          // of a motion
    double displacement = 0;         // m, of all paths together, by the velocity over the stretch
    double duration = 0;             // s, of the stretch
    double spread = 0;               // s^2, sum of the squares of the times of its frames about their mean
};

// Where an object is at a time, s: m, m, rad at the origin.
struct Pose {
    double time;
    Eigen::Vector3d pose;
    Eigen::Vector3d rest;  // of the picture's motion, what is not attributed to the object
    bool measured;         // in this frame, not kept from an earlier one
};

// The path of an object: its pose in the last frames.
class Path {
 public:
    explicit Path(const PathRule& rule) : rule_(rule) {}
    // Drop all frames.
    void reset() { past_.clear(), bends_.clear(); }
    // The motion after a frame. unit: to which the noise of its pose is in proportion; arm: m, of the contact's middle; reach: m, of its
    // edges from there.
    PathMotion add(const Pose& now, double unit, const Eigen::Vector2d& arm, double reach);

 private:
    Eigen::Vector3d measured_noise(const std::vector<Eigen::Vector3d>& positions, double unit);
    double probability(const Eigen::Vector3d& velocity, const Eigen::Vector3d& sigma) const;

    PathRule rule_;
    std::vector<Pose> past_;
    std::deque<std::pair<double, Eigen::Vector3d>> bends_;  // times and third differences of the paths over the unit
};

}  // namespace tactile::taxel
