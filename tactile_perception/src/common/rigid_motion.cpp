// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Tukey's biweight from the best of some fixed starts: all points, else neighbourhoods and triples of points. The starts are chosen by a
// fixed rule, so that the same points give the same answer.
#include "common/rigid_motion.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

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

using Eigen::Vector3d;
using Points = std::vector<std::ptrdiff_t>;

// after = turn before + shift. The second singular value of the products, and the third, negative for mirrored points.
struct Motion {
    Eigen::Matrix3d turn;
    Vector3d shift;
    double second, third;
    Vector3d apply(const Vector3d& place) const { return turn * place + shift; }
};

// The rotation that maximises the sum of the products (3, 3) before_i after_j (Kabsch 1976), by their singular value decomposition.
Motion rotation(const Eigen::Matrix3d& products) {
    if (!products.allFinite()) return {Eigen::Matrix3d::Constant(NAN), Vector3d::Zero(), NAN, NAN};
    const Eigen::JacobiSVD<Eigen::Matrix3d> parts(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double hand = (parts.matrixV() * parts.matrixU().transpose()).determinant() < 0 ? -1 : 1;
    const Vector3d signs(1, 1, hand);
    return {parts.matrixV() * signs.asDiagonal() * parts.matrixU().transpose(), Vector3d::Zero(), parts.singularValues()[1],
            hand * parts.singularValues()[2]};
}

Vector3d place_at(const double* array, std::ptrdiff_t k) {
    return Eigen::Map<const Vector3d>(array + 3 * k);
}

// The two largest variances of points (count, 3), as weighted, along their principal axes.
std::array<double, 2> spreads(const double* points, const std::vector<double>& weights) {
    const auto count = static_cast<std::ptrdiff_t>(weights.size());
    const Eigen::Map<const Eigen::Matrix3Xd> places(points, 3, count);
    const Eigen::VectorXd share = Eigen::Map<const Eigen::VectorXd>(weights.data(), count) / std::accumulate(weights.begin(), weights.end(), 0.0);
    const Eigen::Matrix3Xd off = places.colwise() - places * share;
    const Eigen::Matrix3d covariance = off * share.asDiagonal() * off.transpose();
    const Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues();
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
        return (place_at(after_, i) - motion.apply(place_at(before_, i))).squaredNorm() * base_[i];
    }

    Motion least_squares(const Points& points, const double* weights) const {
        double total = 0;
        for (const std::ptrdiff_t i : points) total += weights[i];
        const double whole = std::max(total, std::numeric_limits<double>::min());
        Vector3d from = Vector3d::Zero(), to = from;
        for (const std::ptrdiff_t i : points)
            from += weights[i] / whole * place_at(before_, i), to += weights[i] / whole * place_at(after_, i);
        Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
        for (const std::ptrdiff_t i : points)
            products += weights[i] / whole * (place_at(before_, i) - from) * (place_at(after_, i) - to).transpose();
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
            const double square = (place_at(before_, i) - place_at(before_, centre)).squaredNorm();
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
    RigidMotion motion{{}, {found.shift.x(), found.shift.y(), found.shift.z()}, std::vector<double>(3 * count), used, fit.open(found, used)};
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(motion.rotation.data()) = found.turn;
    for (std::ptrdiff_t i = 0; i < count; ++i)
        Eigen::Map<Vector3d>(&motion.residuals[3 * i]) = place_at(after, i) - found.apply(place_at(before, i));
    return motion;
}

}  // namespace tactile
