// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Positions of all dots from measured ranges and the balance of forces. Gauss-Newton steps in the ranges of all dots and the fluid's
// pressure minimise
//   sum w_i (range_i - measured_i)^2 + sum (load_k - expected load_k)^2 / s_k^2,
// where each load is expected to be free or touched; the normal equations of the ranges are a band, bordered by the pressure.
#include "touchpad/membrane.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "common/band_matrix.hpp"
#include "common/grid.hpp"
#include "common/median.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

// ---- Unseen dots.

constexpr double UNKNOWN_WEIGHT = 0.5;  // of a neighbour whose value is unknown; a known one weighs 1

// values (K, count): where known is false, each is replaced by the mean of its up to eight neighbours, as a soap film spans a hole
// (Laplace's equation); unknown neighbours weigh half. All are 0 where nothing is known.
void fill_holes(Grid grid, double* values, const std::vector<std::uint8_t>& known, std::ptrdiff_t count) {
    std::vector<std::ptrdiff_t> holes, number(grid.size());  // number: of a hole among the holes
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        number[k] = static_cast<std::ptrdiff_t>(holes.size());
        if (!known[k]) holes.push_back(k);
    }
    const auto size = static_cast<std::ptrdiff_t>(holes.size());
    for (const std::ptrdiff_t k : holes) std::fill_n(values + k * count, count, 0.0);
    if (size == 0 || size == grid.size()) return;
    // Neighbours are at most columns + 1 dots apart, so the matrix is a band.
    BandMatrix matrix(size, std::min(size - 1, grid.columns + 1));
    std::vector<double> right(size * count);  // one row for each of the values
    for (std::ptrdiff_t h = 0; h < size; ++h) {
        beside(grid, holes[h], [&](std::ptrdiff_t near) {
            matrix.row(h)[h] += known[near] ? 1.0 : UNKNOWN_WEIGHT;
            if (!known[near]) matrix.row(h)[number[near]] = -UNKNOWN_WEIGHT;
            for (std::ptrdiff_t i = 0; known[near] && i < count; ++i) right[i * size + h] += values[near * count + i];
        });
    }
    matrix.factor(true);  // positive definite: each hole is linked to a known dot
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        matrix.solve(right.data() + i * size);
        for (std::ptrdiff_t h = 0; h < size; ++h) values[holes[h] * count + i] = right[i * size + h];
    }
}

// ---- Loads.

constexpr double MAX_LOG_ODDS = 30.0;                   // of a load
constexpr double PRESSURE_ROUNDS[] = {0.3, 0.1, 0.06};  // scale of a free dot's load in each round, down to the discretisation error
constexpr double MIN_PRESSURE_SHARE = 0.1;              // of the rest pressure

// Standard deviation of a touched dot's load: 1 under a face, hardly less anywhere, but 2 to 4 under a ball or an edge.
double touched_spread(const MembraneModel& model, double load) {
    return load < model.touched ? model.lighter : model.heavier;
}

// Robust mean of the pressures wanted, at which each inner dot would be free: from their median, by reweighting.
double fluid_pressure(const std::vector<double>& wanted, double least) {
    double pressure = std::max(least, smallest(wanted, static_cast<std::ptrdiff_t>(wanted.size() / 2)));
    for (const double misfit : PRESSURE_ROUNDS) {
        double total = 0, sum = 0;
        for (const double value : wanted) {
            const double off = (value / pressure - 1) / misfit, weight = 1 / ((1 + off * off) * (1 + off * off));
            total += weight, sum += weight * value;
        }
        pressure = std::max(least, sum / total);
    }
    return pressure;
}

// Log likelihood ratio, touched over free, of a load. misfit: standard deviation of a free dot's load; variance: from measurement errors.
double log_likelihood_ratio(const MembraneModel& model, double load, double misfit, double variance) {
    const double narrow = misfit * misfit + variance, off = load - model.touched, spread = touched_spread(model, load);
    // the two halves of the touched loads' distribution meet at its mode: their mean width normalises it
    const double width = (std::sqrt(model.lighter * model.lighter + variance) + std::sqrt(model.heavier * model.heavier + variance)) / 2;
    return (load * load / narrow - off * off / (spread * spread + variance) + std::log(narrow / (width * width))) / 2;
}

