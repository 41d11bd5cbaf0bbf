// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact_point.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/region_moments.hpp"

namespace tactile {
namespace {

constexpr double CURVATURE_SIGMAS = 4.0;     // standard deviations by which a curvature must differ from zero
constexpr double MIN_NORMAL_TURN = 0.1;      // rad from a region's centre to its border; a surface that turns less is a face
constexpr double MAX_CURVATURE_RATIO = 2.5;  // of the principal curvatures of a fingertip
constexpr double DEPTH_FIT_RADIUS = 2.6;     // pitches around the deepest dot in which a quadratic smooths the depth: 21 dots
constexpr double MAX_PEAK_DISTANCE = 0.6;    // pitches from the nearest dot to a maximum of that quadratic: just under half a diagonal
constexpr int MIN_DOTS_FOR_QUADRATIC = 9;    // which has six coefficients
constexpr int MIN_DOTS_FOR_CURVATURE = 5;    // of an isotropic quadratic, which has four coefficients
constexpr double RIDGE = 1e-10;              // of normal equations with columns of about 1
constexpr double FINGERTIP_RADIUS = 8e-3;    // m, of a typical fingertip

using Points = Eigen::Matrix3Xd;

// Least squares with N unknowns, whose columns are divided by their largest values: coefficients, and their covariance for errors of unit
// variance.
template <int N>
struct ScaledFit {
    using Design = Eigen::Matrix<double, Eigen::Dynamic, N>;
    Eigen::Matrix<double, N, 1> coefficients;
    Eigen::Matrix<double, N, N> covariance;
    bool solved;

