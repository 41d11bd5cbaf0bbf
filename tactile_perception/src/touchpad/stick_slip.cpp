// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/stick_slip.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/grid.hpp"
#include "common/median.hpp"
#include "touchpad/object_motion.hpp"

namespace tactile {
namespace {

using Eigen::Vector3d;

constexpr double FIRST_NOISE = 2e-6;                                   // m, across the ray, before it is measured
constexpr double NOISE_QUANTILE = 0.2, NOISE_QUANTILE_SIGMAS = 0.668;  // of the motions, and its value in standard deviations (Rayleigh)
constexpr double SMOOTHING = 0.2;                                      // weight of a new value in the running mean of the noise
constexpr double BORDER_SCORE = 0.5;                                   // score of the border of a contact
constexpr double SLIP_PROBABILITY = 2.0 / 3;                           // from which slip is reported: twice that of no slip
// A sliding object is assumed to keep its velocity for MAX_EXTRAPOLATION, s, if its rotation and its motion along the axis are at most
// these shares of its speed.
constexpr double MAX_EXTRAPOLATION = 1.0, MAX_ROTATION_SHARE = 0.1, MAX_AXIAL_SHARE = 0.3;
constexpr double MAX_RISE_SPEED = 1e-3;    // m/s; a faster object is being lifted: its dots spring back, and do not show its motion
constexpr double MIN_DOTS_FOR_MOTION = 6;  // twice the three dots that determine a motion

using Dots = std::vector<std::ptrdiff_t>;

// Dots of each separate object, the largest first: touched dots (K) with up to one free dot between them belong together.
std::vector<Dots> separate_objects(Grid grid, const std::vector<std::uint8_t>& touched) {
    std::vector<std::uint8_t> wide(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!touched[k]) continue;
        for (std::ptrdiff_t row = k / grid.columns; row <= std::min(k / grid.columns + 1, grid.rows - 1); ++row) {
            for (std::ptrdiff_t c = k % grid.columns; c <= std::min(k % grid.columns + 1, grid.columns - 1); ++c)
                wide[row * grid.columns + c] = 1;
        }
    }
    std::vector<std::int32_t> label;
    std::vector<Dots> objects(components(wide.data(), grid.rows, grid.columns, true, label).size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (touched[k]) objects[label[k] - 1].push_back(k);
    }
    std::stable_sort(objects.begin(), objects.end(), [](const Dots& a, const Dots& b) { return a.size() > b.size(); });
    return objects;
}

// Probabilities of the modes after seconds, if an object changes from one mode to each other one at that rate.
std::array<double, MODES> expected_odds(std::array<double, MODES> odds, double rate, double seconds) {
    const double leaves = -std::expm1(-(MODES - 1) * rate * seconds);
    for (double& one : odds) one += leaves * ((1 - one) / (MODES - 1) - one);
    return odds;
}

constexpr double BORDER_NOISE = 0.2;     // pitches, standard deviation of the network's distances, on random scenes (docs/stick_slip.md)
constexpr double SURE_BUT_WRONG = 0.06;  // share of the dots whose state is wrong although the model is certain, on the same scenes

// Probability of a dot's state. score: half its distance from the border, pitches, plus 1/2; slipping: probability, given that it touches.
double state_confidence(double score, std::uint8_t state, double slipping) {
    const double reported = 0.5 + 0.5 * std::erf(std::abs(2 * score - 1) / BORDER_NOISE / std::sqrt(2.0));
    if (state == FREE) return reported;
    const double slips = SURE_BUT_WRONG + (1 - 2 * SURE_BUT_WRONG) * slipping;
    return reported * (state == SLIPPING ? slips : 1 - slips);
}

}  // namespace

StickSlip::StickSlip(Grid grid, Vector3d origin, StickSlipModel model)
    : grid_(grid),
      origin_(std::move(origin)),
      model_(model),
      noise_(FIRST_NOISE),
      friction_(std::log(model.friction)),
      friction_variance_(model.friction_spread * model.friction_spread),
      held_(grid.size()),
      last_xyz_(3 * grid.size()),
      moved_(3 * grid.size()),
      slipping_(grid.size(), NAN),
      confidence_(grid.size(), NAN),
      last_seen_(grid.size()) {}

Twist TouchingObject::held_twist() const {
    Mode mode = HELD;
    for (const Mode other : {IN_PART, AT_REST}) mode = odds[other] > odds[mode] ? other : mode;
    if (count * (1 - slipping[mode]) < MIN_DOTS_FOR_MOTION) return Twist::Constant(NAN);
    return twist[mode];
}

double StickSlip::friction() const {
    return std::exp(friction_);
}

