// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/dome_method.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tactile {
namespace {

using Eigen::Matrix2d, Eigen::Vector2d, Eigen::Vector3d, Eigen::Vector4d;
using DomePress = Eigen::Matrix<double, PRESS, 1>;

constexpr double MIN_FACTOR = 0.01;   // 1, limit: on a start's depth; a press that the field opposes starts faintly
constexpr double MAX_RIM_RATIO = 0.95;  // 1, limit: distance of a tip from the axis over the rim radius
constexpr double DIFFERENCE = 1e-6;   // 1 and m, numeric: of a number of a press, for derivatives
constexpr int SKIN_STEPS = 15;        // 1, numeric: points of the skin across a tip
constexpr int ERRORS = 3;             // of the result: x, y and depth

Points moved_by(const DomeLibrary& library, const Points& points, const DomePresses& presses) {
    Points moved = Points::Zero(points.rows(), 3);
    for (Eigen::Index k = 0; k < presses.rows(); ++k) press_dome(library, points, presses.row(k).transpose(), moved);
    return moved;
}

// Apparent positions (K, 2), m, in the viewing plane of markers at points (K, 3), m.
Rows2 seen_at(const DomeMarkers& markers, const Points& points) {
    Rows2 seen(points.rows(), 2);
    for (Eigen::Index k = 0; k < points.rows(); ++k) {
        const Eigen::RowVector3d centre = markers.camera_centres.row(k), offset = points.row(k) - centre;
        seen.row(k) = centre.head<2>() + offset.head<2>() * ((markers.plane_z - centre[2]) / offset[2]);
    }
    return seen;
}

// Eigenvalues of a symmetric matrix, the smaller first.
Vector2d principal_values(const Matrix2d& matrix) {
    const double middle = 0.5 * matrix.trace(), half = std::hypot(0.5 * (matrix(0, 0) - matrix(1, 1)), matrix(0, 1));
    return {middle - half, middle + half};
}

// A start is less deep if the field is fainter than its own: from starts that are too deep, a faint press would be fitted where the dome is
// stiffest. residual: squared, minus the square of the field.
struct Fainter {
    double factor, residual;
    Fainter(double match, double size)
        : factor(std::clamp(match / size, MIN_FACTOR, 1.0)), residual(factor * (factor * size - 2 * match)) {}
};

}  // namespace

double DomeScales::depth_scale(const Vector2d& position, double depth, double shallow) const {
    const double far = std::min(position.squaredNorm() / (farthest * farthest), 1.0), limit = shallow * deepest;
    return deeper + (deeper_far - deeper) * far + deeper_shallow * limit / std::max(depth, limit);
}

DomeStarts::DomeStarts(const DomeLibrary& library, const DomeMarkers& markers, DomePresses starts, double min_distance)
    : starts_(std::move(starts)) {
    const Rows2 rest = seen_at(markers, markers.points);
    const Eigen::Index count = starts_.rows();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> fields(count, rest.size());
    for (Eigen::Index s = 0; s < count; ++s) {
        Rows2 shown = seen_at(markers, markers.points + moved_by(library, markers.points, starts_.row(s))) - rest;
        shown = shown.array().isNaN().select(0, shown);
        fields.row(s) = Eigen::RowVectorXd::Map(shown.data(), shown.size());
    }
    fields_ = fields.cast<float>(), sizes_ = fields.rowwise().squaredNorm();
    const Eigen::MatrixXd products = fields * fields.transpose();
    pair_sizes_.setZero(count, count);
    for (Eigen::Index a = 0; a < count; ++a)  // each pair once
        for (Eigen::Index b = a; b < count; ++b)
            if ((starts_.row(a) - starts_.row(b)).head<2>().norm() >= min_distance)
                pair_sizes_(a, b) = 2 * products(a, b) + sizes_[a] + sizes_[b];
}

void DomeStarts::match(const Rows2& shift) {
    Eigen::VectorXf field = Eigen::VectorXf::Zero(shift.size());
    for (Eigen::Index k = 0; k < shift.rows(); ++k)
        if (shift.row(k).allFinite()) field.segment<2>(2 * k) = shift.row(k).cast<float>();
    matches_ = (fields_ * field).cast<double>();
}

DomePresses DomeStarts::one(const Rows2& shift, const std::optional<DomeFit>& last) const {
    Eigen::Index best = 0;
    for (Eigen::Index s = 1; s < starts_.rows(); ++s)
        if (Fainter(matches_[s], sizes_[s]).residual < Fainter(matches_[best], sizes_[best]).residual) best = s;
    const Fainter fainter(matches_[best], sizes_[best]);
    if (last) {
        const Eigen::ArrayXXd residuals = last->shown.array() * (last->shown - 2 * shift).array();
        if (!(residuals.isNaN().select(0, residuals).sum() > fainter.residual)) return last->presses;
    }
    DomePresses start = starts_.row(best);
    start(0, DEPTH) += std::log(fainter.factor);
    return start;
}

