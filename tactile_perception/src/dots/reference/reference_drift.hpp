// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Index of each id (count) among known ids (known_count), of the first of equal ones; -1 where it is not among them.
std::vector<std::ptrdiff_t> find_ids(const std::int64_t* id, std::ptrdiff_t count, const std::int64_t* known, std::ptrdiff_t known_count);

// Moves known places, px, towards places (count, 2) of dots at these indices, -1 for none: to their mean over the first frames, afterwards
// by the share `slow`. counts: number of frames of each known dot, increased by one.
void follow_drift(double* known_places, std::int64_t* counts, const std::ptrdiff_t* at, const double* places, std::ptrdiff_t count,
                  std::int64_t frames, double slow);

// Whether any dot id (count), its motion taken off its place (count, 2), px, is farther than limit along an axis from its known place
// (K, 2), or that is NaN. Dots whose own places or motions are not finite do not count.
bool rest_moved(const std::int64_t* id, const double* places, const double* motions, std::ptrdiff_t count, const double* known,
                double limit);

// Deviation of dots from their common affine motion.
struct Deviation {
    bool moved;   // more dots deviate than outliers, or the whole pattern moved farther than drift
    double size;  // px, the largest deviation without outliers
};

// places, motions (count, 2), px, sigma (count), px per axis; dots whose motion is not finite are left out.
Deviation deviation_from_drift(const double* places, const double* motions, const double* sigma, std::ptrdiff_t count);

// Whether nearly all dots are where they were; ids are distinct. places (count, 2), sigma (count), px.
struct PlacedDots {
    const std::int64_t* id;
    const double* places;
    std::ptrdiff_t count;
};
bool have_stayed(const PlacedDots& now, const double* sigma, const PlacedDots& then);

}  // namespace tactile
