// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dome_fit.hpp"

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
constexpr double ASIDE = 2e-5;           // m, finite difference of the place. Chosen
constexpr double THICKER = 1e-3;         // finite difference of the log radius. Chosen

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

// Slope (K, 2) of the apparent displacement, at moved (K, 3), along a slope of the displacement (K, 3).
Values appear_slope(const DomeMarkers& markers, const Values& moved, const Values& slope) {
    Values shown(2 * markers.count);
    for (std::int64_t k = 0; k < markers.count; ++k) {
        const double *point = markers.points + 3 * k, *eye = markers.eyes + 3 * k, *by = &moved[3 * k], *along = &slope[3 * k];
        const double height = std::max(point[2] - eye[2] + by[2], NEAREST * (point[2] - eye[2]));
        for (int axis = 0; axis < 2; ++axis) {
            const double offset = (point[axis] - eye[axis] + by[axis]) / height;
            const double shift = (along[axis] - offset * along[2]) * (markers.plane_z - eye[2]) / height;
            shown[2 * k + axis] = std::isfinite(shift) ? shift : 0.0;
        }
    }
    return shown;
}

// Slopes (PRESS, 3 K) of the displacement by the numbers of a press.
std::vector<Values> displacement_slopes(const DomeLibrary& library, const DomeMarkers& markers, const double* press) {
    const Meridian here = meridian_of(library, press);
    const OnMesh at(library, markers, here);
    const PressFields fields = fields_of(library, press, here);
    std::vector<Values> slopes(PRESS, Values(3 * markers.count, 0.0));
    add_displacement(library, at, here, fields.by_depth, 1, slopes[DEPTH].data());
    add_displacement(library, at, here, fields.by_friction, 1, slopes[FRICTION].data());
    add_displacement(library, at, here, fields.by_along, here.cosine, slopes[DRAG_X].data());
    add_displacement(library, at, here, fields.by_across, -here.sine, slopes[DRAG_X].data());
    add_displacement(library, at, here, fields.by_along, here.sine, slopes[DRAG_Y].data());
    add_displacement(library, at, here, fields.by_across, here.cosine, slopes[DRAG_Y].data());
    const double steps[] = {ASIDE, ASIDE, 0, THICKER};
    for (const int number : {X, Y, RADIUS}) {  // those that move the mesh
        double other[PRESS];
        std::copy_n(press, PRESS, other);
        other[number] += steps[number];
        const Meridian there = meridian_of(library, other);
        DomeField field = fields.value;
        field.add(there.shift - here.shift, fields.by_shift);
        field.add(there.along - here.along, fields.by_along);
        field.add(there.across - here.across, fields.by_across);
        if (number == RADIUS) field.add(steps[number], fields.by_radius);
        Values& slope = slopes[number];
        add_displacement(library, OnMesh(library, markers, there), there, field, 1 / steps[number], slope.data());
        add_displacement(library, at, here, fields.value, -1 / steps[number], slope.data());
    }
    return slopes;
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

    // Displacements (K, 3) under presses, and the residuals (K, 2) that they leave; squares: weighted sum; cost: with the prior's.
    struct Guess {
        Values presses, moved, left;
        double squares, cost;
    };

    Guess guess(Values presses) const {
        Guess found{std::move(presses), Values(3 * markers.count), {}, 0, 0};
        press_dome(library, markers, found.presses.data(), n, found.moved.data());
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
        std::vector<Values> slopes;
        for (int p = 0; p < n; ++p) {
            for (const Values& slope : displacement_slopes(library, markers, &at.presses[p * PRESS]))
                slopes.push_back(appear_slope(markers, at.moved, slope));
        }
        normal.assign(static_cast<std::size_t>(size) * size, 0.0);
        right.assign(size, 0.0);
        Values weighted(at.left.size());
        for (int a = 0; a < size; ++a) {
            for (std::size_t i = 0; i < weighted.size(); ++i) weighted[i] = weight[i / 2] > 0 ? weight[i / 2] * slopes[a][i] : 0.0;
            for (std::size_t i = 0; i < weighted.size(); ++i) right[a] += weighted[i] * at.left[i];
            for (int b = 0; b <= a; ++b) {
                double sum = 0;
                for (std::size_t i = 0; i < weighted.size(); ++i) sum += weighted[i] * slopes[b][i];
                normal[a * size + b] = normal[b * size + a] = sum;
            }
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
    DomeFit fit{best.presses, Values(normal.size(), 0.0), best.squares};
    for (int a = 0; a < problem.size; ++a) fit.covariance[a * problem.size + a] = 1;
    if (!solve(normal, fit.covariance, problem.size, problem.size))
        std::fill(fit.covariance.begin(), fit.covariance.end(), std::numeric_limits<double>::quiet_NaN());
    return fit;
}

}  // namespace tactile
