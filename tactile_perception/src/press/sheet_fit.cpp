// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Gauss-Newton with Huber weights and Gaussian priors (Triggs et al., Bundle Adjustment, 2000, sections 3 and 4). The field of two presses
// is the sum of the fields of each alone, less an interaction term: the sheet between them is tauter.
#include "press/sheet_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr int DISC_POINTS = 4;  // of a marker's quadrature

// Shift x and y, m, and growth (log of the ratio of areas) in the plane z = 0 of a point at rest, m, seen from camera_centre (3,), m, as
// deformed (3, 3) says; and their derivatives by deformed (3, 3, 3), unless slopes is null. A point at p is seen from e where the ray
// through p meets the plane, at e + (p - e) e_z / (e_z - p_z).
void appear(const double deformed[3][3], const double* rest, const double* camera_centre, double* seen, double (*slopes)[3][3]) {
    const double *moved = deformed[0], *by_x = deformed[1], *by_y = deformed[2];
    const double nearer = 1 / (camera_centre[2] - moved[2]), scale = camera_centre[2] * nearer;
    double offset[2], drawn[2], along_x[2], along_y[2];
    for (int k = 0; k < 2; ++k) {
        offset[k] = rest[k] + moved[k] - camera_centre[k];
        drawn[k] = offset[k] * nearer;
        seen[k] = moved[k] + offset[k] * (scale - 1);
        along_x[k] = (k == 0) + by_x[k] + drawn[k] * by_x[2];
        along_y[k] = (k == 1) + by_y[k] + drawn[k] * by_y[2];
    }
    const double area = along_x[0] * along_y[1] - along_x[1] * along_y[0];
    seen[2] = std::log(std::max(area * scale * scale, 1e-3));
    if (!slopes) return;
    for (int k = 0; k < 3; ++k)
        for (int o = 0; o < 3; ++o)
            for (int c = 0; c < 3; ++c) slopes[k][o][c] = 0;
    for (int k = 0; k < 2; ++k) slopes[k][0][k] = scale, slopes[k][0][2] = drawn[k] * scale;
    const double safe = std::abs(area) > 1e-9 ? area : 1e-9;
    const double by_along_x[2] = {along_y[1] / safe, -along_y[0] / safe}, by_along_y[2] = {-along_x[1] / safe, along_x[0] / safe};
    const double tilt_x = by_x[2] * nearer, tilt_y = by_y[2] * nearer;
    double(&growth)[3][3] = slopes[2];
    for (int k = 0; k < 2; ++k) {
        growth[1][k] = by_along_x[k], growth[2][k] = by_along_y[k];
        growth[1][2] += by_along_x[k] * drawn[k], growth[2][2] += by_along_y[k] * drawn[k];
        growth[0][k] = by_along_x[k] * tilt_x + by_along_y[k] * tilt_y;
    }
    growth[0][2] = growth[1][2] * tilt_x + growth[2][2] * tilt_y + 2 * nearer;
}

// The points of a disc of radius, m, at rest, m: exact to cubic terms.
void disc_points(const double* rest, double radius, double points[DISC_POINTS][2]) {
    const double out = radius * std::sqrt(0.5), way[DISC_POINTS][2] = {{out, 0}, {0, out}, {-out, 0}, {0, -out}};
    for (int p = 0; p < DISC_POINTS; ++p)
        for (int k = 0; k < 2; ++k) points[p][k] = rest[k] + way[p][k];
}

// As appear, of such a disc: the centroid and the area as imaged; deformed (DISC_POINTS, 3, 3) at its points.
void disc_appear(const double (*deformed)[3][3], const double* rest, const double* camera_centre, double radius, double* seen) {
    double points[DISC_POINTS][2], one[3], shift[2] = {0, 0}, whole = 0;
    disc_points(rest, radius, points);
    for (int p = 0; p < DISC_POINTS; ++p) {
        appear(deformed[p], points[p], camera_centre, one, nullptr);
        const double area = std::exp(one[2]);
        whole += area;
        for (int k = 0; k < 2; ++k) shift[k] += area * (one[k] + points[p][k] - rest[k]);
    }
    seen[0] = shift[0] / whole, seen[1] = shift[1] / whole, seen[2] = std::log(whole / DISC_POINTS);
}

