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

constexpr double DEGREES_OF_FREEDOM = 4;      // of Student's t distribution of a dot's residual
constexpr double OUTLIER_PROBABILITY = 0.02;  // of a lag whose direction has nothing to do with the drag
constexpr double MIN_LOAD_RATIO = 0.02;       // tangential over normal load of a dot; lower ones are not distinguished
constexpr double DRIFT_DECADES = 5;           // prior range of the scatter of dots below a sliding object
constexpr double WIDENING = 8;                // factor on the dots' deviations for each of the first rounds that is left
constexpr double MIN_LOG_LIKELIHOOD = -6;     // of a dot's ratio of loads
constexpr double DOTS_PER_RATIO = 4;          // dots whose loads a ratio sums up
constexpr double MEAN_STUDENT_LOSS = 1.084;   // mean negative logarithm of Student's density of a dot with normal noise alone
constexpr double MAX_SPEED = 20e-3;           // m/s, of objects and skin in the first rounds
constexpr double FRICTION_TIME = 0.4, FRICTION_DRIFT = 0.09;  // s, in which dots show the friction once; 1/s, variance that it gains
constexpr double DRIFT_COMPONENTS = 3;                        // that are observable: two along the skin, and a rotation
constexpr int ROUNDS = 4, WIDE_ROUNDS = 2;                    // of a fit, and those with widened deviations and any twist
constexpr double TWO_PI = 2 * M_PI, MEDIAN_SQUARE = 1.386;    // of a normal vector in the plane, in variances

// Of a dot's motion across its ray, and along its normal.
constexpr Student ACROSS{DEGREES_OF_FREEDOM, 2}, ALONG{DEGREES_OF_FREEDOM, 1};

// Logarithmic density of a vector in the plane of that square, of variance v along each axis.
double plane_density(double square, double v) {
    return ACROSS.log_density(square / v) - std::log(TWO_PI * v);
}

// Cauchy's density of the change of each component. With the curvature of the dots' likelihood it gives the evidence by Laplace's
// approximation, to which components that the dots do not show contribute nothing.
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

// Fits a state to values by rows of derivatives, in ROUNDS steps. weigh(residuals, round, state, weights) sets the weights;
// explain(equations, residuals, round) sets the prior or, after the last step, computes the evidence.
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

ObjectMotion::ObjectMotion(const StickSlipModel& model, Grid grid, const DotLoads& loads, const LastFrame& last,
                           const std::vector<std::ptrdiff_t>& dots, const TouchingObject& object)
    : model_(model),
      count_(static_cast<std::ptrdiff_t>(dots.size())),
      noise_(last.noise),
      seconds_(last.seconds),
      least_(std::log(TWO_PI * last.noise * last.noise) + MEAN_STUDENT_LOSS),
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
    for (const std::ptrdiff_t k : dots) radius_ += share * ((vector_at(last.xyz, k) + vector_at(loads.xyz, k)) / 2 - centre_).squaredNorm();
    radius_ = std::max(std::sqrt(radius_), 1e-4);
    for (std::ptrdiff_t i = 0; i < count_; ++i) {
        const std::ptrdiff_t k = dots[i];
        const Vector3d before = vector_at(last.xyz, k), after = vector_at(loads.xyz, k), normal = vector_at(loads.normal, k);
        const Vector3d ray = ((before + after) / 2 - last.origin).normalized(), a = ray.unitOrthogonal(), b = ray.cross(a);
        const Vector3d offset = ((before + after) / 2 - centre_) / radius_, axes[3] = {a, b, normal};
        for (int j = 0; j < 3; ++j) {
            const std::ptrdiff_t row = j * count_ + i;
            rows_.row(row) << axes[j].transpose(), offset.cross(axes[j]).transpose();
            moved_[row] = axes[j].dot(after - before);
        }
        double carried = 0;
        Vector3d pull = Vector3d::Zero();
        around(grid, k, [&](std::ptrdiff_t j) {
            if (!last.touched[j]) return;
            const Vector3d force = vector_at(loads.force, j), up = vector_at(loads.normal, j);
            carried -= force.dot(up), pull += force - force.dot(up) * up;
        });
        ratio_[i] = std::log(std::max(pull.norm() / std::max(carried, 1e-9), MIN_LOAD_RATIO));
        drag_.col(i) = Vector2d(a.dot(pull), b.dot(pull));
        drag_.col(i) /= std::max(drag_.col(i).norm(), 1e-12);
        // Along their normals the dots follow the object, along the skin its drift.
        for (int j = 0; j < 3; ++j) {
            const Eigen::Matrix<double, 1, 6> follows = axes[j].dot(normal) * rows_.row(2 * count_ + i);
            both_rows_.row(j * count_ + i) << follows, rows_.row(j * count_ + i) - follows;
        }
        const double v = model_.friction_noise * model_.friction_noise + friction_variance_, above = ratio_[i] - friction_;
        if_slips_[i] = std::max(-0.5 * std::pow(std::min(above, 0.0), 2) / v - 0.5 * std::log(TWO_PI * v), MIN_LOG_LIKELIHOOD);
        if_sticks_[i] = std::max(std::log(0.5 * std::erfc(above / std::sqrt(2 * v))), MIN_LOG_LIKELIHOOD);
    }
    for (Twist& twist : before_) {
        if (!is_new_) twist.head<3>() += Vector3d(twist.tail<3>()).cross(centre_ - object.centre);
        twist.tail<3>() *= radius_;
        if (is_new_) twist = lowered();
    }
}

