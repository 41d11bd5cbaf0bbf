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

namespace tactile {
namespace {

using Eigen::Vector3d;

// What decides, on simulated presses, drags, twists and impacts of blocks, discs, balls, rings and edges.
// Noise of the sensor: a camera measures a dot's motion across its ray to a micrometre and along it, or the normal, far worse.
constexpr double FIRST_NOISE = 2e-6;   // m, across the ray, before it is measured
constexpr double DEPTH_NOISE = 20e-6;  // m, along the normal
constexpr double CALMEST = 0.2, CALMEST_SIGMA = 0.668;  // quantile of the motions taken for noise, and its place in deviations (Rayleigh)
constexpr double SMOOTHING = 0.2;                       // weight of a new value in the running means of noise and friction
// Physics: how sticking dots move.
constexpr double TOLERANCE = 10e-6;      // m, most that a sticking dot lags behind its object in a frame: the skin creeps
constexpr double QUIET = 1.0 / 3;        // of the tolerance: dots that move less are at rest; a sixth of what dots below a sliding object move
constexpr double LEAST_FRICTION = 0.05;  // coefficient: smaller estimates are noise
constexpr double LOADED = 0.65;          // of the friction coefficient: ratio from which dots may slip grossly
// Priors.
constexpr double HALF = 0.5;              // score of the border of a contact
constexpr std::ptrdiff_t FEWEST = 2;      // dots that tell a motion, as turns are held back: those of a light touch
constexpr double MANY = 0.1;              // share of dots that must slip before all do, and of those whose agreement shows a motion
constexpr double ALL = 0.9;               // share of dots that move as one when an object that starts or stops holds them
constexpr double ALONG = 0.5;             // mean cosine between lags and drags from which dots slip grossly; half of it while they do
constexpr int REST_FRAMES = 3;            // with dots at rest before an object that slid rests
constexpr double LONGEST = 1.0;           // s, for which an object in gross slip is taken to move on as before
// Parts of its speed: largest motion of its dots as it turns, largest along the sensor's axis as it is not lifted, and smallest over dots
// that it does not take along.
constexpr double TURNS = 0.1, STEEP = 0.3, UNTAKEN = 0.3;
// The fit of a twist: distance at which rotation and translation weigh the same, m; weight of the prior in dots, and for turns in sticking
// dots; deviations along the normal at which a dot loses half its weight; rounds of reweighting; scale at first, in tolerances, of a fit
// from nothing and from the expected motion.
constexpr double LEVER = 5e-3, RIDGE = 1e-4, TURN_RIDGE = 0.1, OFF = 3, COARSE = 30, NEAR = 4;
constexpr int ROUNDS = 4;
// A dot whose residual points along its drag (cosine above the first) leads the object; its squared residual counts by the second.
constexpr double LEADS = 0.3, LEADING_WEIGHT = 0.04;

Vector3d vector_at(const std::vector<double>& array, std::ptrdiff_t k) {
    return Eigen::Map<const Vector3d>(array.data() + 3 * k);
}

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

}  // namespace

// Motions and tangential loads of those dots of one object that were in contact and seen in the last frame too, beside the motion that is
// expected of it. All numbers are m a frame, N, or shares.
class StickSlip::ObjectDots {
 public:
    ObjectDots(const StickSlip& known, const DotLoads& loads, const Dots& dots, const std::vector<std::uint8_t>& touched,
               const TouchingObject& object)
        : across_(std::hypot(known.noise_, 0.4 * TOLERANCE)), limit_(std::hypot(1.3 * TOLERANCE, 3 * known.noise_)) {
        for (const std::ptrdiff_t k : dots) centre_ += vector_at(loads.xyz, k) / static_cast<double>(dots.size());
        for (const std::ptrdiff_t k : dots) {
            const Vector3d before = vector_at(known.last_xyz_, k), after = vector_at(loads.xyz, k), middle = (before + after) / 2;
            ray_.push_back((middle - known.origin_).normalized());
            moved_.push_back(after - before);
            offset_.push_back(middle - centre_);
            normal_.push_back(vector_at(loads.normal, k));
        }
        expected_ = object.moves ? object.twist : lowered();
        if (object.moves) {
            expected_.head<3>() += Vector3d(object.twist.tail<3>()).cross(centre_ - object.centre);
            if (!in_touch(expected_)) expected_ = constrained_to_normals(expected_);
        }
        find_friction(known.grid_, loads, dots, touched, object.moves);
    }

    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(ray_.size()); }
    const Vector3d& centre() const { return centre_; }

