// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Which blobs of an image are the dots of a print.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/fields.hpp"
#include "common/rows.hpp"

namespace tactile {

// What is assumed of a print, and of the blobs of any image: photographs, texture, noise, gels without markers.
struct PrintModel {
    double own_share = 0.98;      // of the discs in a print, those of its sign and contrast; in any image half of them are
    double sigma = 0.25;          // least standard deviation of the logarithms of contrast and diameter about the neighbours' in a print
    double range = 1.39;          // of these logarithms in any image, where they are uniform: a factor of two to both sides
    double odd_share = 0.01;      // of the dots, those under glare or dirt
    double odd_sigmas = 3.0;      // standard deviation of these, in standard deviations of the others
    double in_line = 0.2;         // deviation of three equally spaced dots from a line, over their distance
    double chance = 0.2;          // share of a dot's neighbours that have a third such dot in any image
    double max_regular = 0.95;    // and the most that is assumed of a print
    std::ptrdiff_t min_dots = 6;  // of a print: the corners of a square are four
    TACTILE_FIELDS(own_share, sigma, range, odd_share, odd_sigmas, in_line, chance, max_regular, min_dots)
};

// Dots with which others are compared. logarithms (N, K): of contrasts and diameters; sigma (K): their standard deviations about those of
// neighbours; regular: share of a dot's neighbours that make an equally spaced line with it and a third dot.
struct KnownDots {
    Rows2 uv;
    Eigen::MatrixXd logarithms;
    Eigen::VectorXd sigma;
    double regular = 0;

    // Medians (M, K) of the logarithms of the dots near positions.
    Eigen::MatrixXd near(const Rows2& positions) const;

    // Decimal log odds of discs by what their logarithms (N, 2) differ from those near, and the diameters near, px.
    struct Comparison {
        std::vector<double> log_odds, diameter;
    };
    Comparison compare(const Rows2& positions, const Eigen::MatrixXd& logarithms, const PrintModel& model = {}) const;
};

// kept: of each disc, whether it is likelier to be a dot than a blob of any image; log_odds: the decimal logarithm of the odds of all;
// known: the dots that are kept, null where they are too few.
struct LikelyDots {
    std::vector<std::uint8_t> kept;
    double log_odds = 0;
    std::shared_ptr<KnownDots> known;
};

// Discs at positions uv, with logarithms (N, K), by their own odds (N), decimal logarithms, and by those near: of the known dots, or where
// there are none by one another.
LikelyDots likely_dots(const Rows2& uv, const Eigen::MatrixXd& logarithms, const Eigen::VectorXd& own, const KnownDots* known,
                       const PrintModel& model = {});

}  // namespace tactile
