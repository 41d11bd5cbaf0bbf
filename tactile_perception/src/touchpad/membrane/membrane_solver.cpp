// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Gauss-Newton steps in the ranges of all dots and the fluid's pressure. Each step minimises
//   sum w_i (range_i - measured_i)^2 + sum (load_k - expected load_k)^2 / s_k^2,
// where each load is expected to be free or touched (dot_loads.hpp); the normal equations of the ranges are a band, bordered by the
// pressure.
#include "touchpad/membrane/membrane_solver.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "common/band.hpp"
#include "common/vectors.hpp"
#include "common/wide.hpp"
#include "touchpad/contact/dot_loads.hpp"

namespace tactile {
namespace {

// Standard deviation of a free dot's load in each step from nothing and from the last frame. Chosen: from loose to the mesh's
// discretisation error.
constexpr double COLD[] = {1.0, 0.7, 0.4, 0.25, 0.15, 0.2}, WARM[] = {0.4, 0.2};
// From the last frame, as many steps more at most, while dots become touched or free: the border of a contact moves by a dot a step.
// Chosen.
constexpr int MORE = 2;
constexpr double LARGEST_STEP = 4e-4, LARGEST_PRESSURE_STEP = 400.0;  // m and Pa a step; chosen, about 0.3 pitches, 0.2 rest pressures
constexpr double HOLD = 1e6;  // 1/m^2, weight of the prior at the start, for dots without other constraints; chosen, of 1 mm
constexpr double TAIL = 4.0;  // standard deviations of a range beyond which it loses weight; chosen
// A range is an outlier if it is this many standard deviations and this share of its change off its neighbours; chosen.
constexpr double OUTLIER_SIGMA = 5.0, OUTLIER_SHARE = 0.7;
constexpr std::ptrdiff_t FEW = 3;  // changes of more than two steps above which a frame starts from the measured ranges; chosen
constexpr double LEAST_INFORMATION = 1e-3, LEAST_STIFFNESS = 1e-12;  // about a load, and of the pressure; chosen against division by 0

class Steps {
 public:
    Steps(const Membrane& membrane, const MembraneFrame& frame)
        : membrane_(membrane), grid_(membrane.grid), frame_(frame), size_(grid_.size()), factor_(0, 0) {
        found_.weight.assign(frame.weight, frame.weight + size_);
        found_.pressure = frame.pressure;
        start();
        load_variance();
    }

    MembraneSolution run() {
        const double *misfits = cold_ ? std::begin(COLD) : std::begin(WARM), *end = cold_ ? std::end(COLD) : std::end(WARM);
        for (const double* misfit = misfits; misfit < end; ++misfit) {
            const bool first = misfit == misfits, last = misfit + 1 == end;
            step(*misfit, !first || !cold_, !first || last, last);
        }
        for (int more = cold_ ? 0 : MORE; more > 0 && turned_; --more) step(end[-1], true, true, true);
        respond();
        return std::move(found_);
    }

 private:
    // The last ranges plus their change, averaged over 3 x 3 dots; the measured ones without a last frame or where the change is large.
    void start() {
        std::vector<double> gone(size_);
        for (std::ptrdiff_t k = 0; k < size_; ++k) gone[k] = found_.weight[k] > 0 ? frame_.measured[k] - frame_.ranges[k] : 0.0;
        leave_out_outliers(gone);
        std::ptrdiff_t far = 0;
        for (std::ptrdiff_t k = 0; k < size_; ++k) far += found_.weight[k] > 0 && std::abs(gone[k]) > 2 * LARGEST_STEP;
        cold_ = !frame_.touched || far > FEW;
        found_.touched.assign(size_, 0.0);
        if (!cold_) std::copy(frame_.touched, frame_.touched + size_, found_.touched.begin());
        found_.ranges.resize(size_);
        for (std::ptrdiff_t k = 0; k < size_; ++k) {
            double sum = 0, count = 0;
            around(grid_, k, [&](std::ptrdiff_t j) {
                if (found_.weight[j] > 0 && (!cold_ || j == k)) sum += gone[j], count += 1;
            });
            found_.ranges[k] = frame_.ranges[k] + sum / std::max(count, 1.0);
        }
        anchor_ = found_.ranges;
    }

