// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Tukey's biweight from the best of some fixed starts: all points, else neighbourhoods and triples of points. The starts are chosen by a
// fixed rule, so that the same points give the same answer.
#include "common/rigid_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "common/jacobi.hpp"
#include "common/vectors.hpp"

namespace tactile {
namespace {

constexpr double TUKEY = 4.685;                   // 95 % efficiency on normal errors
constexpr std::ptrdiff_t STARTS = 24, PATCH = 9;  // neighbourhoods, and as many triples; points of a neighbourhood. Chosen
constexpr double NEAR = 2.0;                      // standard deviations per coordinate of an inlier. Chosen
constexpr double AGREED = 0.8;                    // share of inliers from which the fit to all points is the start. Chosen
constexpr double SETTLED = 1e-2;                  // relative change of the weights that ends the fit. Chosen
constexpr double GOLDEN = 0.6180339887498949;     // golden ratio less 1: spreads the points of triples

constexpr double ONE_PLACE = 1e-24;  // m^2, a picometre: points that near coincide in any sensor
constexpr double NARROW = 1e-6;      // least variance across the long axis over that along it; below, the turn about it is open. Chosen
constexpr double MIRRORED = 1e-2;    // third singular value over the second of a reflection; noise reaches it at 10 % of the spread

using Points = std::vector<std::ptrdiff_t>;

// after = turn before + shift; turn's rows. The second singular value of the products, and the third, negative for mirrored points.
struct Motion {
    Vec3 turn[3], shift;
    double second, third;
    Vec3 apply(Vec3 place) const { return Vec3{dot(turn[0], place), dot(turn[1], place), dot(turn[2], place)} + shift; }
};

// The rotation that maximises the sum of products c[i][j] = before_i after_j (Horn 1987, Closed-form solution of absolute orientation using
// unit quaternions): its quaternion is the eigenvector of the largest eigenvalue.
Motion rotation(const double (&c)[3][3]) {
    double matrix[4][4] = {{c[0][0] + c[1][1] + c[2][2], c[1][2] - c[2][1], c[2][0] - c[0][2], c[0][1] - c[1][0]},
                           {c[1][2] - c[2][1], c[0][0] - c[1][1] - c[2][2], c[0][1] + c[1][0], c[2][0] + c[0][2]},
                           {c[2][0] - c[0][2], c[0][1] + c[1][0], c[1][1] - c[0][0] - c[2][2], c[1][2] + c[2][1]},
                           {c[0][1] - c[1][0], c[2][0] + c[0][2], c[1][2] + c[2][1], c[2][2] - c[0][0] - c[1][1]}};
    double axes[4][4];
    diagonalise(matrix, axes);
    int order[] = {0, 1, 2, 3};
    std::stable_sort(order, order + 4, [&](int i, int j) { return matrix[i][i] > matrix[j][j]; });
    const auto value = [&](int k) { return matrix[order[k]][order[k]]; };
    const int most = order[0];
    const double w = axes[0][most], x = axes[1][most], y = axes[2][most], z = axes[3][most];
    // With singular values a, b, c the eigenvalues are a + b + c, a - b - c, b - a - c and c - a - b.
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}},
            {0, 0, 0},
            (value(0) + value(2)) / 2,
            (value(0) + value(3)) / 2};
}

// The two largest variances of points (count, 3), as weighted, along their principal axes.
std::array<double, 2> spreads(const double* points, const std::vector<double>& weights) {
    double total = 0, matrix[3][3] = {}, axes[3][3];
    Vec3 middle{0, 0, 0};
    for (const double weight : weights) total += weight;
    for (std::size_t i = 0; i < weights.size(); ++i) middle = middle + weights[i] / total * vec3_at(points, static_cast<std::ptrdiff_t>(i));
    for (std::size_t i = 0; i < weights.size(); ++i) {
        const Vec3 off = vec3_at(points, static_cast<std::ptrdiff_t>(i)) - middle;
        const double away[3] = {off.x, off.y, off.z};
        for (int a = 0; a < 3; ++a) {
            for (int b = 0; b < 3; ++b) matrix[a][b] += weights[i] / total * away[a] * away[b];
        }
    }
    diagonalise(matrix, axes);
    double values[3] = {matrix[0][0], matrix[1][1], matrix[2][2]};
    std::sort(values, values + 3);
    return {values[2], values[1]};
}

class Fit {
 public:
    Fit(const double* before, const double* after, const double* base, std::ptrdiff_t count)
        : before_(before), after_(after), base_(base), count_(count) {}

    std::vector<double> run(int steps) const {
        const Points all = this->all();
        std::vector<double> weights(base_, base_ + count_);
        Motion motion = best_start(all);
        for (int step = 0; step < steps; ++step) {
            double change = 0, largest = 0;
            for (std::ptrdiff_t i = 0; i < count_; ++i) {
                const double share = std::max(1 - scaled(motion, i) / (3 * TUKEY * TUKEY), 0.0), weight = base_[i] * share * share;
                change = std::max(change, std::abs(weight - weights[i]));
                largest = std::max(largest, weight);
                weights[i] = weight;
            }
            if (change < SETTLED * largest) break;
            motion = least_squares(all, weights.data());
        }
        return weights;
    }

    Motion least_squares(const std::vector<double>& weights) const { return least_squares(all(), weights.data()); }