// Weight of a load that is touched with some probability, and the weight times the load's residual from its expected value.
struct Expectation {
    double weight, pull;
};

Expectation expectation(const MembraneModel& model, double load, double touched, double misfit) {
    const double spread = touched_spread(model, load), free = (1 - touched) / (misfit * misfit), held = touched / (spread * spread);
    return {free + held, (free + held) * load - held * model.touched};
}

// Replaces the probabilities touched (K) by those that the log likelihood ratios gain (K) and the neighbours' last ones say.
void update_probabilities(const MembraneModel& model, Grid grid, const double* gain, double* touched) {
    const std::vector<double> last(touched, touched + grid.size());
    each_dot(grid, [&](std::ptrdiff_t k, bool inner) {
        touched[k] = 0;
        if (!inner) return;
        const double beside = (last[k - 1] + last[k + 1] + last[k - grid.columns] + last[k + grid.columns]) / 4;
        touched[k] = 1 / (1 + std::exp(-std::clamp(gain[k] + model.coupling * (2 * beside - 1), -MAX_LOG_ODDS, MAX_LOG_ODDS)));
    });
}

// The force of skin and fluid at this pressure on dot k, N.
Eigen::Vector3d force_at(const Skin& skin, const Balance& balance, double pressure, std::ptrdiff_t k) {
    const Eigen::Vector3d pushed = balance.area[k] * vec3_at(balance.normal.data(), k) - vec3_at(skin.residual.data(), k);
    return vec3_at(balance.elastic.data(), k) + pressure * pushed;
}

// Sets normals, forces and loads at the positions. The fluid's pressure is that at which most inner dots are free, at least a tenth of that
// at rest. Outermost dots have no balance: their forces and loads are 0.
void find_loads(const Skin& skin, DotLoads& found) {
    Balance usual = find_balance(skin, found.xyz.data(), skin.pressure);
    std::vector<double> wanted;  // by each inner dot: that at which it would be free
    each_dot(skin.grid, [&](std::ptrdiff_t k, bool inner) {
        const double value = skin.pressure - usual.load[k] / usual.by_pressure[k];
        if (inner && std::isfinite(value)) wanted.push_back(value);
    });
    const double pressure = wanted.empty() ? skin.pressure : fluid_pressure(wanted, MIN_PRESSURE_SHARE * skin.pressure);
    found.force.assign(found.xyz.size(), 0), found.load.assign(skin.grid.size(), 0);
    each_dot(skin.grid, [&](std::ptrdiff_t k, bool inner) {
        if (!inner) return;
        const Eigen::Vector3d left = force_at(skin, usual, pressure, k);
        store(found.force.data(), k, -1.0 * left);  // what the object balances
        found.load[k] = left.dot(vec3_at(usual.normal.data(), k)) / (pressure * usual.area[k]);
    });
    found.normal = std::move(usual.normal);
}

// ---- A frame.

constexpr double MIN_DISPLACEMENT = 0.5e-3,
                 MIN_DISPLACED_SHARE = 0.02;  // m; the scale is updated while a larger share of the dots is displaced by more
constexpr double SCALE_STEP = 0.01;           // relative step of the finite difference
constexpr double MAX_SCALE_ERROR = 0.2;       // of the scale, and of its step
constexpr double MAX_FREE_LOAD = 0.3;         // sum of the probabilities of a load over 3 x 3 dots, below which a dot counts as free

// The measurements of a frame for all dots. rays (K, 3): unit; measured (K), m, with weight (K), 1/m^2, 0 where unknown; displaced (K), m:
// what is measured less the range at rest, 0 where unknown; last (K), m: ranges in the last frame; seen (K).
struct WholeFrame {
    std::vector<double> rays, measured, weight, displaced, last;
    std::vector<std::uint8_t> seen;
};

// Directions of unseen dots: turned (K, 3), the change of direction of the seen ones since the last frame, is spread over the grid.
void turn_unseen(Grid grid, std::vector<double> turned, WholeFrame& frame) {
    fill_holes(grid, turned.data(), frame.seen, 3);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (frame.seen[k]) continue;
        const Eigen::Vector3d ray = vec3_at(frame.rays.data(), k) + vec3_at(turned.data(), k);
        store(frame.rays.data(), k, ray.normalized());
    }
}

