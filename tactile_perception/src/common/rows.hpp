// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace tactile {

/// Rows of numbers, one after the other as in NumPy.
template <int COLUMNS>
using Rows = Eigen::Matrix<double, Eigen::Dynamic, COLUMNS, Eigen::RowMajor>;
using Rows2 = Rows<2>;
using Rows3 = Rows<3>;
using Numbers = Eigen::Matrix<std::int64_t, Eigen::Dynamic, 1>;

}  // namespace tactile