    // Takes the weight off ranges of inner dots whose change gone (K), m, at most one neighbour shares: glare spoils one or two dots, an
    // edge moves more.
    void leave_out_outliers(const std::vector<double>& gone) {
        std::vector<std::ptrdiff_t> alone;
        each_dot(grid_, [&](std::ptrdiff_t k, bool inner) {
            if (!(found_.weight[k] > 0) || !inner) return;
            std::pair<double, double> beside[9];  // distance to a dot's change, and that change
            const double scale = std::sqrt(found_.weight[k]);
            int off = 0;
            for (int a = 0; a < 9; ++a) {
                const double change = gone[neighbour(k, a)];
                beside[a] = {std::abs(gone[k] - change), change};
                off += beside[a].first * scale > OUTLIER_SIGMA;
            }
            if (off < 7) return;
            std::nth_element(beside, beside + 2, beside + 9);  // the nearest is the dot itself
            if (beside[2].first > OUTLIER_SHARE * std::abs(beside[2].second)) alone.push_back(k);
        });
        for (const std::ptrdiff_t k : alone) found_.weight[k] = 0;
    }

    // Variance of each dot's load from the range errors, all other loads known.
    TACTILE_WIDE void load_variance() {
        std::vector<std::ptrdiff_t> inner;
        each_dot(grid_, [&](std::ptrdiff_t k, bool is_inner) {
            if (is_inner) inner.push_back(k);
        });
        const auto count = static_cast<std::ptrdiff_t>(inner.size());
        std::vector<float> information(count);
        for (std::ptrdiff_t j = 0; j < count; j += 4) {  // four rows in one pass over the sums
            float weight[4];
            const float* row[4];
            for (std::ptrdiff_t part = 0; part < 4; ++part) {
                const std::ptrdiff_t at = std::min(j + part, count - 1);
                weight[part] = at == j + part ? static_cast<float>(found_.weight[inner[at]]) : 0.0f;
                row[part] = frame_.response + at * count;
            }
            for (std::ptrdiff_t k = 0; k < count; ++k)
                information[k] += (weight[0] * row[0][k] + weight[1] * row[1][k]) + (weight[2] * row[2][k] + weight[3] * row[3][k]);
        }
        variance_.assign(size_, 1 / LEAST_INFORMATION);
        for (std::ptrdiff_t k = 0; k < count; ++k) variance_[inner[k]] = 1 / std::max<double>(information[k], LEAST_INFORMATION);
    }

    // One step. misfit: standard deviation of a free dot's load; classify: update the contact probabilities first; robust: ranges lose
    // weight by their residuals; last: drop insignificant patches.
    void step(double misfit, bool classify, bool robust, bool last) {
        std::vector<double> places(3 * size_);
        const Vec3 origin = vec3_at(frame_.origin, 0);
        for (std::ptrdiff_t k = 0; k < size_; ++k) store(places.data(), k, origin + found_.ranges[k] * vec3_at(frame_.rays, k));
        balance_ = find_balance(membrane_, places.data(), found_.pressure);
        // two steps from the last frame share their slopes: both are near the solution
        if (slopes_.empty() || cold_) slopes_ = find_slopes(membrane_, places.data(), frame_.rays, found_.pressure, balance_);
        if (classify) update_touched(misfit, last);
        misfit_ = misfit;
        solve_for(robust);
    }

    // Contact probabilities from the measurements alone: in the loads, the pull of the dot's own prior in the last step is undone.
    void update_touched(double misfit, bool last) {
        std::vector<double> gain(size_);
        const std::vector<double> before = found_.touched;
        for (std::ptrdiff_t k = 0; k < size_; ++k) {
            const double pull = expectation(balance_.load[k], found_.touched[k], misfit_).pull;
            gain[k] = log_likelihood_ratio(balance_.load[k] + variance_[k] * pull, misfit, variance_[k]);
        }
        update_probabilities(grid_, gain.data(), found_.touched.data());
        if (last) drop_weak_patches(grid_, gain.data(), found_.touched.data());
        turned_ = false;
        for (std::ptrdiff_t k = 0; k < size_; ++k) turned_ |= (before[k] > 0.5) != (found_.touched[k] > 0.5);
    }