    Undetermined open(const Motion& motion, const std::vector<double>& weights) const {
        if (std::count_if(weights.begin(), weights.end(), [](double weight) { return weight > 0; }) < 3) return Undetermined::TOO_FEW;
        const std::array<double, 2> from = spreads(before_, weights), to = spreads(after_, weights);
        if (from[0] <= ONE_PLACE) return Undetermined::BEFORE_AT_ONE_PLACE;
        if (from[1] <= NARROW * from[0]) return Undetermined::BEFORE_ON_A_LINE;
        if (to[0] <= ONE_PLACE) return Undetermined::AFTER_AT_ONE_PLACE;
        if (to[1] <= NARROW * to[0]) return Undetermined::AFTER_ON_A_LINE;
        return -motion.third > MIRRORED * motion.second ? Undetermined::REFLECTION : Undetermined::NO;
    }

 private:
    Points all() const {
        Points points(count_);
        std::iota(points.begin(), points.end(), std::ptrdiff_t{0});
        return points;
    }

    // Squared residual of point i over the variance of a coordinate.
    double scaled(const Motion& motion, std::ptrdiff_t i) const {
        const Vec3 left = vec3_at(after_, i) - motion.apply(vec3_at(before_, i));
        return dot(left, left) * base_[i];
    }

    Motion least_squares(const Points& points, const double* weights) const {
        double total = 0;
        for (const std::ptrdiff_t i : points) total += weights[i];
        Vec3 from{0, 0, 0}, to{0, 0, 0};
        for (const std::ptrdiff_t i : points) {
            const double share = weights[i] / std::max(total, std::numeric_limits<double>::min());
            from = from + share * vec3_at(before_, i), to = to + share * vec3_at(after_, i);
        }
        double products[3][3] = {};
        for (const std::ptrdiff_t i : points) {
            const double share = weights[i] / std::max(total, std::numeric_limits<double>::min());
            const Vec3 p = vec3_at(before_, i) - from, q = share * (vec3_at(after_, i) - to);
            const double left[3] = {p.x, p.y, p.z}, right[3] = {q.x, q.y, q.z};
            for (int a = 0; a < 3; ++a) {
                for (int b = 0; b < 3; ++b) products[a][b] += left[a] * right[b];
            }
        }
        Motion motion = rotation(products);
        motion.shift = to - motion.apply(from);
        return motion;
    }

    // The fit to all points where most are inliers; else the fit to a neighbourhood or a triple with the least truncated loss.
    Motion best_start(const Points& all) const {
        Motion best = least_squares(all, base_);
        std::ptrdiff_t near = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) near += scaled(best, i) < 3 * NEAR * NEAR;
        if (count_ <= PATCH || static_cast<double>(near) > AGREED * static_cast<double>(count_)) return best;
        double least = std::numeric_limits<double>::infinity();
        const auto compare = [&](const Points& points) {
            const Motion motion = least_squares(points, base_);
            double loss = 0;
            for (std::ptrdiff_t i = 0; i < count_; ++i) loss += std::min(scaled(motion, i), 3 * NEAR * NEAR);
            if (loss < least) least = loss, best = motion;
        };
        const std::ptrdiff_t centres = std::min(STARTS, count_);
        for (std::ptrdiff_t k = 0; k < centres; ++k) compare(neighbourhood(k * (count_ - 1) / (centres - 1)));
        for (std::ptrdiff_t k = 0; k < STARTS; ++k) compare({spread(3 * k), spread(3 * k + 1), spread(3 * k + 2)});
        return best;
    }

    // The points nearest to one, for an object whose points are contiguous.
    Points neighbourhood(std::ptrdiff_t centre) const {
        std::vector<std::pair<double, std::ptrdiff_t>> distance(count_);
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Vec3 away = vec3_at(before_, i) - vec3_at(before_, centre);
            const double square = dot(away, away);
            distance[i] = {std::isfinite(square) ? square : std::numeric_limits<double>::infinity(), i};
        }
        std::nth_element(distance.begin(), distance.begin() + PATCH - 1, distance.end());
        Points points;
        for (std::ptrdiff_t k = 0; k < PATCH; ++k) points.push_back(distance[k].second);
        return points;
    }

    // Points spread by the golden ratio, for an object whose points are not contiguous.
    std::ptrdiff_t spread(std::ptrdiff_t k) const {
        return static_cast<std::ptrdiff_t>(std::fmod(static_cast<double>(k) * GOLDEN, 1.0) * static_cast<double>(count_));
    }

    const double *before_, *after_, *base_;
    const std::ptrdiff_t count_;
};

}  // namespace

RigidMotion rigid_motion(const double* before, const double* after, const double* weights, std::ptrdiff_t count, int steps) {
    const Fit fit(before, after, weights, count);
    const std::vector<double> used = steps > 0 ? fit.run(steps) : std::vector<double>(weights, weights + count);
    const Motion found = fit.least_squares(used);
    RigidMotion motion{{}, {found.shift.x, found.shift.y, found.shift.z}, std::vector<double>(3 * count), used, fit.open(found, used)};
    for (std::ptrdiff_t i = 0; i < count; ++i) store(motion.residuals.data(), i, vec3_at(after, i) - found.apply(vec3_at(before, i)));
    for (int row = 0; row < 3; ++row) {
        const Vec3& turn = found.turn[row];
        motion.rotation[3 * row] = turn.x, motion.rotation[3 * row + 1] = turn.y, motion.rotation[3 * row + 2] = turn.z;
    }
    return motion;
}

}  // namespace tactile
