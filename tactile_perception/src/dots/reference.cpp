// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/reference.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/median.hpp"
#include "dots/links.hpp"

namespace tactile {
namespace {

using Eigen::Index;

constexpr ContactLimits LIMITS;
constexpr double RIDGE = 1e-12;                             // 1, numeric: of the normal equations, for collinear dots
const double MEDIAN_OF_TWO = std::sqrt(2 * std::log(2.0));  // standard deviations of one coordinate: median of the distance in two
constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();

/// The element of that rank, from 0, rounded down.
double ranked(const Eigen::VectorXd& values, double rank) {
    return smallest({values.begin(), values.end()}, static_cast<std::ptrdiff_t>(rank));
}

double upper_median(const Eigen::VectorXd& values) {
    return ranked(values, static_cast<double>(values.size() / 2));
}

/// Distances of displacements from the affine motion that fits most of the dots best: a least-squares fit to all, and one to those that it
/// fits best.
Eigen::VectorXd off_affine(const Rows2& uv, const Rows2& displacement) {
    Rows3 basis(uv.rows(), 3);
    basis << Eigen::VectorXd::Ones(uv.rows()), uv.rowwise() - uv.row(0);
    Eigen::VectorXd kept = Eigen::VectorXd::Ones(uv.rows()), square;
    for (int round = 0; round < 2; ++round) {
        if (round > 0) kept = (square.array() <= ranked(square, LIMITS.kept * static_cast<double>(square.size() - 1))).cast<double>();
        const Eigen::Matrix<double, 3, Eigen::Dynamic> weighted = basis.transpose() * kept.asDiagonal();
        Eigen::Matrix3d normal = weighted * basis;
        normal.diagonal().array() += RIDGE * normal.trace();
        const Eigen::Matrix<double, 3, 2> motion = normal.partialPivLu().solve(weighted * displacement);
        square = (displacement - basis * motion).rowwise().squaredNorm();
    }
    return square.cwiseSqrt();
}

struct Deviation {
    bool is_touched;  // more dots than outliers deviate, or all have moved farther than drift
    double size;      // px, largest deviation without outliers
};

/// Deviation of dots from the motion that all of them share.
Deviation deviation(const IdentifiedDots& dots, const Rows2& displacement) {
    std::vector<Index> known;
    for (Index k = 0; k < displacement.rows(); ++k)
        if (std::isfinite(displacement(k, 0))) known.push_back(k);
    if (known.empty()) return {false, 0.0};
    const Rows2 moves = displacement(known, Eigen::all);
    const double shared = std::sqrt(upper_median(moves.rowwise().squaredNorm()));
    if (moves.rows() < LIMITS.min_affine) return {shared > LIMITS.max_drift, shared};
    const Eigen::VectorXd off = off_affine(dots.uv(known, Eigen::all), moves);
    const double still = upper_median(off) / MEDIAN_OF_TWO;  // noise of a detector that states none: that of the dots that are still
    Index leaving = 0;
    for (Index k = 0; k < off.size(); ++k) {
        const double sigma = dots.sigma[known[static_cast<std::size_t>(k)]], noise = std::isfinite(sigma) ? sigma : still;
        leaving += off[k] > std::max(LIMITS.quiet_sigmas * noise, LIMITS.quiet_floor);
    }
    const auto count = static_cast<double>(off.size());
    return {static_cast<double>(leaving) > LIMITS.outliers * count || shared > LIMITS.max_drift,
            std::max(ranked(off, (1 - LIMITS.outliers) * (count - 1)), shared)};
}

std::vector<Index> order_of(const Numbers& id) {
    std::vector<Index> order(static_cast<std::size_t>(id.size()));
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return id[a] < id[b]; });
    return order;
}

}  // namespace

Index DotPositions::find(std::int64_t wanted, Index guess) const {
    if (guess < id.size() && id[guess] == wanted) return guess;
    const Index at = std::lower_bound(id.begin(), id.end(), wanted) - id.begin();
    return at < id.size() && id[at] == wanted ? at : -1;
}

bool ContactWatch::judge(const IdentifiedDots& dots, const Rows2& displacement, double stamp_s) {
    const auto [is_touched, size] = deviation(dots, displacement);
    if (!is_touched) return reset(), false;
    largest_ = std::max(largest_, size);
    if (!is_still(dots)) {
        const std::vector<Index> order = order_of(dots.id);
        since_s_ = stamp_s, still_ = {dots.id(order), dots.uv(order, Eigen::all)}, accepted_ = UNKNOWN;
    }
    if (std::isfinite(accepted_)) return size > LIMITS.grown * accepted_;
    if (size > std::min(LIMITS.released * largest_, LIMITS.max_residue) || stamp_s - since_s_ < LIMITS.settled_s) return true;
    accepted_ = size;
    return false;
}

