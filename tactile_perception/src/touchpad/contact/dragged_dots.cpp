// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/dragged_dots.hpp"

#include <algorithm>
#include <cmath>

#include "common/median.hpp"

namespace tactile {
namespace {

constexpr double TIGHT = 0.15;   // of the tolerance: dots that stick move with their object within that; chosen
constexpr double BACK = 0.7;     // mean cosine between their motions and -drags from which dots spring back; chosen
constexpr double LAG = 0.4;      // of the tolerance: standard deviation of a sticking dot's lag behind its object; chosen
constexpr double LOOSE = 1e-3;   // weight of a twist, in dots, that is kept where nothing else tells; chosen
constexpr double ONE_WAY = 0.5;  // of the sum of the drags' lengths: drags with a smaller sum are those of a turn; chosen
constexpr double LOADED = 0.65;  // of the friction coefficient: ratio from which dots may slip grossly; chosen

}  // namespace

DraggedDots::DraggedDots(Grid grid, const FrameBefore& last, const TouchedFrame& now, const Dots& dots, const double* origin,
                         const TouchingObject& thing, const std::vector<std::uint8_t>& touched, const StickSlipMemory& memory)
    : grid_(grid),
      now_(now),
      dots_(dots),
      count_(static_cast<std::ptrdiff_t>(dots.size())),
      normals_(gathered(now.normals, dots)),
      motions_(gathered(last.places, dots).data(), gathered(now.places, dots).data(), normals_.data(), count_, origin,
               std::hypot(memory.noise, LAG * memory.tolerance), memory.depth_noise),
      memory_(memory) {
    if (!thing.moves) {
        expected_ = lowered();
    } else {
        const Vec3 turn{thing.twist[3], thing.twist[4], thing.twist[5]}, shift = cross(turn, motions_.centre() - thing.centre);
        expected_ = thing.twist;
        expected_[0] += shift.x, expected_[1] += shift.y, expected_[2] += shift.z;
        if (!in_touch(expected_)) expected_ = constrained_to_normals(expected_);
    }
    find_friction(touched, thing.moves);
}

Twist DraggedDots::fit(const Twist* start, const std::vector<double>& grip, double coarse, double hold) const {
    return motions_.fit_robust(start, drag_.data(), grip.data(), coarse, memory_.tolerance, hold);
}

Twist DraggedDots::constrained_to_normals(const Twist& twist) const {
    const std::vector<double> none(3 * count_);
    return motions_.fit_robust(&twist, none.data(), none.data(), 1, 1, LOOSE);
}

Twist DraggedDots::lowered() const {
    double product = 0, square = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) {
        const double upright = vec3_at(normals_.data(), i).z;
        product += upright * motions_.normal_residual(i, {}), square += upright * upright;
    }
    return {0, 0, square > 0 ? product / square : 0, 0, 0, 0};
}

bool DraggedDots::in_touch(const Twist& twist) const {
    std::vector<double> off(count_), size(count_);
    for (std::ptrdiff_t i = 0; i < count_; ++i) off[i] = motions_.normal_residual(i, twist), size[i] = std::abs(off[i]);
    return std::abs(median_with_unknown(off)) < 2 * memory_.depth_noise && median_with_unknown(size) < 3 * memory_.depth_noise;
}

Vec3 DraggedDots::sliding_direction(std::ptrdiff_t i) const {
    const Vec3 up = vec3_at(normals_.data(), i), lag = -1.0 * motions_.residual(i, expected_), across = lag - dot(lag, up) * up;
    const double size = length(across);
    return size > memory_.tolerance / 2 ? 1 / size * across : Vec3{0, 0, 0};
}

void DraggedDots::find_friction(const std::vector<std::uint8_t>& touched, bool expected) {
    std::vector<double> normal(grid_.size()), along(grid_.size());
    std::vector<Vec3> pull(grid_.size(), Vec3{0, 0, 0}), direction(count_, Vec3{0, 0, 0});
    for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) {
        if (!touched[k]) continue;
        const Vec3 force = vec3_at(now_.force, k), up = vec3_at(now_.normals, k);
        normal[k] = -dot(force, up);
        pull[k] = force + normal[k] * up;
    }
    for (std::ptrdiff_t i = 0; expected && i < count_; ++i) {
        direction[i] = sliding_direction(i);
        along[dots_[i]] = dot(pull[dots_[i]], direction[i]);
    }
    ratio_.resize(count_), drag_.resize(3 * count_);
    for (std::ptrdiff_t i = 0; i < count_; ++i) {
        double carried = 0, slid = 0;
        Vec3 sum{0, 0, 0};
        around(grid_, dots_[i], [&](std::ptrdiff_t k) { carried += normal[k], slid += along[k], sum = sum + pull[k]; });
        const bool told = direction[i].x != 0 || direction[i].y != 0 || direction[i].z != 0;
        ratio_[i] = (told ? slid : length(sum)) / std::max(carried, 1e-9);
        store(drag_.data(), i, sum);
    }
}

bool DraggedDots::turns() const {
    double sum = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) sum += length(drag(i));
    return length(whole_drag()) < ONE_WAY * sum;
}

Vec3 DraggedDots::whole_drag() const {
    Vec3 sum{0, 0, 0};
    for (std::ptrdiff_t i = 0; i < count_; ++i) sum = sum + drag(i);
    return sum;
}

double DraggedDots::along_drag(Vec3 motion) const {
    const Vec3 drag = whole_drag();
    return dot(motion, drag) / std::max(length(drag), 1e-12);
}

double DraggedDots::moved_along_drags(const Twist& twist) const {
    double sum = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) sum += dot(motions_.residual(i, twist), drag(i)) / std::max(length(drag(i)), 1e-12);
    return sum;
}

bool DraggedDots::spring_back() const {
    const double size = mean_size({}) + 1e-12;
    return moved_along_drags({}) < -BACK * size * static_cast<double>(count_) && size > slip_limit();
}

double DraggedDots::held(const Twist& twist) const {
    double count = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) count += length(motions_.residual(i, twist)) < TIGHT * memory_.tolerance;
    return count < 4 ? 0 : count;
}

double DraggedDots::following(const Twist& twist) const {
    double count = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) count += length(motions_.residual(i, twist)) < 1.3 * memory_.tolerance;
    return count;
}

double DraggedDots::mean_size(const Twist& twist) const {
    double sum = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) sum += length(motions_.residual(i, twist));
    return sum / static_cast<double>(count_);
}

Vec3 DraggedDots::mean_residual(const Twist& twist) const {
    Vec3 sum{0, 0, 0};
    for (std::ptrdiff_t i = 0; i < count_; ++i) sum = sum + motions_.residual(i, twist);
    return 1.0 / static_cast<double>(count_) * sum;
}

bool DraggedDots::loaded(const TouchingObject& thing) const {
    return !(thing.friction > 0) || median_with_unknown(ratio_) > LOADED * thing.friction;
}

double DraggedDots::lag_along_drag() const {
    return -moved_along_drags(expected_) / ((mean_size(expected_) + 1e-12) * static_cast<double>(count_));
}

}  // namespace tactile
