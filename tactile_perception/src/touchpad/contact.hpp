// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Where the border of a contact is, and what the dots in it carry.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "touchpad/contact_point.hpp"
#include "touchpad/membrane.hpp"
#include "touchpad/stick_slip.hpp"

namespace tactile {

// A network of two hidden layers (rectified linear units) that tells a dot's distance from the border, pitches. Weights: a row for each
// number that is fed in.
struct BorderNetwork {
    static constexpr std::ptrdiff_t REACH = 2, SIDE = 2 * REACH + 1, NEXT = SIDE * SIDE;  // dots, of what is fed in around each
    static constexpr std::ptrdiff_t KINDS = 2, FED = KINDS * NEXT + 1;                    // loads and bends; and the spread of all loads
    static constexpr std::ptrdiff_t FIRST = 48, SECOND = 16;                              // units of the hidden layers
    std::vector<float> weights_1, biases_1, weights_2, biases_2, weights_3;
    float bias_3 = 0;
};

// Scores (K) of the dots: half a dot's distance from the border, pitches, plus 1/2, between 0, a pitch outside, and 1, a pitch inside; 0
// where no dot next to it carries a load. pitch: of the dots, m.
std::vector<double> border_scores(const BorderNetwork& network, Grid grid, const DotLoads& loads, double pitch);

// force (K, 3), N, on the dots that carry a load and, by their shares, on those around, 0 on others; their wrench (6), N and N m, about the
// origin.
struct CarriedLoads {
    std::vector<double> force;
    std::array<double, 6> wrench;
};
CarriedLoads carried_loads(Grid grid, const DotLoads& loads);

// Dots of a frame: id (count), on the grid; places (count, 3), m; whether inside a region (count) and whether in that or another one,
// touched (count); force, N, of carried_loads on all dots of the grid (K, 3), null where unknown.
struct RegionDots {
    Grid grid;
    const std::int64_t* id;
    const double *places, *force;
    const bool *inside, *touched;
    std::ptrdiff_t count;
};

// The contact in a region: its place; depth, m, at least 0, and normal force, N, NaN where unknown.
struct RegionContact {
    ContactPlace place;
    double depth, force;
};

// wide, sigma: as for contact_point; rest: as for contact_depth. The force is that of all dots to which this region is the nearest, along
// the region's mean normal, at least 0.
RegionContact region_contact(const RegionDots& dots, const RegionShape& region, const Nodes& wide, const RestCap& rest, double sigma);

// What one frame tells about all K dots: loads; score and state (K); the forces that they carry; probabilities (K) that they slip and the
// objects, their ways (K, 2), m, and the motion of one, see StickSlip. Without a significant load all dots are free.
struct DotFrame {
    DotLoads loads;
    std::vector<double> score;
    std::vector<std::uint8_t> state;
    CarriedLoads carried;
    std::vector<double> ways, slipping;
    std::vector<TouchingObject> objects;
    Eigen::Isometry3d motion;
};

// The dots of a touchpad, frame by frame: which are in contact, which of these stick or slip, and what they carry.
class DotClassifier {
 public:
    // origin: the camera's centre.
    DotClassifier(Skin skin, Vec3 origin, std::shared_ptr<const BorderNetwork> network, const StickSlipModel& model);

    void set_rest(Skin skin);
    const Membrane& membrane() const { return membrane_; }

    // The next frame, so many seconds after the last: dots id (count) seen at places (count, 3), m.
    DotFrame classify(const std::int64_t* id, const double* places, std::ptrdiff_t count, double seconds);

 private:
    Membrane membrane_;
    StickSlip stick_slip_;
    std::shared_ptr<const BorderNetwork> network_;
    double pitch_;
};

}  // namespace tactile
