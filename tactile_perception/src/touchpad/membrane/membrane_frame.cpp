// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/membrane/membrane_frame.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "common/vectors.hpp"
#include "touchpad/membrane/holes.hpp"

namespace tactile {
namespace {

constexpr double CALM = 0.3;  // sum of the probabilities of a load over 3 x 3 dots below which a dot counts as free. Chosen

// Directions of unseen dots: turned (K, 3), the change of direction of the seen ones since the last frame, is spread over the grid.
void turn_unseen(Grid grid, std::vector<double> turned, WholeFrame& frame) {
    const std::unique_ptr<bool[]> known(new bool[grid.size()]);
    std::copy(frame.seen.begin(), frame.seen.end(), known.get());
    fill_holes(turned.data(), known.get(), grid.rows, grid.columns, 3);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (frame.seen[k]) continue;
        const Vec3 ray = vec3_at(frame.rays.data(), k) + vec3_at(turned.data(), k);
        store(frame.rays.data(), k, 1 / length(ray) * ray);
    }
}

// The part along the surface of the force on dot k over the pressure. force and share (K, 3): of add_forces.
Vec3 along_surface(const Membrane& membrane, const std::vector<double>& force, const std::vector<double>& share, double pressure,
                   std::ptrdiff_t k) {
    const Vec3 area = vec3_at(share.data(), k);
    const Vec3 total = vec3_at(force.data(), k) + pressure * (area - vec3_at(membrane.residual, k));
    const double square = dot(area, area);
    return 1 / (pressure * std::sqrt(square)) * (total - dot(total, area) / square * area);
}

}  // namespace

WholeFrame whole_frame(Grid grid, const double* origin, const double* rest, const double* last_places, const SeenRanges& seen,
                       double scale) {
    const auto size = static_cast<std::size_t>(grid.size());
    const Vec3 from = vec3_at(origin, 0);
    WholeFrame found{std::vector<double>(3 * size), std::vector<double>(size), std::vector<double>(size),
                     std::vector<double>(size),     std::vector<double>(size), std::vector<bool>(size)};
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        const Vec3 away = vec3_at(last_places, k) - from;
        found.last[k] = length(away);
        store(found.rays.data(), k, 1 / found.last[k] * away);
    }
    std::vector<double> turned(3 * size);
    for (std::ptrdiff_t i = 0; i < seen.count; ++i) {
        const std::ptrdiff_t k = seen.id[i];
        const Vec3 ray = vec3_at(seen.rays, i);
        store(turned.data(), k, ray - vec3_at(found.rays.data(), k));
        store(found.rays.data(), k, ray);
        const double at_rest = length(vec3_at(rest, k) - from), displaced = scale * (seen.ranges[i] - at_rest);
        const double weight = 1 / (seen.sigma[i] * seen.sigma[i]);
        const bool good = std::isfinite(displaced) && std::isfinite(weight);
        found.seen[k] = true;
        found.weight[k] = good ? weight : 0;
        found.displaced[k] = good ? displaced : 0;
        found.measured[k] = good ? at_rest + displaced : 0;
    }
    if (std::find(found.seen.begin(), found.seen.end(), false) != found.seen.end()) turn_unseen(grid, std::move(turned), found);
    return found;
}

Leaning scale_leaning(const Membrane& membrane, const double* places, const double* rays, const double* touched, const double* moved,
                      double pressure, double lifted, double step, double spread, double scale) {
    const Grid grid = membrane.grid;
    const std::ptrdiff_t size = grid.size();
    const double share = step / scale, higher = pressure + share * lifted;
    std::vector<double> force(3 * size), area(3 * size), force_there(3 * size), area_there(3 * size), there(3 * size);
    for (std::ptrdiff_t k = 0; k < size; ++k) store(there.data(), k, vec3_at(places, k) + share * moved[k] * vec3_at(rays, k));
    add_forces(grid, membrane.triangles, places, force.data(), area.data());
    add_forces(grid, membrane.triangles, there.data(), force_there.data(), area_there.data());
    Leaning found{0, 0};
    for (std::ptrdiff_t row = 1; row + 1 < grid.rows; ++row) {
        for (std::ptrdiff_t k = row * grid.columns + 1; k + 1 < (row + 1) * grid.columns; ++k) {
            double loaded = 0;
            for (const std::ptrdiff_t middle : {k - grid.columns, k, k + grid.columns})
                loaded += touched[middle - 1] + touched[middle] + touched[middle + 1];
            if (!(loaded < CALM)) continue;
            const Vec3 here = along_surface(membrane, force, area, pressure, k);
            const Vec3 slope = 1 / step * (along_surface(membrane, force_there, area_there, higher, k) - here);
            const double off = 1 + dot(here, here) / (4 * spread * spread), weight = 1 / (off * off);
            found.curvature += weight * dot(slope, slope);
            found.gradient += weight * dot(slope, here);
        }
    }
    return found;
}

}  // namespace tactile
