// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Which taxels slip, from their force vectors: a hidden Markov model. The object rests or moves, for all taxels in common; while it moves,
// each taxel sticks and is loaded, or slips at its friction cone. Each mode predicts the shear of a taxel by its own Kalman filter:
// interacting multiple models (Blom and Bar-Shalom 1988). The coefficient of friction is a discrete distribution.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"

namespace tactile::force_taxels {

// What decides, each with its unit and origin.
struct SlipLimits {
    // Rates, prior of a hand at work
    double changes = 2;  // 1/s: an object at rest begins to move, a taxel slips below the known friction, one that slips sticks again
    double stops = 2;    // 1/s: an object that moves comes to rest; a hand mostly holds still
    double same = 0.5;   // probability that a motion has the direction of the last one
    // Shear
    double creep = 0.05;     // standard deviations of noise by which shear changes in 0.01 s at rest: silicone rubber
    double texture = 0.02;   // part of shear by which it changes in 0.01 s of slip: friction varies by some percent within a millimetre
    double unchanged = 0.3;  // probability that a slip changes no force in a frame: textures are uneven
    double load_s = 0.4;     // s, in which a load reaches the limit of friction, and
    double steady_s = 1;     // s, in which its rate changes as much
    // Friction
    double median = 0.6, factor = 2;  // of the prior: rubber on common objects
    double uneven = 0.08;             // relative standard deviation over a surface
    double skewed = 0.05;             // standard deviation of the ratio of shear to pressure by gains of a taxel
    double texture_s = 0.1;           // s, over which the ratios of one slip are not independent
    double forgotten = 0.5;           // probability that a new touch is of another object
    double outlier = 1e-3;            // likelihood of what fits no mode, so that one taxel decides nothing
    TACTILE_FIELDS(changes, stops, same, creep, texture, unchanged, load_s, steady_s, median, factor, uneven, skewed, texture_s, forgotten,
                   outlier)
};

// Force vectors of one frame, (N, 3) each: two tangential components and the pressing one.
struct TaxelForces {
    const double* force;
    const double* noise;                   // variance of white noise
    const double* offset;                  // variance of the untouched reading
    const std::uint8_t *touched, *is_new;  // (N); a reading that is not new repeats the last one
};

class SlipFilter {
 public:
    // tilt: of each taxel, rad, standard deviation of the surface's normal within its cell.
    SlipFilter(std::vector<double> tilt, const SlipLimits& limits);
    // Starts again without a history; what is known of friction is kept.
    void reset();
    // Probability (N) that each taxel slips, interval s after the last frame.
    std::vector<double> update(const TaxelForces& frame, double interval);

    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(taxels_.size()); }
    double friction() const;        // mean of the coefficient
    double friction_sigma() const;  // its standard deviation
    double moving = 0.5;            // probability that the object moves

 private:
    static constexpr int COEFFICIENTS = 40;
    enum Mode { REST, LOAD, SLIP, MODES };
    using Modes = std::array<double, MODES>;
    using Vector = std::array<double, 2>;
    using Coefficients = std::array<double, COEFFICIENTS>;
    struct Taxel {
        bool touched = false;
        std::array<Vector, MODES> shear{};            // mean of each mode's filter, and
        Modes variance{};                             // its variance, equal along both axes
        Vector rate{};                                // 1/s, of a load
        double rate_variance = 0, rate_with_shear = 0;  // its variance, and its covariance with the shear
        double press = 0;                             // of the last frame
        double slips = 0;                             // probability that it slips if the object moves
    };
    struct Reading {  // of a touched taxel
        Taxel* taxel;
        Vector shear;
        double press, noise, press_noise, ratio, sigma;  // noise: variance of an axis; ratio: of shear to pressure
        bool is_first, counts;
        Coefficients cone, below;  // density of the ratio for each coefficient: of a taxel at its friction cone, and of one that sticks
        double on_cone;            // probability that the taxel is at its friction cone, by the ratio alone
        double begins;             // probability that a load begins to slip
        Modes arriving, likelihood;
        double slips;
    };
    void read(const TaxelForces& frame, std::ptrdiff_t k, Reading& one) const;
    void rate_ratio(Reading& one) const;
    void predict(Reading& one, double interval);
    void weigh(std::vector<Reading>& readings, double interval);
    void learn(const std::vector<Reading>& readings, double interval);
    void set_weights(const Coefficients& log);

    SlipLimits limits_;
    std::vector<double> tilt_;
    std::vector<Taxel> taxels_;
    Coefficients coefficient_, prior_, log_, weight_;  // log_: of weight_
};

}  // namespace tactile::force_taxels
