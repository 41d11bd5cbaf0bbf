// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// How far dots deviate from the motion that all of them share: drift moves them by an affine motion of the image, a contact does not.
#pragma once

#include "common/fields.hpp"
#include "common/rows.hpp"

namespace tactile {

struct DotDeviation {
    bool is_touched;  // more dots than outliers deviate, or all have moved farther than drift
    double size;      // px, largest deviation without outliers
    TACTILE_FIELDS(is_touched, size)
};

/// Deviation of dots at uv, px, that are displaced by duv, px, NaN: unknown, with standard deviations sigma, px, per axis, NaN: unknown.
DotDeviation deviation(const Rows2& uv, const Rows2& duv, const Eigen::VectorXd& sigma);

}  // namespace tactile