// The part along the surface of the force on dot k over the pressure.
Eigen::Vector3d along_surface(const Skin& skin, const Balance& balance, double pressure, std::ptrdiff_t k) {
    const Eigen::Vector3d force = force_at(skin, balance, pressure, k), normal = vec3_at(balance.normal.data(), k);
    return 1 / (pressure * balance.area[k]) * (force - force.dot(normal) * normal);
}

// scale: factor on what is measured less the range at rest. Unseen dots keep their direction of the last frame, plus the motion of their
// neighbours.
WholeFrame whole_frame(Grid grid, const Eigen::Vector3d& from, const double* rest, const double* last_places, const SeenRanges& seen,
                       double scale) {
    const auto size = static_cast<std::size_t>(grid.size());
    WholeFrame found{std::vector<double>(3 * size), std::vector<double>(size), std::vector<double>(size),
                     std::vector<double>(size),     std::vector<double>(size), std::vector<std::uint8_t>(size)};
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        const Eigen::Vector3d away = vec3_at(last_places, k) - from;
        found.last[k] = away.norm();
        store(found.rays.data(), k, 1 / found.last[k] * away);
    }
    std::vector<double> turned(3 * size);
    for (std::ptrdiff_t i = 0; i < seen.count; ++i) {
        const std::ptrdiff_t k = seen.id[i];
        const Eigen::Vector3d ray = vec3_at(seen.rays, i);
        store(turned.data(), k, ray - vec3_at(found.rays.data(), k));
        store(found.rays.data(), k, ray);
        const double at_rest = (vec3_at(rest, k) - from).norm(), displaced = scale * (seen.ranges[i] - at_rest);
        const double weight = 1 / (seen.sigma[i] * seen.sigma[i]);
        const bool good = std::isfinite(displaced) && std::isfinite(weight);
        found.seen[k] = true;
        found.weight[k] = good ? weight : 0;
        found.displaced[k] = good ? displaced : 0;
        found.measured[k] = good ? at_rest + displaced : 0;
    }
    if (std::find(found.seen.begin(), found.seen.end(), 0) != found.seen.end()) turn_unseen(grid, std::move(turned), found);
    return found;
}

// How the forces along the surface lean on a common scale of the displacements. With the residual r (K, 3) of the forces along the surface
// over the pressure at free dots, each weighted by 1 / (1 + r^2 / (2 spread)^2)^2, and its derivative r' by the scale: curvature, the sum
// of r'^2, and gradient, that of r r'.
struct Leaning {
    double curvature, gradient;
};

// What changes if all displacements double: the ranges by moved (K), m, and the pressure by lifted, Pa.
struct Response {
    std::vector<double> moved;
    double lifted;
};

// rays (K, 3): unit; share: step of the displacements, of themselves; spread: standard deviation of r by other causes.
Leaning scale_leaning(const Skin& skin, const MembraneState& state, const double* rays, const Response& doubled, double share,
                      double spread) {
    const Grid grid = skin.grid;
    const double higher = state.fluid_pressure + share * doubled.lifted;
    std::vector<double> moved_there(state.xyz);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k)
        store(moved_there.data(), k, vec3_at(moved_there.data(), k) + share * doubled.moved[k] * vec3_at(rays, k));
    const Balance here = find_balance(skin, state.xyz.data(), state.fluid_pressure), there = find_balance(skin, moved_there.data(), higher);
    Leaning found{0, 0};
    each_dot(grid, [&](std::ptrdiff_t k, bool inner) {
        double loaded = 0;
        around(grid, k, [&](std::ptrdiff_t j) { loaded += state.touched[j]; });
        if (!inner || !(loaded < MAX_FREE_LOAD)) return;
        const Eigen::Vector3d pull = along_surface(skin, here, state.fluid_pressure, k),
                   slope = 1 / SCALE_STEP * (along_surface(skin, there, higher, k) - pull);
        const double off = 1 + pull.squaredNorm() / (4 * spread * spread), weight = 1 / (off * off);
        found.curvature += weight * slope.squaredNorm();
        found.gradient += weight * slope.dot(pull);
    });
    return found;
}

// ---- The solution.

