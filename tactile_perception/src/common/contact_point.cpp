// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/contact_point.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/region_moments.hpp"
#include "common/small_systems.hpp"

namespace tactile {
namespace {

constexpr double SIGNIFICANT = 4.0;  // standard deviations by which a curvature must differ from zero; chosen
constexpr double BENT = 0.1;         // rad, turn of the normal from a region's centre to its border below which it is a face; chosen
constexpr double ROUND = 2.5;        // largest ratio of the principal curvatures of a fingertip; chosen
constexpr double REACH = 2.6;        // pitches around the deepest dot in which a quadratic smooths the depth: 21 dots; chosen
constexpr double BETWEEN = 0.6;  // pitches to the nearest dot within which a maximum lies between dots; chosen: over half a diagonal less
constexpr int QUADRATIC = 9;     // fewest dots for the six coefficients of a quadratic; chosen
constexpr int FEWEST = 5;        // fewest dots for the four coefficients of an isotropic quadratic; chosen
constexpr double RIDGE = 1e-10;  // of normal equations with columns of about 1; chosen
constexpr double FINGERTIP = 8e-3;  // m, radius of a typical fingertip

// Normal equations of columns divided by their largest values.
template <int N>
struct ScaledFit {
    double inverse[N][N], square[N][N], scale[N], right[N] = {};
    bool solved = true;

    // row(i, values): writes row i of the design, returns its right side.
    template <class Row>
    ScaledFit(std::ptrdiff_t count, Row row) {
        double values[N];
        std::fill_n(scale, N, 1e-12);
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            row(i, values);
            for (int j = 0; j < N; ++j) scale[j] = std::max(scale[j], std::abs(values[j]));
        }
        SmallSystem<N> system(0);
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            const double value = row(i, values);
            for (int j = 0; j < N; ++j) values[j] /= scale[j];
            system.add(values, value, 1);
        }
        std::copy(system.right, system.right + N, right);
        for (int i = 0; i < N; ++i) {
            for (int j = 0; j < N; ++j) square[i][j] = system.matrix[std::max(i, j)][std::min(i, j)];
        }
        for (int i = 0; i < N; ++i) system.matrix[i][i] += RIDGE;
        for (int j = 0; j < N && solved; ++j) {
            double column[N];
            std::fill_n(system.right, N, 0.0);
            system.right[j] = 1;
            solved = system.solve(column);
            for (int i = 0; i < N && solved; ++i) inverse[i][j] = column[i];
        }
    }
    double coefficient(int i) const {
        double sum = 0;
        for (int j = 0; j < N; ++j) sum += inverse[i][j] * right[j];
        return sum / scale[i];
    }
    // Covariance of two coefficients for errors of unit variance.
    double covariance(int i, int j) const {
        double sum = 0;
        for (int k = 0; k < N; ++k) {
            for (int l = 0; l < N; ++l) sum += inverse[i][k] * square[k][l] * inverse[l][j];
        }
        return sum / scale[i] / scale[j];
    }
};

// Principal curvatures, 1/m, smaller first, positive where the object bulges into the sensor, along directions (x, y) in the tangent plane,
// and slopes, with their standard deviations.
struct Bend {
    double direction[2][2], curvature[2], curvature_sd[2], slope[2], slope_sd[2];
    bool found = false;
};

// What N coefficients of z = f(x, y) are multiplied by: six of a quadratic, or four of an isotropic one.
template <int N>
void quadratic_terms(double x, double y, double* terms) {
    terms[0] = 1, terms[1] = x, terms[2] = y, terms[3] = N == 6 ? x * x / 2 : (x * x + y * y) / 2;
    if constexpr (N == 6) terms[4] = x * y, terms[5] = y * y / 2;
}

