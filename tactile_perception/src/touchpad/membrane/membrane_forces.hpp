// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Nodal forces of a stretched membrane whose nodes are the dots of a grid. Dot k is in row k / columns. Arrays of dots are (K, 3).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

struct Grid {
    std::ptrdiff_t rows, columns;
    std::ptrdiff_t size() const { return rows * columns; }
    // Number of triangles: four a cell.
    std::ptrdiff_t triangles() const { return 4 * (rows - 1) * (columns - 1); }
    // Whether the dot has eight neighbours. Only such dots have a balance of forces.
    bool inner(std::ptrdiff_t row, std::ptrdiff_t column) const { return row > 0 && row < rows - 1 && column > 0 && column < columns - 1; }
};

// A membrane. triangles (T, 4): of each triangle, the weights of its springs, opposite to its first, second and third corner, N/m, and the
// factor of its area term, N m^3, both of membrane_at_rest. residual (K, 3), m^2: the mesh's discretisation error at rest over the
// pressure.
struct Membrane {
    Grid grid;
    const double *triangles, *residual;
};

// Triangles (T, 4) of a membrane with rest positions rest (K, 3), m, and shear stiffness, N/m, whose area term has the share area_share.
std::vector<double> membrane_at_rest(Grid grid, const double* rest, double stiffness, double area_share);

// Adds the elastic force (K, 3), N, on each dot at places (K, 3), m, and the dot's share (K, 3), m^2, of the area vectors.
void add_forces(Grid grid, const double* triangles, const double* places, double* force, double* share);

// Balance of each dot along its normal: normals (K, 3), areas (K), m^2, the residual load over the fluid's pressure (K) and its derivative
// by the pressure (K), 1/Pa. Outermost dots have a load and a derivative of 0.
struct Balance {
    std::vector<double> normal, area, load, by_pressure;
};
Balance find_balance(const Membrane& membrane, const double* places, double pressure);

// Derivatives (K, 9), 1/m, of the loads at places (K, 3) by movements of each dot (slot 4) and its neighbours, row by row, along their unit
// rays (K, 3), normals held; balance: at these places. 0 on the outermost dots. wanted (K): of these dots alone, the others' rows are not
// complete; null: of all.
std::vector<double> find_slopes(const Membrane& membrane, const double* places, const double* rays, double pressure, const Balance& balance,
                                const std::uint8_t* wanted = nullptr);

}  // namespace tactile
