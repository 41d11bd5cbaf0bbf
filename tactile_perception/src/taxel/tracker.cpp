// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/tracker.hpp"

#include <algorithm>
#include <cmath>

#include "common/grid.hpp"
#include "taxel/constants.hpp"
#include "taxel/region.hpp"

namespace tactile::taxel {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double WHOLE = 1 + 1e-6;  // of a stretch: a frame at its beginning belongs to it
constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();

// Square of a deviation without the part that noise of this variance in each of its components has in it.
Matrix3d square_without(const Vector3d& deviation, double variance) {
    const double square = deviation.squaredNorm();
    return deviation * deviation.transpose() * std::max(0.0, 1 - 3 * variance / std::max(square, 1e-300));
}

std::ptrdiff_t count_of(const std::uint8_t* mask, std::ptrdiff_t size) {
    return std::count_if(mask, mask + size, [](std::uint8_t marked) { return marked != 0; });
}

}  // namespace

MotionTracker::MotionTracker(const ShearPad& pad, const MotionLimits& limits)
    : shear(pad),
      limits_(limits),
      watch_({limits.key_moved, limits.traction, limits.curved}),
      path_({TAXEL.window_s, limits.load_s, TAXEL.min_noise * pad.pitch, limits.bound}),
      middle_(0.5 * static_cast<double>(pad.columns - 1), 0.5 * static_cast<double>(pad.rows - 1)),
      blur_(std::max(TAXEL.image_width * pad.thickness, TAXEL.min_image_width)),
      few_(pad.thickness < 1 ? TAXEL.few_coarse : TAXEL.few_fine) {
    reset();
}

void MotionTracker::reset() {
    shear.reset(), watch_.reset(), path_.reset();
    traction_pressure.assign(shear.pad().rows * shear.pad().columns, 0);
    edges_.reset(), centroid_.reset(), last_.reset();
    for (Vector3d* one : {&pose_, &total_, &smooth_, &along_}) one->setZero();
    expected_.setZero(), lead.setZero(), arm_.setZero();
    loads_.clear();
    slip_fraction_ = 0, followed_ = 1;
    waited_ = moves_ = false;
    key_count_ = 1;
}

ObjectMotion MotionTracker::process(const PressedPad& frame, double stamp, bool can_roll) {
    const ShearPad& pad = shear.pad();
    const std::ptrdiff_t size = pad.rows * pad.columns;
    double load = 0;
    for (std::ptrdiff_t k = 0; k < size; ++k) load += frame.touched[k] ? frame.pressure[k] : 0;
    const std::ptrdiff_t count = count_of(frame.touched, size);
    const double mean = load / static_cast<double>(count);
    const auto force = shear.force();
    const Vector2d pulled = Vector2d(force[0], force[1]) / std::max(load * pad.pitch * pad.pitch, 1e-12);
    lead = TAXEL.border_lead * pad.thickness * pad.pitch * pulled;
    std::vector<float> image(frame.pressure, frame.pressure + size);
    if (count > few_) blur(image, pad.rows, pad.columns, blur_, Outside::replicated);
    const Now now{{image.data(), pad.rows, pad.columns, 0}, frame.touched, count, load, frame.sigma, count <= few_};
    if (now.few ? !centroid_ : !edges_) rekey(now);
    std::optional<KeyframeMotion> found = found_since_key(now);
    if (!found) {
        rekey(now);
        return unknown();
    }
    const bool varies = load_varies(load, stamp), waits = varies && !moved(*found, now);
    const Vector3d seen = since_pose(*found);
    if (waited_ && !varies) {
        rekey(now);
        found->fit.setZero(), found->turn *= 0;
    }
    waited_ = waits;
    const Vector3d by_centre = waits ? Vector3d(Vector3d::Zero()) : step_of(*found, mean);
    const Vector3d step = at_origin(by_centre);
    expected_ = found->fit + TAXEL.continued * (found->fit - (last_ ? last_->fit : Vector4d(Vector4d::Zero())));
    last_ = found;
    auto [smooth, path] = follow(step, at_origin(seen - by_centre), stamp);
    if (waits || !moves_) {
        watch_.rest(frame.seen, size, !waits, stamp);
    } else if (const Vector3d direction = along_of(path.velocity);
               can_roll && !now.few && std::abs(direction[2]) <= direction.head<2>().norm() &&
               watch_.follow(shear, frame.seen, frame.sigma, frame.touched, pulled, mean)) {
        smooth.setZero(), moves_ = false;
    }
    const std::vector<float> slip = shear.move(frame.touched, frame.pressure, {smooth[0], smooth[1], smooth[2]});
    traction_pressure = shear.traction_pressure();
    ObjectMotion motion{path.reported.head<2>(), path.reported[2], std::vector<std::uint8_t>(size), step.head<2>(), step[2],
                        unseen(*found),          pad.columns,     {},      {}};
    if (moves_) motion.slipping = lagging(slip, smooth, frame.touched);
    state_errors(*found, seen - by_centre, path, motion);
    const Vector3d direction = along_of(path.velocity);
    along_ = moves_ && direction.norm() > 0 ? Vector3d(direction / direction.norm()) : Vector3d(Vector3d::Zero());
    if (found->largest() > limits_.key_moved) {
        const Vector4d going = expected_ - found->fit;
        rekey(now);
        expected_ = going;
    }
    slip_fraction_ = static_cast<double>(count_of(motion.slipping.data(), size)) / static_cast<double>(count);
    if (std::isnan(found->turn)) motion.turn = UNKNOWN;
    if (found->blind) {
        motion.linear.setConstant(UNKNOWN), motion.step.setConstant(UNKNOWN), motion.step_turn = UNKNOWN;
        motion.step_covariance.setConstant(UNKNOWN), motion.velocity_covariance.setConstant(UNKNOWN);
    }
    return motion;
}

