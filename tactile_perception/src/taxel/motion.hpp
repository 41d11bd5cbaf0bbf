// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Motion of a contact: from image to image, and along its path.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace tactile::taxel {

// An image of a contact: positive pressure (rows, columns) times scale.
struct Picture {
    const float* pressure;
    std::ptrdiff_t rows, columns;
    float scale;
};

// A motion from a keyframe to a later image.
struct Registration {
    Eigen::Vector4d fit;  // shift along columns and rows, turn times reach, growth: taxels
    double spread = 0;    // standard deviation of the image's residuals
};

// The edge taxels of an image, by which the motion to later images is found.
class Keyframe {
 public:
    // Edge taxels where the slope of the image exceeds steep, 1/taxel; none at the border.
    Keyframe(const Picture& picture, double steep);
    // Fit of the edges' motion from a first guess; turns: whether a turn is fitted too.
    Registration motion(const Picture& picture, bool turns, const Eigen::Vector4d& guess) const;
    // Number of edge taxels.
    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(edges_.size()); }

    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();  // sum over the edge taxels of the products of their slopes
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();  // column and row, mean of the edge taxels
    double reach = 1;                                  // taxels from middle, within which most of them lie

 private:
    struct Edge {
        Eigen::Vector2d place;   // column and row, from middle
        double value;            // of the image there
        Eigen::Vector4d slopes;  // by a shift along columns and rows, by a turn times reach, by growth along the normals
    };
    std::vector<Edge> edges_;
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
    double noise = 0;                // m, of a position
    double speed = 0, sigma = 0;     // m/s, of the contact's middle and edges together, and the standard deviation of each
    double lasting = 0;              // s, of the steady motion
    std::ptrdiff_t used = 1;         // its frames
};

// The path of an object: its pose in the last frames.
class Path {
 public:
    explicit Path(const PathRule& rule) : rule_(rule) {}
    // Drop all frames.
    void reset();
    // The motion after a frame at time with a pose. arm: m, of the contact's middle; reach: m, of its edges from there.
    PathMotion add(double time, const Eigen::Vector3d& pose, const Eigen::Vector2d& arm, double reach);

 private:
    struct Frame {
        double time;
        Eigen::Vector3d pose;
    };
    PathRule rule_;
    std::vector<Frame> past_;
};

}  // namespace tactile::taxel
