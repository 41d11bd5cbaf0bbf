// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Eigenvalues>

namespace tactile {

// Pseudo-inverse of a symmetric matrix; eigenvalues up to so many times the largest one count as 0.
template <class Matrix>
Matrix pseudo_inverse(const Matrix& symmetric, double negligible) {
    const Eigen::SelfAdjointEigenSolver<Matrix> parts(symmetric);
    const auto size = parts.eigenvalues().cwiseAbs().eval();
    const auto inverse = (size.array() > negligible * size.maxCoeff()).select(parts.eigenvalues().cwiseInverse(), 0.0).eval();
    return parts.eigenvectors() * inverse.asDiagonal() * parts.eigenvectors().transpose();
}

}  // namespace tactile