std::vector<std::uint8_t> StickSlip::update(const DotLoads& loads, const std::vector<double>& score, double seconds) {
    std::vector<std::uint8_t> touched(grid_.size()), states(grid_.size());
    for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) touched[k] = score[k] > BORDER_SCORE, states[k] = touched[k] ? STICKING : FREE;
    slipping_.assign(grid_.size(), NAN);
    std::vector<TouchingObject> objects;
    std::vector<int> held(grid_.size());
    for (const Dots& dots : separate_objects(grid_, touched)) {
        TouchingObject object = continued(dots);
        Dots common;
        for (const std::ptrdiff_t k : dots) {
            held[k] = static_cast<int>(objects.size()) + 1;
            if (loads.seen[k] && last_seen_[k] && held_[k] > 0) common.push_back(k);
        }
        if (!common.empty() && seconds > 0) {
            const std::array<double, MODES> odds = expected_odds(object.odds, model_.rate, seconds);
            const ObjectMotion motion(model_, grid_, loads, {last_xyz_, seconds, touched, noise_, origin_}, common, object);
            const std::vector<double> slips = motion.explain(object, odds);
            for (std::size_t i = 0; i < common.size(); ++i) {
                slipping_[common[i]] = slips[i];
                states[common[i]] = slips[i] > SLIP_PROBABILITY ? SLIPPING : STICKING;
            }
            object.adrift = object.slides() ? object.adrift + seconds : 0;
            friction_ = object.friction, friction_variance_ = object.friction_variance;
        }
        objects.push_back(object);
    }
    for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) confidence_[k] = state_confidence(score[k], states[k], slipping_[k]);
    if (objects.empty() && objects_.empty()) measure_noise(loads);
    for (std::size_t k = 0; k < moved_.size(); ++k) moved_[k] = loads.xyz[k] - last_xyz_[k];
    objects_ = std::move(objects), held_ = std::move(held), seconds_ = seconds;
    last_xyz_ = loads.xyz, last_seen_ = loads.seen;
    return states;
}

// The object of the last frame that held most of these dots; a new object may have the friction of the last one.
TouchingObject StickSlip::continued(const std::vector<std::ptrdiff_t>& dots) const {
    std::vector<int> shared(objects_.size() + 1);
    for (const std::ptrdiff_t k : dots) ++shared[held_[k]];
    shared[0] = 0;
    const std::ptrdiff_t number = std::max_element(shared.begin(), shared.end()) - shared.begin();
    if (number) return objects_[number - 1];
    TouchingObject object;
    const double prior = model_.friction_spread * model_.friction_spread;
    object.friction = friction_, object.friction_variance = std::min(friction_variance_ + prior / 4, prior);
    return object;
}

// From a low quantile of the motions across the rays, because a contact below the detection limit moves many dots.
void StickSlip::measure_noise(const DotLoads& loads) {
    std::vector<double> sizes;
    for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) {
        if (!loads.seen[k] || !last_seen_[k]) continue;
        const Vector3d before = vector_at(last_xyz_, k), after = vector_at(loads.xyz, k), moved = after - before;
        const Vector3d ray = ((before + after) / 2 - origin_).normalized();
        sizes.push_back((moved - moved.dot(ray) * ray).norm());
    }
    if (sizes.empty()) return;
    const double here =
        smallest(sizes, static_cast<std::ptrdiff_t>(NOISE_QUANTILE * static_cast<double>(sizes.size()))) / NOISE_QUANTILE_SIGMAS;
    if (here > 0) noise_ += (here < noise_ ? SMOOTHING : SMOOTHING / 4) * (here - noise_);
}

std::vector<double> StickSlip::displacements() const {
    std::vector<double> found(2 * grid_.size(), NAN);
    for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) {
        if (!held_[k]) continue;
        const TouchingObject& object = objects_[held_[k] - 1];
        const Twist twist = object.slides() ? object.twist[SLIDING] : object.held_twist();
        const Vector3d middle = vector_at(last_xyz_, k) - vector_at(moved_, k) / 2, turned = twist.tail<3>().cross(middle - object.centre);
        const double speed = twist.head<2>().norm();
        const bool even = object.adrift <= MAX_EXTRAPOLATION && std::abs(twist[2]) <= MAX_AXIAL_SHARE * speed &&
                          turned.head<2>().norm() <= MAX_ROTATION_SHARE * speed;
        if (!(twist[2] < MAX_RISE_SPEED * seconds_) || (object.slides() && !even)) continue;
        const Vector3d displacement = twist.head<3>() + turned - vector_at(moved_, k);
        found[2 * k] = displacement.x(), found[2 * k + 1] = displacement.y();
    }
    return found;
}

std::optional<RigidMotion> StickSlip::motion() const {
    for (const TouchingObject& object : objects_) {
        const Twist twist = object.held_twist();
        if (object.slides() || !twist.allFinite()) continue;
        Eigen::Matrix3d half;  // Cayley's form: after - before = v + w x ((after + before) / 2 - centre)
        half << 0, -twist[5], twist[4], twist[5], 0, -twist[3], -twist[4], twist[3], 0;
        half /= 2;
        const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity(), back = (unit - half).inverse();
        return RigidMotion{back * (unit + half), back * (twist.head<3>() - 2 * half * object.centre)};
    }
    return {};
}

}  // namespace tactile
