// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The field of two presses is the sum of the fields of each alone, minus an interaction term: the sheet between them is tauter.
#include "press/sheet_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/solver.hpp"

namespace tactile {
namespace {

using Eigen::Matrix2d, Eigen::Matrix3d, Eigen::Vector2d, Eigen::Vector3d;

// ---- The image of a deformed sheet.

// Derivatives of shift and growth by a Shape.
using BySheet = Eigen::Matrix<double, 3, 9>;

// Shift x and y, m, and growth (log of the ratio of areas) in the plane z = 0 of a point at rest, m, seen from a camera's centre, m; and
// their derivatives by the shape, unless by is null. A point at p is seen from e where the ray through p meets the plane, at
// e + (p - e) e_z / (e_z - p_z).
Vector3d appear(const Shape& shape, const Vector2d& rest, const Vector3d& camera_centre, BySheet* by) {
    const double per_height = 1 / (camera_centre[2] - shape(2, 0)), scale = camera_centre[2] * per_height;
    const Vector2d moved = shape.col(0).head<2>(), offset = rest + moved - camera_centre.head<2>(), drawn = offset * per_height;
    // Derivatives of the image position, over scale, by x and by y.
    const Matrix2d along = Matrix2d::Identity() + shape.topRightCorner<2, 2>() + drawn * shape.bottomRightCorner<1, 2>();
    const double area = along(0, 0) * along(1, 1) - along(1, 0) * along(0, 1);
    Vector3d seen;
    seen << moved + offset * (scale - 1), std::log(std::max(area * scale * scale, 1e-3));
    if (!by) return seen;
    by->setZero();
    by->topLeftCorner<2, 2>() = scale * Matrix2d::Identity();
    by->block<2, 1>(0, 2) = scale * drawn;
    Matrix2d log_area;  // derivative of the log of the area by along
    log_area << along(1, 1), -along(1, 0), -along(0, 1), along(0, 0);
    log_area /= std::abs(area) > 1e-9 ? area : 1e-9;
    const Vector2d tilt = shape.bottomRightCorner<1, 2>().transpose() * per_height;
    auto growth = by->row(2);
    for (int o = 0; o < 2; ++o) {
        growth.segment<2>(3 + 3 * o) = log_area.col(o).transpose();
        growth[5 + 3 * o] = log_area.col(o).dot(drawn);
    }
    growth.head<2>() = (log_area * tilt).transpose();
    growth[2] = growth[5] * tilt[0] + growth[8] * tilt[1] + 2 * per_height;
    return seen;
}

// Column k of the derivatives of what appears, from that of the shape's.
template <class Slopes, class Shown>
void chain(const BySheet& by, const Slopes& shape, int k, Shown& shown) {
    for (int q = 0; q < 2; ++q) shown(q, k) = by(q, q) * shape(q, k) + by(q, 2) * shape(2, k);
    shown(2, k) = by.row(2).dot(shape.col(k));
}

constexpr int DISC_POINTS = 4;  // of a marker's quadrature, exact to cubic terms

// Shift and growth of a disc of radius, m: its centroid and its area as imaged; shape_at(point): the sheet's there.
template <class ShapeAt>
Vector3d disc_appear(const ShapeAt& shape_at, const Vector2d& rest, const Vector3d& camera_centre, double radius) {
    const double out = radius * std::sqrt(0.5);
    Vector2d shift = Vector2d::Zero();
    double whole = 0;
    for (const Vector2d& aside : {Vector2d(out, 0), Vector2d(0, out), Vector2d(-out, 0), Vector2d(0, -out)}) {
        const Vector3d one = appear(shape_at(rest + aside), rest + aside, camera_centre, nullptr);
        const double area = std::exp(one[2]);
        whole += area, shift += area * (one.head<2>() + aside);
    }
    return {shift[0] / whole, shift[1] / whole, std::log(whole / DISC_POINTS)};
}

// ---- Two presses at once.

constexpr double STEEP_WIDENING =
    0.4;  // share of the widening that remains on steep slopes; for simulated pairs of tips 0.35 to 0.5 fit equally well

// Adds the displacement along the sheet's plane due to the interaction of two presses that lower it by a and b (height, and its derivatives
// by x and by y): where both incline it in the same direction, it is stretched more than by each alone, and draws material there; between
// them, less. Of moderate slopes in a membrane whose energy is as in sheet_membrane.cpp: a displacement -share grad((a - a2) (b - b1)),
// with a2 at the second tip and b1 at the first, solves the balance outside of the contacts, where a and b are harmonic, and at the clamp.
// Adds it and, but for curvatures, its derivatives. As it is linear in a and in b, it also gives the derivative by a number of the press by
// which a changes.
template <class To>
void widen(double share, const Vector3d& a, const Vector3d& b, To&& shape) {
    shape.template topRows<2>() -= share * (a.tail<2>() * b.transpose() + b.tail<2>() * a.transpose());
}

// Correction of the height and its derivatives for two presses that alone give a and b, for a factor of one: the product of their
// depths over the sum; and its derivatives by a and by b.
struct Interaction {
    Vector3d value;
    std::array<Matrix3d, 2> slopes;

