// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Constants of the PSD finger's estimator, each with its unit, origin (measured, physical, prior, limit, numeric) and meaning. What halving
// and doubling those of contact and ambient light changes: docs/psd_finger_method.md.
#pragma once

#include <cstddef>

namespace tactile::finger {

struct FingerConstants {
    // Contact and ambient light
    double change_sigmas = 5;         // 1, limit: standard deviations from which light has changed; noise exceeds it once in 1e6 samples
    double quiet_sigmas = 3;          // 1, limit: standard deviations within which it has not; noise exceeds it once in 400 samples
    double rest_periods = 5;          // mains periods, prior: of equal light in which an object rests; shorter than any press by hand
    double steady_s = 0.2;            // s, prior: of constant light without contact that is ambient light; no hand hovers that long
    double growth = 0.1;              // 1, prior: relative growth of an object's light in two mains periods; a lamp's is less
    double lamp_radius = 0.2;         // half widths, prior: between the spots of a lamp and of the offset, which includes dark voltages
    double object_radius = 0.05;      // half widths, prior: by which the spot moves when an object is pressed harder
    double max_lamp = 3;              // 1, limit: light of a lamp over the room's; brighter light is a second object
    double shade = 0.05;              // 1, prior: share of the room's light that an object shades, and its deviation until measured
    double shade_deviation = 0.01;    // 1, prior: standard deviation of that share between objects
    double max_shade = 0.3;           // 1, limit: of that share, for any object
    double extrapolation_s = 0.5;     // s, prior: for which the drift is extrapolated under a contact; half of a room's fastest period
    double drift_acceleration = 0.2;  // 1/sqrt(s), prior: over the fastest drift, which a room takes seconds to reach
    double mains_s = 0.01;            // s, physical: period of lamps on 50 Hz mains, to average light over; a lamp switches within two
    double noise_memory_s = 5;        // s, prior: over which noise is averaged; some presses
    double new_contact_s = 0.02;      // s, limit: without contact, after which the next contact is a new one
    double steady_share = 0.02;       // 1, prior: relative change of a lamp's light, and of an object's by creep
    double limit_sigmas = 4;          // 1, limit: standard deviations; minimum of a contact's total, and largest difference of equal light
    double history_s = 0.002;         // s, numeric: over which light before an onset is averaged
    double min_history = 4;           // samples, limit: of that average
    double min_sigma = 1e-4;          // V, numeric: of the total; keeps thresholds positive for noiseless input
    std::size_t min_samples = 5;      // samples, limit: of the measurement of the untouched state

    // Samples
    double stuck_samples = 50;  // samples, limit: equal ones in a row of a stuck output; noise of one count makes 50 very unlikely
    double gap_s = 0.003;       // s, limit: without samples, beyond which neighbours are not compared; an object moves little in it
    double lost_s = 0.1;        // s, limit: without samples, after which a contact is a new one; shorter than two presses of a finger
    double max_period_s = 1;    // s, limit: between single samples of unknown rate, as in finger/constants.py
    double max_volts = 1e12;    // V, limit: beyond any signal, and squares stay far from overflow

    // Contacts
    double cross_sigmas = 6;   // 1, limit: standard deviations of the cross term of one contact; a larger deviation is several contacts
    double max_log = 50;       // 1, numeric: keeps exp finite
    double min_light = 1e-6;   // V, numeric: of which a logarithm is taken
    double creep_error = 0.3;  // 1, prior: relative, of the creep; a position may lag by another share than the light
    double min_creep = 0.01;   // 1, limit: square of the creep over the covariance; below a tenth of the deviation it is not corrected
};
inline constexpr FingerConstants FINGER;

}  // namespace tactile::finger