// All chosen.
constexpr double DRAG_SIGMA = 0.5;  // prior standard deviation of the drag: about a coefficient of friction
constexpr double MOST_DRAG = 1.5;   // largest drag
constexpr double DOUBT = 3.0;       // sigmas: threshold of the Huber weights
constexpr double STRIDE[PRESS_SIZE] = {5e-3, 5e-3, 4e-3, 0.3, 0.4, 0.4};  // limit of one step
constexpr int ROUNDS = 8;                                                 // at most
constexpr double SETTLED = 0.3;                                           // sigmas: a smaller step is the last
constexpr double SHALLOW = 1e-5;                                          // m: least depth
constexpr double MIXED = 0.1, MIXED_SIGMA = 0.15;                         // interaction factor: prior mean and standard deviation
constexpr double LEAST_MIXED = -0.6, MOST_MIXED = 0.9;
constexpr double WIDENS = 0.4;  // share of Widening that steep slopes leave: of simulated pairs of tips, 0.35 to 0.5 are alike
constexpr double LATE_SIGMA = 0.3, MOST_LATE = 1.0;  // lateness of a second camera, in motions: prior standard deviation, and largest
constexpr double DRAG_DOUBT = 8.0;                   // how much the model error in proportion to displacement grows with a drag of 1
constexpr double BETWEEN[3] = {0.02, 0.02, 2.0};     // error of the interaction over the lesser of two displacements (growth: 1/m)

// How the sheet is displaced along its plane, in addition, where two presses lower it by a and b: where both incline it alike, it is
// stretched more than by each alone, and draws material towards there; between them, less. Of moderate slopes in a membrane whose energy
// is as in sheet_membrane.cpp: a displacement -share grad((a - a2) (b - b1)), with a2 at the second tip and b1 at the first, solves the
// balance outside of the contacts, where a and b are harmonic, and at the clamp.
struct Widening {
    double share = 0, heights[2] = {0, 0};  // a2, b1

    // Adds it and, but for curvatures, its derivatives.
    void add(const double a[3], const double b[3], double value[3][3]) const {
        for (int c = 0; c < 2; ++c) {
            value[0][c] -= share * (a[1 + c] * (b[0] - heights[1]) + b[1 + c] * (a[0] - heights[0]));
            for (int o = 1; o < 3; ++o) value[o][c] -= share * (a[1 + c] * b[o] + b[1 + c] * a[o]);
        }
    }
    // The same of its derivative by a number of the press whose height changes by changed (value, by x, by y); the other's is a, and
    // level at this press's tip.
    void add_slope(const double changed[3], const double other[3], double level, double slope[3][3]) const {
        for (int c = 0; c < 2; ++c) {
            slope[0][c] -= share * (changed[1 + c] * (other[0] - level) + other[1 + c] * changed[0]);
            for (int o = 1; o < 3; ++o) slope[o][c] -= share * (changed[1 + c] * other[o] + other[1 + c] * changed[o]);
        }
    }
};

// Correction of the height and its derivatives for two presses that alone give a and b, for a factor of one: the product of their
// depths over the sum; and its derivatives by a (first) and by b (second).
struct Interaction {
    double value[3], first[3][3], second[3][3];  // derivatives of (height, by x, by y) by those of a, and of b

    Interaction(const Deformed& one, const Deformed& other) {
        double a[3], b[3];
        for (int o = 0; o < 3; ++o) a[o] = one.value[o][2], b[o] = other.value[o][2];
        a[0] = std::min(a[0], -1e-9), b[0] = std::min(b[0], -1e-9);
        const double sum = a[0] + b[0], by_a = -b[0] * b[0] / (sum * sum), by_b = -a[0] * a[0] / (sum * sum);
        const double cube = 2 * a[0] * b[0] / (sum * sum * sum);  // the mixed second derivative is -cube
        value[0] = -a[0] * b[0] / sum;
        for (int o = 1; o < 3; ++o) value[o] = by_a * a[o] + by_b * b[o];
        for (int o = 0; o < 3; ++o)
            for (int p = 0; p < 3; ++p) first[o][p] = o == p ? by_a : 0.0, second[o][p] = o == p ? by_b : 0.0;
        for (int o = 1; o < 3; ++o) {
            first[o][0] = cube * (b[0] / a[0] * a[o] - b[o]);
            second[o][0] = cube * (a[0] / b[0] * b[o] - a[o]);
        }
    }
};