DomePresses DomeStarts::two() const {
    Eigen::Index first = 0, second = 0;
    double factor = MIN_FACTOR, smallest = std::numeric_limits<double>::infinity();
    for (Eigen::Index a = 0; a < starts_.rows(); ++a)
        for (Eigen::Index b = a; b < starts_.rows(); ++b) {
            if (!(pair_sizes_(a, b) > 0)) continue;
            const Fainter fainter(matches_[a] + matches_[b], pair_sizes_(a, b));
            if (fainter.residual < smallest) first = a, second = b, factor = fainter.factor, smallest = fainter.residual;
        }
    DomePresses starts(2, PRESS);
    starts << starts_.row(first), starts_.row(second);
    starts.col(DEPTH).array() += std::log(factor);
    return starts;
}

DomeMethod::DomeMethod(std::shared_ptr<const DomeLibrary> library, std::shared_ptr<const DomeLibrary> pushes, DomeDevice device,
                       const DomeRules& rules, const DomePresses& starts)
    : library_(std::move(library)),
      pushes_(std::move(pushes)),
      device_(std::move(device)),
      rules_(rules),
      starts_(*library_, device_.markers, starts, rules.apart * device_.pitch) {}

std::vector<PressEstimate> DomeMethod::estimate(const Rows2& rest, const Rows2& shift) {
    find(rest, shift);
    std::vector<PressEstimate> touches;
    for (Eigen::Index k = 0; found_ && k < found_->presses.rows(); ++k) {
        const PressEstimate one = touch(k);
        if (one.depth > rules_.sure * one.depth_sigma &&
            std::sqrt(principal_values(one.covariance.topLeftCorner<2, 2>())[1]) * rules_.sure < library_->radius)
            touches.push_back(one);
    }
    return touches;
}

double DomeMethod::score(const Rows2& shift) {
    starts_.match(shift);
    return starts_.score(device_.errors.still);
}

void DomeMethod::find(const Rows2& rest, const Rows2& shift) {
    const Eigen::Index seen = shift.array().isFinite().rowwise().all().count();
    const double threshold = std::max(rules_.stands_out, rules_.quieter * device_.scales.quiet), found = score(shift);
    if (seen < rules_.min_markers || !is_spread(rest, shift) || !(found > threshold)) {
        choice_ = {}, found_.reset();  // the next press is another contact
        return;
    }
    found_ = explained(shift, seen);
    if (found_->presses.rows() == 1 && found < rules_.faint * threshold) doubt(*found_, shift, seen);
}

std::optional<Eigen::VectorXd> DomeMethod::raised() const {
    if (!found_) return {};
    return moved_by(*library_, device_.markers.points, found_->presses).col(2);
}

// Whether the visible markers span a plane instead of a line or a point.
bool DomeMethod::is_spread(const Rows2& rest, const Rows2& shift) const {
    std::vector<Eigen::Index> seen;
    for (Eigen::Index k = 0; k < shift.rows(); ++k)
        if (shift.row(k).allFinite()) seen.push_back(k);
    Rows2 now = rest(seen, Eigen::all) + shift(seen, Eigen::all);
    now.rowwise() -= now.colwise().mean().eval();
    return principal_values(now.transpose() * now / static_cast<double>(seen.size()))[0] > device_.pitch * device_.pitch;
}

DomeFit DomeMethod::solve(const Rows2& shift, const DomePresses& starts, const DomePrior& prior) const {
    return fit_dome(*library_, device_.markers, device_.errors, prior, shift, starts);
}

// The hypothesis of the largest evidence.
DomeFit DomeMethod::explained(const Rows2& shift, Eigen::Index seen) {
    DomePrior dragged = device_.dragged;
    if (choice_.radius) dragged.tip = choice_.radius->mean, dragged.tip_sigma = choice_.radius->sigma;
    const auto one = [&](const DomePresses& start, bool drags) { return solve(shift, start, drags ? dragged : device_.straight); };
    // Two presses, straight from the best pair of starts and then dragged: directly from the start, drags might diverge to small depths
    // with long displacements.
    const auto two = [&] {
        if (choice_.two) return solve(shift, *choice_.two, device_.two);
        DomeFit straight = solve(shift, starts_.two(), device_.straight);
        for (Eigen::Index depth = DEPTH; depth < straight.covariance.rows(); depth += PRESS)  // the markers must show every depth
            if (!(straight.covariance(depth, depth) * rules_.sure * rules_.sure < 1)) return straight;
        return solve(shift, straight.presses, device_.two);
    };
    return choice_.explain({2 * seen, rules_.ordinary, rules_.odds}, starts_.one(shift, choice_.one), one, two);
}

