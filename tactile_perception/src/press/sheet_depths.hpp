// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace tactile {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Energies of a sheet of K markers, symmetric (K, K): see press/positions.py:SheetSurface.
struct SheetEnergies {
    Eigen::Map<const Rows> bending, strain;
};

// Depths (K), m, under the untouched plane, by displacements (K, 2), m, in the image of markers whose rays have slopes (K, 2); NaN where
// the equations are not positive definite.
Eigen::VectorXd sheet_depths(const SheetEnergies& sheet, const Eigen::Map<const Rows>& slope, const Eigen::Map<const Rows>& shift);

}  // namespace tactile
