// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace tactile::taxel {

// Constants of taxel arrays: unit, origin and meaning of each. Those of motion and slip that decide most: MotionLimits in tracker.hpp.
struct TaxelConstants {
    // Signal
    double rounding_sigma = 0.29;  // values, derived: standard deviation of rounding to whole numbers, 1 / sqrt(12)
    std::ptrdiff_t quiet_margin = 3;  // taxels, physical: around a quiet one that must be untouched: the pad spreads pressure over two
    // frames, limit: quiet frames of a taxel before it adds to the noise: its mean is then known better than that
    float min_quiet_frames = 5;
    std::ptrdiff_t noise_frames = 50;  // frames, limit: of the noise's average; once full, one frame in noise_interval updates it
    std::ptrdiff_t noise_interval = 10;  // frames, numeric: saves time
    std::size_t noise_sample = 2000;  // taxels, numeric: that show the noise: a standard deviation is then known within 2 %
    double max_offset_range = 0.1;  // full scale, limit: range of a smoothed first frame with a contact; offsets vary by less
    float silent_share = 0.1f;  // 1, physical: of both neighbours; a taxel below that is silent, since the pad blurs pressure
    double pressed_sigmas = 12;  // sigma, limit: of the noise, from which a taxel is pressed
    std::uint8_t silent_frames = 10;  // frames, limit: without any response before, after which a taxel is dead
    double slope_sigmas = 5;  // sigma, numeric: at which the slope of the response is evaluated: half of the lowest level of a score
    double saturation = 0.995;  // full scale, physical: from which a taxel is saturated: one count below 255
    double hidden_width = 1;  // taxels, prior: Gaussian by which neighbours show together whether their load rises or falls
    // Regions
    // 1, physical: pressure under a bonded elastic layer at the border of a rigid face over that inside: 0.59 to 0.63 at Poisson ratios of
    // 0.3 to 0.4, whatever the face's width (2.5 to 20 thicknesses) and the load
    double border_share = 0.6;
    double level_sigmas = 10;  // sigma, noise: least level: a false taxel in a hundred thousand frames, also of correlated noise
    // thicknesses, measured: pressure at the border of a curved face over the slope with which the fitted level runs out to zero there. By
    // theory at most 0.22, 1 / sqrt(2 pi) of the width of the pad's blur; less, since the pad stiffens under deep presses
    double border_ramp = 0.165;
    double score_width = 0.5;  // thicknesses, limit: Gaussian that averages noise, differences of gain and roughness
    double min_score_width = 0.5;  // taxels, limit: of that Gaussian
    std::ptrdiff_t load_margin = 2;  // taxels, physical: around a region that share its force: a pad of 2 mm on taxels of 1 mm (paper)
    std::ptrdiff_t max_regions = 64;  // 1, limit: an image with more is broken: more than fingers can make
    // taxels, noise: of a piece: half of that of a single taxel of full score; noise at a border makes smaller ones
    double min_area = 0.25;
    float max_dip = 0.35f;  // 1, limit: of the level, down to which a dip in a contact is closed; well below the share
    std::ptrdiff_t min_level_taxels = 16;  // taxels, limit: from which a level is fitted; over two for each of the 6 coefficients
    // 1, limit: part of the plane's residual variance that a quadratic explains, from which it has a share in the level
    double bent_from = 0.2;
    double bent_wholly = 0.4;  // 1, limit: the same, from which it is the level; a hard choice would shift a border from frame to frame
    float min_level = 0.3f;  // 1, limit: of the level over what is near it
    float max_level = 1.7f;  // 1, limit: of the level over what is near it
    double max_foot = 2.5;  // 1, limit: area of a dome's foot over that above half of its top; 2 for a paraboloid, over 4 for a wide disc
    // Contacts and slip
    double outline_sigma = 0.5;  // pitches, measured: of the vertices of an outline in the test of roundness
    double max_step = 1.5;  // pitches, limit: between the borders of a contact in two consecutive frames
    // sigma, limit: higher peaks are contacts at once, lower ones if largest or persistent: faces start and end in pieces
    double min_peak_sigmas = 40;
    double centroid_sigma = 0.03;  // pitches, measured: of a centroid
    // sigma, measured: of the peak at which a position's error is a pad thickness; it falls with the third power
    double roughness_sigmas = 17;
    double max_turn_radius = 4;  // radii, limit: of the contact: a centre of rotation farther away counts as a translation
    double assumed_slide = 0.1;  // thicknesses, prior: by which a typical pad of unknown response is dragged before it slips
    // Motion
    double image_width = 0.25;  // thicknesses, limit: Gaussian that averages noise: the pad's own blur leaves nothing finer to see
    double min_image_width = 0.5;  // taxels, limit: of that Gaussian: what is finer is the shape of the taxels themselves
    double edge_sigmas = 4;  // sigma, noise: of the noise, from which the slope of an image is an edge (one false taxel in 10,000)
    double spline_variance = 1.0 / 3;  // taxels^2, derived: of the cubic B-spline by which slopes are taken
    // taxels, limit: up to which a contact is followed by its centroid, where the pad is thinner than a taxel
    std::ptrdiff_t few_coarse = 40;
    std::ptrdiff_t few_fine = 12;  // taxels, limit: the same on thicker pads
    double window_s = 0.2;  // s, limit: longest stretch of a steady motion
    double wander_sigmas = 2;  // sigma, noise: of the registration (95 %), by which pressure wanders without motion
    double continued = 0.5;  // 1, prior: of the last step, that is expected of the next one
    double slip_speed = 0.02;  // m/s, prior: mean speed of an object that slips; an object that is let go has it after 2 ms
    double min_noise = 2e-3;  // taxels, noise: of a position: what registration leaves of the phase between object and taxels
    double border_lead = 0.5;  // 1, physical: thicknesses times traction over pressure, by which the image leads (a bonded elastic layer)
    double few_taxels_sigma = 0.3;  // taxels, noise: of the centroid of few taxels, as pressure shifts without motion
    // Registration and path
    double reach_quantile = 0.9;  // 1, limit: of the edges' distances, is the reach: a few edges beside the contact must not count
    int max_steps = 4;  // 1, numeric: of the registration
    double registration_step = 0.04;  // taxels, numeric: a step below it leaves an error of about a tenth of it
    double min_spread = 0.015;  // 1, noise: least standard deviation of an image's residuals
    double max_fit = 1e6;  // taxels, numeric: of a guess, beyond which the fit has failed
    int search = 6;  // taxels, limit: around a guess that are searched: 0.6 m/s at 100 frames/s of 1 mm taxels
    double max_spread = 0.2;  // 1, limit: standard deviation of residuals up to which a fit holds; of an image of about 0.8
    double max_jump = 5;  // taxels, limit: in a frame, of a centroid: no motion
    std::ptrdiff_t min_velocity_frames = 4;  // frames, limit: for a velocity that is reported: two more than a line needs
    // 1, measured: information on a motion over that in the best direction: the rough edge of a half plane has up to 0.06 on a shift, a bar
    // of 5 : 2 has 0.4; a face of 3 : 2 has 0.06 on a turn
    double min_information = 0.04;
    double roughness = 3;  // 1/edge, noise: of that, what edges have in any direction by chance: a ring has only that
    // Rolling
    double rest_s = 0.1;  // s, limit: over which the picture before a motion is averaged
    double max_stiffening = 2;  // 1, physical: of the pad's shear stiffness, of a contact whose surroundings hold it, too
    double slope_width = 0.5;  // taxels, numeric: Gaussian before slopes are taken
    double min_traction_sigmas = -6;  // sigma, limit: of a traction against the motion; a stronger one is limited to this
    // 1, physical: variance of pressure over that of the area of a curved face: 0.6 to 0.67 of a paraboloid, 0.75 to 0.8 by Hertz
    double curved_spread = 0.7;
    double flat_spread = 0.95;  // 1, physical: the same of a flat face, which the pad blurs
    std::ptrdiff_t min_side = 4;  // taxels, limit: of an array that shows a traction
    double surroundings = 2.5;  // thicknesses, physical: around a contact that show its pressure: beyond the spread of what traction causes
    // Shear
    int shear_sweeps = 12;  // 1, numeric: at most a frame, continued in the next one
    float relaxation = 1.4f;  // 1, numeric: best for a coupling of 2, whose slowest mode Jacobi's method shrinks by 8/9
    float shear_step = 1e-8f;  // m, numeric: largest change in the last sweep: a hundred thousandth of a taxel of 1 mm
    double min_friction = 0.02;  // 1, limit: over the load; less friction moves the pressure negligibly
    float unseen_tension = 0.5f;  // 1, limit: of a tension; a pressure below that shows the tension
    double flattening = 0.15;  // 1, physical: attenuation of a pressure wave by the pad over (wave number times thickness) squared
    double unsharp_width = 0.5;  // thicknesses, numeric: Gaussian of the unsharp mask that undoes it
    // 1, physical: stiffness of a surface wave over (wave number times thickness) squared: mean of along (0.8) and across (0.3)
    double coupling = 0.5;
};

inline constexpr TaxelConstants TAXEL;

}  // namespace tactile::taxel
