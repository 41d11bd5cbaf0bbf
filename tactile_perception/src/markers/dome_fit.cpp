// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "markers/dome_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactile {
namespace {

constexpr int ITERATIONS = 14;           // at most, trials included. Chosen
constexpr double SETTLED = 3e-3;         // of the longest step: a smaller one ends the iteration. Chosen
constexpr double GAINED = 1e-4;          // of the cost: an iteration that gains less is the last. Chosen
constexpr double NEAREST = 0.1;          // least height of a point over the eye, of its untouched height. Chosen
constexpr double DAMPED = 1e-3;          // first damping, over the normal equations' diagonal. Chosen
constexpr double MORE = 10, LESS = 0.1;  // change of the damping after a step that failed, and after one that succeeded. Chosen
constexpr double ASIDE = 2e-5;           // m, least distance of a place from the axis, on which the meridian is undefined. Chosen

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

// Solves the symmetric positive definite system (n, n) for right (n, m), both overwritten, by Cholesky's method. Returns false where it
// is not positive definite.
bool solve(Values& matrix, Values& right, int n, int m) {
    for (int j = 0; j < n; ++j) {
        for (int i = j; i < n; ++i) {
            double sum = matrix[i * n + j];
            for (int k = 0; k < j; ++k) sum -= matrix[i * n + k] * matrix[j * n + k];
            if (i == j && !(sum > 0)) return false;
            matrix[i * n + j] = i == j ? std::sqrt(sum) : sum / matrix[j * n + j];
        }
    }
    for (int c = 0; c < m; ++c) {
        for (int i = 0; i < n; ++i) {
            for (int k = 0; k < i; ++k) right[i * m + c] -= matrix[i * n + k] * right[k * m + c];
            right[i * m + c] /= matrix[i * n + i];
        }
        for (int i = n - 1; i >= 0; --i) {
            for (int k = i + 1; k < n; ++k) right[i * m + c] -= matrix[k * n + i] * right[k * m + c];
            right[i * m + c] /= matrix[i * n + i];
        }
    }
    return true;
}

struct Problem {
    const DomeLibrary& library;
    const DomeMarkers& markers;
    const double *shift, *weight;
    const DomePrior& prior;
    int n, size;

    // Displacements (K, 3) under presses, their slopes (K, PRESS, 3) by each, and the residuals (K, 2) that they leave; squares: weighted
    // sum; cost: with the prior's.
    struct Guess {
        Values presses, moved;
        std::vector<Values> slopes;
        Values left;
        double squares = 0, cost = 0;
    };

    Guess guess(Values presses) const {
        Guess found{std::move(presses), Values(3 * markers.count, 0.0), std::vector<Values>(n, Values(3 * PRESS * markers.count)), {}};
        for (int p = 0; p < n; ++p) {
            double* press = &found.presses[p * PRESS];
            if (std::hypot(press[X], press[Y]) < ASIDE) press[X] = press[X] < 0 ? -ASIDE : ASIDE;
            press_dome_with_slopes(library, markers, press, found.moved.data(), found.slopes[p].data());
        }
        found.left = appear(markers, found.moved);
        for (std::size_t i = 0; i < found.left.size(); ++i) {
            found.left[i] = weight[i / 2] > 0 ? shift[i] - found.left[i] : 0.0;
            if (weight[i / 2] > 0) found.squares += weight[i / 2] * found.left[i] * found.left[i];
        }
        found.cost = found.squares;
        for (int a = 0; a < size; ++a) found.cost += prior.weight[a % PRESS] * std::pow(found.presses[a] - prior.mean[a % PRESS], 2);
        return found;
    }

    // Normal equations (size, size) and their right side (size).
    void linearise(const Guess& at, Values& normal, Values& right) const {
        normal.assign(static_cast<std::size_t>(size) * size, 0.0);
        right.assign(size, 0.0);
        Values row(size);
        for (std::int64_t i = 0; i < 2 * markers.count; ++i) {
            if (!(weight[i / 2] > 0)) continue;
            for (int p = 0; p < n; ++p) appear_slopes(markers, at.moved, at.slopes[p], i / 2, i % 2, &row[p * PRESS]);
            for (int a = 0; a < size; ++a) {
                const double weighted = weight[i / 2] * row[a];
                right[a] += weighted * at.left[i];
                for (int b = 0; b < size; ++b) normal[a * size + b] += weighted * row[b];
            }
        }
        for (int a = 0; a < size; ++a) {
            normal[a * size + a] += prior.weight[a % PRESS];
            right[a] += prior.weight[a % PRESS] * (prior.mean[a % PRESS] - at.presses[a]);
        }
    }

    // The presses after the step, shortened to its limits; their change over the longest step. Infinite where there is no solution.
    double step_from(const Values& presses, Values normal, Values step, double damping, Values& next) const {
        for (int a = 0; a < size; ++a) normal[a * size + a] *= 1 + damping;
        next = presses;
        if (!solve(normal, step, size, 1)) return std::numeric_limits<double>::infinity();
        double largest = 0;
        for (int a = 0; a < size; ++a) {
            if (!std::isfinite(step[a])) return std::numeric_limits<double>::infinity();
            largest = std::max(largest, std::abs(step[a]) / prior.limit[a % PRESS]);
        }
        const double share = largest > 1 ? 1 / largest : 1;
        for (int a = 0; a < size; ++a) next[a] = std::clamp(presses[a] + share * step[a], prior.least[a % PRESS], prior.most[a % PRESS]);
        return largest;
    }
};

}  // namespace

DomeFit fit_dome(const DomeLibrary& library, const DomeMarkers& markers, const double* shift, const double* weight, const double* starts,
                 int n, const DomePrior& prior) {
    const Problem problem{library, markers, shift, weight, prior, n, n * PRESS};
    Values normal, right, next, start(starts, starts + problem.size);
    for (int a = 0; a < problem.size; ++a) start[a] = std::clamp(start[a], prior.least[a % PRESS], prior.most[a % PRESS]);
    auto best = problem.guess(start);
    problem.linearise(best, normal, right);
    double damping = DAMPED;
    for (int turn = 0; turn < ITERATIONS; ++turn) {
        const double largest = problem.step_from(best.presses, normal, right, damping, next);
        if (!std::isfinite(largest)) break;
        auto trial = problem.guess(next);
        const double gained = best.cost - trial.cost;
        if (gained > 0) {
            best = std::move(trial);
            problem.linearise(best, normal, right);
            damping *= LESS;
        } else {
            damping *= MORE;
        }
        if (largest < SETTLED || (gained >= 0 && gained < GAINED * best.cost)) break;
    }
    DomeFit fit{best.presses, Values(normal.size(), 0.0), best.left, best.squares};
    for (int a = 0; a < problem.size; ++a) fit.covariance[a * problem.size + a] = 1;
    if (!solve(normal, fit.covariance, problem.size, problem.size))
        std::fill(fit.covariance.begin(), fit.covariance.end(), std::numeric_limits<double>::quiet_NaN());
    return fit;
}

}  // namespace tactile