    // Builds the normal equations at the balance and moves ranges and pressure by their solution.
    void solve_for(bool robust) {
        Band<float> matrix(size_, 2 * grid_.columns + 2);
        std::vector<double> gradient(size_), border(size_);
        std::ptrdiff_t beside[9];  // from a dot to those of the 3 x 3 around it
        for (int a = 0; a < 9; ++a) beside[a] = neighbour(0, a);
        double stiffness = 0, slope = 0;  // second and first derivative by the pressure
        trust_.resize(size_);
        each_dot(grid_, [&](std::ptrdiff_t k, bool inner) {
            const double misfit = found_.ranges[k] - frame_.measured[k], weight = found_.weight[k];
            trust_[k] = robust ? weight / (1 + misfit * misfit * weight / (TAIL * TAIL)) : weight;
            matrix.column(k)[0] += static_cast<float>(trust_[k] + HOLD);
            gradient[k] += trust_[k] * misfit + HOLD * (found_.ranges[k] - anchor_[k]);
            if (!inner) return;
            const Expectation load = expectation(balance_.load[k], found_.touched[k], misfit_);
            const double by_pressure = balance_.by_pressure[k], *slopes = slopes_.data() + 9 * k;
            float part[9];
            for (int a = 0; a < 9; ++a) part[a] = static_cast<float>(slopes[a]);
#pragma GCC unroll 9
            for (int a = 0; a < 9; ++a) {
                const std::ptrdiff_t i = k + beside[a];
                gradient[i] += slopes[a] * load.pull;
                border[i] += slopes[a] * load.weight * by_pressure;
                const float scaled = static_cast<float>(slopes[a] * load.weight);
                float* row = matrix.column(i) - a % 3 + 1;  // then a row of dots further in each line
                for (int line = a / 3; line < 3; ++line, row += grid_.columns) {
                    for (int c = line == a / 3 ? a % 3 : 0; c < 3; ++c) row[c - 1] += scaled * part[3 * line + c];
                }
            }
            stiffness += load.weight * by_pressure * by_pressure;
            slope += load.pull * by_pressure;
        });
        if (!factorise(matrix)) return;
        std::vector<double> by_border = border;
        solve(matrix, by_border.data(), gradient.data());
        stiffness = std::max(stiffness - product(border, by_border), LEAST_STIFFNESS);
        const double change = std::clamp((product(border, gradient) - slope) / stiffness, -LARGEST_PRESSURE_STEP, LARGEST_PRESSURE_STEP);
        for (std::ptrdiff_t k = 0; k < size_; ++k) {
            found_.ranges[k] -= std::clamp(gradient[k] + change * by_border[k], -LARGEST_STEP, LARGEST_STEP);
        }
        found_.pressure += change;
        factor_ = std::move(matrix), border_ = std::move(border), by_border_ = std::move(by_border), stiffness_ = stiffness;
    }

    // First-order response to the frame's change of the measured ranges, by the equations of the last step.
    void respond() {
        found_.moved.assign(size_, 0.0);
        if (factor_.size == 0) return;
        for (std::ptrdiff_t k = 0; k < size_; ++k) found_.moved[k] = trust_[k] * frame_.change[k];
        solve(factor_, found_.moved.data());
        const double change = product(border_, found_.moved) / stiffness_;
        for (std::ptrdiff_t k = 0; k < size_; ++k) found_.moved[k] += change * by_border_[k];
        found_.lifted = -change;
    }

    // Dot in slot 0 to 8 of the 3 x 3 around an inner dot, row by row.
    std::ptrdiff_t neighbour(std::ptrdiff_t k, int place) const {
        return k + (place / 3 - 1) * grid_.columns + place % 3 - 1;
    }

    static double product(const std::vector<double>& a, const std::vector<double>& b) {
        double sum = 0;
        for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
        return sum;
    }

    const Membrane& membrane_;
    const Grid grid_;
    const MembraneFrame& frame_;
    const std::ptrdiff_t size_;
    MembraneSolution found_;
    bool cold_ = true, turned_ = false;  // turned_: dots became touched or free in the last step
    std::vector<double> anchor_, variance_, trust_;
    double misfit_ = 1.0;
    Balance balance_;
    std::vector<double> slopes_;
    Band<float> factor_;  // of the last step's equations, with the pressure's column, the solution for it, and its Schur complement
    std::vector<double> border_, by_border_;
    double stiffness_ = 1.0;
};

}  // namespace

MembraneSolution solve_membrane(const Membrane& membrane, const MembraneFrame& frame) {
    return Steps(membrane, frame).run();
}

}  // namespace tactile
