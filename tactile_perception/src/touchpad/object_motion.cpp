// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/object_motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/median.hpp"
#include "common/solver.hpp"

namespace tactile {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

// Forms of the densities: degrees of freedom of Student's t, by which a dot may be off; probability of a lag that is off its drag for other
// reasons; ratio of loads below which none is reported; ranges of ten that the scatter of dots below a sliding object may have; rounds of a
// fit, of which the first ones see the dots' deviations as WIDER to the power of those left, and any twist.
constexpr double TAILS = 4, ASTRAY = 0.02, LEAST_RATIO = 0.02, SCALES = 5, WIDER = 8, LEAST_LOG = -6;
constexpr double SUMMED = 4;                                  // dots whose loads a ratio sums up
constexpr double USUAL = 1.084;                               // what Student's logarithm costs a dot that is off by normal noise alone
constexpr double FASTEST = 20e-3;                             // m/s, of objects and skin in the first rounds
constexpr double FRICTION_TIME = 0.4, FRICTION_DRIFT = 0.09;  // s, in which dots show the friction once; 1/s, variance that it gains
constexpr double DRIFTS = 3;                                  // components of a drift that are seen: two along the skin, and a turn
constexpr int ROUNDS = 4, WIDE_ROUNDS = 2;
constexpr double TWO_PI = 2 * M_PI, MEDIAN_SQUARE = 1.386;  // of a normal vector in the plane, in variances

// Of a dot's motion across its ray, and along its normal.
constexpr Student ACROSS{TAILS, 2}, ALONG{TAILS, 1};

// Logarithmic density of a vector in the plane of that square, of variance v along each axis.
double plane_density(double square, double v) {
    return ACROSS.log_density(square / v) - std::log(TWO_PI * v);
}

// Cauchy's density of each component's change, scale by scale, with the curvature of the dots: Laplace's approximation, in which a
// component that the dots do not show counts nothing.
template <int N>
struct Prior {
    using Vector = Eigen::Matrix<double, N, 1>;
    using Matrix = Eigen::Matrix<double, N, N>;
    Vector mean, scale;
    Vector variance(const Vector& z) const { return (scale.array().square() + (z - mean).array().square()) / 2; }
    double log_evidence(const Vector& z, const Matrix& curvature) const {
        const Vector off = (z - mean).cwiseQuotient(scale);
        Matrix scaled = scale.asDiagonal() * curvature * scale.asDiagonal();
        scaled.diagonal() += scale.array().square().matrix().cwiseQuotient(variance(z));
        const Eigen::LLT<Matrix> factor(scaled);
        return N * std::log(2.0) / 2 - off.array().square().log1p().sum() - Vector(factor.matrixLLT().diagonal()).array().log().sum();
    }
};

// Fits a state to values by rows of derivatives, in ROUNDS steps; weigh(residuals, round, state, weights) sets the weights, and
// explain(equations, round) is what is left to do there: to set the prior, or after the last step to judge the fit.
template <int N, class Rows, class Weigh, class Explain>
typename NormalEquations<N>::Vector fit_rows(const Rows& rows, const Eigen::VectorXd& values, const Eigen::Matrix<double, N, 1>& start,
                                             Weigh weigh, Explain explain) {
    using Vector = typename NormalEquations<N>::Vector;
    Eigen::VectorXd weights(values.size());
    int round = 0;
    const auto linearise = [&](const Vector& state) {
        NormalEquations<N> found(state);
        const Eigen::VectorXd residuals = values - rows * state;
        weigh(residuals, round, state, weights);
        found.add(rows, residuals, weights);
        explain(found, residuals, round++);
        return found;
    };
    Unbounded<decltype(linearise), Vector> problem{linearise};
    return minimise(problem, start, ROUNDS).at.state;
}

double log_of_sum(double a, double b) {
    return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

}  // namespace

ObjectMotion::ObjectMotion(const StickSlipModel& model, Grid grid, const DotLoads& loads, const std::vector<double>& last_xyz,
                           const Vector3d& origin, double noise, const std::vector<std::ptrdiff_t>& dots,
                           const std::vector<std::uint8_t>& touched, const TouchingObject& object, double seconds)
    : model_(model),
      count_(static_cast<std::ptrdiff_t>(dots.size())),
      noise_(noise),
      seconds_(seconds),
      least_(std::log(TWO_PI * noise * noise) + USUAL),
      friction_(object.friction),
      friction_variance_(object.friction_variance),
      before_(object.twist),
      is_new_(object.count == 0),
      rows_(3 * count_, 6),
      both_rows_(3 * count_, 12),
      moved_(3 * count_),
      ratio_(count_),
      if_slips_(count_),
      if_sticks_(count_),
      drag_(2, count_) {
    const double share = 1.0 / static_cast<double>(count_);
    for (const std::ptrdiff_t k : dots) centre_ += share * vector_at(loads.xyz, k);
    for (const std::ptrdiff_t k : dots)
        radius_ += share * ((vector_at(last_xyz, k) + vector_at(loads.xyz, k)) / 2 - centre_).squaredNorm();
    radius_ = std::max(std::sqrt(radius_), 1e-4);
    for (std::ptrdiff_t i = 0; i < count_; ++i) {
        const std::ptrdiff_t k = dots[i];
        const Vector3d before = vector_at(last_xyz, k), after = vector_at(loads.xyz, k), normal = vector_at(loads.normal, k);
        const Vector3d ray = ((before + after) / 2 - origin).normalized(), a = ray.unitOrthogonal(), b = ray.cross(a);
        const Vector3d offset = ((before + after) / 2 - centre_) / radius_, ways[3] = {a, b, normal};
        for (int j = 0; j < 3; ++j) {
            const std::ptrdiff_t row = j * count_ + i;
            rows_.row(row) << ways[j].transpose(), offset.cross(ways[j]).transpose();
            moved_[row] = ways[j].dot(after - before);
        }
        double carried = 0;
        Vector3d pull = Vector3d::Zero();
        around(grid, k, [&](std::ptrdiff_t j) {
            if (!touched[j]) return;
            const Vector3d force = vector_at(loads.force, j), up = vector_at(loads.normal, j);
            carried -= force.dot(up), pull += force - force.dot(up) * up;
        });
        ratio_[i] = std::log(std::max(pull.norm() / std::max(carried, 1e-9), LEAST_RATIO));
        drag_.col(i) = Vector2d(a.dot(pull), b.dot(pull));
        drag_.col(i) /= std::max(drag_.col(i).norm(), 1e-12);
        // Along their normals the dots follow the object, along the skin its drift.
        for (int j = 0; j < 3; ++j) {
            const Eigen::Matrix<double, 1, 6> follows = ways[j].dot(normal) * rows_.row(2 * count_ + i);
            both_rows_.row(j * count_ + i) << follows, rows_.row(j * count_ + i) - follows;
        }
        const double v = model_.friction_noise * model_.friction_noise + friction_variance_, above = ratio_[i] - friction_;
        if_slips_[i] = std::max(-0.5 * std::pow(std::min(above, 0.0), 2) / v - 0.5 * std::log(TWO_PI * v), LEAST_LOG);
        if_sticks_[i] = std::max(std::log(0.5 * std::erfc(above / std::sqrt(2 * v))), LEAST_LOG);
    }
    for (Twist& twist : before_) {
        if (!is_new_) twist.head<3>() += Vector3d(twist.tail<3>()).cross(centre_ - object.centre);
        twist.tail<3>() *= radius_;
        if (is_new_) twist = lowered();
    }
}

// Motion along the sensor's axis that follows the dots along their normals: that of an object that comes down.
Twist ObjectMotion::lowered() const {
    const auto up = rows_.col(2).tail(count_);
    const double square = up.squaredNorm();
    Twist found = Twist::Zero();
    if (square > 0) found[2] = up.dot(moved_.tail(count_)) / square;
    return found;
}

// The motion that all dots share.
Twist ObjectMotion::carried_along() const {
    const double variance = stick_variance(lowered()), any = std::pow(FASTEST * seconds_, 2);
    Eigen::VectorXd weights(3 * count_);
    weights << Eigen::VectorXd::Constant(2 * count_, 1 / variance), Eigen::VectorXd::Constant(count_, 1e-3 / variance);
    NormalEquations<6> equations(Twist::Zero());
    equations.add(rows_, moved_, weights);
    equations.expect(Twist::Zero(), Twist::Constant(1 / any));
    return step_from<NormalEquations<6>, Twist>(equations, nullptr, 0).value_or(Twist::Zero());
}

ObjectMotion::Residual ObjectMotion::residual(const Eigen::VectorXd& left, std::ptrdiff_t i) const {
    return {across(left, i).squaredNorm(), std::pow(left[2 * count_ + i] / model_.depth_noise, 2)};
}

// Sets the weights of a dot's motions: across its ray, and along the normal by its residual there.
void ObjectMotion::weigh(Eigen::VectorXd& weights, std::ptrdiff_t i, double across, double along) const {
    weights[i] = weights[count_ + i] = across;
    weights[2 * count_ + i] = ALONG.weight(along) / std::pow(model_.depth_noise, 2) / model_.share;
}

// Logarithmic density of a dot's motion along its normal.
double ObjectMotion::depth_density(double along) const {
    return ALONG.log_density(along) / model_.share;
}

double ObjectMotion::stick_variance(const Twist& twist) const {
    const double least = model_.strain * twist.norm(), most = model_.creep * seconds_;
    return noise_ * noise_ + 1 / (1 / (most * most) + 1 / std::max(least * least, 1e-18));
}

// Logarithmic density of a lag's direction, over that along the drag.
double ObjectMotion::off_aim(const Vector2d& left, std::ptrdiff_t i) const {
    const double size = std::max(left.norm(), 1e-12), angle = std::acos(std::clamp(-left.dot(drag_.col(i)) / size, -1.0, 1.0));
    return log_of_sum(-0.5 * std::pow(angle / model_.aim, 2), std::log(ASTRAY));
}

// Logarithmic probability that a lag counts as one of a dot that slips.
double ObjectMotion::lags(const Vector2d& left) const {
    return 2 * std::log1p(1e-6 - std::exp(-left.norm() / (model_.slip * seconds_)));
}

// Logarithmic density of the lag of a dot that slips under an object that moves so far.
double ObjectMotion::slip_density(const Vector2d& left, std::ptrdiff_t i, double way) const {
    const double size = left.norm(), least = model_.slip * seconds_, most = least + way;
    return std::log(most) - 2 * std::log(most + size) - std::log(std::max(size, least)) + lags(left) + off_aim(left, i) -
           std::log(model_.aim * std::sqrt(TWO_PI));
}

// How much a dot counts whose motion has that variance: its noise is its own, the rest it shares with its neighbours.
double ObjectMotion::own_part(double variance) const {
    const double noise = noise_ * noise_;
    return (noise + (variance - noise) / model_.share) / variance;
}

// The dots, all of them or a part, move with the object, whose twist is near mean.
ObjectMotion::Explanation ObjectMotion::stick(const Twist& start, const Twist& mean, bool in_part) const {
    const Prior<6> prior{mean, Twist::Constant(model_.acceleration * seconds_ * seconds_)};
    Explanation found{start, 0, std::vector<double>(count_)};
    double share = 0.5, stuck = 0;
    const auto weigh_dots = [&](const Eigen::VectorXd& left, int round, const Twist& twist, Eigen::VectorXd& weights) {
        const double variance = stick_variance(twist), way = twist.norm(), own = own_part(variance);
        const double wide = variance * std::pow(WIDER, 2 * std::max(0, WIDE_ROUNDS - round));
        const bool last = round == ROUNDS;
        stuck = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Residual off = residual(left, i);
            double sticks = 1, here = in_part || last ? plane_density(off.across, variance) : 0, ratio = if_sticks_[i];
            if (in_part) {
                const double stuck_here = std::log(share) + here, slips = std::log1p(-share) + slip_density(across(left, i), i, way);
                here = log_of_sum(stuck_here, slips);
                const double more = if_slips_[i] - ratio;
                sticks = 1 / (1 + std::exp(slips + more - stuck_here)), ratio += (1 - sticks) * more;
            }
            if (last) found.evidence += own * (here + least_) + ratio / SUMMED + depth_density(off.along);
            stuck += sticks, found.slips[i] = 1 - sticks;
            weigh(weights, i, sticks * ACROSS.weight(off.across / wide) / wide * own, off.along);
        }
    };
    const auto explain = [&](NormalEquations<6>& at, const Eigen::VectorXd&, int round) {
        const auto all = static_cast<double>(count_);
        if (round < ROUNDS) {
            share = std::clamp((stuck + 0.5) / (all + 1), 0.01, 0.99);
            at.expect(mean, prior.variance(at.state).cwiseInverse());
        } else {
            found.evidence += prior.log_evidence(at.state, at.information) - (in_part ? 0.5 * std::log1p(all / model_.share) : 0);
        }
    };
    found.twist = fit_rows<6>(rows_, moved_, start, weigh_dots, explain);
    return found;
}