// Of the surface through local coordinates, by N coefficients.
template <int N>
Bend principal_bend(const std::vector<Vec3>& local, double sigma) {
    const auto count = static_cast<std::ptrdiff_t>(local.size());
    const auto row = [&](std::ptrdiff_t i, double* terms) {
        quadratic_terms<N>(local[i].x, local[i].y, terms);
        return local[i].z;
    };
    const ScaledFit<N> fit(count, row);
    Bend bend;
    if (!fit.solved) return bend;
    double c[N], terms[N], squares = 0;
    for (int j = 0; j < N; ++j) c[j] = fit.coefficient(j);
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        double left = row(i, terms);
        for (int j = 0; j < N; ++j) left -= c[j] * terms[j];
        squares += left * left;
    }
    const double noise = std::max(sigma, std::sqrt(squares / static_cast<double>(count - N)));
    const int second[3] = {3, N == 6 ? 4 : -1, N == 6 ? 5 : 3};  // coefficients of xx, xy, yy; -1: it is 0
    const double xx = c[3], xy = N == 6 ? c[N - 2] : 0, yy = N == 6 ? c[N - 1] : c[3];
    const double middle = (xx + yy) / 2, radius = std::hypot((xx - yy) / 2, xy), angle = std::atan2(xy, (xx - yy) / 2) / 2;
    const double cosine = std::cos(angle), sine = std::sin(angle);
    bend = {{{-sine, cosine}, {cosine, sine}}, {middle - radius, middle + radius}, {}, {}, {}, true};
    for (int k = 0; k < 2; ++k) {
        const double* a = bend.direction[k];
        const double weight[3] = {a[0] * a[0], 2 * a[0] * a[1], a[1] * a[1]};
        double curvature = 0, slope = 0;
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                if (second[i] >= 0 && second[j] >= 0) curvature += weight[i] * weight[j] * fit.covariance(second[i], second[j]);
            }
        }
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) slope += a[i] * a[j] * fit.covariance(1 + i, 1 + j);
        }
        bend.curvature_sd[k] = noise * std::sqrt(curvature);
        bend.slope_sd[k] = noise * std::sqrt(slope);
        bend.slope[k] = c[1] * a[0] + c[2] * a[1];
    }
    return bend;
}

// Lowest point of the object from the centroid: x and y, projector (2 x 2) on the directions in which the object is round (x and y are 0
// across them), covariance (2 x 2).
struct Tip {
    double offset[2] = {}, projector[2][2] = {}, covariance[2][2] = {};
};

Tip sphere_tip(const std::vector<Vec3>& points, double sigma) {
    const ScaledFit<4> fit(static_cast<std::ptrdiff_t>(points.size()), [&](std::ptrdiff_t i, double* terms) {
        terms[0] = 2 * points[i].x, terms[1] = 2 * points[i].y, terms[2] = 2 * points[i].z, terms[3] = 1;
        return dot(points[i], points[i]);
    });
    Tip tip{{NAN, NAN}, {{1, 0}, {0, 1}}, {}};
    if (!fit.solved) return tip;
    const Vec3 centre{fit.coefficient(0), fit.coefficient(1), fit.coefficient(2)};
    const double square = fit.coefficient(3) + dot(centre, centre);
    if (square > 0) tip.offset[0] = centre.x, tip.offset[1] = centre.y;
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) tip.covariance[i][j] = fit.covariance(i, j) * 4 * square * sigma * sigma;
    }
    return tip;
}

Tip round_tip(const std::vector<Vec3>& points, Vec3 normal, double sigma) {
    const double size[3] = {std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)};
    const Vec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, axis = axes[std::min_element(size, size + 3) - size];
    const Vec3 level = axis - dot(axis, normal) * normal, first = 1 / length(level) * level, second = cross(normal, first);
    std::vector<Vec3> local;
    for (const Vec3 point : points) local.push_back({dot(point, first), dot(point, second), dot(point, normal)});
    const Bend bend = local.size() >= QUADRATIC ? principal_bend<6>(local, sigma) : principal_bend<4>(local, sigma);
    Tip tip;
    if (!bend.found) return tip;
    bool curved[2];
    for (int k = 0; k < 2; ++k) {
        double sum = 0, squares = 0;
        for (const Vec3 point : local) {
            const double along = point.x * bend.direction[k][0] + point.y * bend.direction[k][1];
            sum += along, squares += along * along;
        }
        const auto count = static_cast<double>(local.size());
        const double reach = 2 * std::sqrt(std::max(squares / count - sum * sum / count / count, 0.0));
        curved[k] = bend.curvature[k] > SIGNIFICANT * bend.curvature_sd[k] && bend.curvature[k] * reach > BENT;
    }
    if (curved[0] && curved[1] && bend.curvature[1] < ROUND * bend.curvature[0]) return sphere_tip(points, sigma);
    for (int k = 0; k < 2; ++k) {
        if (!curved[k]) continue;
        const Vec3 direction = bend.direction[k][0] * first + bend.direction[k][1] * second;
        const double steep = direction.z / normal.z + bend.slope[k], along = -steep / std::hypot(1, steep) / bend.curvature[k];
        const double flat[2] = {direction.x, direction.y}, trace = flat[0] * flat[0] + flat[1] * flat[1];
        const double variance =
            (std::pow(along * bend.curvature_sd[k], 2) + std::pow(bend.slope_sd[k], 2)) / std::pow(bend.curvature[k], 2);
        for (int i = 0; i < 2; ++i) {
            tip.offset[i] += along * flat[i];
            for (int j = 0; j < 2; ++j) {
                tip.projector[i][j] += flat[i] * flat[j] / trace;
                tip.covariance[i][j] += flat[i] * flat[j] * variance;
            }
        }
    }
    return tip;
}