bool ContactWatch::is_still(const IdentifiedDots& dots) const {
    std::vector<double> squares, known;
    Index at = -1;
    for (Index k = 0; k < dots.id.size(); ++k) {
        if (std::isfinite(dots.sigma[k])) known.push_back(dots.sigma[k]);
        if (const Index found = still_.find(dots.id[k], at + 1); found >= 0)
            at = found, squares.push_back((dots.uv.row(k) - still_.uv.row(found)).squaredNorm());
    }
    const auto count = static_cast<double>(squares.size());
    if (count < std::max(1.0, LIMITS.common * static_cast<double>(std::max(dots.id.size(), still_.id.size())))) return false;
    const auto middle = static_cast<std::ptrdiff_t>(known.size() / 2);
    const double limit = known.empty() ? LIMITS.still : std::max(LIMITS.still, LIMITS.still_sigmas * smallest(known, middle));
    return smallest(std::move(squares), static_cast<std::ptrdiff_t>(LIMITS.nearly_all * (count - 1))) < limit * limit;
}

void DotReference::reset() {
    take({}, Rows2(0, 2), {});
    is_touched_ = false, stamp_s_ = UNKNOWN;
}

void DotReference::take(const Numbers& id, const Rows2& uv, const Numbers& frames) {
    const std::vector<Index> order = order_of(id);
    positions_ = {id(order), uv(order, Eigen::all)}, counts_ = frames(order);
    averaged_ = (frames.size() ? frames.maxCoeff() : 0) + frames_;
    contact_.reset();
}

Rows2 DotReference::displacement(const Numbers& id, const Rows2& uv) const {
    Rows2 found = Rows2::Constant(uv.rows(), 2, UNKNOWN);
    Index at = -1;
    for (Index k = 0; k < uv.rows(); ++k)
        if (const Index known = positions_.find(id[k], at + 1); known >= 0) at = known, found.row(k) = uv.row(k) - positions_.uv.row(known);
    return found;
}

DotReference::Update DotReference::update(const IdentifiedDots& all, double stamp_s, std::optional<bool> is_touched) {
    std::vector<Index> good;
    for (Index k = 0; k < all.uv.rows(); ++k)
        if (std::abs(all.uv(k, 0)) < FARTHEST && std::abs(all.uv(k, 1)) < FARTHEST) good.push_back(k);
    const IdentifiedDots dots{all.id(good), all.uv(good, Eigen::all), all.sigma(good)};
    Rows2 moves = displacement(dots.id, dots.uv);
    is_touched_ = is_touched ? *is_touched : contact_.judge(dots, moves, stamp_s);
    Update found{Rows2::Constant(all.uv.rows(), 2, UNKNOWN), false};
    if (!is_touched_) {
        follow(dots, stamp_s);
        found.grown = add_missing(dots);
        moves = displacement(dots.id, dots.uv);
    }
    stamp_s_ = stamp_s;
    found.displacement(good, Eigen::all) = moves;
    return found;
}

// Averages the first images, then follows with the time constant.
void DotReference::follow(const IdentifiedDots& dots, double stamp_s) {
    const double elapsed = std::isfinite(stamp_s_) ? std::max(stamp_s - stamp_s_, 0.0) : 0.0;
    const double drift = std::min(1.0, elapsed / time_constant_s_);
    Index at = -1;
    for (Index k = 0; k < dots.id.size(); ++k) {
        const Index known = positions_.find(dots.id[k], at + 1);
        if (known < 0) continue;
        at = known;
        const double gain = counts_[at] < averaged_ ? 1 / static_cast<double>(counts_[at] + 1) : drift;
        positions_.uv.row(at) += gain * (dots.uv.row(k) - positions_.uv.row(at));
        ++counts_[at];
    }
}

// Gives dots without a position their present one; returns whether there are any.
bool DotReference::add_missing(const IdentifiedDots& dots) {
    std::vector<Index> missing;
    Index at = -1;
    for (Index k = 0; k < dots.id.size(); ++k) {
        const Index known = positions_.find(dots.id[k], at + 1);
        if (known < 0) missing.push_back(k);
        at = known < 0 ? at : known;
    }
    if (missing.empty()) return false;
    const Index before = positions_.id.size(), count = before + static_cast<Index>(missing.size());
    Numbers id(count), counts = Numbers::Zero(count);
    Rows2 uv(count, 2);
    id << positions_.id, dots.id(missing);
    uv << positions_.uv, dots.uv(missing, Eigen::all);
    counts.head(before) = counts_;
    const std::vector<Index> order = order_of(id);
    positions_ = {id(order), uv(order, Eigen::all)}, counts_ = counts(order);
    return true;
}

}  // namespace tactile
