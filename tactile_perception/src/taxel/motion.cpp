// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Motion of a contact: from image to image, and along its path.
#include "taxel/motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "common/median.hpp"
#include "common/pseudo_inverse.hpp"
#include "common/solver.hpp"
#include "common/wide.hpp"
#include "taxel/constants.hpp"

namespace tactile::taxel {

// Registration of a contact's image with a keyframe: Gauss-Newton on the residuals at the edges (Lucas and Kanade 1981), weighted by
// Tukey's biweight. The image is the sum of a cubic B-spline at each taxel times its value there.
namespace {

using Eigen::Vector4d;

constexpr Tukey KERNEL{4.685};       // standard deviations: 95 percent efficiency for Gaussian noise
constexpr int UNKNOWNS = 4;
constexpr double NEGLIGIBLE = 1e-9;  // of the largest eigenvalue: rounding
constexpr float TINY = 1e-12f;       // against a division by zero

// Cubic B-spline at the four taxels around a point, part past the second.
std::array<double, 4> spline(double part) {
    const double rest = 1 - part;
    return {rest * rest * rest / 6, (4 + part * part * (3 * part - 6)) / 6, (4 + rest * rest * (3 * rest - 6)) / 6, part * part * part / 6};
}

// The image at a taxel.
TACTILE_INLINE float shown(float pressure, float scale) {
    const float value = pressure * scale;
    return value > 0 ? std::min(value, 1e15f) : 0;  // 0 for NaN
}

double sampled(const Picture& picture, double row, double column) {
    const std::ptrdiff_t rows = picture.rows, columns = picture.columns;
    row = row > 0 ? std::min(row, static_cast<double>(rows - 1)) : 0;
    column = column > 0 ? std::min(column, static_cast<double>(columns - 1)) : 0;
    const auto top = static_cast<std::ptrdiff_t>(row), left = static_cast<std::ptrdiff_t>(column);
    const auto down = spline(row - static_cast<double>(top)), across = spline(column - static_cast<double>(left));
    double sum = 0;
    for (std::ptrdiff_t r = 0; r < 4; ++r) {
        const float* line = picture.pressure + std::clamp<std::ptrdiff_t>(top + r - 1, 0, rows - 1) * columns;
        double part = 0;
        for (std::ptrdiff_t c = 0; c < 4; ++c)
            part += across[c] * shown(line[std::clamp<std::ptrdiff_t>(left + c - 1, 0, columns - 1)], picture.scale);
        sum += down[r] * part;
    }
    return sum;
}

TACTILE_WIDE void show(const float* pressure, std::ptrdiff_t columns, float scale, double* line) {
    for (std::ptrdiff_t c = 0; c < columns; ++c) line[c] = shown(pressure[c], scale);
}

// Slopes along both axes, and value of the spline, along the middle one of three lines of the image (3, columns); none at the ends.
TACTILE_WIDE void slopes_of(const double* lines, std::ptrdiff_t columns, double* across, double* down, double* value) {
    const double *up = lines, *here = lines + columns, *low = lines + 2 * columns;
#pragma GCC ivdep
    for (std::ptrdiff_t c = 1; c < columns - 1; ++c) {
        const double left = up[c - 1] + 4 * here[c - 1] + low[c - 1], right = up[c + 1] + 4 * here[c + 1] + low[c + 1];
        const double top = up[c - 1] + 4 * up[c] + up[c + 1], bottom = low[c - 1] + 4 * low[c] + low[c + 1];
        const double middle = here[c - 1] + 4 * here[c] + here[c + 1];
        across[c] = (right - left) / 12;
        down[c] = (bottom - top) / 12;
        value[c] = (top + 4 * middle + bottom) / 36;
    }
}

}  // namespace

EdgeKeyframe::EdgeKeyframe(const Picture& picture, double steep) {
    const std::ptrdiff_t rows = picture.rows, columns = picture.columns;
    std::vector<double> lines(3 * columns), across(columns), down(columns), value(columns), far;
    for (std::ptrdiff_t r = 1; r < rows - 1; ++r) {
        for (std::ptrdiff_t k = 0; k < 3; ++k)
            show(picture.pressure + (r + k - 1) * columns, columns, picture.scale, lines.data() + k * columns);
        slopes_of(lines.data(), columns, across.data(), down.data(), value.data());
        for (std::ptrdiff_t c = 1; c < columns - 1; ++c) {
            const double slope = std::hypot(across[c], down[c]);
            if (!(slope > steep)) continue;
            edges_.push_back({{static_cast<double>(c), static_cast<double>(r)}, value[c], {across[c], down[c], 0, -slope}});
            middle += edges_.back().position;
        }
    }
    if (count() == 0) return;
    middle /= static_cast<double>(count());
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    for (const Edge& edge : edges_) far.push_back((edge.position - middle).norm());
    reach = std::max(smallest(std::move(far), std::lround(TAXEL.reach_quantile * static_cast<double>(count() - 1))), 1e-6);
    for (Edge& edge : edges_) {
        edge.position -= middle;
        edge.slopes[2] = (edge.position.x() * edge.slopes[1] - edge.position.y() * edge.slopes[0]) / reach;
        normal += edge.slopes * edge.slopes.transpose();
    }
    find_observable(normal);
}

// Which motions the edges determine, from the products of their slopes. Of the slopes of few edges, a part of one over their number has any
// direction by chance.
void EdgeKeyframe::find_observable(const Eigen::Matrix4d& normal) {
    if (count() < UNKNOWNS) return;
    const double least = (TAXEL.min_information + TAXEL.roughness / static_cast<double>(count())) * (normal(0, 0) + normal(1, 1));
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> shifts(normal.topLeftCorner<2, 2>());
    double turn_alone = normal(2, 2);  // information on a turn that no shift explains
    blind_ = false;
    for (int k = 0; k < 2; ++k) {
        const double information = shifts.eigenvalues()[k];
        const Eigen::Vector2d direction = shifts.eigenvectors().col(k);
        if (!(information > least)) {
            blind_ = true;
            continue;
        }
        determined_ = true;
        visible_.topLeftCorner<2, 2>() += direction * direction.transpose();
        const double along = direction.dot(normal.block<2, 1>(0, 2));
        turn_alone -= along * along / information;
    }
    turns_ = turn_alone > least;
    visible_(2, 2) = turns_;
    visible_(3, 3) = 1;
    const Eigen::Matrix3d covariance = pseudo_inverse<Eigen::Matrix4d>(visible_ * normal * visible_, NEGLIGIBLE).topLeftCorner<3, 3>();
    position_sigma_ = std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues()[2]);
}

