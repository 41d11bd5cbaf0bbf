// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "force_taxels/skin.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "force_taxels/constants.hpp"

namespace tactile::force_taxels {

namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

double cross(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

// Numbers of the points of a convex hull, counterclockwise: Andrew's monotone chain.
std::vector<std::size_t> hull_of(const std::vector<Vector2d>& points) {
    std::vector<std::size_t> order(points.size()), hull;
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return points[a].x() != points[b].x() ? points[a].x() < points[b].x() : points[a].y() < points[b].y();
    });
    for (int side = 0; side < 2; ++side) {
        const std::size_t first = hull.size();
        for (const std::size_t next : order) {
            while (hull.size() >= first + 2 && cross(points[hull[hull.size() - 2]], points[hull.back()], points[next]) <= 0) hull.pop_back();
            hull.push_back(next);
        }
        hull.pop_back();  // the other side begins with it
        std::reverse(order.begin(), order.end());
    }
    return hull;
}

}  // namespace

std::vector<std::uint8_t> Skin::touched(const double* press, const double* probability) const {
    std::vector<std::uint8_t> found(count());
    for (std::ptrdiff_t k = 0; k < count(); ++k) {
        double carried = press[k];
        for (std::ptrdiff_t j = 0; j < width(); ++j) carried = std::max(carried, press[around(k)[j]]);
        found[k] = probability[k] > 0.5 && press[k] > TAXEL.carried * carried;
    }
    return found;
}

std::vector<std::uint8_t> Skin::beside(const std::uint8_t* mask) const {
    std::vector<std::uint8_t> found(mask, mask + count());
    for (std::ptrdiff_t k = 0; k < count(); ++k)
        for (std::ptrdiff_t j = 0; j < width(); ++j) found[k] = found[k] || mask[around(k)[j]];
    return found;
}

std::vector<std::int64_t> Skin::labelled(const std::uint8_t* touched) const {
    std::vector<std::int64_t> label(count(), 0);
    std::vector<std::ptrdiff_t> open;
    for (std::ptrdiff_t first = 0; first < count(); ++first) {
        if (!touched[first] || label[first]) continue;
        label[first] = first + 1;
        open.assign(1, first);
        while (!open.empty()) {
            const std::int64_t* next = around(open.back());
            open.pop_back();
            for (std::ptrdiff_t j = 0; j < width(); ++j)
                if (touched[next[j]] && !label[next[j]]) label[next[j]] = first + 1, open.push_back(next[j]);
        }
    }
    return label;
}

Touches Skin::contacts(const double* components, const double* variance, const std::uint8_t* touched) const {
    Touches found;
    found.labels = labelled(touched);
    std::vector<std::ptrdiff_t> all, members;
    for (std::ptrdiff_t k = 0; k < count(); ++k)
        if (touched[k]) all.push_back(k);
    if (all.empty()) return found;
    for (const std::ptrdiff_t first : all) {
        if (found.labels[first] != first + 1) continue;  // not the first of its group
        members.clear();
        for (const std::ptrdiff_t k : all)
            if (found.labels[k] == first + 1) members.push_back(k);
        Touch& one = found.each.emplace_back(summed(members, components, variance));
        one.label = static_cast<int>(first + 1);
        one.outline = outline(members, one.normal);
    }
    found.all = summed(all, components, variance);
    return found;
}

Touch Skin::summed(const std::vector<std::ptrdiff_t>& members, const double* components, const double* variance) const {
    Touch one;
    one.count = static_cast<int>(members.size());
    double total = 0, squares = 0;
    for (const std::ptrdiff_t k : members) {
        const Map<const Vector3d> parts(components + 3 * k);
        const Vector3d position = shape_.positions.row(k), normal = shape_.normals.row(k);
        total += parts[2];
        squares += parts[2] * parts[2];
        one.position += parts[2] * position;
        one.normal += parts[2] * normal;
        one.force += shape_.axes.middleRows<3>(3 * k).transpose() * parts;
        one.normals += normal;
        one.positions += position;
        one.squares += Vector3d(position.x() * position.x(), position.x() * position.y(), position.y() * position.y());
    }
    one.position /= total;
    one.normal.normalize();
    for (const std::ptrdiff_t k : members) {
        const Vector3d away = shape_.positions.row(k).transpose() - one.position;
        one.covariance += variance[3 * k + 2] / (total * total) * away * away.transpose();
    }
    one.covariance += TAXEL.position_variance * shape_.pitch * shape_.pitch * squares / (total * total) *
                      (Matrix3d::Identity() - one.normal * one.normal.transpose());
    return one;
}

