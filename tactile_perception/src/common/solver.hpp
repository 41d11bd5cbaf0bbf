// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Robust nonlinear least squares for a state of few numbers. Residuals and priors add to normal equations; steps are those of Gauss and
// Newton, or of Levenberg and Marquardt with the damping of Nielsen (1999, Damping parameter in Marquardt's method, IMM-REP-1999-05).
// Robust kernels weigh the residuals again at each step (Triggs et al., Bundle Adjustment, 2000, sections 3 and 4).
//
// Two problems of many numbers have solvers of their own, because a dense or a sparse Cholesky factor is slower (of one thread):
// - The membrane (484 dots) solves its band with the pressure as border in 0.065 ms a step (common/band_matrix.hpp); Eigen's LLT takes
//   1.93 ms, SimplicialLLT 0.43 ms.
// - Traction with friction (taxel/shear.cpp, 44 x 44) is no least squares; over-relaxation from the last frame takes 0.018 ms a frame,
//   one step of SimplicialLLT for one axis 0.37 ms.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace tactile {

// ---- Robust kernels: what a residual, in standard deviations, weighs and costs.

struct Huber {
    double threshold;
    double weight(double residual) const { return threshold / std::max(std::abs(residual), threshold); }
    double cost(double residual) const { return std::min(residual * residual, threshold * std::abs(residual)); }
};

/// Tukey's biweight: residuals beyond the threshold have no weight.
struct Tukey {
    double threshold;
    double weight(double residual) const {
        const double share = residual / threshold, rest = 1 - share * share;
        return rest > 0 ? rest * rest : 0;
    }
};

// Student's t of so many components and degrees of freedom; square: of the residual.
struct Student {
    double freedom, components;
    double weight(double square) const { return (freedom + components) / (freedom + square); }
    double log_density(double square) const { return -(freedom + components) / 2 * std::log1p(square / freedom); }
};

// ---- Normal equations.

// At a state of N numbers, MAX_N at most: information * step = right. cost: weighted sum of the squared residuals.
template <int N, int MAX_N = N>
struct NormalEquations {
    using Vector = Eigen::Matrix<double, N, 1, 0, MAX_N, 1>;
    using Matrix = Eigen::Matrix<double, N, N, 0, MAX_N, MAX_N>;
    Vector state, right;
    Matrix information;
    double cost = 0;

    explicit NormalEquations(const Vector& at)
        : state(at), right(Vector::Zero(at.size())), information(Matrix::Zero(at.size(), at.size())) {}

    // Residuals (M) with weights (M), and the derivatives rows (M, N) of what is predicted, which the residuals are less.
    template <class Rows, class Residuals, class Weights>
    void add(const Rows& rows, const Residuals& residuals, const Weights& weights) {
        const typename Rows::PlainObject weighted = weights.asDiagonal() * rows;
        for (Eigen::Index i = 0; i < state.size(); ++i) {
            right[i] += weighted.col(i).dot(residuals);
            for (Eigen::Index j = 0; j < i; ++j) information(j, i) = information(i, j) += weighted.col(i).dot(rows.col(j));
            information(i, i) += weighted.col(i).dot(rows.col(i));
        }
        cost += weights.dot(residuals.cwiseAbs2());
    }

    // Normal prior; weight: one over its variance.
    void expect(const Vector& mean, const Vector& weight) {
        information.diagonal() += weight;
        right -= weight.cwiseProduct(state - mean);
        cost += weight.dot((state - mean).cwiseAbs2());
    }

    // NaN where the residuals and priors do not determine the state.
    Matrix covariance() const {
        const Eigen::LLT<Matrix> factor(information);
        if (factor.info() != Eigen::Success) return Matrix::Constant(state.size(), state.size(), std::numeric_limits<double>::quiet_NaN());
        return factor.solve(Matrix::Identity(state.size(), state.size()));
    }
};

// ---- Steps.

// Range of each number, and its longest step. cut: whether a step that leaves the range is cut there number by number; else the others step
// as if the number that stays at its end were known.
template <class Vector>
struct Bounds {
    Vector lowest, highest, longest;
    bool cut = false;
};