    ScaledFit(const Design& design, const Eigen::VectorXd& values, double ridge = RIDGE) {
        const Eigen::Matrix<double, N, 1> scale = design.cwiseAbs().colwise().maxCoeff().cwiseMax(1e-12).cwiseInverse();
        const Design scaled = design * scale.asDiagonal();
        const Eigen::Matrix<double, N, N> square = scaled.transpose() * scaled, unit = Eigen::Matrix<double, N, N>::Identity();
        const Eigen::LLT<Eigen::Matrix<double, N, N>> factor(square + ridge * unit);
        solved = factor.info() == Eigen::Success;
        const Eigen::Matrix<double, N, N> inverse = scale.asDiagonal() * factor.solve(unit);
        coefficients = inverse * (scaled.transpose() * values);
        covariance = inverse * square * inverse.transpose();
    }
};

// The terms of z = f(x, y): six of a quadratic, or the four of an isotropic one.
template <int N>
typename ScaledFit<N>::Design quadratic_terms(const Eigen::ArrayXd& x, const Eigen::ArrayXd& y) {
    typename ScaledFit<N>::Design terms(x.size(), N);
    terms.col(0).setOnes();
    terms.col(1) = x, terms.col(2) = y;
    if constexpr (N == 6) {
        terms.col(3) = x * x / 2, terms.col(4) = x * y, terms.col(5) = y * y / 2;
    } else {
        terms.col(3) = (x * x + y * y) / 2;
    }
    return terms;
}

// Principal curvatures, 1/m, smaller first, positive where the object bulges into the sensor, along directions (columns) in the tangent
// plane, and slopes, with their standard deviations.
struct Bend {
    Eigen::Matrix2d direction;
    Eigen::Vector2d curvature, curvature_sd, slope, slope_sd;
    bool found = false;
};

// Of the surface through local coordinates, by N coefficients.
template <int N>
Bend principal_bend(const Points& local, double sigma) {
    const auto terms = quadratic_terms<N>(local.row(0).array(), local.row(1).array());
    const Eigen::VectorXd height = local.row(2);
    const ScaledFit<N> fit(terms, height);
    Bend bend;
    if (!fit.solved) return bend;
    const double squares = (height - terms * fit.coefficients).squaredNorm();
    const double noise = std::max(sigma, std::sqrt(squares / static_cast<double>(local.cols() - N)));
    const auto& c = fit.coefficients;
    Eigen::Matrix2d shape;
    shape << c[3], N == 6 ? c[N - 2] : 0, N == 6 ? c[N - 2] : 0, N == 6 ? c[N - 1] : c[3];
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> principal(shape);
    bend.direction = principal.eigenvectors(), bend.curvature = principal.eigenvalues(), bend.found = true;
    for (int k = 0; k < 2; ++k) {
        const Eigen::Vector2d a = bend.direction.col(k);
        Eigen::Matrix<double, N, 1> curve = Eigen::Matrix<double, N, 1>::Zero(), slope = curve;  // derivatives by the coefficients
        curve[3] += a.x() * a.x();
        curve[N - 1] += a.y() * a.y();
        if (N == 6) curve[N - 2] += 2 * a.x() * a.y();
        slope[1] = a.x(), slope[2] = a.y();
        bend.curvature_sd[k] = noise * std::sqrt(curve.dot(fit.covariance * curve));
        bend.slope_sd[k] = noise * std::sqrt(slope.dot(fit.covariance * slope));
        bend.slope[k] = slope.dot(c);
    }
    return bend;
}

// Lowest point of the object from the centroid: x and y, projector on the directions in which the object is round (x and y are 0 across
// them), covariance.
struct Tip {
    Eigen::Vector2d offset = Eigen::Vector2d::Zero();
    Eigen::Matrix2d projector = Eigen::Matrix2d::Zero(), covariance = Eigen::Matrix2d::Zero();
};

Tip sphere_tip(const Points& points, double sigma) {
    ScaledFit<4>::Design design(points.cols(), 4);
    design << 2 * points.transpose(), Eigen::VectorXd::Ones(points.cols());
    const ScaledFit<4> fit(design, points.colwise().squaredNorm().transpose());
    Tip tip{{NAN, NAN}, Eigen::Matrix2d::Identity()};
    if (!fit.solved) return tip;
    const double square = fit.coefficients[3] + fit.coefficients.head<3>().squaredNorm();
    if (square > 0) tip.offset = fit.coefficients.head<2>();
    tip.covariance = fit.covariance.topLeftCorner<2, 2>() * 4 * square * sigma * sigma;
    return tip;
}

Tip round_tip(const Points& points, const Eigen::Vector3d& normal, double sigma) {
    const Eigen::Vector3d first = normal.unitOrthogonal(), second = normal.cross(first);
    Eigen::Matrix3d axes;
    axes << first, second, normal;
    const Points local = axes.transpose() * points;
    const Bend bend = local.cols() >= MIN_DOTS_FOR_QUADRATIC ? principal_bend<6>(local, sigma) : principal_bend<4>(local, sigma);
    Tip tip;
    if (!bend.found) return tip;
    bool curved[2];
    for (int k = 0; k < 2; ++k) {
        const Eigen::ArrayXd along = (bend.direction.col(k).transpose() * local.topRows<2>()).transpose();
        const double reach = 2 * std::sqrt((along - along.mean()).square().mean());
        curved[k] = bend.curvature[k] > CURVATURE_SIGMAS * bend.curvature_sd[k] && bend.curvature[k] * reach > MIN_NORMAL_TURN;
    }
    if (curved[0] && curved[1] && bend.curvature[1] < MAX_CURVATURE_RATIO * bend.curvature[0]) return sphere_tip(points, sigma);
    for (int k = 0; k < 2; ++k) {
        if (!curved[k]) continue;
        const Eigen::Vector3d direction = axes.leftCols<2>() * bend.direction.col(k);
        const double steep = direction.z() / normal.z() + bend.slope[k], along = -steep / std::hypot(1, steep) / bend.curvature[k];
        const Eigen::Vector2d flat = direction.head<2>();
        const Eigen::Matrix2d outer = flat * flat.transpose();
        tip.offset += along * flat;
        tip.projector += outer / flat.squaredNorm();
        tip.covariance +=
            outer * (std::pow(along * bend.curvature_sd[k], 2) + std::pow(bend.slope_sd[k], 2)) / std::pow(bend.curvature[k], 2);
    }
    return tip;
}

// Variances of the centroid's coordinates due to errors of the outline and of the dots.
Eigen::Vector3d centroid_variance(const RegionShape& region, const RegionBorder& border, std::ptrdiff_t count) {
    Eigen::Vector3d variance = Eigen::Vector3d::Zero();
    each_side(border.points, border.start, border.loops,
              [&](const Eigen::Vector3d& at, double side) { variance += side * (at - region.centroid).cwiseAbs2(); });
    for (double& value : variance) value = std::pow(border_sigma(value, region.pitch) / region.area, 2);
    variance[2] += region.sigma * region.sigma / static_cast<double>(std::max<std::ptrdiff_t>(count, 1));
    return variance;
}

}  // namespace

ContactPosition contact_point(const double* points, std::ptrdiff_t count, const RegionShape& region, const RegionBorder& border,
                              const Nodes& wide) {
    const Eigen::Vector3d variance = centroid_variance(region, border, count), &centroid = region.centroid, &normal = region.normal;
    ContactPosition found{centroid, variance.asDiagonal(), normal};
    if (count < MIN_DOTS_FOR_CURVATURE) {  // as the tip of a fingertip of unknown shape: its offset grows with the surface's tilt
        const Eigen::Vector2d away = normal.head<2>() * FINGERTIP_RADIUS;
        found.covariance.topLeftCorner<2, 2>() += away * away.transpose();
        return found;
    }
    const Tip tip = round_tip(Eigen::Map<const Points>(points, 3, count).colwise() - centroid, normal, region.sigma);
    if (tip.projector.isZero(0) || !(tip.offset.squaredNorm() < 2 * region.area)) return found;
    const SurfacePoint surface = surface_at(wide, centroid.x() + tip.offset.x(), centroid.y() + tip.offset.y());
    found.position = surface.point;
    found.normal = surface.normal;
    const Eigen::Matrix2d across = Eigen::Matrix2d::Identity() - tip.projector;  // there the centroid's covariance applies
    found.covariance.topLeftCorner<2, 2>() = across * variance.head<2>().asDiagonal() * across.transpose() + tip.covariance;
    return found;
}

double contact_depth(const double* points, std::ptrdiff_t count, const RestCap& rest, double pitch) {
    const Eigen::Map<const Eigen::Array3Xd> at(points, 3, count);
    // NaN beyond the sphere
    const Eigen::ArrayXd gap = rest.centre_z + (rest.radius * rest.radius - at.row(0).square() - at.row(1).square()).sqrt() - at.row(2);
    std::ptrdiff_t deepest = -1;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (std::isfinite(gap[i]) && (deepest < 0 || gap[i] > gap[deepest])) deepest = i;
    }
    if (deepest < 0) return NAN;
    std::vector<std::ptrdiff_t> near;
    const Eigen::ArrayXd east = (at.row(0) - at(0, deepest)) / pitch, north = (at.row(1) - at(1, deepest)) / pitch;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (std::isfinite(gap[i]) && east[i] * east[i] + north[i] * north[i] < DEPTH_FIT_RADIUS * DEPTH_FIT_RADIUS) near.push_back(i);
    }
    if (near.size() < MIN_DOTS_FOR_QUADRATIC) return gap[deepest];
    const Eigen::ArrayXd x = east(near), y = north(near), depth = gap(near);
    const auto terms = quadratic_terms<6>(x, y);
    const ScaledFit<6> fit(terms, depth, 10 * RIDGE);
    if (!fit.solved) return gap[deepest];
    const auto& c = fit.coefficients;
    const double best = (terms * c).maxCoeff(), across = c[3] * c[5] - c[4] * c[4];
    if (c[3] >= 0 || across <= 0) return best;  // no maximum
    // The maximum is not extrapolated beyond the dots.
    const double top_x = (c[4] * c[2] - c[5] * c[1]) / across, top_y = (c[4] * c[1] - c[3] * c[2]) / across;
    const double apart = std::sqrt(((x - top_x).square() + (y - top_y).square()).minCoeff());
    return apart < MAX_PEAK_DISTANCE ? std::max(best, c[0] + 0.5 * (c[1] * top_x + c[2] * top_y)) : best;
}

}  // namespace tactile
