// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "common/solver.hpp"
#include "press/dome.hpp"

namespace tactile {
namespace {

// Each constant with its unit, origin and meaning.
constexpr struct DomeFitConstants {
    int max_steps = 14;               // 1, numeric: of the fit, including trials
    double settled_step = 0.1;        // 1, numeric: of the maximum step, over which fields are linear; a shorter step is the last
    double settled_gain = 1e-3;       // 1, numeric: of the cost; a step that gains less is the last
    double first_damping = 1e-3;      // 1, numeric: over the diagonal of the normal equations
    double min_height = 0.1;          // 1, limit: of a point over the camera's centre, as a share of its undeformed height
    double min_depth = 1e-5;          // m, limit: of a press, far below the noise
    double max_drag = 2;              // 1, limit: displacement over the depth
    double free = 1e-6;               // 1, numeric: weight of a number without a prior
    double min_axis_distance = 2e-5;  // m, numeric: of a press from the axis, on which the meridian is undefined
} FIT;

constexpr int MAX_STATE = MAX_DOME_PRESSES * PRESS;
using State = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, MAX_STATE, 1>;

// The equations at some presses, their residuals (K, 2), and the derivatives of the apparent displacements along x and along y.
struct DomeEquations : NormalEquations<Eigen::Dynamic, MAX_STATE> {
    Eigen::MatrixXd residual, slopes[2];  // (K, 2), (K, n PRESS)
    using NormalEquations::NormalEquations;
};

// The measurements of a frame: weights (K) of its displacements, 0 for hidden markers, and variances (K), m^2, of noise and model error.
// The outer products of the columns shared (K, M), of errors common to the markers, are subtracted from the weight matrix of each axis
// (Woodbury 1950), whose inverse then includes the error of a sum of two fields.
struct DomeFrame {
    const Rows2& shift;
    Eigen::VectorXd square, variance, weight;
    Eigen::MatrixXd shared;
    Eigen::Index seen = 0;

    DomeFrame(const DomeMarkers& markers, const DomeErrors& errors, double together, const Rows2& displacement) : shift(displacement) {
        const Eigen::Index count = shift.rows();
        square.setZero(count), weight.setZero(count);
        for (Eigen::Index k = 0; k < count; ++k)
            if (shift.row(k).allFinite()) square[k] = shift.row(k).squaredNorm();
        const double noise = errors.still * errors.still, top = square.maxCoeff();
        const Eigen::VectorXd model = (errors.share * errors.share * square).array() + errors.top * errors.top * top;
        variance = noise + model.array();
        for (Eigen::Index k = 0; k < count; ++k) {
            if (!shift.row(k).allFinite() || !markers.points.row(k).allFinite()) continue;
            weight[k] = 1 / (noise + errors.alike * errors.alike * model[k]), ++seen;
        }
        if (!(together > 0)) return;
        const Eigen::MatrixXd weighted = markers.smooth.transpose() * weight.asDiagonal();
        Eigen::MatrixXd matrix = weighted * markers.smooth;
        matrix.diagonal().array() += static_cast<double>(weighted.rows()) / (together * together * top);
        shared = matrix.llt().matrixL().solve(weighted).transpose();
    }
};

class DomeProblem {
 public:
    DomeProblem(const DomeLibrary& library, const DomeMarkers& markers, const DomeFrame& frame, const Bounds<State>& within)
        : library_(library), markers_(markers), frame_(frame), bounds_(within) {}

    State mean, weight;  // of the prior

    const Bounds<State>* const bounds = &bounds_;

    DomeEquations linearise(State presses) const {
        const Eigen::Index count = markers_.points.rows();
        for (Eigen::Index p = 0; p < presses.size(); p += PRESS)
            if (std::hypot(presses[p + X], presses[p + Y]) < FIT.min_axis_distance)
                presses[p + X] = std::copysign(FIT.min_axis_distance, presses[p + X]);
        DomeEquations found(presses);
        found.residual.setZero(count, 2);
        for (auto& slopes : found.slopes) slopes.setZero(count, presses.size());
        Points moved = Points::Zero(count, 3);
        Eigen::MatrixXd by(count, 3 * presses.size());
        for (Eigen::Index p = 0; p < presses.size(); p += PRESS)
            by.middleCols<3 * PRESS>(3 * p) = press_dome(library_, markers_.points, presses.segment<PRESS>(p), moved);
        for (Eigen::Index k = 0; k < count; ++k)
            if (frame_.weight[k] > 0) appear(k, moved.row(k), by, found);
        for (int axis = 0; axis < 2; ++axis) {
            found.add(found.slopes[axis], found.residual.col(axis), frame_.weight);
            if (const Eigen::Index shared = frame_.shared.cols())
                found.add(Eigen::MatrixXd(frame_.shared.transpose() * found.slopes[axis]),
                          Eigen::VectorXd(frame_.shared.transpose() * found.residual.col(axis)), Eigen::VectorXd::Constant(shared, -1.0));
        }
        found.expect(mean, weight);
        return found;
    }