    // Twist by which the object moves if it goes on as before, about the dots' centre; of a new one: along the sensor's axis.
    const Twist& expected() const { return expected_; }

    // Tangential over normal load of each dot, summed over 3 x 3 dots.
    const std::vector<double>& ratios() const { return ratio_; }

    // Lag behind the object above which a dot slips.
    double slip_limit() const { return limit_; }

    // What a dot's motion is beyond the twist's, across its ray.
    Vector3d residual(std::ptrdiff_t i, const Twist& twist) const {
        const Vector3d left = moved_[i] - twist.head<3>() - Vector3d(twist.tail<3>()).cross(offset_[i]);
        return left - left.dot(ray_[i]) * ray_[i];
    }

    // The motion that the dots share, each with its probability grip of sticking, the scale of the residuals reduced from coarse to the
    // tolerance. start: twist to begin with and prior that weighs hold dots, null: a fit to all dots. A dot that lags along its drag may slip
    // and loses its weight, one that leads cannot slip and keeps it.
    Twist fit(const Twist* start, const std::vector<double>& grip, double coarse, double hold) const {
        const Twist prior = start ? *start : Twist::Zero();
        std::vector<double> carried = grip, touching(count(), 1.0);
        double turn = 0;
        for (const double weight : grip) turn += TURN_RIDGE * weight / static_cast<double>(count());
        Twist twist = start ? prior : least_squares(carried, touching, prior, 0, turn);
        for (int round = 0; round < ROUNDS; ++round) {
            const double bound = coarse * std::pow(TOLERANCE / coarse, round / (ROUNDS - 1.0));
            for (std::ptrdiff_t i = 0; i < count(); ++i) {
                const Vector3d left = residual(i, twist);
                const double leads = left.dot(drag_[i]) > LEADS * drag_[i].norm() * left.norm() ? LEADING_WEIGHT : 1;
                const double square = left.squaredNorm() / (bound * bound) * leads, off = normal_residual(i, twist) / (OFF * DEPTH_NOISE);
                carried[i] = grip[i] / ((1 + square) * (1 + square));
                touching[i] = 1 / (1 + off * off);
            }
            twist = least_squares(carried, touching, prior, start ? hold : 0, turn);
        }
        return twist;
    }

    // Whether the dots follow the object along the normal, as all dots in contact must.
    bool in_touch(const Twist& twist) const {
        std::vector<double> off(count()), size(count());
        for (std::ptrdiff_t i = 0; i < count(); ++i) off[i] = normal_residual(i, twist), size[i] = std::abs(off[i]);
        return std::abs(median_with_unknown(off)) < 2 * DEPTH_NOISE && median_with_unknown(size) < 3 * DEPTH_NOISE;
    }

    // Dots that move with an object of this twist.
    double following(const Twist& twist) const {
        double found = 0;
        for (std::ptrdiff_t i = 0; i < count(); ++i) found += residual(i, twist).norm() < 1.3 * TOLERANCE;
        return found;
    }

    // Mean and root mean square of the sizes of the dots' motions beyond the twist's.
    double mean_size(const Twist& twist) const {
        double sum = 0;
        for (std::ptrdiff_t i = 0; i < count(); ++i) sum += residual(i, twist).norm();
        return sum / static_cast<double>(count());
    }
    double root_mean_square() const {
        double sum = 0;
        for (std::ptrdiff_t i = 0; i < count(); ++i) sum += residual(i, Twist::Zero()).squaredNorm();
        return std::sqrt(sum / static_cast<double>(count()));
    }

    // Whether the dots are dragged about as much as in earlier slip.
    bool loaded(const TouchingObject& object) const {
        return !(object.friction > 0) || median_with_unknown(ratio_) > LOADED * object.friction;
    }

    // Mean cosine, weighted by their size, between the dots' lags behind the expected motion and their drags.
    double lag_along_drag() const {
        double along = 0, size = 1e-12;
        for (std::ptrdiff_t i = 0; i < count(); ++i) {
            const Vector3d left = residual(i, expected_);
            along -= left.dot(drag_[i]) / std::max(drag_[i].norm(), 1e-12), size += left.norm();
        }
        return along / size;
    }