// Standard deviation of a free dot's load in each step from nothing and from the last frame, over the model's: from loose to that.
constexpr double COLD[] = {5, 3.5, 2, 1.25, 0.75, 1}, WARM[] = {2, 1};
constexpr double MAX_RANGE_STEP = 4e-4, MAX_PRESSURE_STEP = 400.0;  // m and Pa a step, about 0.3 pitches and 0.2 rest pressures
constexpr double PRIOR_WEIGHT = 1e6;  // 1/m^2, of the start, for dots without other constraints: a standard deviation of 1 mm
constexpr std::ptrdiff_t MAX_FAST_DOTS =
    3;  // dots that changed by more than two steps, above which a frame starts from the measured ranges
constexpr double MIN_PRESSURE_STIFFNESS = 1e-12;  // against division by 0

// Sets touched (K) to 0 in connected patches whose summed log likelihood ratios gain (K) are not significant.
void drop_weak_patches(const MembraneModel& model, Grid grid, const double* gain, double* touched) {
    std::vector<std::uint8_t> held(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) held[k] = touched[k] > 0.5;
    std::vector<std::int32_t> patch;
    std::vector<double> evidence(1 + components(held.data(), grid.rows, grid.columns, true, patch).size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) evidence[patch[k]] += std::min(gain[k], model.most);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (evidence.size() == 1 || (patch[k] > 0 && !(evidence[patch[k]] > model.evidence))) touched[k] = 0;
    }
}

// ranges (K), m; touched (K): probability that a dot carries a load; weight (K): without the ranges that were left out; pressure, Pa.
struct Solution {
    std::vector<double> ranges, touched, weight;
    double pressure;
};

class Steps {
 public:
    // last: state of the last frame, empty where there is none; matrix: memory for the equations.
    Steps(const MembraneModel& model, const Skin& skin, const Eigen::Vector3d& origin, const WholeFrame& frame, const MembraneState& last,
          BandMatrix& matrix)
        : model_(model), skin_(skin), grid_(skin.grid), origin_(origin), frame_(frame), size_(grid_.size()), matrix_(matrix) {
        found_.weight = frame.weight;
        found_.pressure = last.xyz.empty() ? skin.pressure : last.fluid_pressure;
        start(last.touched);
    }

    Solution run() {
        const double *misfits = cold_ ? std::begin(COLD) : std::begin(WARM), *end = cold_ ? std::end(COLD) : std::end(WARM);
        for (const double* misfit = misfits; misfit < end; ++misfit) {
            const bool first = misfit == misfits;
            step(model_.misfit * *misfit, !first || !cold_, !first, misfit + 1 == end);
        }
        return std::move(found_);
    }

    // First-order change of ranges (K), m, and pressure, Pa, for the frame's displacements, by the equations of the last step.
    Response respond() {
        Response found{std::vector<double>(size_), 0};
        if (!solved_) return found;
        for (std::ptrdiff_t k = 0; k < size_; ++k) found.moved[k] = trust_[k] * frame_.displaced[k];
        matrix_.solve(found.moved.data());
        found.lifted = -product(border_, found.moved) / stiffness_;
        for (std::ptrdiff_t k = 0; k < size_; ++k) found.moved[k] -= found.lifted * by_border_[k];
        return found;
    }

 private:
    // The last ranges plus their change, averaged over 3 x 3 dots; the measured ones without a last frame or where the change is large.
    void start(const std::vector<double>& touched) {
        std::vector<double> gone(size_);
        for (std::ptrdiff_t k = 0; k < size_; ++k) gone[k] = found_.weight[k] > 0 ? frame_.measured[k] - frame_.last[k] : 0.0;
        std::ptrdiff_t far = 0;
        for (std::ptrdiff_t k = 0; k < size_; ++k) far += found_.weight[k] > 0 && std::abs(gone[k]) > 2 * MAX_RANGE_STEP;
        cold_ = touched.empty() || far > MAX_FAST_DOTS;
        found_.touched.assign(size_, 0.0);
        if (!cold_) found_.touched = touched;
        found_.ranges.resize(size_);
        for (std::ptrdiff_t k = 0; k < size_; ++k) {
            double sum = 0, count = 0;
            around(grid_, k, [&](std::ptrdiff_t j) {
                if (found_.weight[j] > 0 && (!cold_ || j == k)) sum += gone[j], count += 1;
            });
            found_.ranges[k] = frame_.last[k] + sum / std::max(count, 1.0);
        }
        anchor_ = found_.ranges;
    }