std::vector<double> Skin::outline(const std::vector<std::ptrdiff_t>& members, const Vector3d& normal) const {
    Vector3d first = shape_.axes.row(3 * members[0]);
    first = (first - first.dot(normal) * normal).normalized();
    const Vector3d second = normal.cross(first);
    std::vector<Vector3d> corners;
    std::vector<Vector2d> flat;
    for (const std::ptrdiff_t k : members)
        for (const auto& [x, y] : {std::array{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
            const Vector3d away = x * shape_.axes.row(3 * k) + y * shape_.axes.row(3 * k + 1);
            corners.push_back(shape_.positions.row(k).transpose() + shape_.pitch * away);
            flat.emplace_back(corners.back().dot(first), corners.back().dot(second));
        }
    std::vector<double> found;
    for (const std::size_t k : hull_of(flat)) found.insert(found.end(), corners[k].data(), corners[k].data() + 3);
    return found;
}

std::pair<Wrench, WrenchCovariance> Skin::wrench(const double* components, const double* variance, const std::uint8_t* touched,
                                                 const std::uint8_t* alive, double error) const {
    const auto bears = beside(touched);
    std::pair<Wrench, WrenchCovariance> found{Wrench::Zero(), WrenchCovariance::Zero()};
    auto& [total, covariance] = found;
    double squares = 0;
    for (std::ptrdiff_t k = 0; k < count(); ++k) {
        Vector3d force = Vector3d::Zero(), uncertain = Map<const Vector3d>(variance + 3 * k);
        if (alive[k] && bears[k]) {
            force = Map<const Vector3d>(components + 3 * k);
            if (!touched[k]) {
                // What the elastomer carries over, of which this is known before it is measured: its size.
                double carried = 0;
                for (std::ptrdiff_t j = 0; j < width(); ++j)
                    if (const std::int64_t next = around(k)[j]; touched[next])
                        carried = std::max(carried, TAXEL.carried * TAXEL.carried *
                                                        Map<const Vector3d>(components + 3 * next).squaredNorm());
                const Eigen::Array3d gain = carried / (carried + uncertain.array().max(TAXEL.no_force));
                force.array() *= gain, uncertain.array() *= gain;
            }
            squares += force.squaredNorm();
            uncertain.array() += error * error * force.squaredNorm();
        }
        if (!alive[k]) {
            // The mean of the neighbours, from which it is as different as they are from nothing.
            int known = 0;
            double power = 0;
            for (std::ptrdiff_t j = 0; j < width(); ++j)
                if (const std::int64_t next = around(k)[j]; next != k && alive[next] && bears[next]) {
                    const Map<const Vector3d> near(components + 3 * next);
                    force += near, power += near.squaredNorm();
                }
            for (std::ptrdiff_t j = 0; j < width(); ++j) known += around(k)[j] != k && alive[around(k)[j]];
            force /= std::max(known, 1);
            uncertain.setConstant(power / std::max(known, 1));
        }
        const Vector3d position = shape_.positions.row(k);
        for (int axis = 0; axis < 3; ++axis) {
            const Vector3d along = shape_.axes.row(3 * k + axis);
            Wrench effect;
            effect << along, position.cross(along);
            total += force[axis] * effect;
            if (uncertain[axis] > 0) covariance.noalias() += uncertain[axis] * effect * effect.transpose();
        }
    }
    // The force is somewhere within the taxel's cell.
    covariance.bottomRightCorner<3, 3>() += Matrix3d::Identity() * (TAXEL.position_variance * shape_.pitch * shape_.pitch * squares);
    return found;
}

}  // namespace tactile::force_taxels