 private:
    double normal_residual(std::ptrdiff_t i, const Twist& twist) const {
        return normal_[i].dot(moved_[i] - twist.head<3>() - Vector3d(twist.tail<3>()).cross(offset_[i]));
    }

    // Across the rays with weights carried, along the normals with weights touching; the prior weighs as much as hold dots, no turn as turn
    // dots.
    Twist least_squares(const std::vector<double>& carried, const std::vector<double>& touching, const Twist& prior, double hold,
                        double turn) const {
        Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
        Twist right = Twist::Zero();
        const double share = across_ * across_ / (DEPTH_NOISE * DEPTH_NOISE);
        const auto add = [&](const Vector3d& direction, std::ptrdiff_t i, double weight) {
            Twist row;
            row << direction, offset_[i].cross(direction);
            matrix.noalias() += weight * row * row.transpose();
            right += weight * direction.dot(moved_[i]) * row;
        };
        for (std::ptrdiff_t i = 0; i < count(); ++i) {
            const Vector3d first = ray_[i].unitOrthogonal();
            add(first, i, carried[i]);
            add(ray_[i].cross(first), i, carried[i]);
            add(normal_[i], i, touching[i] * share);
        }
        for (int j = 0; j < 6; ++j) {
            const double unit = j < 3 ? 1 : LEVER * LEVER;
            matrix(j, j) += (RIDGE + (j < 3 ? 0 : turn) + hold) * unit;
            right[j] += hold * unit * prior[j];
        }
        const Eigen::LLT<Eigen::Matrix<double, 6, 6>> factor(matrix);
        return factor.info() == Eigen::Success ? Twist(factor.solve(right)) : Twist::Constant(NAN);
    }

    // twist with the components that move the surface along its normals fitted to the dots, the others, which slip hides, kept.
    Twist constrained_to_normals(const Twist& twist) const {
        Twist found = twist;
        std::vector<double> none(count()), touching(count());
        for (int round = 0; round < ROUNDS; ++round) {
            for (std::ptrdiff_t i = 0; i < count(); ++i)
                touching[i] = 1 / (1 + std::pow(normal_residual(i, found) / (OFF * DEPTH_NOISE), 2));
            found = least_squares(none, touching, twist, 10 * RIDGE, 0);
        }
        return found;
    }

    // Motion along the sensor's axis that follows the dots along their normals.
    Twist lowered() const {
        double product = 0, square = 0;
        for (std::ptrdiff_t i = 0; i < count(); ++i)
            product += normal_[i].z() * normal_[i].dot(moved_[i]), square += normal_[i].z() * normal_[i].z();
        Twist found = Twist::Zero();
        if (square > 0) found[2] = product / square;
        return found;
    }

    // Where the object slides over a dot, only the load in that direction counts: it may differ from dot to dot.
    void find_friction(Grid grid, const DotLoads& loads, const Dots& dots, const std::vector<std::uint8_t>& touched, bool known) {
        std::vector<double> normal(grid.size()), along(grid.size());
        std::vector<Vector3d> pull(grid.size(), Vector3d::Zero()), direction(count(), Vector3d::Zero());
        for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
            if (!touched[k]) continue;
            const Vector3d force = vector_at(loads.force, k), up = vector_at(loads.normal, k);
            normal[k] = -force.dot(up);
            pull[k] = force + normal[k] * up;
        }
        for (std::ptrdiff_t i = 0; known && i < count(); ++i) {
            const Vector3d lag = -residual(i, expected_), sideways = lag - lag.dot(normal_[i]) * normal_[i];
            if (sideways.norm() > TOLERANCE / 2) direction[i] = sideways.normalized();
            along[dots[i]] = pull[dots[i]].dot(direction[i]);
        }
        for (std::ptrdiff_t i = 0; i < count(); ++i) {
            double carried = 0, slid = 0;
            Vector3d sum = Vector3d::Zero();
            around(grid, dots[i], [&](std::ptrdiff_t k) { carried += normal[k], slid += along[k], sum += pull[k]; });
            ratio_.push_back((direction[i].isZero(0) ? sum.norm() : slid) / std::max(carried, 1e-9));
            drag_.push_back(sum);
        }
    }

    const double across_, limit_;
    Vector3d centre_ = Vector3d::Zero();
    std::vector<Vector3d> ray_, moved_, offset_, normal_, drag_;
    std::vector<double> ratio_;
    Twist expected_;
};