    // One step. misfit: standard deviation of a free dot's load; classify: update the contact probabilities first; robust: ranges lose
    // weight by their residuals; last: drop insignificant patches.
    void step(double misfit, bool classify, bool robust, bool last) {
        std::vector<double> positions(3 * size_);
        for (std::ptrdiff_t k = 0; k < size_; ++k) store(positions.data(), k, origin_ + found_.ranges[k] * vec3_at(frame_.rays.data(), k));
        balance_ = find_balance(skin_, positions.data(), found_.pressure);
        // two steps from the last frame share their slopes: both are near the solution
        if (slopes_.empty() || cold_) {
            slopes_ = find_slopes(skin_, positions.data(), frame_.rays.data(), found_.pressure, balance_);
            find_variance();
        }
        if (classify) update_touched(misfit, last);
        misfit_ = misfit;
        solve_for(robust);
    }

    // Variance of each inner dot's load by the errors of the ranges around it.
    void find_variance() {
        variance_.assign(size_, 0.0);
        each_dot(grid_, [&](std::ptrdiff_t k, bool inner) {
            for (int a = 0; a < 9 && inner; ++a)
                variance_[k] += slopes_[9 * k + a] * slopes_[9 * k + a] / (found_.weight[neighbour(k, a)] + PRIOR_WEIGHT) / model_.smoothed;
        });
    }

    // Contact probabilities from the measurements alone: in the loads, the pull of the dot's own prior in the last step is undone.
    void update_touched(double misfit, bool last) {
        std::vector<double> gain(size_);
        for (std::ptrdiff_t k = 0; k < size_; ++k) {
            const double pull = expectation(model_, balance_.load[k], found_.touched[k], misfit_).pull;
            gain[k] = log_likelihood_ratio(model_, balance_.load[k] + variance_[k] * pull, misfit, variance_[k]);
        }
        update_probabilities(model_, grid_, gain.data(), found_.touched.data());
        if (last) drop_weak_patches(model_, grid_, gain.data(), found_.touched.data());
    }

    // Builds the normal equations at the balance and moves ranges and pressure by their solution.
    void solve_for(bool robust) {
        matrix_.clear();
        std::vector<double> gradient(size_);
        border_.assign(size_, 0.0);
        std::ptrdiff_t beside[9];  // from a dot to those of the 3 x 3 around it
        for (int a = 0; a < 9; ++a) beside[a] = neighbour(0, a);
        double stiffness = 0, slope = 0;  // second and first derivative by the pressure
        trust_.resize(size_);
        each_dot(grid_, [&](std::ptrdiff_t k, bool inner) {
            const double misfit = found_.ranges[k] - frame_.measured[k], weight = found_.weight[k];
            trust_[k] = robust ? weight / (1 + misfit * misfit * weight / (model_.tail * model_.tail)) : weight;
            matrix_.row(k)[k] += static_cast<float>(trust_[k] + PRIOR_WEIGHT);
            gradient[k] += trust_[k] * misfit + PRIOR_WEIGHT * (found_.ranges[k] - anchor_[k]);
            if (!inner) return;
            const Expectation load = expectation(model_, balance_.load[k], found_.touched[k], misfit_);
            const double by_pressure = balance_.by_pressure[k], *slopes = slopes_.data() + 9 * k;
            float part[9];
            for (int a = 0; a < 9; ++a) part[a] = static_cast<float>(slopes[a]);
#pragma GCC unroll 9
            for (int a = 0; a < 9; ++a) {
                const std::ptrdiff_t i = k + beside[a];
                gradient[i] += slopes[a] * load.pull;
                border_[i] += slopes[a] * load.weight * by_pressure;
                const float scaled = static_cast<float>(slopes[a] * load.weight);
                float* row = matrix_.row(i) + k - grid_.columns;  // then a row of dots further in each line
                for (int line = 0; line < 3; ++line, row += grid_.columns) {
                    for (int c = 0; c < 3; ++c) row[c - 1] += scaled * part[3 * line + c];
                }
            }
            stiffness += load.weight * by_pressure * by_pressure;
            slope += load.pull * by_pressure;
        });
        solved_ = matrix_.factor(true);
        if (!solved_) return;
        by_border_ = border_;
        matrix_.solve(by_border_.data());
        matrix_.solve(gradient.data());
        stiffness_ = std::max(stiffness - product(border_, by_border_), MIN_PRESSURE_STIFFNESS);
        const double change = std::clamp((product(border_, gradient) - slope) / stiffness_, -MAX_PRESSURE_STEP, MAX_PRESSURE_STEP);
        for (std::ptrdiff_t k = 0; k < size_; ++k) {
            found_.ranges[k] -= std::clamp(gradient[k] + change * by_border_[k], -MAX_RANGE_STEP, MAX_RANGE_STEP);
        }
        found_.pressure += change;
    }

