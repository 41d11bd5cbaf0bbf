// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
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
    double inliers = 0;   // share of the edge taxels whose residual the biweight keeps
};

// The edge taxels of an image, by which the motion to later images is found.
class Keyframe {
 public:
    // Edge taxels where the slope of the image exceeds steep, 1/taxel, none within rim of the border, of which about `most` are used.
    Keyframe(const Picture& picture, double steep, std::ptrdiff_t rim, std::ptrdiff_t most);
    // Fit of the edges' motion from a first guess; turns: whether a turn is fitted too.
    Registration motion(const Picture& picture, bool turns, const Eigen::Vector4d& guess) const;

    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();  // sum over all edge taxels of the products of their slopes
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();  // column and row, mean of all edge taxels
    double reach = 1;                                  // taxels from middle, within which most of them lie
    std::ptrdiff_t count = 0;                          // of all

 private:
    struct Edge {
        Eigen::Vector2d place;   // column and row, from middle
        double value;            // of the image there
        Eigen::Vector4d slopes;  // by a shift along columns and rows, by a turn times reach, by growth along the normals
    };
    std::vector<Edge> edges_;
};

}  // namespace tactile::taxel
