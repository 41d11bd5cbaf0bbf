// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/sheet_surface.hpp"

#include <Eigen/Cholesky>
#include <limits>
#include <vector>

namespace tactile {

// A depth w moves a marker by slope w in the image; the remaining displacement is strain in the plane. With the strain's energy S and the
// bending's B: (B + sum over axes of slope S slope) w = sum over axes of slope S shift.
Eigen::VectorXd SheetSurface::raised(const Rows2& rest, const Rows2& shift, const Rows3& camera_centre) const {
    const Eigen::Index count = rest.rows();
    std::vector<Eigen::Index> seen, lost;
    Eigen::MatrixXd known = Eigen::MatrixXd::Zero(count, 4);  // slope and shift, x and y each
    for (Eigen::Index k = 0; k < count; ++k) {
        (shift.row(k).allFinite() ? seen : lost).push_back(k);
        if (!shift.row(k).allFinite()) continue;
        known.row(k) << (camera_centre.row(k).head<2>() - rest.row(k) - shift.row(k)) / camera_centre(k, 2), shift.row(k);
    }
    if (seen.empty()) return Eigen::VectorXd::Constant(count, std::numeric_limits<double>::quiet_NaN());
    if (!lost.empty()) known(lost, Eigen::all) = -laplacian(lost, lost).llt().solve(laplacian(lost, seen) * known(seen, Eigen::all));
    const auto slope = known.leftCols<2>();
    const Eigen::MatrixXd matrix = bending + strain.cwiseProduct(slope * slope.transpose());
    return -matrix.llt().solve(slope.cwiseProduct(strain * known.rightCols<2>()).rowwise().sum());
}

}  // namespace tactile