// Increases the covariance of a faint press if two presses explain it better: if the squared residual decreases by more than two (Akaike
// 1974) for each number of a second press. The position is then as uncertain as the two presses are apart.
void DomeMethod::doubt(DomeFit& found, const Rows2& shift, Eigen::Index seen) const {
    const DomeFit two = solve(shift, starts_.two(), device_.straight);
    // A faint press determines position and depth.
    if (2 * static_cast<double>(seen) * (found.misfit / two.misfit - 1) < 2 * 3) return;
    const Rows3 offset = two.presses.leftCols<3>().rowwise() - found.presses.row(0).head<3>();
    found.covariance.topLeftCorner<3, 3>() += offset.transpose() * offset / 2;
}

// Height, m, of the untouched dome.
double DomeMethod::cap_height(const Vector2d& position) const {
    return library_->centre_z + std::sqrt(library_->curvature * library_->curvature - position.squaredNorm());
}

// Height, m, of a round tip's lowest point at first contact.
double DomeMethod::touch_height(const Vector2d& position, double radius) const {
    const double reach = library_->curvature + radius;
    return library_->centre_z + std::sqrt(reach * reach - position.squaredNorm()) - radius;
}

// Lowest point and depth of a press, m, as a function of its numbers and of errors of the result; scale: of its depth; sunk: m, by which
// other presses lower the skin.
struct DomeMethod::Tip {
    const DomeMethod& of;
    double scale, sunk;

    Vector2d inside(const Vector2d& position) const {
        return position * std::min(1.0, MAX_RIM_RATIO * of.device_.surface.rim_radius / std::max(position.norm(), 1e-9));
    }
    Vector4d at(const DomePress& press, const Vector3d& errors) const {
        const double radius = of.library_->radius * std::exp(of.library_->radius_spread * press[RADIUS]), pressed = std::exp(press[DEPTH]);
        const Vector2d first = press.head<2>() / of.device_.scales.wider + errors.head<2>();
        const double low = of.touch_height(inside(first), radius) - pressed / scale - sunk - errors[2];
        const Vector2d position = inside(first + pressed * press.tail<2>());  // to which the drag has moved it
        return {position[0], position[1], low, of.touch_height(position, radius) - low};
    }
};

PressEstimate DomeMethod::touch(Eigen::Index number) const {
    const DomePress press = found_->presses.row(number);
    const DomeScales& scales = device_.scales;
    const double pressed = std::exp(press[DEPTH]), drag = press.tail<2>().norm();
    const Vector2d first = press.head<2>() / scales.wider;
    PressEstimate found;
    found.radius = library_->radius * std::exp(library_->radius_spread * press[RADIUS]);
    const Others others = by_others(number, found.radius);
    const double scale = scales.depth_scale(first, pressed, rules_.shallow);
    const Tip tip{*this, scale, others.sunk};
    const Vector4d there = tip.at(press, Vector3d::Zero());
    Eigen::Matrix<double, 4, PRESS> by_press;
    Eigen::Matrix<double, 4, ERRORS> by_errors;
    for (int k = 0; k < PRESS; ++k)
        by_press.col(k) = (tip.at(press + DIFFERENCE * DomePress::Unit(k), Vector3d::Zero()) - there) / DIFFERENCE;
    for (int k = 0; k < ERRORS; ++k) by_errors.col(k) = (tip.at(press, DIFFERENCE * Vector3d::Unit(k)) - there) / DIFFERENCE;
    found.position = found.lowest = there.head<3>(), found.depth = there[3];
    const double aside = rules_.not_linear[0] * pressed * drag + scales.place_error + rules_.scaled * (first - press.head<2>()).norm();
    const double deeper = rules_.not_linear[1] * pressed * drag +
                          (scales.depth_share + rules_.scaled * std::abs(scale - 1)) * found.depth + std::abs(others.sunk);
    Eigen::Matrix4d covariance = by_press * found_->covariance.block<PRESS, PRESS>(PRESS * number, PRESS * number) * by_press.transpose() +
                                 by_errors * Vector3d(aside, aside, deeper).cwiseAbs2().asDiagonal() * by_errors.transpose();
    if (!covariance.allFinite()) covariance = device_.surface.rim_radius * device_.surface.rim_radius * Eigen::Matrix4d::Identity();
    found.flags |= OUT_OF_RANGE * (found.depth > rules_.max_relative_depth * scales.deepest);
    found.flags |= AT_EDGE * (press.head<2>().norm() > rules_.max_relative_reach * scales.reach || first.norm() > scales.farthest);
    found.flags |= AMBIGUOUS * (found_->misfit > rules_.unexplained);
    if (found_->presses.rows() == 1) {
        found.wrench = wrench(found.lowest, found.radius);
    } else {
        const Vector3d offset = centre(number, found.radius, others.slopes);
        const double centre_error = rules_.centre_error * offset.norm(), added = rules_.added * found.depth;
        found.position += offset, covariance.diagonal() += Vector4d(centre_error, centre_error, added, added).cwiseAbs2();
    }
    found.covariance = covariance.topLeftCorner<3, 3>(), found.depth_sigma = std::sqrt(covariance(3, 3));
    return found;
}