    Interaction(Vector3d a, Vector3d b) {
        a[0] = std::min(a[0], -1e-9), b[0] = std::min(b[0], -1e-9);
        const double sum = a[0] + b[0], by_a = -b[0] * b[0] / (sum * sum), by_b = -a[0] * a[0] / (sum * sum);
        const double cube = 2 * a[0] * b[0] / (sum * sum * sum);  // the mixed second derivative is -cube
        value << -a[0] * b[0] / sum, by_a * a.tail<2>() + by_b * b.tail<2>();
        slopes = {by_a * Matrix3d::Identity(), by_b * Matrix3d::Identity()};
        slopes[0].col(0).tail<2>() = cube * (b[0] / a[0] * a.tail<2>() - b.tail<2>());
        slopes[1].col(0).tail<2>() = cube * (a[0] / b[0] * b.tail<2>() - a.tail<2>());
    }
};

// The parameters of the presses, the factor of their interaction, and the time offset of a view.
constexpr int MAX_STATE = MAX_SHEET_PRESSES * PRESS_SIZE + 2;
using State = Eigen::Matrix<double, MAX_STATE, 1>;

// A point of the sheet under all presses, and its derivatives by the state without the lateness.
struct Whole {
    Shape value;
    Eigen::Matrix<double, 9, MAX_STATE - 1> slope;
};

// Presses looked up at one state, and the appearance of the markers under them.
class Scene {
 public:
    // drags: as of look_up.
    Scene(const SheetTable& table, const SheetMarkers& markers, int count, bool drags)
        : table_(table), markers_(markers), count_(count), drags_(drags) {}

    void set(const State& state) {
        for (int press = 0; press < count_; ++press) look_up(table_, state.data() + press * PRESS_SIZE, drags_, pressed_[press]);
        mixed_ = state[count_ * PRESS_SIZE];
        for (int press = 0; press < count_ && count_ > 1; ++press)
            levels_[press] = read(press, 0, Eigen::Map<const Vector2d>(pressed_[1 - press].press)).value(2, 0);
    }
    const double* wrench(int press) const { return pressed_[press].wrench; }

    // Shift and growth of marker n; with slopes (3, presses and interaction) their derivatives, unless null (by drags only if they are
    // looked up); shape: of the sheet there; moved_squares: squared displacements by each press alone.
    Vector3d show(Eigen::Index n, Eigen::Matrix<double, 3, MAX_STATE - 1>* slopes, Shape& shape, double* moved_squares) const {
        const Vector2d rest = markers_.rest.row(n);
        const Vector3d camera_centre = markers_.camera_centre.row(n);
        Deformed alone[MAX_SHEET_PRESSES];
        Whole whole;
        BySheet by;
        read_all(rest, slopes ? pressed_[0].numbers : 0, alone, whole);
        for (int press = 0; press < count_; ++press) moved_squares[press] = alone[press].value.col(0).squaredNorm();
        shape = whole.value;
        Vector3d shown = appear(shape, rest, camera_centre, slopes ? &by : nullptr);
        for (int press = 0; press < count_ && slopes; ++press)
            for (int k = 0; k < pressed_[press].numbers; ++k) chain(by, whole.slope, press * PRESS_SIZE + k, *slopes);
        if (slopes && count_ > 1) chain(by, whole.slope, count_ * PRESS_SIZE, *slopes);
        if (is_near(rest)) {
            const auto shape_at = [&](const Vector2d& point) {
                read_all(point, 0, alone, whole);
                return whole.value;
            };
            shown += disc_appear(shape_at, rest, camera_centre, markers_.radius) - appear(shape, rest, camera_centre, nullptr);
        }
        return shown;
    }

 private:
    Deformed read(int press, int numbers, const Vector2d& rest) const {
        Deformed found;
        const PressedSheet& sheet = pressed_[press];
        read_point(table_, sheet.press, sheet.field.data(), numbers, rest.data(), found);
        return found;
    }

