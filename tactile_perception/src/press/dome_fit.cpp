// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/dome_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tactile {
namespace {

constexpr int ITERATIONS = 14;    // at most, trials included. Chosen
constexpr double SETTLED = 3e-3;  // of the longest step: a smaller one is the last. Chosen
constexpr double GAINED = 1e-3;   // of the cost: a step that gains less is the last. Chosen
constexpr double NEAREST = 0.1;   // least height of a point over the eye, of its untouched height. Chosen
constexpr double DAMPED = 1e-3;   // first damping, over the normal equations' diagonal. Chosen
constexpr double ASIDE = 2e-5;    // m, least distance of a place from the axis, on which the meridian is undefined. Chosen

using Values = std::vector<double>;

// Apparent displacement (K, 2) in the viewing plane of markers that moved by (K, 3); 0 for one at an unknown place.
Values appear(const DomeMarkers& markers, const Values& moved) {
    Values shown(2 * markers.count);
    for (std::int64_t k = 0; k < markers.count; ++k) {
        const double *point = markers.points + 3 * k, *eye = markers.eyes + 3 * k, *by = &moved[3 * k];
        const double away = markers.plane_z - eye[2], height = point[2] - eye[2];
        const double now = away / std::max(height + by[2], NEAREST * height), before = away / height;
        for (int axis = 0; axis < 2; ++axis) {
            const double offset = point[axis] - eye[axis], shift = (offset + by[axis]) * now - offset * before;
            shown[2 * k + axis] = std::isfinite(shift) ? shift : 0.0;
        }
    }
    return shown;
}

// Slopes (PRESS) of the apparent displacement of a marker (K, 2), at moved (K, 3), along slopes of the displacement (K, PRESS, 3).
void appear_slopes(const DomeMarkers& markers, const Values& moved, const Values& slopes, std::int64_t k, int axis, double* shown) {
    const double *point = markers.points + 3 * k, *eye = markers.eyes + 3 * k, *by = &moved[3 * k], *along = &slopes[3 * PRESS * k];
    const double height = std::max(point[2] - eye[2] + by[2], NEAREST * (point[2] - eye[2]));
    const double offset = (point[axis] - eye[axis] + by[axis]) / height, larger = (markers.plane_z - eye[2]) / height;
    for (int number = 0; number < PRESS; ++number, along += 3) {
        const double shift = (along[axis] - offset * along[2]) * larger;
        shown[number] = std::isfinite(shift) ? shift : 0.0;
    }
}

struct Problem {
    const DomeLibrary& library;
    const DomeMarkers& markers;
    const double* shift;
    const DomeWeights& weights;
    const DomePrior& prior;
    int n, size;

    double weight(std::int64_t k) const { return weights.weight[k]; }

    // Displacements (K, 3) under presses, their slopes (K, PRESS, 3) by each, and the residuals (K, 2) that they leave; squares: weighted
    // sum; cost: with the prior's.
    struct Guess {
        Values presses, moved;
        std::vector<Values> slopes;
        Values left;
        double squares = 0, cost = 0;
    };

    // (2 shared, columns): products of the shared rows with the axes of columns of numbers (K, 2, columns / 2).
    Values shared_parts(const double* numbers, int columns) const {
        Values parts(static_cast<std::size_t>(weights.shared) * columns, 0.0);
        for (int r = 0; r < weights.shared; ++r)
            for (std::int64_t k = 0; k < markers.count; ++k)
                for (int c = 0; c < columns; ++c) parts[r * columns + c] += weights.rows[r * markers.count + k] * numbers[k * columns + c];
        return parts;
    }

    Guess guess(Values presses) const {
        Guess found{std::move(presses), Values(3 * markers.count, 0.0), std::vector<Values>(n, Values(3 * PRESS * markers.count)), {}};
        for (int p = 0; p < n; ++p) {
            double* press = &found.presses[p * PRESS];
            if (std::hypot(press[X], press[Y]) < ASIDE) press[X] = press[X] < 0 ? -ASIDE : ASIDE;
            press_dome_with_slopes(library, markers, press, found.moved.data(), found.slopes[p].data());
        }
        found.left = appear(markers, found.moved);
        for (std::size_t i = 0; i < found.left.size(); ++i) {
            found.left[i] = weight(i / 2) > 0 ? shift[i] - found.left[i] : 0.0;
            if (weight(i / 2) > 0) found.squares += weight(i / 2) * found.left[i] * found.left[i];
        }
        for (double part : shared_parts(found.left.data(), 2)) found.squares -= part * part;
        found.cost = found.squares;
        for (int a = 0; a < size; ++a) found.cost += prior.weight[a % PRESS] * std::pow(found.presses[a] - prior.mean[a % PRESS], 2);
        return found;
    }

    // Adds a row (size) of slopes and what is left there to the lower triangle of the normal equations and their right side.
    void add_row(const double* row, double weight, double left, Values& normal, Values& right) const {
        for (int a = 0; a < size; ++a) {
            const double weighted = weight * row[a];
            right[a] += weighted * left;
            for (int b = 0; b <= a; ++b) normal[a * size + b] += weighted * row[b];
        }
    }