// What a dot's load and its lag say about that it slips; left (3 N): motions of all dots less the object's.
double ObjectMotion::slipping(std::ptrdiff_t i, const Eigen::VectorXd& left) const {
    return if_slips_[i] + off_aim(across(left, i), i) + lags(across(left, i));
}

// The object, whose twist is near mean, slides over all dots: along their normals they move with it, along the skin they drift, as a rigid
// body and beyond that by an unknown scatter.
ObjectMotion::Explanation ObjectMotion::slide(const Twist& mean, double& drift_speed) const {
    Prior<12> prior;
    prior.mean << mean, Twist::Zero();
    prior.scale << Twist::Constant(model_.acceleration * seconds_ * seconds_), Twist::Constant(model_.drift * seconds_);
    Explanation found{mean, 0, std::vector<double>(count_, 1.0)};
    std::vector<double> squares(count_);
    double variance = 0;
    const auto weigh_dots = [&](const Eigen::VectorXd& left, int, const auto&, Eigen::VectorXd& weights) {
        for (std::ptrdiff_t i = 0; i < count_; ++i) squares[i] = residual(left, i).across;
        variance = std::max(median(squares) / MEDIAN_SQUARE, noise_ * noise_);
        const double own = own_part(variance);
        for (std::ptrdiff_t i = 0; i < count_; ++i)
            weigh(weights, i, ACROSS.weight(squares[i] / variance) / variance * own, residual(left, i).along);
    };
    const auto explain = [&](NormalEquations<12>& at, const Eigen::VectorXd& left, int round) {
        const double drift = at.state.tail<6>().norm() / std::sqrt(6.0);
        if (round == ROUNDS) {
            const Eigen::VectorXd lag = moved_ - rows_ * at.state.head<6>();
            found.evidence = prior.log_evidence(at.state, at.information);
            for (std::ptrdiff_t i = 0; i < count_; ++i) {
                found.evidence += own_part(variance) * (plane_density(squares[i], variance) + least_) + slipping(i, lag) / SUMMED;
                found.evidence += depth_density(residual(left, i).along);
            }
            drift_speed = drift / seconds_;
            return;
        }
        // Where the object rises, the dots spring back by friction's part of its way.
        const double risen = (rows_.bottomRows(count_) * at.state.head<6>()).mean();
        const double fastest = model_.drift * seconds_ + std::exp(friction_) * std::max(risen, 0.0);
        if (round > 0) prior.scale.tail<6>().setConstant(std::clamp(drift, noise_ / std::sqrt(count_), fastest));
        Eigen::Matrix<double, 12, 1> variances = prior.variance(at.state);
        if (round == 0) variances.tail<6>().setConstant(std::pow(FASTEST * seconds_, 2));
        at.expect(prior.mean, variances.cwiseInverse());
    };
    found.twist = fit_rows<12>(both_rows_, moved_, prior.mean, weigh_dots, explain).template head<6>();
    return found;
}