std::optional<KeyframeMotion> EdgeKeyframe::motion(const Picture& picture, const Eigen::Vector4d& guess) const {
    if (!determined_) return {};
    const Eigen::Vector4d start = visible_ * guess;
    Registration found = fitted(picture, start);
    if (!(found.spread <= TAXEL.max_spread) && start.cwiseAbs().maxCoeff() < TAXEL.max_fit) {
        const Registration far = fitted(picture, searched(picture, start));
        if (far.spread < found.spread) found = far;
    }
    if (!(found.spread <= TAXEL.max_spread)) return {};
    const double turn = turns_ ? found.fit[2] / reach : std::numeric_limits<double>::quiet_NaN();
    return KeyframeMotion{found.fit, turn, reach, found.spread * position_sigma_, blind_};
}

Eigen::Vector4d EdgeKeyframe::searched(const Picture& picture, const Eigen::Vector4d& guess) const {
    Eigen::Vector4d best = guess;
    double least = std::numeric_limits<double>::infinity();
    for (int down = -TAXEL.search; down <= TAXEL.search; ++down) {
        for (int across = -TAXEL.search; across <= TAXEL.search; ++across) {
            const Eigen::Vector4d start = guess + visible_ * Eigen::Vector4d(across, down, 0, 0);
            double sum = 0;
            for (const Edge& edge : edges_) {
                const auto row = std::clamp<std::ptrdiff_t>(std::lround(middle.y() + edge.position.y() + start[1]), 0, picture.rows - 1);
                const auto column =
                    std::clamp<std::ptrdiff_t>(std::lround(middle.x() + edge.position.x() + start[0]), 0, picture.columns - 1);
                sum += std::min(std::abs(edge.value - shown(picture.pressure[row * picture.columns + column], picture.scale)), 1.0);
            }
            if (!(sum < least)) continue;
            least = sum;
            best = start;
        }
    }
    return best;
}

// Residuals of an image at the edges, and the equations of the fit that make them small.
class EdgeKeyframe::Problem {
 public:
    struct Equations : NormalEquations<UNKNOWNS> {
        using NormalEquations::NormalEquations;
        double spread = 0;  // standard deviation of the residuals
    };
    const Bounds<Vector4d>* const bounds = nullptr;

    Problem(const EdgeKeyframe& key, const Picture& picture)
        : key_(key), picture_(picture), rows_(key.count(), UNKNOWNS), residuals_(key.count()), weights_(key.count()) {
        for (std::ptrdiff_t k = 0; k < key.count(); ++k) rows_.row(k) = key.visible_ * key.edges_[k].slopes;
    }

