// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contacts of a pressure image: the score of each taxel, and outlines.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"

namespace tactile::taxel {

constexpr double LEVEL = 0.5;  // score at the border of a contact

// What the pad makes of the pressure at the border of a contact. Lengths in taxels.
//
// The pad spreads pressure over about its thickness. At the border of a flat face it falls to a fixed part of the level inside, whatever
// the load; under a curved face the level itself runs out, and a part of its slope is left. The level is a plane, or a quadratic, fitted to
// each patch.
struct ScoreRule {
    // Of a pad of a thickness, taxels, on an array of at most side taxels, whose pressure has a noise of sigma.
    static ScoreRule of(double thickness, std::ptrdiff_t side, double sigma);

    double smooth;         // standard deviation of the Gaussian that averages noise and differences of gain
    std::ptrdiff_t reach;  // thickness of the pad, in whole taxels
    float least;           // least level of pressure that counts as contact
    float share;           // pressure at the border of a flat face over the level inside
    float ramp;            // taxels: pressure at the border of a curved face over the slope of the level there
};

// Scores (rows, columns) of pressure, 0 to 1, LEVEL at the border of a contact; 0 far from all contacts. full: taxels that are saturated.
std::vector<float> contact_score(const float* pressure, const std::uint8_t* full, std::ptrdiff_t rows, std::ptrdiff_t columns,
                                 const ScoreRule& rule);

// How a score becomes regions.
struct RegionRule {
    // On an array of at most side taxels, pitch m apart. Pieces within reach taxels are one region: a pad hands on the pressure of two
    // objects nearer than its thickness as that of one.
    static RegionRule of(double reach, std::ptrdiff_t side, double pitch);

    double level;           // score at the border
    std::ptrdiff_t reach;   // taxels: pieces within twice of it are one region
    std::ptrdiff_t around;  // taxels around a region that share its load
    std::ptrdiff_t most;    // regions; of more the largest pieces remain
    double least;           // taxels, area of a piece
    double pitch;           // m
};

// One region, of one piece or of several.
struct Region {
    std::int32_t label;
    std::vector<std::vector<double>> outlines{}, holes{};  // (M, 3) m, of its pieces
    std::array<double, 6> integrals{};                     // of 1, x, y, xx, xy, yy, without the holes, m
    std::ptrdiff_t count = 0;                              // of taxels
    double force = 0;                                      // sum of pressure over them and those around, times the area of a taxel
    float peak = 0;                                        // largest pressure there
    bool at_edge = false, saturated = false;               // whether any of its taxels is at the array's border, is saturated
    Eigen::Vector3d centroid() const { return {integrals[1] / integrals[0], integrals[2] / integrals[0], 0}; }  // m
    TACTILE_FIELDS(label, outlines, holes, integrals, count, force, peak, at_edge, saturated)
};

// Regions, largest first. labels: (rows, columns), 0 outside; near: the same with the taxels around.
struct Regions {
    std::vector<Region> all;
    std::vector<std::int32_t> labels, near;
    std::vector<std::uint8_t> touched;  // (rows, columns), in contact; of a broken image also what is in no region
    std::ptrdiff_t rows, columns;
    bool broken = false;  // more than most
    TACTILE_FIELDS(all, labels, near, touched, broken)
};

// Regions where score (rows, columns) exceeds the level, with their share of pressure; full: taxels that are saturated.
Regions find_regions(const float* score, const float* pressure, const std::uint8_t* full, std::ptrdiff_t rows, std::ptrdiff_t columns,
                     const RegionRule& rule);

}  // namespace tactile::taxel
