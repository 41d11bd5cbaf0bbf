// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Taxels on flat and curved patches: which of them touch, their contacts and the total wrench. Vectors of a taxel are (N, 3) in rows: two
// tangential components and the pressing one.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/fields.hpp"

namespace tactile::force_taxels {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Wrench = Eigen::Matrix<double, 6, 1>;
using WrenchCovariance = Eigen::Matrix<double, 6, 6>;

// Where taxels are.
struct SkinShape {
    Rows positions, normals;               // m; unit vectors out of the sensor
    Rows axes;                             // three rows a taxel: two tangents and the inward normal
    std::vector<std::int64_t> neighbours;  // as many a taxel, filled up with itself
    double pitch;                          // m
};

// Connected taxels that press.
struct Touch {
    int label = 0;                                                 // of its taxels
    int count = 0;                                                 // of its taxels
    Eigen::Vector3d position = Eigen::Vector3d::Zero();            // m, centre of pressure
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();              // mean, weighted by pressure, of unit length
    Eigen::Vector3d force = Eigen::Vector3d::Zero();               // of the object, in the unit of the components
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();          // m^2, of the position
    Eigen::Vector3d normals = Eigen::Vector3d::Zero();             // sum
    Eigen::Vector3d positions = Eigen::Vector3d::Zero();           // m, sum
    Eigen::Vector3d squares = Eigen::Vector3d::Zero();             // m^2, sums of xx, xy and yy
    std::vector<double> outline;                                   // (M, 3) m, convex hull of its cells seen along the normal
    TACTILE_FIELDS(label, count, position, normal, force, covariance, normals, positions, squares, outline)
};

struct Touches {
    std::vector<Touch> each;
    Touch all;                         // of all taxels that touch
    std::vector<std::int64_t> labels;  // (N), 0 outside
    TACTILE_FIELDS(each, all, labels)
};

class Skin {
 public:
    explicit Skin(SkinShape shape) : shape_(std::move(shape)) {}
    std::ptrdiff_t count() const { return shape_.positions.rows(); }
    // Taxels (N) that bear the object: more likely than not, and more than what the elastomer carries over from a neighbour.
    std::vector<std::uint8_t> touched(const double* press, const double* probability) const;
    // Taxels (N) with a neighbour in a mask, and those in it.
    std::vector<std::uint8_t> beside(const std::uint8_t* mask) const;
    // Contacts of the taxels that touch; variance: of components.
    Touches contacts(const double* components, const double* variance, const std::uint8_t* touched) const;
    // Wrench at the origin, N and N m, and its covariance. error: relative standard deviation of the force of a taxel.
    std::pair<Wrench, WrenchCovariance> wrench(const double* components, const double* variance, const std::uint8_t* touched,
                                               const std::uint8_t* alive, double error) const;

 private:
    std::ptrdiff_t width() const { return static_cast<std::ptrdiff_t>(shape_.neighbours.size()) / std::max<std::ptrdiff_t>(count(), 1); }
    const std::int64_t* around(std::ptrdiff_t taxel) const { return shape_.neighbours.data() + taxel * width(); }
    std::vector<std::int64_t> labelled(const std::uint8_t* touched) const;
    Touch summed(const std::vector<std::ptrdiff_t>& members, const double* components, const double* variance) const;
    std::vector<double> outline(const std::vector<std::ptrdiff_t>& members, const Eigen::Vector3d& normal) const;

    SkinShape shape_;
};

}  // namespace tactile::force_taxels
