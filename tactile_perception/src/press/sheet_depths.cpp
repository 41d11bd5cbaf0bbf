// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A depth w moves a marker by slope w in the image; the rest of its displacement is strain in the plane. With the strain's energy S and the
// bending's B, (B + sum over axes of slope S slope) w = sum over axes of slope S shift.
#include "press/sheet_depths.hpp"

#include <Eigen/Cholesky>
#include <limits>

namespace tactile {

Eigen::VectorXd sheet_depths(const SheetEnergies& sheet, const Eigen::Map<const Rows>& slope, const Eigen::Map<const Rows>& shift) {
    Eigen::MatrixXd matrix = sheet.bending + sheet.strain.cwiseProduct(slope * slope.transpose());
    const Rows strained = sheet.strain * shift;
    const Eigen::VectorXd right = slope.cwiseProduct(strained).rowwise().sum();
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(matrix);
    if (factor.info() != Eigen::Success) return Eigen::VectorXd::Constant(right.size(), std::numeric_limits<double>::quiet_NaN());
    return factor.solve(right);
}

}  // namespace tactile
