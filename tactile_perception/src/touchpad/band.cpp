// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/band.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {

// Column by column: each loses what the columns before explain, four of them at a time, and is scaled by its pivot.
TACTILE_WIDE bool Band::factorise() {
    for (std::ptrdiff_t j = 0; j < size_; ++j) {
        float* __restrict now = column(j);
        std::ptrdiff_t k = std::max<std::ptrdiff_t>(j - width_, 0);
        for (; k + TOGETHER <= j; k += TOGETHER) {
            const float *a = column(k) + j - k, *b = column(k + 1) + j - k - 1, *c = column(k + 2) + j - k - 2,
                        *d = column(k + 3) + j - k - 3;
            const float fa = a[0], fb = b[0], fc = c[0], fd = d[0];
            for (std::ptrdiff_t i = 0; i < width_ + TOGETHER - (j - k); ++i) now[i] -= fa * a[i] + fb * b[i] + (fc * c[i] + fd * d[i]);
        }
        for (; k < j; ++k) {
            const float *a = column(k) + j - k, fa = a[0];
            for (std::ptrdiff_t i = 0; i <= width_ - (j - k); ++i) now[i] -= fa * a[i];
        }
        if (!(now[0] > 0) || !std::isfinite(now[0])) return false;
        const float scale = 1 / std::sqrt(now[0]);
        for (std::ptrdiff_t i = 0; i <= width_; ++i) now[i] *= scale;
    }
    return true;
}

void Band::solve(double* right) const {
    using Numbers = Eigen::Map<const Eigen::VectorXf>;
    Eigen::VectorXf x = Eigen::VectorXf::Zero(size_ + width_);
    x.head(size_) = Eigen::Map<const Eigen::VectorXd>(right, size_).cast<float>();
    for (std::ptrdiff_t j = 0; j < size_; ++j) {
        x[j] /= column(j)[0];
        x.segment(j + 1, width_) -= x[j] * Numbers(column(j) + 1, width_);
    }
    x.tail(width_).setZero();
    for (std::ptrdiff_t j = size_ - 1; j >= 0; --j)
        x[j] = (x[j] - Numbers(column(j) + 1, width_).dot(x.segment(j + 1, width_))) / column(j)[0];
    Eigen::Map<Eigen::VectorXd>(right, size_) = x.head(size_).cast<double>();
}

}  // namespace tactile
