// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"

namespace tactile::taxel {

// A pad on an array of rows by columns taxels.
struct ShearPad {
    std::ptrdiff_t rows, columns;
    double pitch;      // m
    double thickness;  // taxels
    double stiffness;  // Pa/m, traction over tangential displacement of the surface
    double friction;   // coefficient between pad and object
    TACTILE_FIELDS(rows, columns, pitch, thickness, stiffness, friction)
};


// Rigid motion of the object in one frame: m at the origin, in the middle of the array, and rad.
struct Shift {
    double x, y, turn;
};

// The pad's surface: tangential displacement and traction. Fields are (2, rows, columns), along x and along y.
class SurfaceShear {
 public:
    explicit SurfaceShear(const ShearPad& pad);
    // Release all traction.
    void reset();
    // Slip (2, rows, columns), m, of an object that moves over the surface; touched, pressure (Pa): (rows, columns).
    std::vector<float> move(const std::uint8_t* touched, const float* pressure, const Shift& shift);
    // (2,) N that the object exerts along the surface.
    std::array<double, 2> force() const;
    // Pressure (rows, columns) under the pad, Pa, that the present traction causes, and that a traction causes, in units of Pa.
    std::vector<float> traction_pressure() const;
    std::vector<float> pressure_of(const float* traction, double unit = 1) const;
    // Where pressure acts on the pad's surface, m, of which pressure (rows, columns), Pa, acts on the taxels under touched and around;
    // friction: N of the object on the pad. NaN without load, and for more friction than the load can hold.
    //
    // Friction on the surface has a moment about the taxels, a thickness below, which only pressure that moves along it can balance,
    // whatever the pad is made of. A part of that is tension behind the object, of which taxels show nothing: it is that of an even
    // traction under the object.
    std::array<double, 2> pressure_centre(const float* pressure, const std::uint8_t* touched, const std::array<double, 2>& friction) const;
    const ShearPad& pad() const { return pad_; }

 private:
    ShearPad pad_;
    std::vector<float> drag_, pull_;  // m: displacement, and traction over stiffness
};

}  // namespace tactile::taxel
