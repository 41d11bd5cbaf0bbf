// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The samples of a PSD finger: sums and places of single samples, and the contact that several of them make (Maekawa et al., eqs 1 and 7).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Functions of the detector's position, tabulated on a square grid over -1 to 1 along both axes and bilinear between its nodes.
struct PlaceTable {
    const double* values;     // (nodes, nodes, channels), rows along y
    std::ptrdiff_t nodes;     // along each axis, 2 or more
    std::ptrdiff_t channels;  // the first three are the normal
};

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

struct FingerContact {
    std::array<double, 4> sums;        // mean
    std::array<double, 2> place;       // half widths
    std::array<double, 3> normal;      // unit
    std::array<double, 9> covariance;  // of the normal, by the noise of the light alone, rad^2
    std::vector<double> row;           // (channels,) the table there
};

// The contact of the mean of samples: sums (N, 4), those with used (N,) not 0. noise: (4, 4) covariance of a sample's sums, V^2; shot: V,
// variance of an output per V of its signal. NaN throughout where none is used or the mean total is not positive.
FingerContact finger_contact(const double* sums, const std::uint8_t* used, std::ptrdiff_t count, const PlaceTable& table,
                             const double* noise, double shot);

// The table's values (N, channels) at places (N, 2), clipped to the square; NaN at places that are not finite.
std::vector<double> place_values(const double* places, std::ptrdiff_t count, const PlaceTable& table);

// Covariance (xx, xy, yy), half widths squared, of a place that is measured with that total, V: first-order propagation of eq 1.
std::array<double, 3> place_covariance(double x, double y, double total, const double* noise, double shot);

}  // namespace tactile