// Effect of the other presses on the skin under one press: by how much they lower it, m, and the slopes that they cause. Depth is measured
// from the untouched dome.
DomeMethod::Others DomeMethod::by_others(Eigen::Index number, double radius) const {
    if (found_->presses.rows() == 1) return {};
    const Vector2d at = found_->presses.row(number).head<2>() * library_->curvature / (library_->curvature + radius);
    Points skin(5, 3);
    for (Eigen::Index k = 0; k < 5; ++k) {
        Vector2d point = at;
        if (k) point[(k - 1) / 2] += (k % 2 ? 1 : -1) * rules_.slope_base;
        skin.row(k) << point.transpose(), cap_height(point);
    }
    const Eigen::VectorXd up = moved_by(*library_, skin, found_->presses.row(1 - number)).col(2);
    return {-up[0], Vector2d(up[1] - up[2], up[3] - up[4]) / (2 * rules_.slope_base)};
}

// Vector, m, from the lowest point of a tip of this radius, m, to the centre of its contact on the tip: the mean of the skin that its own
// press brings near the tip, corrected for slopes of the skin by other presses.
Vector3d DomeMethod::centre(Eigen::Index number, double radius, const Vector2d& slopes) const {
    const DomePress press = found_->presses.row(number);
    const Vector2d at = press.head<2>(), middle = at * library_->curvature / (library_->curvature + radius);
    Points skin(SKIN_STEPS * SKIN_STEPS, 3);
    Eigen::Index count = 0;
    for (int k = 0; k < SKIN_STEPS * SKIN_STEPS; ++k) {
        const Vector2d aside = radius * (2.0 / (SKIN_STEPS - 1) * Vector2d(k % SKIN_STEPS, k / SKIN_STEPS).array() - 1).matrix();
        const Vector2d point = middle + aside;
        if (aside.norm() <= radius && point.norm() < rules_.max_relative_reach * device_.surface.rim_radius)
            skin.row(count++) << point.transpose(), cap_height(point);
    }
    skin.conservativeResize(count, 3);
    Vector3d tip;
    tip << at + std::exp(press[DEPTH]) * press.tail<2>(), touch_height(at, radius) - std::exp(press[DEPTH]) + radius;
    const Rows3 from_tip = (skin + moved_by(*library_, skin, found_->presses.row(number))).rowwise() - tip.transpose();
    const Eigen::ArrayXd gap = from_tip.rowwise().norm();
    const double nearest = count ? gap.minCoeff() : 0;
    Vector3d centre = Vector3d::Zero();
    for (Eigen::Index k = 0; k < count; ++k)
        centre += std::clamp(2 - 2 * (gap[k] - nearest) / (rules_.contact_gap * radius), 0.0, 1.0) * library_->curvature /
                  (skin(k, 2) - library_->centre_z) * from_tip.row(k).transpose();
    centre.normalize();
    centre.head<2>() -= rules_.slope_share * slopes;
    return radius * (centre.normalized() + Vector3d::UnitZ());
}

// Wrench, m and m^2, at the origin over shear modulus and thickness of the only press; the force acts at the point of first contact.
Vector6 DomeMethod::wrench(const Vector3d& lowest, double radius) const {
    Points top(1, 3);
    top << 0, 0, device_.surface.height;
    const Vector3d force = moved_by(*pushes_, top, found_->presses).row(0);
    const Vector3d normal = device_.surface.normal(found_->presses.row(0).head<2>() / (1 + radius / library_->curvature));
    Vector6 found;
    found << force, (lowest + radius * (Vector3d::UnitZ() - normal)).cross(force);
    return found;
}

}  // namespace tactile