    Equations linearise(const Vector4d& fit) {
        Equations found(fit);
        const double turn = fit[2] / key_.reach, cosine = std::cos(turn), sine = std::sin(turn);
        std::vector<double> size(key_.edges_.size());
        for (std::size_t k = 0; k < size.size(); ++k) {
            const Edge& edge = key_.edges_[k];
            const double x = edge.position.x(), y = edge.position.y();
            const double column = key_.middle.x() + cosine * x - sine * y + fit[0], row = key_.middle.y() + cosine * y + sine * x + fit[1];
            const double residual = edge.value - sampled(picture_, row, column) - edge.slopes[3] * fit[3];
            size[k] = std::isnan(residual) ? std::numeric_limits<double>::infinity() : std::abs(residual);
            residuals_[k] = std::isfinite(residual) ? residual : 0;
        }
        found.spread = SIGMA_PER_MAD * (size.empty() ? 0 : smallest(size, static_cast<std::ptrdiff_t>(size.size() / 2)));
        found.spread = std::max(found.spread, TAXEL.min_spread);
        for (std::size_t k = 0; k < size.size(); ++k) weights_[k] = KERNEL.weight(size[k] / found.spread);
        found.add(rows_, residuals_, weights_);
        found.information.diagonal().array() += 1e-9 * found.information.trace() + 1e-12;
        return found;
    }
    bool is_settled(const Equations&, const Vector4d& step, double) const {
        const double largest = step.cwiseAbs().maxCoeff();
        return !(largest >= TAXEL.registration_step && largest < TAXEL.max_fit);
    }

 private:
    const EdgeKeyframe& key_;
    const Picture& picture_;
    Eigen::Matrix<double, Eigen::Dynamic, UNKNOWNS> rows_;
    Eigen::VectorXd residuals_, weights_;
};

EdgeKeyframe::Registration EdgeKeyframe::fitted(const Picture& picture, const Vector4d& guess) const {
    Problem problem(*this, picture);
    const auto& [at, left] = minimise(problem, guess, TAXEL.max_steps - 1);
    const std::optional<Vector4d> last = step_from<Problem::Equations, Vector4d>(at, nullptr, 0);
    return {at.state + last.value_or(left), at.spread};
}

namespace {

// Column and row of the centroid of pressure where touched (rows, columns).
Eigen::Vector2d centroid(const float* pressure, const std::uint8_t* touched, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    Eigen::Vector2d moment = Eigen::Vector2d::Zero();
    double load = 0;
    for (std::ptrdiff_t k = 0; k < rows * columns; ++k) {
        if (!touched[k]) continue;
        const double weight = std::max(pressure[k], 0.0f) + TINY;
        moment += weight * Eigen::Vector2d(static_cast<double>(k % columns), static_cast<double>(k / columns));
        load += weight;
    }
    return moment / load;
}

}  // namespace

CentroidKeyframe::CentroidKeyframe(const Picture& picture, const std::uint8_t* touched)
    : middle(centroid(picture.pressure, touched, picture.rows, picture.columns)),
      pressure_(picture.pressure, picture.pressure + picture.rows * picture.columns),
      touched_(touched, touched + picture.rows * picture.columns) {}

std::optional<KeyframeMotion> CentroidKeyframe::motion(const Picture& picture, const std::uint8_t* touched) const {
    std::vector<std::uint8_t> either = touched_;
    for (std::size_t k = 0; k < either.size(); ++k) either[k] |= touched[k];
    const Eigen::Vector2d shift = centroid(picture.pressure, either.data(), picture.rows, picture.columns) -
                                  centroid(pressure_.data(), either.data(), picture.rows, picture.columns);
    if (!(shift.norm() < TAXEL.max_jump)) return {};
    return KeyframeMotion{{shift.x(), shift.y(), 0, 0}, std::numeric_limits<double>::quiet_NaN(), 1, TAXEL.few_taxels_sigma, false};
}

