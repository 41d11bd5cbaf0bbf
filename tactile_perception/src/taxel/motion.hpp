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

constexpr double CENTROID_SIGMA = 0.3;  // taxels, of the centroid of few of them, as pressure shifts without motion

}  // namespace tactile::taxel