    // A point under each press alone, and under all; numbers: of parameters of a press by which derivatives are wanted.
    void read_all(const Vector2d& rest, int numbers, Deformed* alone, Whole& whole) const {
        for (int press = 0; press < count_; ++press) alone[press] = read(press, numbers, rest);
        whole.value = alone[0].value;
        for (int press = 0; press < count_ && numbers; ++press)
            whole.slope.middleCols(press * PRESS_SIZE, numbers) = alone[press].slope.leftCols(numbers);
        if (count_ < 2) return;
        whole.value += alone[1].value;
        const Vector3d heights[] = {alone[0].value.row(2), alone[1].value.row(2)};
        const Interaction lacks(heights[0], heights[1]);
        whole.value.row(2) += mixed_ * lacks.value.transpose();
        const double share = STEEP_WIDENING * table_.widening;
        const Vector3d over[] = {heights[0] - levels_[0] * Vector3d::UnitX(), heights[1] - levels_[1] * Vector3d::UnitX()};
        widen(share, over[0], over[1], whole.value);
        const auto column = [&](int k) { return Eigen::Map<Shape>(whole.slope.col(k).data()); };
        for (int press = 0; press < count_; ++press)
            for (int k = 0; k < numbers; ++k) {
                Eigen::Map<Shape> slope = column(press * PRESS_SIZE + k);
                const Vector3d changed = slope.row(2);
                slope.row(2) += mixed_ * (lacks.slopes[press] * changed).transpose();
                widen(share, changed, over[1 - press], slope);
            }
        if (!numbers) return;
        column(count_ * PRESS_SIZE).setZero(), column(count_ * PRESS_SIZE).row(2) = lacks.value.transpose();
    }

    bool is_near(const Vector2d& rest) const {
        bool near = false;
        for (int press = 0; press < count_; ++press) {
            const double* position = pressed_[press].press;
            near = near || std::max(std::abs(rest[0] - position[0]), std::abs(rest[1] - position[1])) < markers_.near;
        }
        return near && markers_.radius > 0;
    }

    const SheetTable& table_;
    const SheetMarkers& markers_;
    const int count_;
    const bool drags_;
    double mixed_ = 0, levels_[MAX_SHEET_PRESSES] = {};  // height of the sheet by each press alone at the other's tip
    PressedSheet pressed_[MAX_SHEET_PRESSES];
};

// ---- The fit.

// Each constant with its unit, origin and meaning. A growth's standard deviation over displacement or depth is in 1/m.
constexpr struct SheetFitConstants {
    int max_steps = 7;                          // 1, numeric: steps of the fit
    double settled = 0.3;                       // sigma, numeric: a smaller step is not taken
    double longest_step[PRESS_SIZE] = {5e-3, 5e-3, 4e-3, 0.3, 0.4, 0.4};  // m and 1, numeric: of each parameter
    double min_depth = 1e-5;                    // m, limit: of a press, far below the noise
    double max_drag = 1.5;                      // 1, limit: tangential over normal force; above that of rubber
    double drag_sigma = 0.5;                    // 1, prior: of the drag, of the order of a coefficient of friction
    double interaction = 0.1;                   // 1, prior: mean of the factor of interaction
    double interaction_sigma = 0.15;            // 1, prior: its standard deviation
    double interaction_range[2] = {-0.6, 0.9};  // 1, limit: of that factor
    double lateness_sigma = 0.3;                // motions, prior: of a second camera
    double max_lateness = 1;                    // motions, limit: of a second camera, one frame
    Huber kernel{3};                            // sigma, measured: residuals beyond it are of few markers
    double drag_doubt = 8;                      // 1, measured: increase of the relative model error with a drag of 1
    double between[3] = {0.02, 0.02, 2};        // 1, 1 and 1/m, measured: error of the interaction over the lesser of two displacements
} FIT;

// Inverse standard deviations of a marker's shift and growth. doubt: factor on the model error over displacement; between: m^2, the lesser
// squared displacement of two presses.
Vector3d precision(const MarkerNoise& noise, double depth, double doubt, const Shape& shape, double between) {
    const Vector3d own(noise.shift, noise.shift, noise.growth), share(noise.share_shift, noise.share_shift, noise.share_growth);
    const Vector3d all(noise.depth_shift, noise.depth_shift, noise.depth_growth);
    return (own.cwiseAbs2() + (depth * all).cwiseAbs2() + (doubt * share).cwiseAbs2() * shape.col(0).squaredNorm() +
            Vector3d::Map(FIT.between).cwiseAbs2() * between)
        .cwiseSqrt()
        .cwiseInverse();
}

struct SheetEquations : NormalEquations<Eigen::Dynamic, MAX_STATE> {
    double misfit = 0, expected = 1;
    using NormalEquations::NormalEquations;
};

// The fit of the unknown parameters of the state.
class SheetProblem {
 public:
    using Vector = SheetEquations::Vector;