// The sum of the deformations of presses, with their interaction, and its derivatives by the state.
struct Whole {
    double value[3][3], slope[MOST_STATE][3][3];
};

// numbers: of a press, by which slopes are wanted.
void add_up(const Deformed* alone, int count, double mixed, const Widening& widening, int numbers, Whole& whole) {
    const bool slopes = numbers > 0;
    for (int o = 0; o < 3; ++o)
        for (int c = 0; c < 3; ++c) whole.value[o][c] = alone[0].value[o][c] + (count > 1 ? alone[1].value[o][c] : 0.0);
    for (int press = 0; press < count; ++press)
        for (int k = 0; k < numbers; ++k)
            for (int o = 0; o < 3; ++o)
                for (int c = 0; c < 3; ++c) whole.slope[press * PRESS_SIZE + k][o][c] = alone[press].slope[k][o][c];
    if (count < 2) return;
    const Interaction lacks(alone[0], alone[1]);
    for (int o = 0; o < 3; ++o) {
        whole.value[o][2] += mixed * lacks.value[o];
        for (int press = 0; press < count && slopes; ++press) {
            const auto& by = press == 0 ? lacks.first : lacks.second;
            for (int k = 0; k < numbers; ++k)
                for (int p = 0; p < 3; ++p) whole.slope[press * PRESS_SIZE + k][o][2] += mixed * by[o][p] * alone[press].slope[k][p][2];
        }
        for (int c = 0; c < 3 && slopes; ++c) whole.slope[count * PRESS_SIZE][o][c] = c == 2 ? lacks.value[o] : 0.0;
    }
    double heights[MOST_PRESSES][3];
    for (int press = 0; press < count; ++press)
        for (int o = 0; o < 3; ++o) heights[press][o] = alone[press].value[o][2];
    widening.add(heights[0], heights[1], whole.value);
    for (int press = 0; press < count && slopes; ++press) {
        for (int k = 0; k < numbers; ++k) {
            const auto& by = alone[press].slope[k];
            const double changed[3] = {by[0][2], by[1][2], by[2][2]};
            widening.add_slope(changed, heights[1 - press], widening.heights[1 - press], whole.slope[press * PRESS_SIZE + k]);
        }
    }
}

// Presses looked up at one state, and what markers show of them. drags: as of look_up.
class Scene {
 public:
    Scene(const SheetTable& table, const SeenMarkers& seen, int count, bool drags, double near)
        : table_(table), seen_(seen), count_(count), drags_(drags), near_(near) {}

    void set(const double* state) {
        for (int press = 0; press < count_; ++press) look_up(table_, state + press * PRESS_SIZE, drags_, pressed_[press]);
        mixed_ = state[count_ * PRESS_SIZE];
        if (count_ < 2) return;
        widening_.share = WIDENS * table_.widening;
        for (int press = 0; press < count_; ++press) {
            Deformed there;
            read(press, 0, pressed_[1 - press].press, there);
            widening_.heights[press] = there.value[0][2];
        }
    }
    const PressedSheet& pressed(int press) const { return pressed_[press]; }

