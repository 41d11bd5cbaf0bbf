// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Motion of a contact: from image to image, and along its path.
#include "taxel/motion.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "common/median.hpp"
#include "common/wide.hpp"

namespace tactile::taxel {

// Registration of a contact's image with a keyframe: Gauss-Newton on the residuals at the edges (Lucas and Kanade 1981), weighted by
// Tukey's biweight. The image is the sum of a cubic B-spline at each taxel times its value there.
namespace {

constexpr double QUANTILE = 0.9;  // of the edges' distances, is the reach: a few edges beside the contact must not count
constexpr int ITERATIONS = 4;
constexpr double CONVERGED = 0.04;      // taxels: a step below it leaves an error of about a tenth of it
constexpr double TUKEY = 4.685;         // of the biweight: 95 percent efficiency for Gaussian noise
constexpr double LEAST_SPREAD = 0.015;  // least standard deviation of the image's residuals
constexpr double FARTHEST = 1e6;        // taxels, of a guess, beyond which the fit has failed

// Cubic B-spline at the four taxels around a place, part past the second.
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

Keyframe::Keyframe(const Picture& picture, double steep) {
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
            middle += edges_.back().place;
        }
    }
    if (count() == 0) return;
    middle /= static_cast<double>(count());
    for (const Edge& edge : edges_) far.push_back((edge.place - middle).norm());
    reach = std::max(smallest(std::move(far), std::lround(QUANTILE * static_cast<double>(count() - 1))), 1e-6);
    for (Edge& edge : edges_) {
        edge.place -= middle;
        edge.slopes[2] = (edge.place.x() * edge.slopes[1] - edge.place.y() * edge.slopes[0]) / reach;
        normal += edge.slopes * edge.slopes.transpose();
    }
}

Registration Keyframe::motion(const Picture& picture, bool turns, const Eigen::Vector4d& guess) const {
    const Eigen::Vector4d fitted(1, 1, turns, 1);
    Registration found{guess};
    std::vector<double> left(edges_.size()), size(edges_.size());
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        const double turn = found.fit[2] / reach, cosine = std::cos(turn), sine = std::sin(turn);
        for (std::size_t k = 0; k < edges_.size(); ++k) {
            const double x = edges_[k].place.x(), y = edges_[k].place.y();
            const double column = middle.x() + cosine * x - sine * y + found.fit[0],
                         row = middle.y() + cosine * y + sine * x + found.fit[1];
            left[k] = edges_[k].value - sampled(picture, row, column) - edges_[k].slopes[3] * found.fit[3];
            size[k] = std::isnan(left[k]) ? std::numeric_limits<double>::infinity() : std::abs(left[k]);
        }
        const auto half = static_cast<std::ptrdiff_t>(size.size() / 2);
        found.spread = std::max(SIGMA_PER_MAD * (size.empty() ? 0 : smallest(size, half)), LEAST_SPREAD);
        Eigen::Matrix4d products = Eigen::Matrix4d::Zero();
        Eigen::Vector4d right = Eigen::Vector4d::Zero();
        for (std::size_t k = 0; k < edges_.size(); ++k) {
            const double off = left[k] / (TUKEY * found.spread);
            if (!(off * off < 1)) continue;
            const Eigen::Vector4d slopes = edges_[k].slopes.cwiseProduct(fitted);
            const Eigen::Vector4d weighed = (1 - off * off) * (1 - off * off) * slopes;
            products += weighed * slopes.transpose();
            right += weighed * left[k];
        }
        products.diagonal().array() += 1e-9 * products.trace() + 1e-12;
        const Eigen::Vector4d step = products.ldlt().solve(right);
        found.fit += step;
        const double largest = step.cwiseAbs().maxCoeff();
        if (!(largest >= CONVERGED && largest < FARTHEST)) break;
    }
    return found;
}

// Velocity from the longest stretch of the past in which it was constant: lines are fitted to ever longer stretches, as long as the
// confidence intervals of their slopes have a point in common (Goldenshluger and Nemirovski 1997; Katkovnik 1999). A start, a stop or a
// reversal is seen within a few frames, and a slow motion is averaged over many.
namespace {

using Eigen::Vector3d;

constexpr double WHOLE = 1 + 1e-6;  // of a stretch: a frame at its beginning belongs to it
constexpr double LARGEST = std::numeric_limits<double>::max();
constexpr std::ptrdiff_t FEWEST = 4;  // frames for a velocity that is reported: two more than a line needs

// Standard deviation of the first two coordinates, by the median length of their second differences, in which steady motion has no part;
// without the last one, in which a motion may begin.
double noise_of(const std::vector<Vector3d>& positions) {
    std::vector<double> bends;
    for (std::size_t k = 0; k + 3 < positions.size(); ++k) {
        const double bend = (positions[k + 2] - 2 * positions[k + 1] + positions[k]).head<2>().norm();
        bends.push_back(bend >= 0 ? bend : std::numeric_limits<double>::infinity());
    }
    // A second difference has six times the variance of a position; the median of a Rayleigh distribution is sqrt(2 ln 2).
    return bends.empty() ? 0 : median(std::move(bends)) / std::sqrt(6 * 2 * std::log(2.0));
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

void Path::reset() {
    past_.clear();
}

PathMotion Path::add(double time, const Vector3d& pose, const Eigen::Vector2d& arm, double reach) {
    std::size_t old = 0;
    while (past_.size() - old >= static_cast<std::size_t>(FEWEST) && past_[old].time < time - rule_.window * WHOLE) ++old;
    past_.erase(past_.begin(), past_.begin() + static_cast<std::ptrdiff_t>(old));
    past_.push_back({time, pose});
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
    found.lasting = times.back() - times[frames - found.used];
    for (Vector3d* at : {&found.pose, &found.velocity}) {
        const double turn = (*at)[2] / reach;
        *at = {(*at)[0] + turn * arm[1], (*at)[1] - turn * arm[0], turn};
    }
    found.reported.setConstant(std::numeric_limits<double>::quiet_NaN());
    if (frames < FEWEST) return found;
    std::ptrdiff_t first = frames - FEWEST;
    while (first > 0 && times[first - 1] >= time - rule_.reported * WHOLE) --first;
    double mean = 0, square = 0;
    for (std::ptrdiff_t k = first; k < frames; ++k) mean += times[k] / static_cast<double>(frames - first);
    found.reported.setZero();
    for (std::ptrdiff_t k = first; k < frames; ++k) {
        square += (times[k] - mean) * (times[k] - mean);
        found.reported += (times[k] - mean) * past_[k].pose;
    }
    found.reported /= square;
    return found;
}

}  // namespace tactile::taxel
