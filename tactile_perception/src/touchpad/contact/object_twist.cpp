// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A camera measures a dot's motion across its ray to a micrometre and along it fifty times worse. Sticking dots follow the object across
// their rays; all dots in contact, sticking or slipping, follow it along the surface normal.
#include "touchpad/contact/object_twist.hpp"

#include <cmath>
#include <numeric>

#include "common/small_systems.hpp"

namespace tactile {
namespace {

constexpr double LEVER = 5e-3;  // m, distance at which rotation and translation weigh the same in the prior; chosen
// A dot whose residual points along its drag (cosine above the first) leads the object; its squared residual counts by the second; chosen.
constexpr double LEADS = 0.3, LEADING_WEIGHT = 0.04;
// Weight of the prior, in dots, that keeps a fit regular, and for turns, in sticking dots: a few dots do not tell a turn from slip. Chosen.
constexpr double RIDGE = 1e-4, TURN_RIDGE = 0.1;
constexpr double OFF = 3;      // standard deviations along the normal at which a dot loses half its weight; chosen
constexpr int ITERATIONS = 4;  // of reweighting; chosen

Vec3 motion_at(Vec3 offset, const Twist& twist) {
    return Vec3{twist[0], twist[1], twist[2]} + cross(Vec3{twist[3], twist[4], twist[5]}, offset);
}

// Row of the equation direction . motion = value: direction . v + (offset x direction) . w.
void fill_row(Vec3 direction, Vec3 offset, double* row) {
    const Vec3 turn = cross(offset, direction);
    store(row, 0, direction);
    store(row, 1, turn);
}

}  // namespace

DotMotions::DotMotions(const double* before, const double* after, const double* normals, std::ptrdiff_t count, const double* origin,
                       double across, double along)
    : count_(count), share_(across / along * (across / along)), along_(along) {
    for (std::ptrdiff_t i = 0; i < count; ++i) centre_ = centre_ + 1.0 / count * vec3_at(after, i);
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const Vec3 first = vec3_at(before, i), last = vec3_at(after, i), middle = 0.5 * (first + last);
        const Vec3 away = middle - vec3_at(origin, 0);
        ray_.push_back(1 / length(away) * away);
        moved_.push_back(last - first);
        offset_.push_back(middle - centre_);
        normal_.push_back(vec3_at(normals, i));
    }
}

Vec3 DotMotions::residual(std::ptrdiff_t dot_, const Twist& twist) const {
    const Vec3 left = moved_[dot_] - motion_at(offset_[dot_], twist);
    return left - dot(left, ray_[dot_]) * ray_[dot_];
}

double DotMotions::normal_residual(std::ptrdiff_t dot_, const Twist& twist) const {
    return dot(normal_[dot_], moved_[dot_] - motion_at(offset_[dot_], twist));
}

// Least squares: across the rays with weights carried, along the normals with weights touching; expected weighs as much as hold dots,
// no turn as turn dots.
Twist DotMotions::fit(const std::vector<double>& carried, const std::vector<double>& touching, const Twist& expected, double hold,
                      double turn) const {
    SmallSystem<6> system(0);
    double row[6];
    for (std::ptrdiff_t i = 0; i < count_; ++i) {
        const Vec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, across = moved_[i] - dot(moved_[i], ray_[i]) * ray_[i];
        for (const Vec3 axis : axes) {
            fill_row(axis - dot(axis, ray_[i]) * ray_[i], offset_[i], row);
            system.add(row, dot(axis, across), carried[i]);
        }
        fill_row(normal_[i], offset_[i], row);
        system.add(row, dot(normal_[i], moved_[i]), touching[i] * share_);
    }
    for (int j = 0; j < 6; ++j) {
        const double prior = j < 3 ? 1 : LEVER * LEVER;
        system.matrix[j][j] += (RIDGE + (j < 3 ? 0 : turn) + hold) * prior;
        system.right[j] += hold * prior * expected[j];
    }
    Twist found{};
    if (!system.solve(found.data())) found.fill(NAN);
    return found;
}

Twist DotMotions::fit_robust(const Twist* start, const double* drag, const double* weights, double coarse, double fine, double hold) const {
    const Twist expected = start ? *start : Twist{};
    std::vector<double> carried(weights, weights + count_), touching(count_, 1.0);
    if (!start) hold = 0;
    const double turn = TURN_RIDGE / static_cast<double>(count_) * std::accumulate(carried.begin(), carried.end(), 0.0);
    Twist twist = start ? *start : fit(carried, touching, expected, 0, turn);
    for (int narrowing = 0; narrowing < ITERATIONS; ++narrowing) {
        const double bound = coarse * std::pow(fine / coarse, narrowing / (ITERATIONS - 1.0));
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Vec3 left = residual(i, twist), pull = vec3_at(drag, i);
            const double size = length(left), along = dot(left, pull);
            const double square = size * size / (bound * bound) * (along > LEADS * length(pull) * size ? LEADING_WEIGHT : 1);
            const double off = normal_residual(i, twist) / (OFF * along_);
            carried[i] = weights[i] / ((1 + square) * (1 + square));
            touching[i] = 1 / (1 + off * off);
        }
        twist = fit(carried, touching, expected, hold, turn);
    }
    return twist;
}

}  // namespace tactile