    // Marker n: shift and growth shown (3,), their derivatives by the state (by drags only if they are looked up) unless null, and
    // squared displacements by each press, and how the sheet is deformed there (3, 3).
    void show(std::ptrdiff_t n, double* shown, double (*slopes)[3], double* moved_squares, double (*deformed)[3]) const {
        const int numbers = slopes ? pressed_[0].numbers : 0;
        const double *rest = seen_.rest + 2 * n, *camera_centre = seen_.camera_centre + 3 * n;
        Deformed alone[MOST_PRESSES];
        for (int press = 0; press < count_; ++press) {
            read(press, numbers, rest, alone[press]);
            const double* moved = alone[press].value[0];
            moved_squares[press] = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2];
        }
        Whole whole;
        double by[3][3][3];
        add_up(alone, count_, mixed_, widening_, numbers, whole);
        appear(whole.value, rest, camera_centre, shown, slopes ? by : nullptr);
        for (int o = 0; o < 3; ++o) std::copy(whole.value[o], whole.value[o] + 3, deformed[o]);
        const int states = count_ * PRESS_SIZE + (count_ > 1);
        for (int k = 0; k < states && slopes; ++k) {
            if (k < count_ * PRESS_SIZE && k % PRESS_SIZE >= numbers) continue;
            for (int q = 0; q < 3; ++q) {
                double sum = 0;
                for (int o = 0; o < 3; ++o)
                    for (int c = 0; c < 3; ++c) sum += by[q][o][c] * whole.slope[k][o][c];
                slopes[k][q] = sum;
            }
        }
        if (is_near(rest)) add_disc(rest, camera_centre, whole.value, shown);
    }

 private:
    void read(int press, int numbers, const double* rest, Deformed& found) const {
        const PressedSheet& sheet = pressed_[press];
        read_point(table_, sheet.press, sheet.field.data(), numbers, rest, found);
    }

    bool is_near(const double* rest) const {
        bool near = false;
        for (int press = 0; press < count_; ++press) {
            const double* place = pressed_[press].press;
            near = near || std::max(std::abs(rest[0] - place[0]), std::abs(rest[1] - place[1])) < near_;
        }
        return near && seen_.radius > 0;
    }

    // Adds the difference of a disc and its centre point.
    void add_disc(const double* rest, const double* camera_centre, const double centre[3][3], double* shown) const {
        double points[DISC_POINTS][2], deformed[DISC_POINTS][3][3], disc[3], point[3];
        disc_points(rest, seen_.radius, points);
        for (int p = 0; p < DISC_POINTS; ++p) {
            Deformed alone[MOST_PRESSES];
            Whole whole;
            for (int press = 0; press < count_; ++press) read(press, 0, points[p], alone[press]);
            add_up(alone, count_, mixed_, widening_, 0, whole);
            for (int o = 0; o < 3; ++o) std::copy(whole.value[o], whole.value[o] + 3, deformed[p][o]);
        }
        disc_appear(deformed, rest, camera_centre, seen_.radius, disc);
        appear(centre, rest, camera_centre, point, nullptr);
        for (int q = 0; q < 3; ++q) shown[q] += disc[q] - point[q];
    }

    const SheetTable& table_;
    const SeenMarkers& seen_;
    int count_;
    bool drags_;
    double near_, mixed_ = 0;
    Widening widening_;
    PressedSheet pressed_[MOST_PRESSES];
};

// Inverse standard deviations (3,) of a marker's shift and growth.
void weigh(const MarkerNoise& noise, double depth, double doubt, const double* displacement, const double* moved_squares, int count,
           double* weight) {
    double amount = 0;
    for (int c = 0; c < 3; ++c) amount += displacement[c] * displacement[c];
    const double shared = count > 1 ? std::min(moved_squares[0], moved_squares[1]) : 0.0;
    for (int q = 0; q < 3; ++q) {
        const double own = q < 2 ? noise.shift : noise.growth, share = doubt * (q < 2 ? noise.share_shift : noise.share_growth);
        const double all = depth * (q < 2 ? noise.depth_shift : noise.depth_growth);
        weight[q] = 1 / std::sqrt(own * own + all * all + share * share * amount + BETWEEN[q] * BETWEEN[q] * shared);
    }
}

constexpr int WHOLE = (MOST_STATE + 3) / 4 * 4;  // numbers of whole vectors

// Adds the products of slopes with each other, times a factor.
TACTILE_WIDE void add_products(const double* slopes, double factor, int size, double (*products)[WHOLE]) {
    for (int k = 0; k < size; ++k)
        for (int l = 0; l < WHOLE; ++l) products[k][l] += factor * slopes[k] * slopes[l];
}

// Of the unknown numbers of a state.
using Row = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, MOST_STATE, 1>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, MOST_STATE, MOST_STATE>;

class Fit {
 public:
    Fit(const SheetTable& table, const SeenMarkers& seen, const MarkerNoise& noise, const TipPrior& tip, const double* start, int count,
        bool drags, double near)
        : table_(table), seen_(seen), noise_(noise), tip_(tip), scene_(table, seen, count, drags, near), count_(count) {
        std::copy(start, start + count * PRESS_SIZE, state_);
        for (int k = 0; k < count * PRESS_SIZE; ++k) {
            if (drags || k % PRESS_SIZE <= 3)
                free_.push_back(k);
            else
                state_[k] = 0;
        }
        if (count > 1) state_[mixed()] = MIXED, free_.push_back(mixed());
        const double* end = seen.motion + 3 * seen.count;
        if (std::any_of(seen.motion, end, [](double way) { return way != 0; })) free_.push_back(late());
        limit();
    }

