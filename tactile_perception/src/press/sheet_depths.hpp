// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace tactile {

// Energies of a sheet of so many markers, symmetric matrices (markers, markers): see press/sheet/positions.py:SheetSurface.
struct SheetEnergies {
    std::ptrdiff_t markers;
    const double *bending, *strain;
};

// Depths (count, markers), m, under the untouched plane, by displacements (count, markers, 2), m, in the image of markers whose rays have
// slopes (markers, 2); NaN where the equations are not positive definite.
void sheet_depths(const SheetEnergies& sheet, const double* slope, const double* shifts, std::ptrdiff_t count, double* depths);

}  // namespace tactile
