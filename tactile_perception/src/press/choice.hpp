// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The estimate of one press, and the selection of the hypothesis that explains a marker field: press/estimate.py.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/fields.hpp"

namespace tactile {

enum PressFlag { OUT_OF_RANGE = 1, AT_EDGE = 2, AMBIGUOUS = 4 };  // of tactile_msgs/Contact

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Fields of a TouchEstimate.
struct PressEstimate {
    Eigen::Vector3d position, lowest;
    double depth, depth_sigma, radius;
    Eigen::Matrix3d covariance;
    Vector6 wrench = Vector6::Constant(std::numeric_limits<double>::quiet_NaN());
    int flags = 0;
    TACTILE_FIELDS(position, lowest, depth, depth_sigma, radius, covariance, wrench, flags)
};

/// Prior odds over a straight press, and values that share a model error: PressConstants.
struct PressOdds {
    double values_per_error = 1, dragged_odds = 1, two_odds = 1;
    TACTILE_FIELDS(values_per_error, dragged_odds, two_odds)
};

/// A hypothesis; its value is how many numbers are fitted.
enum Hypothesis { STRAIGHT = 3, DRAGGED = 5, TWO = 8 };

/// Compares hypotheses. values: number of values of the visible markers; expected: chi-square of presses under their own hypothesis, below
/// which a fit counts as no better.
class Evidence {
 public:
    Evidence(Eigen::Index values, double expected, const PressOdds& odds)
        : odds_(odds), count_(std::max(static_cast<double>(values) / odds.values_per_error, 2.0)), expected_(expected) {}

    /// The log evidence; chi_square: of the residuals, per value.
    double of(Hypothesis hypothesis, double chi_square) const {
        const double misfit = count_ * std::log(std::max(chi_square, expected_)),
                     prior = hypothesis == DRAGGED ? odds_.dragged_odds : hypothesis == TWO ? odds_.two_odds : 1;
        return std::log(prior) - 0.5 * (misfit + hypothesis * std::log(count_));
    }
    /// Whether a perfect fit of a hypothesis would exceed a known log evidence.
    bool may_win(Hypothesis hypothesis, double known) const { return of(hypothesis, expected_) > known; }
    /// Whether the residual of a fit is at most that expected of the model error.
    template <class Fit>
    bool is_explained(const Fit& fit) const {
        return fit.misfit <= expected_ * fit.expected;
    }

 private:
    PressOdds odds_;
    double count_, expected_;
};

/// Log of a tip's radius, and its standard deviation.
struct TipRadius {
    double mean, sigma;
};

/// Selects the hypothesis of the largest evidence frame by frame. A Fit has presses, misfit (residual chi-square per value), expected (that
/// of the model error over that of a straight press), and radius(), the TipRadius of the first press.
template <class Fit>
class Choice {
 public:
    using Presses = decltype(Fit::presses);

    std::optional<Fit> one;           ///< Fit of one press to the last frame with one press.
    bool dragged = false;             ///< Whether that was a drag, which persists until contact ends: friction holds the lifted skin.
    std::optional<TipRadius> radius;  ///< Of the last straight press, which a dragged tip keeps.
    std::optional<Presses> two;       ///< The presses of the last frame if they were two.

    /// Fits the hypotheses to a frame and returns the fit of the best one. solve(start, dragged) fits one press, a straight one from begin;
    /// solve_two() fits two presses, if the residual of one exceeds the expected model error, which grows with drags.
    template <class Solve, class SolveTwo>
    Fit explain(const Evidence& evidence, const Presses& begin, const Solve& solve, const SolveTwo& solve_two) {
        bool drags = dragged;
        Fit single = solve(drags ? one->presses : begin, drags);
        double best = evidence.of(drags ? DRAGGED : STRAIGHT, single.misfit);
        if (!drags && evidence.may_win(DRAGGED, best)) {
            Fit drag = solve(single.presses, true);
            if (const double found = evidence.of(DRAGGED, drag.misfit); found > best) single = std::move(drag), best = found, drags = true;
        }
        if (!evidence.is_explained(single) && evidence.may_win(TWO, best)) {
            Fit pair = solve_two();
            if (evidence.of(TWO, pair.misfit) > best) {
                two = pair.presses;
                return pair;
            }
        }
        one = single, dragged = drags, two.reset();
        if (!drags && single.radius().sigma > 0) radius = single.radius();  // the fit did not fail
        return single;
    }
};

}  // namespace tactile