    PressFit run() {
        const auto size = static_cast<Eigen::Index>(free_.size());
        Square covariance = Square::Zero(size, size);
        for (int turn = 0; turn < ROUNDS; ++turn) {
            scene_.set(state_);
            Square information = Square::Zero(size, size);
            Row gradient = Row::Zero(size);
            gather(information, gradient);
            const Eigen::LLT<Square> factor(information);
            if (factor.info() != Eigen::Success) break;
            covariance = factor.solve(Square::Identity(size, size));
            const Row step = covariance * gradient;
            const double length = step.dot(gradient);  // judged by the scatter that the residuals show, not by less
            if (!std::isfinite(length) || turn == ROUNDS - 1 || length < SETTLED * SETTLED * std::max(misfit_, 1.0)) break;
            take(step);
        }
        const int states = count_ * PRESS_SIZE + (count_ > 1);
        PressFit found{Eigen::Map<Eigen::VectorXd>(state_, states), Eigen::MatrixXd::Zero(states, states), misfit_, expected_, {count_, WRENCH_SIZE}};
        for (Eigen::Index k = 0; k < size; ++k)
            for (Eigen::Index l = 0; l < size; ++l)
                if (free_[k] < states && free_[l] < states) found.covariance(free_[k], free_[l]) = covariance(k, l);
        for (int press = 0; press < count_; ++press)
            for (int k = 0; k < WRENCH_SIZE; ++k) found.wrenches(press, k) = scene_.pressed(press).wrench[k];
        return found;
    }

 private:
    // Indices in the state of the factor of two presses' interaction, and of the lateness.
    int mixed() const { return count_ * PRESS_SIZE; }
    int late() const { return count_ * PRESS_SIZE + 1; }

    // Prior mean and standard deviation of a number of the state.
    std::pair<double, double> expected(int number) const {
        if (number == late()) return {0.0, LATE_SIGMA};
        if (number == mixed()) return {MIXED, MIXED_SIGMA};
        if (number % PRESS_SIZE == 3) return {tip_.log_radius, tip_.sigma};
        return {0.0, number % PRESS_SIZE > 3 ? DRAG_SIGMA : INFINITY};
    }

    // Adds up information, gradient and misfit at the present state.
    void gather(Square& information, Row& gradient) {
        const Eigen::Index size = gradient.size();
        double squares = 0, doubted = 0, known = 0, deepest = 0, doubt = 1;
        for (int press = 0; press < count_; ++press) {
            const double* state = state_ + press * PRESS_SIZE;
            deepest = std::max(deepest, state[2]);
            doubt = std::max(doubt, 1 + DRAG_DOUBT * std::hypot(state[4], state[5]));
        }
        double along[WHOLE] = {}, products[WHOLE][WHOLE] = {};
        for (std::ptrdiff_t n = 0; n < seen_.count; ++n) {
            double shown[3], slopes[MOST_STATE][3], moved[MOST_PRESSES], deformed[3][3], weight[3], plain[3];
            scene_.show(n, shown, slopes, moved, deformed);
            weigh(noise_, deepest, doubt, deformed[0], moved, count_, weight);
            weigh(noise_, deepest, 1.0, deformed[0], moved, count_, plain);
            for (int q = 0; q < 3; ++q) {
                const double motion = seen_.motion[3 * n + q];
                slopes[late()][q] = motion;
                const double residual = weight[q] * (seen_.value[3 * n + q] - shown[q] - state_[late()] * motion);
                if (!std::isfinite(residual)) continue;
                const double pull = std::min(1.0, DOUBT / std::max(std::abs(residual), DOUBT)) * weight[q];
                const double without = residual * plain[q] / weight[q];  // doubt of drags
                squares += std::min(without * without, DOUBT * std::abs(without)), known += 1;
                doubted += plain[q] * plain[q] / (weight[q] * weight[q]);
                for (Eigen::Index k = 0; k < size; ++k) along[k] = slopes[free_[k]][q];
                for (Eigen::Index k = 0; k < size; ++k) gradient[k] += pull * residual * along[k];
                add_products(along, pull * weight[q], static_cast<int>(size), products);
            }
        }
        for (Eigen::Index k = 0; k < size; ++k)
            for (Eigen::Index l = 0; l < size; ++l) information(k, l) = products[k][l];
        misfit_ = squares / std::max(known, 1.0), expected_ = doubted / std::max(known, 1.0);
        information.diagonal() *= 1 + 1e-9;
        for (Eigen::Index k = 0; k < size; ++k) {
            const auto [mean, sigma] = expected(free_[k]);
            information(k, k) += 1 / (sigma * sigma);
            gradient[k] -= (state_[free_[k]] - mean) / (sigma * sigma);
        }
    }