    // Dot in slot 0 to 8 of the 3 x 3 around an inner dot, row by row.
    std::ptrdiff_t neighbour(std::ptrdiff_t k, int slot) const {
        return k + (slot / 3 - 1) * grid_.columns + slot % 3 - 1;
    }

    static double product(const std::vector<double>& a, const std::vector<double>& b) {
        double sum = 0;
        for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
        return sum;
    }

    const MembraneModel& model_;
    const Skin& skin_;
    const Grid grid_;
    const Eigen::Vector3d origin_;
    const WholeFrame& frame_;
    const std::ptrdiff_t size_;
    Solution found_;
    bool cold_ = true;
    std::vector<double> anchor_, variance_, trust_;
    double misfit_ = 1.0;
    Balance balance_;
    std::vector<double> slopes_;
    BandMatrix& matrix_;  // factors of the last step's equations; the pressure's column, the solution for it, and its Schur complement
    std::vector<double> border_, by_border_;
    double stiffness_ = 1.0;
    bool solved_ = false;
};

}  // namespace

const MembraneState& Membrane::solve(const SeenRanges& seen) {
    const Grid grid = skin_.grid;
    const bool is_first = state_.xyz.empty();
    const WholeFrame frame = whole_frame(grid, origin_, skin_.rest.data(), is_first ? skin_.rest.data() : state_.xyz.data(), seen, scale());
    Steps steps(model_, skin_, origin_, frame, state_, matrix_);
    Solution found = steps.run();
    MembraneState state{std::vector<double>(frame.rays.size()), std::move(found.ranges), std::move(found.touched), found.pressure,
                        frame.seen};
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) store(state.xyz.data(), k, origin_ + state.ranges[k] * vec3_at(frame.rays.data(), k));
    learn_scale(frame.displaced, [&] {
        return scale_leaning(skin_, state, frame.rays.data(), steps.respond(), SCALE_STEP / scale(), model_.residual);
    });
    state_ = std::move(state);
    return state_;
}

// A Gauss-Newton step towards the scale of best balance, while enough dots are displaced.
template <class Lean>
void Membrane::learn_scale(const std::vector<double>& displaced, Lean lean) {
    if (std::isinf(scale_precision_)) return;
    const auto far = std::count_if(displaced.begin(), displaced.end(), [](double one) { return std::abs(one) > MIN_DISPLACEMENT; });
    if (static_cast<double>(far) <= MIN_DISPLACED_SHARE * static_cast<double>(displaced.size())) return;
    const Leaning leaning = lean();
    const double information = leaning.curvature / (model_.residual * model_.residual) / model_.correlated;
    if (!(information > 0)) return;
    scale_precision_ += information;
    const double best = std::clamp(-leaning.gradient / leaning.curvature, -MAX_SCALE_ERROR, MAX_SCALE_ERROR);
    scale_error_ = std::clamp(scale_error_ + information / scale_precision_ * best, -MAX_SCALE_ERROR, MAX_SCALE_ERROR);
}

DotLoads Membrane::loads(const std::int64_t* id, const double* positions, std::ptrdiff_t count) const {
    const std::ptrdiff_t size = skin_.grid.size();
    DotLoads found;
    found.seen.assign(size, 0), found.xyz.assign(3 * size, 0);  // displacements first
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        found.seen[id[i]] = 1;
        store(found.xyz.data(), id[i], vec3_at(positions, i) - vec3_at(skin_.rest.data(), id[i]));
    }
    fill_holes(skin_.grid, found.xyz.data(), found.seen, 3);
    for (std::ptrdiff_t k = 0; k < size; ++k) store(found.xyz.data(), k, vec3_at(skin_.rest.data(), k) + vec3_at(found.xyz.data(), k));
    find_loads(skin_, found);
    return found;
}

}  // namespace tactile