StickSlip::StickSlip(Grid grid, Vector3d origin)
    : grid_(grid), origin_(std::move(origin)), noise_(FIRST_NOISE), held_(grid.size()), last_xyz_(3 * grid.size()), moved_(3 * grid.size()),
      last_seen_(grid.size()) {}

std::vector<std::uint8_t> StickSlip::update(const DotLoads& loads, const std::vector<double>& score, double seconds) {
    std::vector<std::uint8_t> touched(grid_.size()), states(grid_.size());
    for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) touched[k] = score[k] > HALF, states[k] = touched[k] ? STICKING : FREE;
    std::vector<TouchingObject> objects;
    std::vector<int> held(grid_.size());
    for (const Dots& dots : separate_objects(grid_, touched)) {
        TouchingObject object = continued(dots);
        Dots both;
        for (const std::ptrdiff_t k : dots) {
            held[k] = static_cast<int>(objects.size()) + 1;
            if (loads.seen[k] && last_seen_[k] && held_[k] > 0) both.push_back(k);
        }
        if (!both.empty()) {
            const std::vector<std::uint8_t> slips = classify(object, ObjectDots(*this, loads, both, touched, object), seconds);
            for (std::size_t i = 0; i < both.size(); ++i) states[both[i]] = slips[i] ? SLIPPING : STICKING;
        }
        objects.push_back(object);
    }
    if (objects.empty() && objects_.empty()) measure_noise(loads);
    for (std::size_t k = 0; k < moved_.size(); ++k) moved_[k] = loads.xyz[k] - last_xyz_[k];
    objects_ = std::move(objects), held_ = std::move(held);
    last_xyz_ = loads.xyz, last_seen_ = loads.seen;
    return states;
}

// Which dots slip; updates the object.
std::vector<std::uint8_t> StickSlip::classify(TouchingObject& object, const ObjectDots& dots, double seconds) {
    const bool starts = !object.moves && dots.mean_size(dots.expected()) > dots.slip_limit() && dots.lag_along_drag() > ALONG &&
                        dots.loaded(object);
    const Twist twist = starts ? dots.expected() : find_motion(object, dots);
    object.gross = object.gross || starts;
    std::vector<std::uint8_t> slips(dots.count());
    if (dots.count() < FEWEST && !object.gross) {  // they tell no motion
        object = TouchingObject{object.friction};
        return slips;
    }
    for (std::ptrdiff_t i = 0; i < dots.count(); ++i) slips[i] = dots.residual(i, twist).norm() > dots.slip_limit();
    learn(object, dots, slips);
    if (starts) return slips;
    object.twist = twist, object.centre = dots.centre(), object.moves = true;
    object.adrift = object.gross ? object.adrift + seconds : 0;
    object.slipping = static_cast<double>(std::count(slips.begin(), slips.end(), 1)) / static_cast<double>(dots.count());
    return slips;
}

// The object's twist; sets whether it slips grossly.
Twist StickSlip::find_motion(TouchingObject& object, const ObjectDots& dots) const {
    const bool still = rests(object, dots), gross = std::exchange(object.gross, false);
    if (still) return Twist::Zero();
    const double enough = MANY * static_cast<double>(dots.count());
    std::vector<double> grip(dots.count(), 1.0);
    for (std::ptrdiff_t i = 0; object.friction > 0 && i < dots.count(); ++i)
        grip[i] = std::pow(std::clamp((object.friction - dots.ratios()[i]) / (0.4 * object.friction), 0.05, 1.0), 2);
    const auto by_dots = [&] { return dots.fit(nullptr, grip, COARSE * TOLERANCE, 0); };
    if (!object.moves) return by_dots();
    const Twist near = dots.fit(&dots.expected(), grip, NEAR * TOLERANCE, std::max(1.0, enough));
    const double agree = dots.following(near);
    // All lag behind the expected motion along their drag, at the friction of earlier slip.
    const bool slides = dots.lag_along_drag() > (gross ? ALONG / 2 : ALONG) && dots.loaded(object) && dots.in_touch(dots.expected()) &&
                        (gross || object.slipping > MANY);
    // Far from the expected motion the fit stays near that; an object that starts or stops may leave it within a frame.
    if (!gross && !slides && agree < (1 - MANY) * static_cast<double>(dots.count())) {
        const Twist whole = by_dots();
        if (dots.following(whole) > ALL * static_cast<double>(dots.count()) && dots.in_touch(whole)) return whole;
    }
    if (agree >= std::max(FEWEST - 1.0, enough) && !gross && dots.in_touch(near)) return near;
    object.gross = slides;
    return slides ? dots.expected() : by_dots();
}

