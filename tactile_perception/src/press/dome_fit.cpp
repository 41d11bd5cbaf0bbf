// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Least squares by the method of Levenberg and Marquardt, with the damping of Nielsen (1999, Damping parameter in Marquardt's method,
// IMM-REP-1999-05).
#include "press/dome.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace tactile {
namespace {

constexpr int ITERATIONS = 14;    // at most, trials included. Chosen
constexpr double SETTLED = 0.1;   // of the longest step: over less, fields are linear. Chosen
constexpr double GAINED = 1e-3;   // of the cost: a step that gains less is the last. Chosen
constexpr double NEAREST = 0.1;   // least height of a point over the camera centre, of its untouched height. Chosen
constexpr double DAMPED = 1e-3;   // first damping, over the normal equations' diagonal. Chosen
constexpr double ASIDE = 2e-5;    // m, least distance of a place from the axis, on which the meridian is undefined. Chosen

enum Known { MEAN, WEIGHT, LEAST, MOST, LONGEST };

// Presses, the residuals (K, 2) that they leave, and the slopes (K, n PRESS) of what markers show along x and along y; cost: weighted sum
// of their squares and the prior's.
struct Guess {
    Eigen::VectorXd presses;
    Eigen::MatrixXd left, slopes[2];
    double cost;
};

class Problem {
 public:
    Problem(const DomeLibrary& library, const DomeFrame& frame, const DomePrior& prior, Eigen::Index size)
        : library_(library), frame_(frame), prior_(prior.replicate(1, size / PRESS)) {}

    double known(Known what, Eigen::Index number) const { return prior_(what, number); }

    Guess guess(Eigen::VectorXd presses) const {
        const Eigen::Index count = frame_.points.rows(), size = presses.size();
        for (Eigen::Index p = 0; p < size; p += PRESS)
            if (std::hypot(presses[p + X], presses[p + Y]) < ASIDE) presses[p + X] = presses[p + X] < 0 ? -ASIDE : ASIDE;
        Guess found{std::move(presses), Eigen::MatrixXd::Zero(count, 2), {}, 0};
        for (auto& slopes : found.slopes) slopes = Eigen::MatrixXd::Zero(count, size);
        Points moved = Points::Zero(count, 3);
        Eigen::MatrixXd by(count, 3 * size);
        for (Eigen::Index p = 0; p < size; p += PRESS)
            by.middleCols(3 * p, 3 * PRESS) = press_dome(library_, frame_.points, found.presses.segment<PRESS>(p), moved);
        for (Eigen::Index k = 0; k < count; ++k)
            if (frame_.weight[k] > 0) appear(k, moved.row(k), by, found);
        found.cost = frame_.weight.dot(found.left.rowwise().squaredNorm()) - (frame_.shared * found.left).squaredNorm() +
                     prior_.row(WEIGHT).dot((found.presses.transpose() - prior_.row(MEAN)).cwiseAbs2());
        return found;
    }

    // Normal equations and their right side.
    void linearise(const Guess& at, Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
        normal = prior_.row(WEIGHT).asDiagonal();
        right = prior_.row(WEIGHT).cwiseProduct(prior_.row(MEAN) - at.presses.transpose());
        for (int axis = 0; axis < 2; ++axis) {
            const Eigen::MatrixXd& slopes = at.slopes[axis];
            const Eigen::MatrixXd weighted = frame_.weight.asDiagonal() * slopes, shared = frame_.shared * slopes;
            normal += slopes.transpose() * weighted - shared.transpose() * shared;
            right += weighted.transpose() * at.left.col(axis) - shared.transpose() * (frame_.shared * at.left.col(axis));
        }
    }