    // Takes a step, shortened for each press to STRIDE.
    void take(const Row& step) {
        double share[MOST_PRESSES + 1] = {1, 1, 1};
        for (Eigen::Index k = 0; k < step.size(); ++k) {
            const int number = free_[k], press = number / PRESS_SIZE;
            if (press < count_) share[press] = std::min(share[press], STRIDE[number % PRESS_SIZE] / std::max(std::abs(step[k]), 1e-12));
        }
        for (Eigen::Index k = 0; k < step.size(); ++k) state_[free_[k]] += share[free_[k] / PRESS_SIZE] * step[k];
        limit();
    }

    void limit() {
        const double most[PRESS_SIZE] = {table_.reach[0], table_.reach[1], table_.depth, table_.spread, MOST_DRAG, MOST_DRAG};
        for (int k = 0; k < count_ * PRESS_SIZE; ++k) {
            const int which = k % PRESS_SIZE;
            state_[k] = std::clamp(state_[k], which == 2 ? SHALLOW : -most[which] * (1 - 1e-6), most[which] * (1 - 1e-6));
        }
        if (count_ > 1) state_[mixed()] = std::clamp(state_[mixed()], LEAST_MIXED, MOST_MIXED);
        state_[late()] = std::clamp(state_[late()], -MOST_LATE, MOST_LATE);
    }

    const SheetTable& table_;
    const SeenMarkers& seen_;
    const MarkerNoise& noise_;
    const TipPrior& tip_;
    Scene scene_;
    int count_;
    double state_[MOST_STATE] = {}, misfit_ = 0, expected_ = 1;
    std::vector<int> free_;  // numbers of the state that are not known
};

}  // namespace

PressFit fit_presses(const SheetTable& table, const SeenMarkers& seen, const MarkerNoise& noise, const TipPrior& tip, const double* start,
                     int count, bool drags, double near) {
    return Fit(table, seen, noise, tip, start, count, drags, near).run();
}

void show_presses(const SheetTable& table, const SeenMarkers& seen, const double* presses, int count, double mixed, double near,
                  double* shown, double (*deformed)[3][3]) {
    double state[MOST_STATE] = {}, squares[MOST_PRESSES];
    std::copy(presses, presses + count * PRESS_SIZE, state);
    state[count * PRESS_SIZE] = mixed;
    Scene scene(table, seen, count, true, near);
    scene.set(state);
    for (std::ptrdiff_t n = 0; n < seen.count; ++n) scene.show(n, shown + 3 * n, nullptr, squares, deformed[n]);
}

void show_field(const SheetTable& table, const SeenMarkers& seen, const double* place, const float* field, double* shown) {
    std::vector<float> values(table.side() * table.side() * CHANNELS);
    for (std::size_t k = 0; k < values.size() / LANES; ++k) values[k * LANES] = field[k];
    for (std::ptrdiff_t n = 0; n < seen.count; ++n) {
        double points[DISC_POINTS][2], deformed[DISC_POINTS][3][3];
        disc_points(seen.rest + 2 * n, seen.radius, points);
        for (int p = 0; p < DISC_POINTS; ++p) {
            Deformed point;
            read_point(table, place, values.data(), 0, points[p], point);
            for (int o = 0; o < 3; ++o) std::copy(point.value[o], point.value[o] + 3, deformed[p][o]);
        }
        disc_appear(deformed, seen.rest + 2 * n, seen.camera_centre + 3 * n, seen.radius, shown + 3 * n);
    }
}

}  // namespace tactile