std::optional<KeyframeMotion> MotionTracker::found_since_key(const Now& now) const {
    Picture picture = now.picture;
    if (now.few) return centroid_->motion(picture, now.touched);
    picture.scale = static_cast<float>(scale(now.load));
    return edges_->motion(picture, expected_);
}

// The motion after a registration that failed.
ObjectMotion MotionTracker::unknown() {
    path_.reset();
    moves_ = false;
    const Vector2d nowhere = Vector2d::Constant(UNKNOWN);
    const Matrix3d any = Matrix3d::Constant(UNKNOWN);
    return {nowhere, UNKNOWN, std::vector<std::uint8_t>(shear.pad().rows * shear.pad().columns), nowhere, UNKNOWN, 1, shear.pad().columns,
            any,     any};
}

// Probability that an object that slips is not seen to, in the direction in which its position is known worst: that it is slower than what
// the registration would show within the longest stretch of a steady motion.
double MotionTracker::unseen(const KeyframeMotion& found) const {
    return found.blind ? 1 : -std::expm1(-TAXEL.wander_sigmas * found.sigma * shear.pad().pitch / (TAXEL.window_s * TAXEL.slip_speed));
}

// Whether the load varies, so that motion since the keyframe is estimated when it has settled: a new keyframe at each variation would add
// up the errors of those positions.
bool MotionTracker::load_varies(double load, double stamp) {
    while (!loads_.empty() && loads_.front().first < stamp - TAXEL.window_s * WHOLE) loads_.pop_front();
    loads_.emplace_back(stamp, load);
    return first_and_change(limits_.load_s).second > limits_.load_change;
}

// Whether the contact has shifted by more than a change of load can explain: a contact that grows on one side only shifts by half of what
// it grows, and grows by the other half.
bool MotionTracker::moved(const KeyframeMotion& found, const Now& now) const {
    if (now.few) return found.fit.head<2>().norm() > TAXEL.few_taxels_sigma;
    const double wanders = TAXEL.wander_sigmas * found.sigma + std::abs(found.fit[3]) + released(limits_.load_s) / shear.pad().pitch;
    return found.fit.head<2>().norm() > wanders;
}

// m, by which the picture moves as traction is let go by the change of the load over the last interval, s.
double MotionTracker::released(double interval) const {
    return lead.norm() * first_and_change(interval).second;
}

// The first load of the last interval, s, and the relative change of the load over it.
std::pair<double, double> MotionTracker::first_and_change(double interval) const {
    double first = loads_.back().second, least = first, most = 1e-9;
    for (auto at = loads_.rbegin(); at != loads_.rend() && at->first >= loads_.back().first - interval * WHOLE; ++at)
        first = at->second, least = std::min(least, first), most = std::max(most, first);
    return {first, 1 - least / most};
}

// m, m, rad of the picture, at the keyframe's centre, beyond what has been attributed to the object.
Vector3d MotionTracker::since_pose(const KeyframeMotion& found) const {
    const double pitch = shear.pad().pitch;
    return Vector3d(found.fit[0] * pitch, found.fit[1] * pitch, found.known_turn()) - pose_;
}

Vector3d MotionTracker::at_origin(const Vector3d& by_centre) const {
    return {by_centre[0] + by_centre[2] * arm_[1], by_centre[1] - by_centre[2] * arm_[0], by_centre[2]};
}

// Sets the covariances of a motion; rest: of the picture's motion, at the keyframe's centre, what is not attributed to the object.
void MotionTracker::state_errors(const KeyframeMotion& found, const Vector3d& rest, const PathMotion& path, ObjectMotion& motion) const {
    const double reach = reach_ * shear.pad().pitch, variance = std::pow(found.sigma * shear.pad().pitch, 2);
    const Vector3d paths(1, 1, reach);
    const Matrix3d whole = Matrix3d::Identity();
    const Vector3d hidden = rest.cwiseProduct(paths);
    motion.step_covariance = 2 * followed_ * followed_ * variance * whole + square_without(hidden, variance);
    // The object may follow the picture. A velocity that is reported as none may be one.
    const Vector3d carried = (1 / followed_ - (moves_ ? 1 : 0)) * along_of(path.reported) + along_of(path.hidden);
    const double noise = path.reported_sigma * path.reported_sigma;
    motion.velocity_covariance = noise * whole + square_without(carried, noise / (followed_ * followed_)) +
                                 square_without(along_of(path.bend), path.bend_sigma * path.bend_sigma);
    Matrix3d to_origin = Vector3d(1, 1, 1 / reach).asDiagonal();
    to_origin(0, 2) = arm_[1] / reach, to_origin(1, 2) = -arm_[0] / reach;
    for (Matrix3d* one : {&motion.step_covariance, &motion.velocity_covariance}) {
        *one = to_origin * *one * to_origin.transpose();
        if (std::isnan(found.turn)) one->row(2).setConstant(UNKNOWN), one->col(2).setConstant(UNKNOWN);
    }
}