// Velocity from the longest stretch of the past in which it was constant: lines are fitted to ever longer stretches, as long as the
// confidence intervals of their slopes have a point in common (Goldenshluger and Nemirovski 1997; Katkovnik 1999). A start, a stop or a
// reversal is seen within a few frames, and a slow motion is averaged over many.
namespace {

using Eigen::Vector3d;

constexpr double WHOLE = 1 + 1e-6;  // of a stretch: a frame at its beginning belongs to it
constexpr double LARGEST = std::numeric_limits<double>::max();

// Standard deviation of the first two coordinates, by the median length of their third differences, in which a steady acceleration has no
// part; without the last one, in which a motion may begin.
double noise_of(const std::vector<Vector3d>& positions) {
    std::vector<double> bends;
    for (std::size_t k = 0; k + 4 < positions.size(); ++k) {
        const double bend = (positions[k + 3] - 3 * positions[k + 2] + 3 * positions[k + 1] - positions[k]).head<2>().norm();
        bends.push_back(bend >= 0 ? bend : std::numeric_limits<double>::infinity());
    }
    // A third difference has twenty times the variance of a position; the median of a Rayleigh distribution is sqrt(2 ln 2).
    return bends.empty() ? 0 : median(std::move(bends)) / std::sqrt(20 * 2 * std::log(2.0));
}

// Sets pose, velocity, sigma and used by the longest steady line through the latest positions.
void fit_line(const std::vector<double>& times, const std::vector<Vector3d>& positions, double bound, PathMotion& found) {
    const Vector3d& last = positions.back();
    found.pose = last;
    found.velocity.setZero();
    found.sigma = LARGEST;
    Vector3d least = Vector3d::Constant(-LARGEST), most = -least, sum = Vector3d::Zero(), moment = sum;
    double total = 0, square = 0;  // of the times before the last one
    const std::size_t count = times.size();
    for (std::size_t n = 1; n <= count; ++n) {
        const double time = times[count - n] - times.back();
        const Vector3d off = positions[count - n] - last;
        total += time;
        square += time * time;
        sum += off;
        moment += time * off;
        const double spread = square - total * total / static_cast<double>(n);
        if (!(spread > 0)) continue;
        const Vector3d slope = (moment - total / static_cast<double>(n) * sum) / spread;
        const double sigma = found.noise / std::sqrt(spread);
        least = least.cwiseMax((slope.array() - bound * sigma).matrix());
        most = most.cwiseMin((slope.array() + bound * sigma).matrix());
        if (!(least.array() <= most.array()).all()) return;
        found.velocity = slope;
        found.pose = last + (sum - slope * total) / static_cast<double>(n);
        found.sigma = sigma;
        found.used = static_cast<std::ptrdiff_t>(n);
    }
}

}  // namespace

PathMotion Path::add(double time, const Vector3d& pose, const Vector3d& rest, const Eigen::Vector2d& arm, double reach) {
    std::size_t old = 0;
    const auto fewest = static_cast<std::size_t>(TAXEL.min_velocity_frames);
    while (past_.size() - old >= fewest && past_[old].time < time - rule_.window * WHOLE) ++old;
    past_.erase(past_.begin(), past_.begin() + static_cast<std::ptrdiff_t>(old));
    past_.push_back({time, pose, rest});
    std::vector<double> times;
    std::vector<Vector3d> positions;  // of the contact's middle, and of its edges along a turn
    for (const Frame& one : past_) {
        times.push_back(one.time);
        const double turn = one.pose[2];
        positions.push_back({one.pose[0] - turn * arm[1], one.pose[1] + turn * arm[0], turn * reach});
    }
    PathMotion found;
    found.noise = std::max(noise_of(positions), rule_.least_noise);
    fit_line(times, positions, rule_.bound, found);
    found.speed = found.velocity.norm();
    const auto frames = static_cast<std::ptrdiff_t>(times.size());
    found.duration = times.back() - times[frames - found.used];
    for (Vector3d* at : {&found.pose, &found.velocity}) {
        const double turn = (*at)[2] / reach;
        *at = {(*at)[0] + turn * arm[1], (*at)[1] - turn * arm[0], turn};
    }
    for (Vector3d* one : {&found.reported, &found.hidden, &found.bend}) one->setConstant(std::numeric_limits<double>::quiet_NaN());
    if (frames < TAXEL.min_velocity_frames) return found;
    std::ptrdiff_t first = frames - TAXEL.min_velocity_frames;
    while (first > 0 && times[first - 1] >= time - rule_.reported * WHOLE) --first;
    double mean = 0, square = 0;
    for (std::ptrdiff_t k = first; k < frames; ++k) mean += times[k] / static_cast<double>(frames - first);
    found.reported.setZero(), found.hidden.setZero();
    for (std::ptrdiff_t k = first; k < frames; ++k) {
        square += (times[k] - mean) * (times[k] - mean);
        found.reported += (times[k] - mean) * past_[k].pose;
        found.hidden += (times[k] - mean) * past_[k].rest;
    }
    found.reported /= square, found.hidden /= square;
    found.reported_sigma = found.noise / std::sqrt(square);
    const std::ptrdiff_t half = (first + frames - 1) / 2;
    const double early = times[half] - times[first], late = time - times[half];
    const auto seen = [&](std::ptrdiff_t k) -> Vector3d { return past_[k].pose + past_[k].rest; };
    found.bend = (seen(frames - 1) - seen(half)) / late - (seen(half) - seen(first)) / early;
    found.bend_sigma = found.noise * std::sqrt(2 / (early * early) + 2 / (late * late) + 2 / (early * late));
    return found;
}

}  // namespace tactile::taxel
