// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Nodal forces of a stretched membrane whose nodes are the dots of a grid. Dot k is in row k / columns. Arrays of dots are (K, 3).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"

namespace tactile {

/// A grid of dots, numbered row by row.
struct Grid {
    std::ptrdiff_t rows, columns;
    std::ptrdiff_t size() const { return rows * columns; }
    // Cells of a row, as a multiple of four, which are handled at once.
    std::ptrdiff_t padded_cells() const { return (columns + 2) / 4 * 4; }
    // Length of a membrane's description: four numbers of each of the four triangles of each cell.
    std::ptrdiff_t triangle_numbers() const { return (rows - 1) * 16 * padded_cells(); }
    // Whether the dot has eight neighbours. Only such dots have a balance of forces.
    bool inner(std::ptrdiff_t row, std::ptrdiff_t column) const { return row > 0 && row < rows - 1 && column > 0 && column < columns - 1; }
};

// Calls visit(k, inner) with each dot, and whether it is an inner one, row by row.
template <class Visit>
void each_dot(Grid grid, Visit visit) {
    for (std::ptrdiff_t row = 0, k = 0; row < grid.rows; ++row) {
        for (std::ptrdiff_t column = 0; column < grid.columns; ++column, ++k) visit(k, grid.inner(row, column));
    }
}

// Calls visit with each dot of the 3 x 3 around dot k that exists, k among them, row by row.
template <class Visit>
void around(Grid grid, std::ptrdiff_t k, Visit visit) {
    const std::ptrdiff_t row = k / grid.columns, column = k % grid.columns;
    for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(row - 1, 0); r <= std::min(row + 1, grid.rows - 1); ++r) {
        for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(column - 1, 0); c <= std::min(column + 1, grid.columns - 1); ++c) {
            visit(r * grid.columns + c);
        }
    }
}

// Calls visit with each existing neighbour of dot k.
template <class Visit>
void beside(Grid grid, std::ptrdiff_t k, Visit visit) {
    around(grid, k, [&](std::ptrdiff_t j) {
        if (j != k) visit(j);
    });
}

/// A membrane of shear stiffness, N/m, whose area term has the share area_share, over a fluid of this pressure, Pa, at rest.
struct MembraneMaterial {
    double stiffness, area_share, pressure;
    TACTILE_FIELDS(stiffness, area_share, pressure)
};

/// An undeformed membrane. rest (K, 3): positions of the dots, m. triangles (rows - 1, 16, padded_cells): for each of the four triangles of
/// each cell, the weights of the springs opposite to its first, second and third corner, N/m, and the factor of its area term, N m^3; zeros
/// follow. residual (K, 3), m^2: the mesh's discretisation error at rest over the pressure.
struct Skin {
    Grid grid;
    double pressure;
    std::vector<double> rest, triangles, residual;
    Skin(Grid grid, const double* rest, const MembraneMaterial& material);
};

/// Adds the elastic force (K, 3), N, on each dot at positions (K, 3), m, and the dot's share (K, 3), m^2, of the area vectors.
void add_forces(const Skin& skin, const double* positions, double* force, double* share);

/// Balance of each dot along its normal: normals (K, 3), elastic forces (K, 3), N, areas (K), m^2, the residual load over the fluid's
/// pressure (K) and its derivative by the pressure (K), 1/Pa. Outermost dots have a load and a derivative of 0.
struct Balance {
    std::vector<double> normal, elastic, area, load, by_pressure;
};
Balance find_balance(const Skin& skin, const double* positions, double pressure);

/// Derivatives (K, 9), 1/m, of the loads at positions (K, 3) by displacements of each dot (slot 4) and its neighbours, row by row, along
/// their unit rays (K, 3), with constant normals; balance: at these positions. 0 on the outermost dots.
std::vector<double> find_slopes(const Skin& skin, const double* positions, const double* rays, double pressure, const Balance& balance);

}  // namespace tactile