// Motion along the sensor's axis that follows the dots along their normals, as of an object that approaches.
Twist ObjectMotion::lowered() const {
    const auto up = rows_.col(2).tail(count_);
    const double square = up.squaredNorm();
    Twist found = Twist::Zero();
    if (square > 0) found[2] = up.dot(moved_.tail(count_)) / square;
    return found;
}

// The motion that all dots share.
Twist ObjectMotion::carried_along() const {
    const double variance = stick_variance(lowered()), any = std::pow(MAX_SPEED * seconds_, 2);
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
double ObjectMotion::aim_density(const Vector2d& left, std::ptrdiff_t i) const {
    const double size = std::max(left.norm(), 1e-12), angle = std::acos(std::clamp(-left.dot(drag_.col(i)) / size, -1.0, 1.0));
    return log_of_sum(-0.5 * std::pow(angle / model_.aim, 2), std::log(OUTLIER_PROBABILITY));
}

// Logarithmic probability that a lag counts as one of a dot that slips.
double ObjectMotion::lag_log_probability(const Vector2d& left) const {
    return 2 * std::log1p(1e-6 - std::exp(-left.norm() / (model_.slip * seconds_)));
}

// Logarithmic density of the lag of a slipping dot, by the displacement of the object.
double ObjectMotion::slip_density(const Vector2d& left, std::ptrdiff_t i, double displacement) const {
    const double size = left.norm(), least = model_.slip * seconds_, most = least + displacement;
    return std::log(most) - 2 * std::log(most + size) - std::log(std::max(size, least)) + lag_log_probability(left) + aim_density(left, i) -
           std::log(model_.aim * std::sqrt(TWO_PI));
}

// Weight of a dot whose motion has that variance: its noise is independent, the rest is common to its neighbours.
double ObjectMotion::own_share(double variance) const {
    const double noise = noise_ * noise_;
    return (noise + (variance - noise) / model_.share) / variance;
}

// The dots, all of them or a part, move with the object, whose twist is near mean.
ObjectMotion::Explanation ObjectMotion::stick(const Twist& start, const Twist& mean, bool in_part) const {
    const Prior<6> prior{mean, Twist::Constant(model_.acceleration * seconds_ * seconds_)};
    Explanation found{start, 0, std::vector<double>(count_)};
    double share = 0.5, stuck = 0;
    const auto weigh_dots = [&](const Eigen::VectorXd& left, int round, const Twist& twist, Eigen::VectorXd& weights) {
        const double variance = stick_variance(twist), displacement = twist.norm(), own = own_share(variance);
        const double wide = variance * std::pow(WIDENING, 2 * std::max(0, WIDE_ROUNDS - round));
        const bool last = round == ROUNDS;
        stuck = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Residual off = residual(left, i);
            double sticks = 1, here = in_part || last ? plane_density(off.across, variance) : 0, ratio = if_sticks_[i];
            if (in_part) {
                const double stuck_here = std::log(share) + here,
                             slips = std::log1p(-share) + slip_density(across(left, i), i, displacement);
                here = log_of_sum(stuck_here, slips);
                const double more = if_slips_[i] - ratio;
                sticks = 1 / (1 + std::exp(slips + more - stuck_here)), ratio += (1 - sticks) * more;
            }
            if (last) found.evidence += own * (here + least_) + ratio / DOTS_PER_RATIO + depth_density(off.along);
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

// Logarithmic likelihood of a dot's load ratio and lag if it slips; left (3 N): motions of all dots relative to the object.
double ObjectMotion::slip_log_likelihood(std::ptrdiff_t i, const Eigen::VectorXd& left) const {
    return if_slips_[i] + aim_density(across(left, i), i) + lag_log_probability(across(left, i));
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
        const double own = own_share(variance);
        for (std::ptrdiff_t i = 0; i < count_; ++i)
            weigh(weights, i, ACROSS.weight(squares[i] / variance) / variance * own, residual(left, i).along);
    };
    const auto explain = [&](NormalEquations<12>& at, const Eigen::VectorXd& left, int round) {
        const double drift = at.state.tail<6>().norm() / std::sqrt(6.0);
        if (round == ROUNDS) {
            const Eigen::VectorXd lag = moved_ - rows_ * at.state.head<6>();
            found.evidence = prior.log_evidence(at.state, at.information);
            for (std::ptrdiff_t i = 0; i < count_; ++i) {
                found.evidence +=
                    own_share(variance) * (plane_density(squares[i], variance) + least_) + slip_log_likelihood(i, lag) / DOTS_PER_RATIO;
                found.evidence += depth_density(residual(left, i).along);
            }
            drift_speed = drift / seconds_;
            return;
        }
        // Where the object rises, the dots spring back by friction's part of its displacement.
        const double risen = (rows_.bottomRows(count_) * at.state.head<6>()).mean();
        const double fastest = model_.drift * seconds_ + std::exp(friction_) * std::max(risen, 0.0);
        if (round > 0) prior.scale.tail<6>().setConstant(std::clamp(drift, noise_ / std::sqrt(count_), fastest));
        Eigen::Matrix<double, 12, 1> variances = prior.variance(at.state);
        if (round == 0) variances.tail<6>().setConstant(std::pow(MAX_SPEED * seconds_, 2));
        at.expect(prior.mean, variances.cwiseInverse());
    };
    found.twist = fit_rows<12>(both_rows_, moved_, prior.mean, weigh_dots, explain).template head<6>();
    return found;
}

// Logarithmic density of the motions if no dot moves.
double ObjectMotion::rest_density() const {
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
    // Sliding starts from the twist of sliding in the last frame, or else from that of the likeliest mode.
    const bool slid = object.odds[SLIDING] > model_.rate * seconds_ * (1 - object.odds[SLIDING]);
    const double drift = object.drift * seconds_;
    found[SLIDING] = slide(slid ? before_[SLIDING] : last, object.drift);
    // At rest the dots keep the loads with which they stuck, or those with which they slipped until the object stopped.
    const Eigen::VectorXd predicted = rows_ * before_[SLIDING], lag = moved_ - predicted;
    double slipped = 0;
    for (std::ptrdiff_t i = 0; i < count_; ++i) slipped += slip_log_likelihood(i, lag) / DOTS_PER_RATIO;
    const double at_rest = rest_density(), faintest = noise_ / std::sqrt(count_), risen = predicted.tail(count_).squaredNorm() / count_;
    found[AT_REST] = {Twist::Zero(), at_rest + std::max(if_sticks_.sum() / DOTS_PER_RATIO, slipped), std::vector<double>(count_)};
    // The dots are also at rest below an object that slides steadily, after their drift has ended, and it rises no more. The scale of a new
    // drift is unknown; a drift that ends at once is unlikely.
    const auto ended = [&](double now) {
        return slid ? DRIFT_COMPONENTS * std::log(std::max(drift / std::max(now, faintest), 1.0)) : std::log(DRIFT_DECADES);
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

// The friction of the object follows from the ratios of slipping dots, and of sticking dots whose ratio is larger.
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
