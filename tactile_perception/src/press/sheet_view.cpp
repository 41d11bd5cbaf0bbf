// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Central projection onto the plane z = 0: a point at p is seen from e where the ray through p meets the plane, at e + (p - e) e_z / (e_z -
// p_z).
#include "press/sheet_view.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {

void appear(const double deformed[3][3], const double* rest, const double* camera_centre, double* seen, double (*slopes)[3][3]) {
    const double *moved = deformed[0], *by_x = deformed[1], *by_y = deformed[2];
    const double nearer = 1 / (camera_centre[2] - moved[2]), scale = camera_centre[2] * nearer;
    double offset[2], drawn[2], along_x[2], along_y[2];
    for (int k = 0; k < 2; ++k) {
        offset[k] = rest[k] + moved[k] - camera_centre[k];
        drawn[k] = offset[k] * nearer;
        seen[k] = moved[k] + offset[k] * (scale - 1);
        along_x[k] = (k == 0) + by_x[k] + drawn[k] * by_x[2];
        along_y[k] = (k == 1) + by_y[k] + drawn[k] * by_y[2];
    }
    const double area = along_x[0] * along_y[1] - along_x[1] * along_y[0];
    seen[2] = std::log(std::max(area * scale * scale, 1e-3));
    if (!slopes) return;
    for (int k = 0; k < 3; ++k)
        for (int o = 0; o < 3; ++o)
            for (int c = 0; c < 3; ++c) slopes[k][o][c] = 0;
    for (int k = 0; k < 2; ++k) slopes[k][0][k] = scale, slopes[k][0][2] = drawn[k] * scale;
    const double safe = std::abs(area) > 1e-9 ? area : 1e-9;
    const double by_along_x[2] = {along_y[1] / safe, -along_y[0] / safe}, by_along_y[2] = {-along_x[1] / safe, along_x[0] / safe};
    const double tilt_x = by_x[2] * nearer, tilt_y = by_y[2] * nearer;
    double(&growth)[3][3] = slopes[2];
    for (int k = 0; k < 2; ++k) {
        growth[1][k] = by_along_x[k], growth[2][k] = by_along_y[k];
        growth[1][2] += by_along_x[k] * drawn[k], growth[2][2] += by_along_y[k] * drawn[k];
        growth[0][k] = by_along_x[k] * tilt_x + by_along_y[k] * tilt_y;
    }
    growth[0][2] = growth[1][2] * tilt_x + growth[2][2] * tilt_y + 2 * nearer;
}

void disc_points(const double* rest, double radius, double points[DISC_POINTS][2]) {
    const double out = radius * std::sqrt(0.5), way[DISC_POINTS][2] = {{out, 0}, {0, out}, {-out, 0}, {0, -out}};
    for (int p = 0; p < DISC_POINTS; ++p)
        for (int k = 0; k < 2; ++k) points[p][k] = rest[k] + way[p][k];
}

void disc_appear(const double (*deformed)[3][3], const double* rest, const double* camera_centre, double radius, double* seen) {
    double points[DISC_POINTS][2], one[3], shift[2] = {0, 0}, whole = 0;
    disc_points(rest, radius, points);
    for (int p = 0; p < DISC_POINTS; ++p) {
        appear(deformed[p], points[p], camera_centre, one, nullptr);
        const double area = std::exp(one[2]);
        whole += area;
        for (int k = 0; k < 2; ++k) shift[k] += area * (one[k] + points[p][k] - rest[k]);
    }
    seen[0] = shift[0] / whole, seen[1] = shift[1] / whole, seen[2] = std::log(whole / DISC_POINTS);
}

}  // namespace tactile