    SheetProblem(const SheetTable& table, const SheetMarkers& markers, const SheetFrame& frame, const MarkerNoise& noise,
                 const SheetPrior& prior, const Rows6& start)
        : frame_(frame), noise_(noise), count_(static_cast<int>(start.rows())), scene_(table, markers, count_, prior.drags) {
        const double range[PRESS_SIZE] = {table.reach[0], table.reach[1], table.depth, table.spread, FIT.max_drag, FIT.max_drag};
        for (int k = 0; k < count_ * PRESS_SIZE; ++k) {
            const int which = k % PRESS_SIZE;
            if (which > 3 && !prior.drags) continue;
            const double end = range[which] * (1 - 1e-6), sigma = which == 3 ? prior.sigma : which > 3 ? FIT.drag_sigma : INFINITY;
            add(k, {start(k / PRESS_SIZE, which), which == 3 ? prior.log_radius : 0.0, sigma, which == 2 ? FIT.min_depth : -end, end,
                    FIT.longest_step[which]});
        }
        const auto [lowest, highest] = FIT.interaction_range;
        if (count_ > 1) add(mixed(), {FIT.interaction, FIT.interaction, FIT.interaction_sigma, lowest, highest, 1.0});
        if ((frame.motion.array() != 0).any()) add(late(), {0, 0, FIT.lateness_sigma, -FIT.max_lateness, FIT.max_lateness, 1.0});
        // A straight press that explains a drag by a radius at the end of its range must not explain it well: then the drag is tried.
        bounds_.cut = true;
        rows_.resize(3 * frame.value.rows(), start_.size());
        residuals_.resize(rows_.rows()), weights_.resize(rows_.rows());
    }

    const Bounds<Vector>* const bounds = &bounds_;
    const Vector& start() const { return start_; }

    SheetEquations linearise(const Vector& at) {
        SheetEquations found(at);
        const State state = whole(at);
        double deepest = 0, doubt = 1, squares = 0, doubted = 0;
        for (int press = 0; press < count_; ++press) {
            const auto one = state.segment<PRESS_SIZE>(press * PRESS_SIZE);
            deepest = std::max(deepest, one[2]), doubt = std::max(doubt, 1 + FIT.drag_doubt * std::hypot(one[4], one[5]));
        }
        scene_.set(state);
        Eigen::Index row = 0;
        for (Eigen::Index n = 0; n < frame_.value.rows(); ++n) {
            Eigen::Matrix<double, 3, MAX_STATE - 1> slopes;
            Shape shape;
            double moved[MAX_SHEET_PRESSES];
            const Vector3d motion = frame_.motion.row(n);
            const Vector3d residual = frame_.value.row(n).transpose() - scene_.show(n, &slopes, shape, moved) - state[late()] * motion;
            const double between = count_ > 1 ? std::min(moved[0], moved[1]) : 0.0;
            const Vector3d weight = precision(noise_, deepest, doubt, shape, between),
                           plain = doubt > 1 ? precision(noise_, deepest, 1, shape, between) : weight;
            for (int q = 0; q < 3; ++q) {
                const double sigmas = weight[q] * residual[q], share = plain[q] / weight[q];  // share: by the doubt of drags
                if (!std::isfinite(sigmas)) continue;
                squares += FIT.kernel.cost(share * sigmas), doubted += share * share;
                residuals_[row] = residual[q], weights_[row] = FIT.kernel.weight(sigmas) * weight[q] * weight[q];
                for (Eigen::Index k = 0; k < at.size(); ++k) rows_(row, k) = free_[k] == late() ? motion[q] : slopes(q, free_[k]);
                ++row;
            }
        }
        const double known = std::max<double>(row, 1);
        found.misfit = squares / known, found.expected = doubted / known;
        found.add(rows_.topRows(row), residuals_.head(row), weights_.head(row));
        found.information.diagonal() *= 1 + 1e-9;
        found.expect(mean_, weight_);
        return found;
    }