// m, m, rad since the last frame, at the keyframe's centre, under a mean pressure, Pa. The pressure of the last frame's traction is already
// subtracted from the image; that of the new motion is corrected here.
Vector3d MotionTracker::step_of(const KeyframeMotion& found, double mean) {
    const ShearPad& pad = shear.pad();
    const double stiff = TAXEL.border_lead * pad.thickness * pad.pitch * pad.stiffness / std::max(mean, 1.0);
    const Vector3d moved = since_pose(found);
    // Where the object slips, traction is at its limit and changes its direction only.
    const Vector3d paths(1, 1, found.reach * pad.pitch);
    const Vector3d along = along_ * along_.dot(moved.cwiseProduct(paths));
    const Vector3d sliding = along.cwiseQuotient(paths);
    followed_ = 1 / (1 + stiff * (1 - slip_fraction_));
    const Vector3d step = (moved - sliding) / (1 + stiff) + sliding * followed_;
    pose_ += step;
    return step;
}

// The last motion at the origin (m, m, rad) without noise, and that of the path. step: with noise; rest: of the picture's motion, what is
// not attributed to the object.
std::pair<Vector3d, PathMotion> MotionTracker::follow(const Vector3d& step, const Vector3d& rest, double stamp) {
    total_ += step;
    const PathMotion found = path_.add(stamp, total_, rest, arm_, reach_ * shear.pad().pitch);
    moves_ = found.used > 1 && is_evident(found);
    const Vector3d smooth = found.pose - smooth_;
    smooth_ = found.pose;
    return {smooth, found};
}

// Whether the path is a motion of the object. It begins by a displacement longer than the registration's own error, by which pressure
// wanders without motion, and than that of the traction that a load lets go.
bool MotionTracker::is_evident(const PathMotion& path) const {
    const double pitch = shear.pad().pitch;
    if (path.speed <= limits_.begins * path.sigma + limits_.creep * pitch) return false;
    const double wanders = moves_ ? 0 : TAXEL.wander_sigmas * last_->sigma * pitch;
    return path.speed * path.duration > (wanders + released(path.duration)) * followed_;
}

// m/s of the keyframe's centre, and of its edges by the turn, for a velocity at the origin.
Vector3d MotionTracker::along_of(const Vector3d& velocity) const {
    const double turn = velocity[2];
    return {velocity[0] - turn * arm_[1], velocity[1] + turn * arm_[0], turn * reach_ * shear.pad().pitch};
}

// Where the pad's surface lagged by slip (2, rows, columns), m, behind the object's step.
std::vector<std::uint8_t> MotionTracker::lagging(const std::vector<float>& slip, const Vector3d& step, const std::uint8_t* touched) const {
    const ShearPad& pad = shear.pad();
    const std::ptrdiff_t plane = pad.rows * pad.columns;
    std::vector<std::uint8_t> found(plane);
    for (std::ptrdiff_t k = 0; k < plane; ++k) {
        if (!touched[k]) continue;
        const double x = step[0] - step[2] * taxel_y(k / pad.columns), y = step[1] + step[2] * taxel_x(k % pad.columns);
        const double lag = slip[k] * slip[k] + slip[plane + k] * slip[plane + k];
        found[k] = lag > limits_.lag * limits_.lag * (x * x + y * y);
    }
    return found;
}

void MotionTracker::rekey(const Now& now) {
    key_count_ = now.count, waited_ = false;
    Picture picture = now.picture;
    picture.scale = static_cast<float>(scale(now.load));
    edges_.reset(), centroid_.reset();
    if (now.few) {
        centroid_.emplace(picture, now.touched);
    } else {
        const double noise = now.sigma * scale(now.load) / (std::sqrt(8 * M_PI) * (blur_ * blur_ + TAXEL.spline_variance));  // of a slope
        edges_.emplace(picture, std::max(limits_.edge, TAXEL.edge_sigmas * noise));
    }
    reach_ = now.few ? 1 : edges_->reach;
    arm_ = ((now.few ? centroid_->middle : edges_->middle) - middle_) * shear.pad().pitch;
    last_.reset();
    expected_.setZero(), pose_.setZero();
}

// 1/Pa that makes pressure an image: over that of the keyframe at this load, scaled as the score of a flat face. The level that is fitted
// for a contact's border varies by itself from frame to frame.
double MotionTracker::scale(double load) const {
    return LEVEL / TAXEL.border_share / std::max(load / static_cast<double>(key_count_), 1e-9);
}

}  // namespace tactile::taxel