    bool is_settled(const DomeEquations& at, const State& step, double gain) const {
        return step.cwiseAbs().cwiseQuotient(bounds_.longest).maxCoeff() < FIT.settled_step || gain < FIT.settled_gain * at.cost;
    }

 private:
    // Apparent displacement of marker k, which is displaced by moved (3) with derivatives by (K, 3 n PRESS).
    void appear(Eigen::Index k, const Eigen::RowVector3d& moved, const Eigen::MatrixXd& by, DomeEquations& found) const {
        const Eigen::RowVector3d still = markers_.points.row(k) - markers_.camera_centres.row(k);
        const double plane = markers_.plane_z - markers_.camera_centres(k, 2),
                     height = std::max(still[2] + moved[2], FIT.min_height * still[2]);
        for (int axis = 0; axis < 2; ++axis) {
            const double offset = (still[axis] + moved[axis]) / height;
            const double residual = frame_.shift(k, axis) - (offset - still[axis] / still[2]) * plane;
            if (!std::isfinite(residual)) continue;
            found.residual(k, axis) = residual;
            for (Eigen::Index a = 0; a < found.state.size(); ++a)
                found.slopes[axis](k, a) = (by(k, 3 * a + axis) - offset * by(k, 3 * a + 2)) * plane / height;
        }
    }

    const DomeLibrary& library_;
    const DomeMarkers& markers_;
    const DomeFrame& frame_;
    const Bounds<State> bounds_;
};

}  // namespace

DomeFit fit_dome(const DomeLibrary& library, const DomeMarkers& markers, const DomeErrors& errors, const DomePrior& prior,
                 const Rows2& shift, const DomePresses& starts) {
    using Numbers = Eigen::Matrix<double, PRESS, 1>;
    const Eigen::Index count = starts.rows();
    const DomeFrame frame(markers, errors, prior.together, shift);
    const auto inverse_square = [](double sigma) { return 1 / (sigma * sigma); };
    Numbers lowest, highest, mean = Numbers::Zero(), weight;
    lowest << -library.reach, -library.reach, std::log(FIT.min_depth), -1, -1, -FIT.max_drag, -FIT.max_drag;
    highest << library.reach, library.reach, std::log(library.depth), 1, 0, FIT.max_drag, FIT.max_drag;
    mean[RADIUS] = prior.tip;
    weight << FIT.free, FIT.free, FIT.free, inverse_square(prior.tip_sigma), inverse_square(prior.friction), inverse_square(prior.drag),
        inverse_square(prior.drag);
    DomeProblem problem(library, markers, frame,
                        {lowest.replicate(count, 1), highest.replicate(count, 1), errors.longest.replicate(count, 1)});
    problem.mean = mean.replicate(count, 1), problem.weight = weight.replicate(count, 1);
    const State start = State::Map(starts.data(), starts.size()).cwiseMax(problem.bounds->lowest).cwiseMin(problem.bounds->highest);
    auto [at, last] = minimise(problem, start, FIT.max_steps, FIT.first_damping);
    for (int axis = 0; axis < 2; ++axis) at.residual.col(axis) -= at.slopes[axis] * last;
    const State state = at.state + last;

    DomeFit found;
    found.presses = DomePresses::Map(state.data(), count, PRESS), found.covariance = at.covariance();
    const double seen = static_cast<double>(std::max<Eigen::Index>(frame.seen, 1));
    found.misfit = (at.residual.rowwise().squaredNorm().array() / frame.variance.array()).sum() / (2 * seen);
    const double scale = count == 1 ? found.misfit : 1;  // the error of a sum of two fields is in the covariance
    found.radius_sigma = std::sqrt(scale * found.covariance(RADIUS, RADIUS));
    double doubt = 0;
    for (Eigen::Index p = 0; p < count; ++p)
        doubt = std::max(doubt, errors.not_linear * std::hypot(found.presses(p, DRAG_X), found.presses(p, DRAG_Y)));
    found.expected = 1 + doubt * doubt * ((frame.weight.array() > 0).select(frame.square.array() / frame.variance.array(), 0).sum() / seen);
    // Friction and radius vary by more than the prior of the fit assumes.
    Numbers variance = Numbers::Zero();
    variance[RADIUS] = prior.wider * prior.wider, variance[FRICTION] = prior.rougher * prior.rougher;
    const Numbers more = weight.cwiseProduct(Numbers(weight.cwiseProduct(variance).array() - 1)).cwiseMax(0);
    const Eigen::MatrixXd own = found.covariance;
    found.covariance = scale * own + own * State(more.replicate(count, 1)).asDiagonal() * own;
    found.shown = shift - at.residual;
    return found;
}

}  // namespace tactile
