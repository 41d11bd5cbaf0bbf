// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/likely.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/cells.hpp"
#include "common/median.hpp"
#include "common/nearest.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t NEIGHBOURS = 4;  // of a dot, with which lines are made: those of a square grid
constexpr double MIN_LIKELIHOOD = 1e-9;   // of one logarithm over that in any image: bounds what one speck of dirt decides

using Eigen::Index;

// Medians of the logarithms of near points, count for each; a point is not near itself.
Eigen::MatrixXd medians(const Eigen::MatrixXd& logarithms, const Nearest& near, Index queries, Index count, bool without_self) {
    Eigen::MatrixXd found(queries, logarithms.cols());
    std::vector<double> values;
    for (Index i = 0; i < queries; ++i) {
        for (Index k = 0; k < logarithms.cols(); ++k) {
            values.clear();
            for (Index n = i * count; n < (i + 1) * count; ++n)
                if (!without_self || near.index[n] != i) values.push_back(logarithms(near.index[n], k));
            found(i, k) = median(values);
        }
    }
    return found;
}

// The number of a dot's neighbours, and of those that make an equally spaced line with it and a third dot.
struct Lines {
    std::ptrdiff_t neighbours;
    std::vector<std::ptrdiff_t> regular;
};

Lines lines_of(const Rows2& uv, double tolerance) {
    const Index count = uv.rows(), each = std::min(NEIGHBOURS, count - 1) + 1;
    const Nearest near = nearest_points(uv.data(), count, uv.data(), count, each);
    const Cells cells(uv.data(), count);
    const auto is_dot = [&](const Eigen::RowVector2d& at, double radius) {
        bool is_near = false;
        cells.within(at[0], at[1], radius, [&](std::ptrdiff_t, double) { is_near = true; });
        return is_near;
    };
    Lines found{each - 1, std::vector<std::ptrdiff_t>(count, 0)};
    for (Index i = 0; i < count; ++i) {
        for (Index n = i * each; n < (i + 1) * each; ++n) {
            const Index j = near.index[n];
            if (j == i) continue;
            const double radius = tolerance * near.distance[n];
            found.regular[i] += is_dot(2 * uv.row(i) - uv.row(j), radius) || is_dot(2 * uv.row(j) - uv.row(i), radius);
        }
    }
    return found;
}

double log_likelihood(const Eigen::VectorXd& deviation, const Eigen::VectorXd& sigma, const PrintModel& model) {
    double found = 0;
    for (Index k = 0; k < sigma.size(); ++k) {
        const double square = std::pow(deviation[k] / sigma[k], 2) / 2, odd = model.odd_sigmas;
        const double density = (1 - model.odd_share) * std::exp(-square) + model.odd_share / odd * std::exp(-square / (odd * odd));
        found += std::log10(std::max(model.range / (std::sqrt(2 * M_PI) * sigma[k]) * density, MIN_LIKELIHOOD));
    }
    return found;
}

}  // namespace

Eigen::MatrixXd KnownDots::near(const Rows2& positions) const {
    const Index count = std::min<Index>(2 * NEIGHBOURS, uv.rows());
    const Nearest found = nearest_points(uv.data(), uv.rows(), positions.data(), positions.rows(), count);
    return medians(logarithms, found, positions.rows(), count, false);
}

KnownDots::Comparison KnownDots::compare(const Rows2& positions, const Eigen::MatrixXd& given, const PrintModel& model) const {
    const Eigen::MatrixXd usual = near(positions);
    Comparison found;
    for (Index i = 0; i < usual.rows(); ++i) {
        found.log_odds.push_back(log_likelihood((given.row(i) - usual.row(i)).transpose(), sigma, model));
        found.diameter.push_back(std::exp(usual(i, 1)));
    }
    return found;
}

LikelyDots likely_dots(const Rows2& uv, const Eigen::MatrixXd& logarithms, const Eigen::VectorXd& own, const KnownDots* known,
                       const PrintModel& model) {
    const double other = std::log10(2 * (1 - model.own_share));  // of a disc that is none of the print
    std::vector<Index> some(uv.rows());
    for (Index i = 0; i < uv.rows(); ++i) some[i] = i;
    Eigen::MatrixXd deviation;
    if (known && uv.rows()) deviation = logarithms - known->near(uv);
    LikelyDots found{std::vector<std::uint8_t>(uv.rows(), 0), 0, nullptr};
    for (;;) {
        const auto count = static_cast<Index>(some.size());
        if (count < model.min_dots) return {std::move(found.kept), other * static_cast<double>(uv.rows()), nullptr};
        Rows2 at(count, 2);
        for (Index i = 0; i < count; ++i) at.row(i) = uv.row(some[i]);
        const Lines lines = lines_of(at, model.in_line);
        if (!known) {
            found.known = std::make_shared<KnownDots>();
            KnownDots& fresh = *found.known;
            fresh.uv = at;
            fresh.logarithms.resize(count, logarithms.cols());
            for (Index i = 0; i < count; ++i) fresh.logarithms.row(i) = logarithms.row(some[i]);
            const Index each = std::min<Index>(2 * NEIGHBOURS + 1, count);
            deviation =
                fresh.logarithms - medians(fresh.logarithms, nearest_points(at.data(), count, at.data(), count, each), count, each, true);
            fresh.sigma.resize(logarithms.cols());
            for (Index k = 0; k < logarithms.cols(); ++k) {
                const Eigen::VectorXd size = deviation.col(k).cwiseAbs();
                fresh.sigma[k] = std::max(SIGMA_PER_MAD * median({size.data(), size.data() + count}), model.sigma);
            }
            double regular = 0;
            for (const std::ptrdiff_t each_regular : lines.regular) regular += static_cast<double>(each_regular);
            fresh.regular = regular / static_cast<double>(count * lines.neighbours);
        }
        const KnownDots& here = known ? *known : *found.known;
        const double share = std::clamp(here.regular, model.chance, model.max_regular);
        const double in_line = std::log10(share / model.chance), alone = std::log10((1 - share) / (1 - model.chance));
        std::vector<Index> good;
        double log_odds = 0;
        for (Index i = 0; i < count; ++i) {
            const auto regular = static_cast<double>(lines.regular[i]);
            const double odds = own[some[i]] + log_likelihood(deviation.row(known ? some[i] : i).transpose(), here.sigma, model) +
                                regular * in_line + (static_cast<double>(lines.neighbours) - regular) * alone;
            log_odds += odds;
            if (odds > other) good.push_back(some[i]);
        }
        if (good.size() < some.size()) {
            some = std::move(good);
            continue;
        }
        for (const Index i : some) found.kept[i] = 1;
        found.log_odds = log_odds + other * static_cast<double>(uv.rows() - count);
        if (known) found.known = std::make_shared<KnownDots>(*known);
        return found;
    }
}

}  // namespace tactile