// Variances of the centroid's coordinates due to errors of the outline and of the dots.
std::array<double, 3> centroid_variance(const RegionShape& region, double sigma, std::ptrdiff_t count) {
    Vec3 squares{0, 0, 0};
    each_side(region.border, region.start, region.loops, [&](Vec3 at, double side) {
        const Vec3 off = at - region.centroid;
        squares = squares + side * Vec3{off.x * off.x, off.y * off.y, off.z * off.z};
    });
    std::array<double, 3> variance{squares.x, squares.y, squares.z};
    for (double& value : variance) value = std::pow(border_sigma(value, region.pitch) / region.area, 2);
    variance[2] += sigma * sigma / static_cast<double>(std::max<std::ptrdiff_t>(count, 1));
    return variance;
}

}  // namespace

ContactPlace contact_point(const double* points, std::ptrdiff_t count, const RegionShape& region, const Nodes& wide, double sigma) {
    const std::array<double, 3> variance = centroid_variance(region, sigma, count);
    ContactPlace found{region.centroid, {variance[0], 0, 0, 0, variance[1], 0, 0, 0, variance[2]}, region.normal};
    if (count < FEWEST) {  // as the tip of a fingertip of unknown shape: its offset grows with the surface's tilt
        const double away[2] = {region.normal.x * FINGERTIP, region.normal.y * FINGERTIP};
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) found.covariance[3 * i + j] += away[i] * away[j];
        }
        return found;
    }
    std::vector<Vec3> around;
    for (std::ptrdiff_t i = 0; i < count; ++i) around.push_back(vec3_at(points, i) - region.centroid);
    const Tip tip = round_tip(around, region.normal, sigma);
    const bool round = tip.projector[0][0] != 0 || tip.projector[1][1] != 0;
    if (!round || !(tip.offset[0] * tip.offset[0] + tip.offset[1] * tip.offset[1] < 2 * region.area)) return found;
    const SurfacePlace place = surface_at(wide, region.centroid.x + tip.offset[0], region.centroid.y + tip.offset[1]);
    found.position = place.point, found.normal = place.normal;
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {  // across the round directions the centroid's covariance is left
            double rest = 0;
            for (int k = 0; k < 2; ++k) rest += ((i == k) - tip.projector[i][k]) * variance[k] * ((j == k) - tip.projector[k][j]);
            found.covariance[3 * i + j] = rest + tip.covariance[i][j];
        }
    }
    return found;
}

double contact_depth(const double* points, std::ptrdiff_t count, const RestCap& rest, double pitch) {
    std::vector<double> gap(count);  // NaN beyond the sphere
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const Vec3 place = vec3_at(points, i);
        gap[i] = rest.centre_z + std::sqrt(rest.radius * rest.radius - (place.x * place.x + place.y * place.y)) - place.z;
    }
    std::ptrdiff_t deepest = -1;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (std::isfinite(gap[i]) && (deepest < 0 || gap[i] > gap[deepest])) deepest = i;
    }
    if (deepest < 0) return NAN;
    std::vector<std::array<double, 3>> near;  // x and y, pitches from the deepest, and gap
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const double x = (points[3 * i] - points[3 * deepest]) / pitch, y = (points[3 * i + 1] - points[3 * deepest + 1]) / pitch;
        if (std::isfinite(gap[i]) && x * x + y * y < REACH * REACH) near.push_back({x, y, gap[i]});
    }
    if (near.size() < QUADRATIC) return gap[deepest];
    const auto row = [&](std::size_t i, double* terms) { quadratic_terms<6>(near[i][0], near[i][1], terms); };
    SmallSystem<6> system(10 * RIDGE);
    double terms[6], c[6], best = -INFINITY, apart = INFINITY;
    for (std::size_t i = 0; i < near.size(); ++i) row(i, terms), system.add(terms, near[i][2], 1);
    if (!system.solve(c)) return gap[deepest];
    for (std::size_t i = 0; i < near.size(); ++i) {
        row(i, terms);
        double value = 0;
        for (int j = 0; j < 6; ++j) value += c[j] * terms[j];
        best = std::max(best, value);
    }
    const double across = c[3] * c[5] - c[4] * c[4];
    if (c[3] >= 0 || across <= 0) return best;  // no maximum
    // At the dots or between them: it is not extrapolated.
    const double x = (c[4] * c[2] - c[5] * c[1]) / across, y = (c[4] * c[1] - c[3] * c[2]) / across;
    for (const auto& dot : near) apart = std::min(apart, std::hypot(dot[0] - x, dot[1] - y));
    return apart < BETWEEN ? std::max(best, c[0] + 0.5 * (c[1] * x + c[2] * y)) : best;
}

}  // namespace tactile
