// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/deviation.hpp"

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "common/median.hpp"

namespace tactile {
namespace {

using Eigen::Index;

constexpr double QUIET_SIGMAS = 5.0, QUIET_FLOOR = 0.1;  // standard deviations, and px, that changes of light shift a dot by at most
constexpr double OUTLIERS = 0.01;                        // share of the dots that may deviate so without a contact
constexpr double MAX_DRIFT = 0.5;                        // px, median displacement: drift is followed before it grows so far
constexpr double KEPT = 0.8;                             // share of the dots with the smallest residuals that the fit uses
constexpr double FARTHEST = 1e12;                        // px: squares of it are finite
constexpr Index MIN_DOTS_FOR_AFFINE = 8;
constexpr double RIDGE = 1e-12;                             // of the normal equations, for collinear dots
const double MEDIAN_OF_TWO = std::sqrt(2 * std::log(2.0));  // standard deviations of one coordinate: median of the distance in two

/// The element of that rank, from 0, rounded down.
double ranked(const Eigen::VectorXd& values, double rank) {
    return smallest({values.begin(), values.end()}, static_cast<std::ptrdiff_t>(rank));
}

double upper_median(const Eigen::VectorXd& values) {
    return ranked(values, static_cast<double>(values.size() / 2));
}

/// Distances of duv from the affine motion that fits most of the dots best: a least-squares fit to all, and one to those that it fits best.
Eigen::VectorXd off_affine(const Rows2& uv, const Rows2& duv) {
    Rows3 basis(uv.rows(), 3);
    basis << Eigen::VectorXd::Ones(uv.rows()), uv.rowwise() - uv.row(0);
    Eigen::VectorXd kept = Eigen::VectorXd::Ones(uv.rows()), square;
    for (int round = 0; round < 2; ++round) {
        if (round > 0) kept = (square.array() <= ranked(square, KEPT * static_cast<double>(square.size() - 1))).cast<double>();
        const Eigen::Matrix<double, 3, Eigen::Dynamic> weighted = basis.transpose() * kept.asDiagonal();
        Eigen::Matrix3d normal = weighted * basis;
        normal.diagonal().array() += RIDGE * normal.trace();
        const Eigen::Matrix<double, 3, 2> motion = normal.partialPivLu().solve(weighted * duv);
        square = (duv - basis * motion).rowwise().squaredNorm();
    }
    return square.cwiseSqrt();
}

}  // namespace

DotDeviation deviation(const Rows2& uv, const Rows2& duv, const Eigen::VectorXd& sigma) {
    std::vector<Index> known;
    for (Index k = 0; k < duv.rows(); ++k)
        if ((duv.row(k).array().abs() < FARTHEST).all()) known.push_back(k);  // not of NaN
    if (known.empty()) return {false, 0.0};
    const Rows2 moves = duv(known, Eigen::all);
    const double shared = std::sqrt(upper_median(moves.rowwise().squaredNorm()));
    if (moves.rows() < MIN_DOTS_FOR_AFFINE) return {shared > MAX_DRIFT, shared};
    const Eigen::VectorXd off = off_affine(uv(known, Eigen::all), moves);
    const double still = upper_median(off) / MEDIAN_OF_TWO;  // noise of a detector that states none: that of the dots that are still
    Index leaving = 0;
    for (Index k = 0; k < off.size(); ++k) {
        const double noise = std::isfinite(sigma[known[k]]) ? sigma[known[k]] : still;
        leaving += off[k] > std::max(QUIET_SIGMAS * noise, QUIET_FLOOR);
    }
    const auto count = static_cast<double>(off.size());
    return {static_cast<double>(leaving) > OUTLIERS * count || shared > MAX_DRIFT,
            std::max(ranked(off, (1 - OUTLIERS) * (count - 1)), shared)};
}

}  // namespace tactile