    // The step that the damped normal equations ask for, within each number's range and longest step: the number that would go beyond by
    // most stops there, one after the other, and the others step as if that were known. Empty where there is no solution.
    Eigen::VectorXd step_from(const Eigen::VectorXd& presses, Eigen::MatrixXd normal, Eigen::VectorXd right, double damping) const {
        normal.diagonal() *= 1 + damping;
        while (true) {
            const Eigen::LLT<Eigen::MatrixXd> factor(normal);
            const Eigen::VectorXd step = factor.solve(right);
            if (factor.info() != Eigen::Success || !step.allFinite()) return {};
            Eigen::Index worst = -1;
            double most = 1e-9, end = 0;
            for (Eigen::Index a = 0; a < step.size(); ++a) {
                const double down = std::max(-known(LONGEST, a), known(LEAST, a) - presses[a]);
                const double up = std::min(known(LONGEST, a), known(MOST, a) - presses[a]);
                const double allowed = std::clamp(step[a], down, up), over = std::abs(step[a] - allowed) / known(LONGEST, a);
                if (over > most) worst = a, most = over, end = allowed;
            }
            if (worst < 0) return step;
            right -= normal.col(worst) * end;
            normal.row(worst).setZero(), normal.col(worst).setZero();
            normal(worst, worst) = 1, right[worst] = end;
        }
    }

    // The largest part of a longest step.
    double largest(const Eigen::VectorXd& step) const { return step.transpose().cwiseAbs().cwiseQuotient(prior_.row(LONGEST)).maxCoeff(); }

 private:
    // What marker k shows, as of (3) moved with slopes by (K, 3 n PRESS).
    void appear(Eigen::Index k, const Eigen::RowVector3d& moved, const Eigen::MatrixXd& by, Guess& found) const {
        const double away = frame_.plane_z - frame_.camera_centres(k, 2), before = frame_.points(k, 2) - frame_.camera_centres(k, 2);
        const double height = std::max(before + moved[2], NEAREST * before);
        for (int axis = 0; axis < 2; ++axis) {
            const double still = frame_.points(k, axis) - frame_.camera_centres(k, axis), offset = (still + moved[axis]) / height;
            const double left = frame_.shift(k, axis) - (offset - still / before) * away;
            if (!std::isfinite(left)) continue;
            found.left(k, axis) = left;
            for (Eigen::Index a = 0; a < found.presses.size(); ++a)
                found.slopes[axis](k, a) = (by(k, 3 * a + axis) - offset * by(k, 3 * a + 2)) * away / height;
        }
    }

    const DomeLibrary& library_;
    const DomeFrame& frame_;
    const Eigen::MatrixXd prior_;
};

}  // namespace

DomeFit fit_dome(const DomeLibrary& library, const DomeFrame& frame, const Eigen::VectorXd& starts, const DomePrior& prior) {
    const Eigen::Index size = starts.size();
    const Problem problem(library, frame, prior, size);
    Eigen::MatrixXd normal;
    Eigen::VectorXd right, start = starts;
    for (Eigen::Index a = 0; a < size; ++a) start[a] = std::clamp(start[a], problem.known(LEAST, a), problem.known(MOST, a));
    Guess best = problem.guess(start);
    problem.linearise(best, normal, right);
    double damping = DAMPED, more = 2;
    for (int turn = 0; turn < ITERATIONS; ++turn) {
        const Eigen::VectorXd step = problem.step_from(best.presses, normal, right, damping);
        if (!step.size()) break;
        const double expected = step.dot(2 * right - normal * step), enough = GAINED * best.cost;
        if (problem.largest(step) < SETTLED || expected < enough) {
            best.presses += step;
            for (int axis = 0; axis < 2; ++axis) best.left.col(axis) -= best.slopes[axis] * step;
            break;
        }
        Guess trial = problem.guess(best.presses + step);
        const double gained = best.cost - trial.cost;
        if (gained > 0) {
            best = std::move(trial);
            problem.linearise(best, normal, right);
            damping *= std::max(1.0 / 3, 1 - std::pow(2 * gained / expected - 1, 3));
            more = 2;
        } else {
            damping *= more;
            more *= 2;
        }
        if (gained >= 0 && gained < enough) break;
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(normal);
    const bool known = factor.info() == Eigen::Success;
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    return {best.presses, known ? Eigen::MatrixXd(factor.solve(Eigen::MatrixXd::Identity(size, size)))
                                : Eigen::MatrixXd::Constant(size, size, unknown), best.left};
}

}  // namespace tactile