    // By the scatter that the residuals show, not by less.
    bool is_settled(const SheetEquations& at, const Vector&, double gain) const {
        return !(gain >= FIT.settled * FIT.settled * std::max(at.misfit, 1.0));
    }

    SheetFit fit(const SheetEquations& at) const {
        const Eigen::Index size = count_ * PRESS_SIZE + (count_ > 1);
        const State state = whole(at.state);
        SheetFit found{Eigen::Map<const Rows6>(state.data(), count_, PRESS_SIZE),
                       count_ > 1 ? state[mixed()] : 0.0,
                       Eigen::MatrixXd::Zero(size, size),
                       at.misfit,
                       at.expected,
                       Rows9(count_, WRENCH_SIZE)};
        const Eigen::MatrixXd covariance = at.covariance();
        for (std::size_t k = 0; k < free_.size(); ++k)
            for (std::size_t l = 0; l < free_.size(); ++l)
                if (free_[k] < size && free_[l] < size) found.covariance(free_[k], free_[l]) = covariance(k, l);
        for (int press = 0; press < count_; ++press)
            found.wrenches.row(press) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(scene_.wrench(press));
        return found;
    }

 private:
    // Numbers in the state of the factor of interaction, and of the lateness.
    int mixed() const { return count_ * PRESS_SIZE; }
    int late() const { return count_ * PRESS_SIZE + 1; }

    State whole(const Vector& at) const {
        State state = State::Zero();
        for (std::size_t k = 0; k < free_.size(); ++k) state[free_[k]] = at[k];
        return state;
    }

    // What is known of a number before the fit; longest: step.
    struct Unknown {
        double start, mean, sigma, lowest, highest, longest;
    };

    void add(int number, const Unknown& one) {
        free_.push_back(number);
        const auto append = [](Vector& to, double value) { to.conservativeResize(to.size() + 1), to[to.size() - 1] = value; };
        append(start_, std::clamp(one.start, one.lowest, one.highest));
        append(mean_, one.mean), append(weight_, 1 / (one.sigma * one.sigma));
        append(bounds_.lowest, one.lowest), append(bounds_.highest, one.highest), append(bounds_.longest, one.longest);
    }

    const SheetFrame& frame_;
    const MarkerNoise& noise_;
    const int count_;
    Scene scene_;
    std::vector<int> free_;  // numbers in the state of those that are not known
    Vector start_, mean_, weight_;
    Bounds<Vector> bounds_;
    Eigen::MatrixXd rows_;
    Eigen::VectorXd residuals_, weights_;
};

}  // namespace

SheetFit fit_presses(const SheetTable& table, const SheetMarkers& markers, const SheetFrame& frame, const MarkerNoise& noise,
                     const SheetPrior& prior, const Rows6& start) {
    SheetProblem problem(table, markers, frame, noise, prior, start);
    return problem.fit(minimise(problem, problem.start(), FIT.max_steps).at);
}

ShownMarkers show_presses(const SheetTable& table, const SheetMarkers& markers, const Rows6& presses, double interaction) {
    State state = State::Zero();
    const auto count = static_cast<int>(presses.rows());
    state.head(presses.size()) = Eigen::Map<const Eigen::VectorXd>(presses.data(), presses.size());
    state[presses.size()] = interaction;
    Scene scene(table, markers, count, true);
    scene.set(state);
    ShownMarkers found{Rows3(markers.rest.rows(), 3), Rows9(markers.rest.rows(), 9)};
    Shape shape;
    double squares[MAX_SHEET_PRESSES];
    for (Eigen::Index n = 0; n < markers.rest.rows(); ++n) {
        found.value.row(n) = scene.show(n, nullptr, shape, squares);
        found.shape.row(n) = Eigen::Map<Eigen::Matrix<double, 1, 9>>(shape.data());
    }
    return found;
}

Rows3 show_field(const SheetTable& table, const SheetMarkers& markers, const double* position, const float* field) {
    std::vector<float> values(table.side() * table.side() * CHANNELS);
    for (std::size_t k = 0; k < values.size() / LANES; ++k) values[k * LANES] = field[k];
    const auto shape_at = [&](const Vector2d& point) {
        Deformed found;
        read_point(table, position, values.data(), 0, point.data(), found);
        return found.value;
    };
    Rows3 shown(markers.rest.rows(), 3);
    for (Eigen::Index n = 0; n < shown.rows(); ++n)
        shown.row(n) = disc_appear(shape_at, markers.rest.row(n).transpose(), markers.camera_centre.row(n).transpose(), markers.radius);
    return shown;
}

}  // namespace tactile
