// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Heights of the markers of a clamped sheet from their apparent displacements.
#pragma once

#include <Eigen/Core>

#include "common/rows.hpp"

namespace tactile {

/// Energies (K, K) of the K markers, of displacements in pitches: of bending; of strain, in the plane, from which the displacement in the
/// image is free to differ; and the negative Laplacian, by which displacements of markers that are not visible are interpolated.
struct SheetSurface {
    Eigen::MatrixXd bending, strain, laplacian;

    /// Heights (K), m, over the untouched plane of markers that appear at rest (K, 2) and displaced by shift (K, 2), m, NaN where not
    /// visible, seen from the camera centres (K, 3), m. NaN without a visible marker.
    Eigen::VectorXd raised(const Rows2& rest, const Rows2& shift, const Rows3& camera_centre) const;
};

}  // namespace tactile