    // Normal equations (size, size) and their right side (size).
    void linearise(const Guess& at, Values& normal, Values& right) const {
        normal.assign(static_cast<std::size_t>(size) * size, 0.0);
        right.assign(size, 0.0);
        Values rows(static_cast<std::size_t>(weights.shared ? 2 * markers.count : 1) * size, 0.0);
        for (std::int64_t i = 0; i < 2 * markers.count; ++i) {
            if (!(weight(i / 2) > 0)) continue;
            double* row = rows.data() + (weights.shared ? i * size : 0);  // data(): there may be no press
            for (int p = 0; p < n; ++p) appear_slopes(markers, at.moved, at.slopes[p], i / 2, i % 2, row + p * PRESS);
            add_row(row, weight(i / 2), at.left[i], normal, right);
        }
        const Values slopes = shared_parts(rows.data(), 2 * size), left = shared_parts(at.left.data(), 2);
        for (int r = 0; r < 2 * weights.shared; ++r) add_row(slopes.data() + r * size, -1, left[r], normal, right);
        for (int a = 0; a < size; ++a) {
            for (int b = 0; b < a; ++b) normal[b * size + a] = normal[a * size + b];
            normal[a * size + a] += prior.weight[a % PRESS];
            right[a] += prior.weight[a % PRESS] * (prior.mean[a % PRESS] - at.presses[a]);
        }
    }

    // Farthest step of number a of presses, down and up: within its range, and at most its longest step.
    std::array<double, 2> farthest(const Values& presses, int a) const {
        const int number = a % PRESS;
        return {std::max(-prior.limit[number], prior.least[number] - presses[a]),
                std::min(prior.limit[number], prior.most[number] - presses[a])};
    }

    // The step that the damped normal equations ask for. Numbers that are stopped step as given, the others as if that were known. Empty
    // where there is no solution.
    Values wanted(Values normal, Values right, double damping, const std::vector<char>& stopped, const Values& given) const {
        for (int a = 0; a < size; ++a) normal[a * size + a] *= 1 + damping;
        for (int a = 0; a < size; ++a) {
            if (!stopped[a]) continue;
            for (int b = 0; b < size; ++b) {
                right[b] -= normal[b * size + a] * given[a];
                normal[a * size + b] = normal[b * size + a] = 0;
            }
            normal[a * size + a] = 1, right[a] = given[a];
        }
        const Eigen::LLT<Eigen::MatrixXd> factor(Eigen::Map<Eigen::MatrixXd>(normal.data(), size, size));
        if (factor.info() != Eigen::Success) return Values();
        Eigen::Map<Eigen::VectorXd> solved(right.data(), size);
        factor.solveInPlace(solved);
        return solved.allFinite() ? right : Values();
    }

    // The step from presses within what is allowed: the number that would go beyond it by most stops there, one after the other. Empty
    // where there is no solution.
    Values step_from(const Values& presses, const Values& normal, const Values& right, double damping) const {
        std::vector<char> stopped(size, false);
        Values step(size, 0.0);
        while (true) {
            step = wanted(normal, right, damping, stopped, step);
            int worst = -1;
            double beyond = 0, end = 0;
            for (int a = 0; a < static_cast<int>(step.size()); ++a) {
                const auto [down, up] = farthest(presses, a);
                const double allowed = std::clamp(step[a], down, up), over = std::abs(step[a] - allowed) / prior.limit[a % PRESS];
                if (!stopped[a] && over > beyond) worst = a, beyond = over, end = allowed;
            }
            if (worst < 0) return step;
            stopped[worst] = true, step[worst] = end;
        }
    }

    // The gain in cost that the normal equations expect of a step.
    double expected(const Values& step, const Values& normal, const Values& right) const {
        double gain = 0;
        for (int a = 0; a < size; ++a) {
            double change = 2 * right[a];
            for (int b = 0; b < size; ++b) change -= normal[a * size + b] * step[b];
            gain += change * step[a];
        }
        return gain;
    }

    // The largest part of a longest step.
    double largest(const Values& step) const {
        double found = 0;
        for (int a = 0; a < size; ++a) found = std::max(found, std::abs(step[a]) / prior.limit[a % PRESS]);
        return found;
    }
};

}  // namespace

DomeFit fit_dome(const DomeLibrary& library, const DomeMarkers& markers, const double* shift, const DomeWeights& weights,
                 const double* starts, int n, const DomePrior& prior) {
    const Problem problem{library, markers, shift, weights, prior, n, n * PRESS};
    Values normal, right, next(problem.size), start(starts, starts + problem.size);
    for (int a = 0; a < problem.size; ++a) start[a] = std::clamp(start[a], prior.least[a % PRESS], prior.most[a % PRESS]);
    auto best = problem.guess(start);
    problem.linearise(best, normal, right);
    double damping = DAMPED, more = 2;
    for (int turn = 0; turn < ITERATIONS; ++turn) {
        const Values step = problem.step_from(best.presses, normal, right, damping);
        if (step.empty()) break;
        for (int a = 0; a < problem.size; ++a) next[a] = best.presses[a] + step[a];
        const double expected = problem.expected(step, normal, right), enough = GAINED * best.cost;
        if (problem.largest(step) < SETTLED || expected < enough) {
            best.presses = next;  // so near that what it leaves is the same
            break;
        }
        auto trial = problem.guess(next);
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
    DomeFit fit{best.presses, Values(normal.size(), std::numeric_limits<double>::quiet_NaN()), best.left, best.squares};
    const Eigen::LLT<Eigen::MatrixXd> factor(Eigen::Map<Eigen::MatrixXd>(normal.data(), problem.size, problem.size));
    if (factor.info() == Eigen::Success)
        Eigen::Map<Eigen::MatrixXd>(fit.covariance.data(), problem.size, problem.size) =
            factor.solve(Eigen::MatrixXd::Identity(problem.size, problem.size));
    return fit;
}

}  // namespace tactile
