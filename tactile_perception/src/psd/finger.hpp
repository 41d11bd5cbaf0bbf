// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The samples of a PSD finger: sums and places of single samples, and the contact that several of them make (Maekawa et al., eqs 1 and 7).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "psd/place_table.hpp"

namespace tactile {

// The sums of four outputs x1, y1, x2, y2: differences along x and along y, the numerators of eq 1, the total, its denominator, and the
// cross term.
enum FingerSum { X, Y, TOTAL, CROSS };
using FingerSums = std::array<double, 4>;  // V

inline void mix(const double* outputs, double* sums) {
    const double x1 = outputs[0], y1 = outputs[1], x2 = outputs[2], y2 = outputs[3];
    sums[X] = (y1 + x2) - (x1 + y2);
    sums[Y] = (x2 + y2) - (x1 + y1);
    sums[TOTAL] = (x1 + y1) + (x2 + y2);
    sums[CROSS] = (x1 + x2) - (y1 + y2);
}

// The outputs that have these sums.
inline std::array<double, 4> unmixed(const FingerSums& sums) {
    const double x = sums[X], y = sums[Y], total = sums[TOTAL], cross = sums[CROSS];
    return {(total - x - y + cross) / 4, (total + x - y - cross) / 4, (total + x + y + cross) / 4, (total - x + y - cross) / 4};
}

// Eq 1 without its offset, clipped to the detector: noise takes weak light beyond it. NaN without light.
inline Place place_of(const double* sums) {
    const auto along = [&](FingerSum axis) { return std::min(std::max(sums[axis] / sums[TOTAL], -1.0), 1.0); };
    return {along(X), along(Y)};
}

// What a sample is held against. Voltages in V.
struct FingerLimits {
    std::array<double, 4> offset;  // of the untouched outputs
    double lit;                    // total from which a place is computed
    double least;                  // lowest light that counts as first contact
    double saturation;             // at which an output saturates
    std::ptrdiff_t level;          // channel of the table: light at first contact
};

struct FingerSamples {
    std::vector<double> sums;             // (N, 4) net voltages mixed: difference along x, along y, total, cross term
    std::vector<double> place;            // (N, 2) half widths, within -1 to 1; NaN where it is not lit
    std::vector<double> over;             // (N,) V, total above the light at first contact there; -infinity where it is not lit
    std::vector<std::uint8_t> saturated;  // (N,)
    std::ptrdiff_t known = 0;             // samples whose four voltages are finite
    double lowest, highest, least_over;   // of the totals and of over; infinite without samples
};

FingerSamples finger_samples(const double* volts, std::ptrdiff_t count, const FingerLimits& limits, const PlaceTable& table);

// How many samples each output has not changed for, (4,), after samples (N, 4). last: (4,) the sample before them; same: (4,) so far. An
// output that is saturated is not counted: it stands still for that.
void count_repeats(const double* volts, std::ptrdiff_t count, double saturation, double* last, double* same);

enum FingerFlags { OUT_OF_RANGE = 1, AMBIGUOUS = 4, SATURATED = 8 };  // of tactile_msgs/Contact

// One finger, and what is known of its outputs.
struct FingerRules {
    PlaceTable table;     // with the channels of a finger
    const double* noise;  // (4, 4) V^2, covariance of a sample's sums
    const double* loads;  // (2, 8) coefficients of log N and log m (response.features); NaN where not calibrated
    double shot;          // V, variance of an output per V of its signal
    double cross_volts;   // V, standard deviation of the cross term of a single contact
    double radius;        // m, of the cover
    FingerSums room;      // V, light of the room, whose centroid an error of it has; 0 where it is not known
    double room_volts;    // V, standard deviation of the total that is taken off as the room's light
    FingerSums lamp;      // V, part of the contact's light that may be a lamp's
    bool stuck;           // an output has stopped changing
};

struct FingerTouch {
    std::ptrdiff_t samples = 0;        // in contact
    std::array<double, 3> position;    // m
    std::array<double, 3> normal;      // unit
    std::array<double, 9> covariance;  // of the position, m^2
    double force, depth;               // N, m; NaN where not calibrated
    int flags = 0;                     // sum of FingerFlags
};

// The contact of the mean of samples: sums (N, 4) of those in contact (N,) that are not saturated (N,). NaN throughout where there is none,
// the mean total is not positive, or an output is stuck.
FingerTouch finger_touch(const double* sums, const std::uint8_t* in_contact, const std::uint8_t* saturated, std::ptrdiff_t count,
                         const FingerRules& finger);

// The table's values (N, channels) at places (N, 2), clipped to the square; NaN at places that are not finite.
std::vector<double> place_values(const double* places, std::ptrdiff_t count, const PlaceTable& table);

// Covariance (xx, xy, yy), half widths squared, of a place that is measured with that total, V: first-order propagation of eq 1.
std::array<double, 3> place_covariance(double x, double y, double total, const double* noise, double shot);

}  // namespace tactile
