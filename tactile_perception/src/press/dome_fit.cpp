// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "common/solver.hpp"
#include "press/dome.hpp"

namespace tactile {
namespace {

constexpr int MAX_STEPS = 14;               // including trials
constexpr double SETTLED_STEP = 0.1;        // of the maximum step, over which fields are linear
constexpr double SETTLED_GAIN = 1e-3;       // of the cost; a step that gains less is the last
constexpr double MIN_HEIGHT = 0.1;          // of a point over the camera's centre, as a share of its undeformed height
constexpr double FIRST_DAMPING = 1e-3;      // over the normal equations' diagonal
constexpr double MIN_AXIS_DISTANCE = 2e-5;  // m, of a press from the axis, on which the meridian is undefined

constexpr int MAX_STATE = MAX_DOME_PRESSES * PRESS;
using State = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, MAX_STATE, 1>;

// The equations at some presses, their residuals (K, 2), and the derivatives of the apparent displacements along x and along y.
struct DomeEquations : NormalEquations<Eigen::Dynamic, MAX_STATE> {
    Eigen::MatrixXd residual, slopes[2];  // (K, 2), (K, n PRESS)
    using NormalEquations::NormalEquations;
};

class DomeProblem {
 public:
    DomeProblem(const DomeLibrary& library, const DomeMarkers& markers, const DomeFrame& frame, const PressPrior& prior,
                Eigen::Index presses)
        : library_(library),
          markers_(markers),
          frame_(frame),
          mean_(prior.mean.replicate(presses, 1)),
          weight_(prior.weight.replicate(presses, 1)),
          bounds_{prior.lowest.replicate(presses, 1), prior.highest.replicate(presses, 1), prior.longest.replicate(presses, 1)} {}

    const Bounds<State>* const bounds = &bounds_;

    DomeEquations linearise(State presses) const {
        const Eigen::Index count = markers_.points.rows();
        for (Eigen::Index p = 0; p < presses.size(); p += PRESS)
            if (std::hypot(presses[p + X], presses[p + Y]) < MIN_AXIS_DISTANCE)
                presses[p + X] = std::copysign(MIN_AXIS_DISTANCE, presses[p + X]);
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
        found.expect(mean_, weight_);
        return found;
    }

    bool is_settled(const DomeEquations& at, const State& step, double gain) const {
        return step.cwiseAbs().cwiseQuotient(bounds_.longest).maxCoeff() < SETTLED_STEP || gain < SETTLED_GAIN * at.cost;
    }

 private:
    // Apparent displacement of marker k, which is displaced by moved (3) with derivatives by (K, 3 n PRESS).
    void appear(Eigen::Index k, const Eigen::RowVector3d& moved, const Eigen::MatrixXd& by, DomeEquations& found) const {
        const Eigen::RowVector3d still = markers_.points.row(k) - markers_.camera_centres.row(k);
        const double plane = markers_.plane_z - markers_.camera_centres(k, 2),
                     height = std::max(still[2] + moved[2], MIN_HEIGHT * still[2]);
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
    const State mean_, weight_;
    const Bounds<State> bounds_;
};

}  // namespace

DomeFit fit_dome(const DomeLibrary& library, const DomeMarkers& markers, const DomeFrame& frame, const PressPrior& prior,
                 const DomePresses& starts) {
    DomeProblem problem(library, markers, frame, prior, starts.rows());
    const State start = State::Map(starts.data(), starts.size()).cwiseMax(problem.bounds->lowest).cwiseMin(problem.bounds->highest);
    auto [at, last] = minimise(problem, start, MAX_STEPS, FIRST_DAMPING);
    for (int axis = 0; axis < 2; ++axis) at.residual.col(axis) -= at.slopes[axis] * last;
    const State found = at.state + last;
    return {DomePresses::Map(found.data(), starts.rows(), PRESS), at.covariance(), at.residual};
}

}  // namespace tactile