// The step that solves the damped equations within bounds, if there are any: the number that would leave its range by most stops at its
// end, one after the other, and the others step as if that were known; a step that is too long is shortened. Empty where there is no
// solution.
template <class Equations, class Vector = typename Equations::Vector>
std::optional<Vector> step_from(const Equations& at, const Bounds<Vector>* bounds, double damping) {
    typename Equations::Matrix matrix = at.information;
    Vector right = at.right;
    matrix.diagonal() *= 1 + damping;
    while (true) {
        const Eigen::LLT<typename Equations::Matrix> factor(matrix);
        const Vector step = factor.solve(right);
        if (factor.info() != Eigen::Success || !step.allFinite()) return {};
        if (!bounds) return step;
        const auto shortened = [&] { return Vector(step / std::max(1.0, step.cwiseAbs().cwiseQuotient(bounds->longest).maxCoeff())); };
        if (bounds->cut) return Vector((at.state + shortened()).cwiseMax(bounds->lowest).cwiseMin(bounds->highest) - at.state);
        Eigen::Index worst = -1;
        double most = 1e-9, end = 0;  // shares of the longest step; the first is rounding
        for (Eigen::Index a = 0; a < step.size(); ++a) {
            const double inside = std::clamp(step[a], bounds->lowest[a] - at.state[a], bounds->highest[a] - at.state[a]);
            const double over = std::abs(step[a] - inside) / bounds->longest[a];
            if (over > most) worst = a, most = over, end = inside;
        }
        if (worst < 0) return shortened();
        right -= matrix.col(worst) * end;
        matrix.row(worst).setZero(), matrix.col(worst).setZero();
        matrix(worst, worst) = 1, right[worst] = end;
    }
}

// ---- The loop.

// The equations at the last state, and the step from there that was too small to be taken.
template <class Equations>
struct Minimum {
    Equations at;
    typename Equations::Vector left;
};

// Up to so many steps from start, trials included. problem.linearise(state) gives NormalEquations there, or what is derived of them;
// problem.bounds: Bounds of the state, or null; problem.is_settled(equations, step, gain): whether a step that reduces the cost by gain
// ends the search. damping: the first one over the diagonal; 0: each step is taken (Gauss-Newton), as the weights may change the cost.
template <class Problem, class Vector>
auto minimise(Problem& problem, const Vector& start, int steps, double damping = 0) {
    auto best = problem.linearise(start);
    using Equations = decltype(best);
    const bool damped = damping > 0;
    double more = 2;
    Minimum<Equations> found{std::move(best), Vector::Zero(start.size())};
    for (int k = 0; k < steps; ++k) {
        const std::optional<Vector> step = step_from(found.at, problem.bounds, damping);
        if (!step) break;
        // What is cut may gain nothing although the minimum is far: then the whole step is judged.
        const bool cut = problem.bounds && problem.bounds->cut;
        const double expected = cut ? found.at.right.dot(step_from<Equations, Vector>(found.at, nullptr, damping).value_or(*step))
                                    : step->dot(2 * found.at.right - found.at.information * *step);
        if (problem.is_settled(found.at, *step, expected)) {
            found.left = *step;
            break;
        }
        Equations next = problem.linearise(Vector(found.at.state + *step));
        const double gained = found.at.cost - next.cost;
        if (damped && !(gained > 0)) {
            damping *= more, more *= 2;
            continue;
        }
        found.at = std::move(next);
        if (!damped) continue;
        damping *= std::max(1.0 / 3, 1 - std::pow(2 * gained / expected - 1, 3)), more = 2;
        if (problem.is_settled(found.at, *step, gained)) break;
    }
    return found;
}

// A problem without bounds, all of whose steps are taken.
template <class Linearise, class Vector>
struct Unbounded {
    Linearise linearise;
    const Bounds<Vector>* bounds = nullptr;
    template <class Equations>
    bool is_settled(const Equations&, const Vector&, double) const {
        return false;
    }
};

}  // namespace tactile
