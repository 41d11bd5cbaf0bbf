// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Motion of a contact: from image to image, and along its path.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace tactile::taxel {

// An image of a contact: positive pressure (rows, columns) times scale.
struct Picture {
    const float* pressure;
    std::ptrdiff_t rows, columns;
    float scale;
};

// Motion since a keyframe: a point p (column, row, taxels) of the contact moves to middle + R(turn) (p - middle) + shift.
struct KeyframeMotion {
    Eigen::Vector4d fit = Eigen::Vector4d::Zero();  // taxels: shift along columns and rows, turn times reach, growth along the normals
    double turn = 0;                                // rad, NaN where it is not observable
    double reach = 1;                               // taxels, distance of far edges from the middle
    double sigma = 0;    // taxels, standard deviation of the registered position along the direction in which it is known worst
    bool blind = false;  // whether a shift in some direction is not observable

    // rad, 0 where it is not observable.
    double known_turn() const { return std::isnan(turn) ? 0 : turn; }
    // Largest displacement, taxels.
    double largest() const { return fit.head<2>().norm() + std::abs(known_turn()) * reach; }
};

// An image that later ones are registered with by the normal flow of its edges. Growth along the edges' normals is fitted too, since a
// change of load makes a contact grow without motion. A shift along which the edges are straight is not fitted: it is unknown, not 0.
class EdgeKeyframe {
 public:
    // Edge taxels where the slope of the image exceeds steep, 1/taxel; none at the border.
    EdgeKeyframe(const Picture& picture, double steep);
    // The motion from the keyframe to an image; guess: the predicted fit. None where the fit fails.
    std::optional<KeyframeMotion> motion(const Picture& picture, const Eigen::Vector4d& guess) const;
    // Number of edge taxels.
    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(edges_.size()); }

    Eigen::Vector2d middle = Eigen::Vector2d::Zero();  // column and row, mean of the edge taxels
    double reach = 1;                                  // taxels from middle, within which most of them lie

 private:
    struct Edge {
        Eigen::Vector2d position;  // column and row, from middle
        double value;              // of the image there
        Eigen::Vector4d slopes;    // by a shift along columns and rows, by a turn times reach, by growth along the normals
    };
    class Problem;
    struct Registration {
        Eigen::Vector4d fit;
        double spread = 0;  // standard deviation of the image's residuals
    };
    void find_observable(const Eigen::Matrix4d& normal);
    Registration fitted(const Picture& picture, const Eigen::Vector4d& guess) const;
    Eigen::Vector4d searched(const Picture& picture, const Eigen::Vector4d& guess) const;

    std::vector<Edge> edges_;
    Eigen::Matrix4d visible_ = Eigen::Matrix4d::Zero();  // projector on the motions that the edges determine
    double position_sigma_ = 0;                          // taxels of the position over the spread of the residuals
    bool determined_ = false, turns_ = false, blind_ = false;
};

// A contact of few taxels, registered by the centroid of its pressure (rows, columns), where touched.
class CentroidKeyframe {
 public:
    CentroidKeyframe(const Picture& picture, const std::uint8_t* touched);
    // The motion from the keyframe to an image where touched; none for a jump. Both centroids are taken over the taxels that either
    // touches: one that crosses the border moves no centroid at once.
    std::optional<KeyframeMotion> motion(const Picture& picture, const std::uint8_t* touched) const;

    Eigen::Vector2d middle;  // column and row, of the centroid

 private:
    std::vector<float> pressure_;
    std::vector<std::uint8_t> touched_;
};


// How an object's motion is found. Times in s, lengths in m.
struct PathRule {
    double window, reported;    // longest stretch of a steady motion, and the stretch of the velocity that is reported
    double least_noise, bound;  // of a position at least; standard deviations by which velocities of ever longer stretches may differ
};

// Motion of an object in the last of its frames, at the origin: m, m, rad and per s.
struct PathMotion {
    Eigen::Vector3d pose, velocity;  // without noise
    Eigen::Vector3d reported;        // velocity over the reported stretch, NaN with fewer than four frames
    double reported_sigma = 0;       // m/s, standard deviation by noise of each of its components, of a turn by its path
    Eigen::Vector3d hidden;          // over the same stretch, velocity of the picture's motion that is not attributed to the object
    Eigen::Vector3d bend;            // of both together, the velocity in the second half of the stretch without that in the first
    double bend_sigma = 0;           // m/s, by noise
    double noise = 0;                // m, of a position
    double speed = 0, sigma = 0;     // m/s, of the contact's middle and edges together, and the standard deviation of each
    double duration = 0;             // s, of the steady motion
    std::ptrdiff_t used = 1;         // its frames
};

// The path of an object: its pose in the last frames.
class Path {
 public:
    explicit Path(const PathRule& rule) : rule_(rule) {}
    // Drop all frames.
    void reset() { past_.clear(); }
    // The motion after a frame at time with a pose. rest: of the picture's motion, at the origin, what is not attributed to the object;
    // arm: m, of the contact's middle; reach: m, of its edges from there.
    PathMotion add(double time, const Eigen::Vector3d& pose, const Eigen::Vector3d& rest, const Eigen::Vector2d& arm, double reach);

 private:
    struct Frame {
        double time;
        Eigen::Vector3d pose, rest;
    };
    PathRule rule_;
    std::vector<Frame> past_;
};

}  // namespace tactile::taxel
