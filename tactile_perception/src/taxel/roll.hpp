// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Whether an object that moves over the pad rolls.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/grid.hpp"
#include "taxel/shear.hpp"

namespace tactile::taxel {

// Whether an object that moves has no traction, so that it rolls, by the odds of two hypotheses.
//
// Traction raises the pressure before an object at the expense of that behind it, over some two thicknesses of the pad. So a picture is
// fitted by the one before the motion, shifted, turned, grown, of another load, and with some traction (least squares). An object that
// slides has any traction from none to what its displacement and friction allow; one that rolls has none, and is curved.
class RollWatch {
 public:
    struct Limits {
        double key_moved;  // taxels from the picture before the motion, up to which its slopes hold
        double traction;   // traction over pressure, 1/taxel of motion, which a picture that changes while it moves seems to show
        double curved;     // standard deviation of the variance of pressure over that of the area, along a motion
    };
    explicit RollWatch(const Limits& limits) : limits_(limits) {}
    // The next picture is the one before a motion.
    void reset() { before_.clear(); }
    // Take pressure (rows, columns) as of an object that does not move; same_load: since the last frame; stamp: s.
    void rest(const float* pressure, std::ptrdiff_t size, bool same_load, double stamp);
    // Whether an object that moves, after a rest, over touched (rows, columns) under a mean pressure, Pa, rolls. pressure: (rows, columns)
    // as taxels see it, of noise sigma; pulled: traction over pressure, if it slides.
    bool follow(const SurfaceShear& shear, const float* pressure, double sigma, const std::uint8_t* touched, const Eigen::Vector2d& pulled,
                double mean);

 private:
    void fit(const SurfaceShear& shear, const std::uint8_t* touched);
    std::vector<double> within_box(const float* values, std::ptrdiff_t columns) const;

    Limits limits_;
    std::vector<float> before_;                           // the picture before the motion, empty without one
    std::ptrdiff_t frames_ = 0;                           // that it is the mean of
    double rested_ = 0;                                   // s, stamp of the last one
    double newest_ = 1;                                   // part of the last one in it
    Eigen::Matrix<double, 4, Eigen::Dynamic> estimator_;  // (4, box) shift and traction of a change of the picture; of no columns before
    Box box_{};
    double noise_ = 0;  // of a traction over that of the picture
    Eigen::Vector2d pulled_ = Eigen::Vector2d::Zero();
    double odds_ = 0;   // logarithm of the odds that it rolls
    bool near_ = true;  // whether the object is still within key_moved of where it rested
};

}  // namespace tactile::taxel