// Whether the dots have been at rest for long enough, so that the object rests: dots below one that slides on may stand still for a while.
bool StickSlip::rests(TouchingObject& object, const ObjectDots& dots) const {
    const double size = dots.root_mean_square(), excess = size * size / (2 * noise_ * noise_) - 1;
    const bool calm = excess < 3 / std::sqrt(static_cast<double>(dots.count()));  // within three standard deviations of noise
    object.still = (calm || size < QUIET * TOLERANCE) && dots.in_touch(Twist::Zero()) ? object.still + 1 : 0;
    return object.still >= (object.gross ? REST_FRAMES : 1);
}

// Updates the running mean of the slipping dots' friction.
void StickSlip::learn(TouchingObject& object, const ObjectDots& dots, const std::vector<std::uint8_t>& slips) {
    std::vector<double> slipping;
    for (std::ptrdiff_t i = 0; i < dots.count(); ++i) {
        if (slips[i]) slipping.push_back(dots.ratios()[i]);
    }
    const double seen = static_cast<std::ptrdiff_t>(slipping.size()) >= FEWEST ? median_with_unknown(slipping) : 0.0;
    if (!(seen > LEAST_FRICTION)) return;
    object.friction = object.friction > 0 ? object.friction + SMOOTHING * (seen - object.friction) : seen;
    friction_ = object.friction;
}

// What is known of an object: of that which held most of its dots.
TouchingObject StickSlip::continued(const std::vector<std::ptrdiff_t>& dots) const {
    std::vector<int> shared(objects_.size() + 1);
    for (const std::ptrdiff_t k : dots) ++shared[held_[k]];
    shared[0] = 0;
    const std::ptrdiff_t number = std::max_element(shared.begin(), shared.end()) - shared.begin();
    return number ? objects_[number - 1] : TouchingObject{friction_};
}

// By a low quantile of the motions across the rays: a touch below the detection limit moves many dots.
void StickSlip::measure_noise(const DotLoads& loads) {
    std::vector<double> sizes;
    for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) {
        if (!loads.seen[k] || !last_seen_[k]) continue;
        const Vector3d before = vector_at(last_xyz_, k), after = vector_at(loads.xyz, k), moved = after - before;
        const Vector3d ray = ((before + after) / 2 - origin_).normalized();
        sizes.push_back((moved - moved.dot(ray) * ray).norm());
    }
    if (sizes.empty()) return;
    const double here = smallest(sizes, static_cast<std::ptrdiff_t>(CALMEST * static_cast<double>(sizes.size()))) / CALMEST_SIGMA;
    if (here > 0) noise_ += (here < noise_ ? SMOOTHING : SMOOTHING / 4) * (here - noise_);
}

std::vector<double> StickSlip::slides() const {
    std::vector<double> found(2 * grid_.size(), NAN);
    for (std::size_t number = 1; number <= objects_.size(); ++number) {
        const TouchingObject& object = objects_[number - 1];
        if (!object.gross || !object.moves || object.adrift > LONGEST) continue;
        Dots dots;
        Eigen::Vector2d middle = Eigen::Vector2d::Zero(), taken = Eigen::Vector2d::Zero();
        for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) {
            if (held_[k] != static_cast<int>(number)) continue;
            dots.push_back(k);
            middle += vector_at(last_xyz_, k).head<2>(), taken += vector_at(moved_, k).head<2>();
        }
        const auto count = static_cast<double>(dots.size());
        middle /= count, taken /= count;
        double spread = 0;
        for (const std::ptrdiff_t k : dots) spread += (vector_at(last_xyz_, k).head<2>() - middle).squaredNorm() / count;
        const Eigen::Vector2d speed = object.twist.head<2>(), way = speed - taken;
        const bool turns = std::abs(object.twist[5]) * std::sqrt(spread) > TURNS * speed.norm();
        const bool lifted = std::abs(object.twist[2]) > STEEP * speed.norm();
        if (turns || lifted || !(way.norm() > UNTAKEN * speed.norm())) continue;
        for (const std::ptrdiff_t k : dots) found[2 * k] = way.x(), found[2 * k + 1] = way.y();
    }
    return found;
}

}  // namespace tactile