// Logarithmic density of the dots if none moves.
double ObjectMotion::still() const {
    double density = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) {
        const Residual off = residual(moved_, i);
        density += plane_density(off.across, noise_ * noise_) + least_ + depth_density(off.along);
    }
    return density;
}

std::vector<double> ObjectMotion::explain(TouchingObject& object, const std::array<double, MODES>& odds) const {
    const auto likeliest = [&](std::initializer_list<Mode> modes) {
        return before_[*std::max_element(modes.begin(), modes.end(), [&](Mode a, Mode b) { return object.odds[a] < object.odds[b]; })];
    };
    const Twist last = likeliest({HELD, IN_PART, SLIDING, AT_REST}), whole = carried_along();
    std::array<Explanation, MODES> found;
    found[HELD] = stick(whole, last, false);
    found[IN_PART] = stick(whole, last, true);
    // Sliding goes on from sliding, or else begins from what was likeliest.
    const bool slid = object.odds[SLIDING] > model_.rate * seconds_ * (1 - object.odds[SLIDING]);
    const double drift = object.drift * seconds_;
    found[SLIDING] = slide(slid ? before_[SLIDING] : last, object.drift);
    // At rest the dots keep the loads with which they stuck, or those with which they slipped until the object stopped.
    const Eigen::VectorXd ways = rows_ * before_[SLIDING], lag = moved_ - ways;
    double slipped = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) slipped += slipping(i, lag) / SUMMED;
    const double at_rest = still(), faintest = noise_ / std::sqrt(count_), risen = ways.tail(count_).squaredNorm() / count_;
    found[AT_REST] = {Twist::Zero(), at_rest + std::max(if_sticks_.sum() / SUMMED, slipped), std::vector<double>(count_)};
    // They are also at rest below an object that slides on evenly, from when their drift has ended, and it rises no more. A drift that
    // begins has any scale; one that goes on does not end at once.
    const auto ended = [&](double now) {
        return slid ? DRIFTS * std::log(std::max(drift / std::max(now, faintest), 1.0)) : std::log(SCALES);
    };
    const double change = drift > 0 ? std::log1p(risen / std::pow(model_.acceleration * seconds_ * seconds_, 2)) : 0;
    const double evenly = at_rest + slipped - ended(0) - change;
    found[SLIDING].evidence -= ended(object.drift * seconds_);
    if (slid && evenly > found[SLIDING].evidence) {
        found[SLIDING].twist = before_[SLIDING], found[SLIDING].evidence = evenly;
        object.drift = 0;
    }
    double largest = -INFINITY, sum = 0;
    for (int mode = 0; mode < MODES; ++mode) largest = std::max(largest, found[mode].evidence + std::log(odds[mode]));
    for (int mode = 0; mode < MODES; ++mode) {
        object.odds[mode] = std::max(std::exp(found[mode].evidence + std::log(odds[mode]) - largest), 1e-6);
        sum += object.odds[mode];
    }
    std::vector<double> slips(count_);
    for (int mode = 0; mode < MODES; ++mode) {
        object.odds[mode] /= sum;
        for (std::size_t i = 0; i < slips.size(); ++i) slips[i] += object.odds[mode] * found[mode].slips[i];
        object.slipping[mode] = std::accumulate(found[mode].slips.begin(), found[mode].slips.end(), 0.0) / count_;
        object.twist[mode] = found[mode].twist;
        object.twist[mode].tail<3>() /= radius_;
    }
    object.centre = centre_, object.count = count_;
    learn_friction(object, slips);
    return slips;
}

// Slipping dots show the object's friction, and sticking ones whose ratio is larger; it changes as the modes do.
void ObjectMotion::learn_friction(TouchingObject& object, const std::vector<double>& slips) const {
    double weights = 0, sum = 0;
    for (std::size_t i = 0; i < slips.size(); ++i) {
        const double weight = slips[i] + (ratio_[i] > friction_ ? 0.5 * (1 - slips[i]) : 0);
        weights += weight, sum += weight * ratio_[i];
    }
    const double once = std::min(1.0, seconds_ / FRICTION_TIME);
    const double prior = friction_variance_ + FRICTION_DRIFT * seconds_;
    const double seen = once * weights / model_.share / std::pow(model_.friction_noise, 2);
    object.friction_variance = 1 / (1 / prior + seen);
    object.friction = weights > 0 ? object.friction_variance * (friction_ / prior + seen * sum / weights) : friction_;
}

}  // namespace tactile
