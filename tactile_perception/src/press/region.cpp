// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/region.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tactile {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr int CORNERS = 36;  // of a circle, numeric: 0.5 % less area than the disc

// Two unit vectors across a unit normal and each other; with the normal they are a right-handed frame.
Eigen::Matrix<double, 2, 3> tangents(const Vector3d& normal) {
    Eigen::Index smallest;
    normal.cwiseAbs().minCoeff(&smallest);
    const Vector3d first = (Vector3d::Unit(smallest) - normal[smallest] * normal).normalized();
    Eigen::Matrix<double, 2, 3> found;
    found << first.transpose(), normal.cross(first).transpose();
    return found;
}

}  // namespace

double contact_radius(double depth, double tip_radius, double clearance, double max_ratio) {
    const double largest = std::max(std::min(max_ratio * tip_radius, clearance), 1e-9);
    double low = 0, high = largest;
    while (true) {  // the depth rises with the radius
        const double middle = 0.5 * (low + high);
        if (!(low < middle && middle < high)) return high;
        const double found = middle * middle / tip_radius * (0.5 + std::log(std::max(clearance, 1e-9) / middle));
        (found < depth ? low : high) = middle;
    }
}

ContactDisc::ContactDisc(const MarkerSurface& surface, const Vector3d& lowest, double depth, double tip_radius, double max_ratio) {
    const double bend = surface.curvature();  // a convex skin separates from the tip sooner
    radius = contact_radius(depth, 1 / (1 / tip_radius + bend), surface.clearance(lowest.head<2>()), max_ratio);
    normal = surface.normal(lowest.head<2>() / (1 + tip_radius * bend));
    centre = lowest + tip_radius * Vector3d::UnitZ() - std::sqrt(std::max(tip_radius * tip_radius - radius * radius, 0.0)) * normal;
}

PressRegion press_region(const MarkerSurface& surface, const std::vector<ContactDisc>& discs, const Rows2& positions,
                         const Rows3& camera_centre) {
    PressRegion region;
    region.under.resize(positions.rows());
    region.corners.resize(CORNERS * static_cast<Eigen::Index>(discs.size()), 3);
    region.centroid.setZero(), region.normal.setZero();
    Eigen::Index corner = 0;
    for (const ContactDisc& disc : discs) {
        for (Eigen::Index k = 0; k < positions.rows(); ++k) {
            const Vector3d centre = camera_centre.row(k);
            const double share = (surface.plane_z() - centre[2]) / (disc.centre[2] - centre[2]);  // as seen in the viewing plane
            const Vector2d aside = positions.row(k).transpose() - centre.head<2>() - share * (disc.centre - centre).head<2>();
            region.under[k] |= aside.norm() <= disc.radius;
        }
        const Eigen::Matrix<double, 2, 3> across = tangents(disc.normal);
        for (int k = 0; k < CORNERS; ++k) {
            const double angle = k * 2 * M_PI / CORNERS;
            region.corners.row(corner++) =
                disc.centre.transpose() + disc.radius * (std::cos(angle) * across.row(0) + std::sin(angle) * across.row(1));
        }
        const double area = M_PI * disc.radius * disc.radius;
        region.area += area, region.centroid += area * disc.centre, region.normal += area * disc.normal;
    }
    region.centroid /= region.area, region.normal.normalize();
    region.diameter = discs.size() == 1 ? 2 * discs[0].radius : NAN;
    return region;
}

}  // namespace tactile
