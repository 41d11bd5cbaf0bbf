// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/sheet_method.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace tactile {
namespace {

using Eigen::Matrix2d, Eigen::Matrix3d, Eigen::Vector2d, Eigen::Vector3d;

constexpr double MIN_START_DEPTH = 1e-5;  // m, limit: of a start, far below the noise

// Shift and growth (K, 3) of all markers.
Rows3 values_of(const MarkerField& field) {
    Rows3 values(field.shift.rows(), 3);
    values << field.shift, field.growth;
    return values;
}

}  // namespace

Eigen::Index CameraShifts::number(const Eigen::RowVector3d& camera_centre) const {
    const auto distance = [&](Eigen::Index k) { return (camera_centre - camera_centres.row(k)).squaredNorm(); };
    Eigen::Index nearest = 0;
    for (Eigen::Index k = 1; k < camera_centres.rows(); ++k)
        if (distance(k) < distance(nearest)) nearest = k;
    return nearest;
}

MarkerField CameraShifts::shifted(MarkerField field) const {
    Matrix2d turn;  // of row vectors
    turn << std::cos(turned), std::sin(turned), -std::sin(turned), std::cos(turned);
    for (Eigen::Index k = 0; k < field.rest.rows(); ++k) {
        const Eigen::RowVector3d centre = field.camera_centre.row(k);
        field.camera_centre.row(k).head<2>() = (centre.head<2>() + shifts.row(number(centre))) * turn + printed.transpose();
    }
    field.rest = (field.rest * turn).rowwise() + printed.transpose();
    field.shift = field.shift * turn;
    return field;
}

SheetTemplates::SheetTemplates(const Rows3& presses, Eigen::Index depths, double shift, double growth)
    : presses_(presses), depths_(depths), sigma_(shift, shift, growth) {}

void SheetTemplates::match(const SheetTable& table, const MarkerField& field, double max_shift) {
    update(table, field, max_shift);
    const Rows3 values = values_of(field);
    value_.setZero(values.size());
    Eigen::VectorXf known = Eigen::VectorXf::Zero(values.size());
    for (Eigen::Index k = 0; k < values.rows(); ++k)
        for (int q = 0; q < 3 && seen_.row(k).allFinite(); ++q)
            if (const double value = values(k, q) / sigma_[q]; std::isfinite(value))
                value_[3 * k + q] = static_cast<float>(value), known[3 * k + q] = 1;
    count_ = static_cast<Eigen::Index>(known.sum());
    if (known_.size() != known.size() || known_ != known) {
        known_ = known;
        lengths_ = (fields_.array().square().matrix() * known).cwiseMax(1e-9f).cwiseSqrt();
    }
    matches_ = fields_ * value_;
    matches_.cwiseQuotient(lengths_).maxCoeff(&best_);
}

void SheetTemplates::update(const SheetTable& table, const MarkerField& field, double max_shift) {
    Rows<5> seen(field.rest.rows(), 5);
    seen << field.rest, field.camera_centre;
    if (seen.rows() == seen_.rows()) {  // a marker that is not visible keeps its last position
        seen = seen.array().isFinite().select(seen, seen_);
        if (((seen - seen_).array().abs() <= max_shift || seen.array().isNaN()).all()) return;
    }
    seen_ = seen;
    std::vector<Eigen::Index> shown;
    for (Eigen::Index k = 0; k < seen.rows(); ++k)
        if (seen.row(k).allFinite()) shown.push_back(k);
    const SheetMarkers markers{seen(shown, Eigen::seqN(0, 2)), seen(shown, Eigen::seqN(2, 3))};
    fields_.setZero(presses_.rows(), 3 * seen.rows());
    for (Eigen::Index s = 0; s < presses_.rows(); ++s) {
        Rows6 press = Rows6::Zero(1, PRESS_SIZE);
        press.leftCols<3>() = presses_.row(s);
        const Rows3 value = show_presses(table, markers, press, 0).value;
        for (std::size_t n = 0; n < shown.size(); ++n)
            fields_.block<1, 3>(s, 3 * shown[n]) = value.row(n).cwiseQuotient(sigma_.transpose()).cast<float>();
    }
    known_.resize(0), gram_.resize(0, 0);
}

Rows6 SheetTemplates::best(double deepest) const {
    Rows6 press = Rows6::Zero(1, PRESS_SIZE);
    press.leftCols<3>() = presses_.row(best_);
    const double length = lengths_[best_];
    press(0, 2) = std::clamp(press(0, 2) * static_cast<double>(matches_[best_] / lengths_[best_]) / length, MIN_START_DEPTH, deepest);
    return press;
}

double SheetTemplates::score() const {
    const double best = matches_[best_] / lengths_[best_];
    const double residual = (value_.squaredNorm() - best * best) / static_cast<double>(std::max<Eigen::Index>(count_, 1));
    return best / std::sqrt(std::max(residual, 1.0));
}

Rows6 SheetTemplates::best_pair(double deepest) {
    const auto second = Eigen::seq(1, presses_.rows() - 1, depths_);
    if (!gram_.size()) {
        const FloatRows fields = fields_(second, Eigen::all);
        gram_ = (fields * fields.transpose()).cast<double>();
    }
    const Eigen::VectorXd match = matches_(second).cast<double>(), own = gram_.diagonal().array() + 1e-9;
    // Of the first of a pair; similar templates cannot be separated.
    const auto share = [&](Eigen::Index a, Eigen::Index b) {
        const double gram = gram_(std::max(a, b), std::min(a, b)), whole = own[a] * own[b];
        return (match[a] * own[b] - gram * match[b]) / std::max(whole - gram * gram, 1e-3 * whole);
    };
    std::pair<Eigen::Index, Eigen::Index> pair{0, 0};
    double most = 0;
    for (Eigen::Index a = 0; a < match.size(); ++a)
        for (Eigen::Index b = a; b < match.size(); ++b) {
            const double first = share(a, b), other = share(b, a), reported = first * match[a] + other * match[b];
            if (first > 0 && other > 0 && reported > most) most = reported, pair = {a, b};
        }
    const auto [a, b] = pair;
    Rows6 presses = Rows6::Zero(2, PRESS_SIZE);
    presses.leftCols<3>() << presses_.row(1 + a * depths_), presses_.row(1 + b * depths_);
    presses(0, 2) = std::clamp(presses(0, 2) * share(a, b), MIN_START_DEPTH, deepest);
    presses(1, 2) = std::clamp(presses(1, 2) * share(b, a), MIN_START_DEPTH, deepest);
    return presses;
}

SheetMethod::SheetMethod(std::shared_ptr<const SheetTable> table, SheetDevice device, const SheetRules& rules, SheetTemplates templates)
    : table_(std::move(table)), device_(std::move(device)), rules_(rules), templates_(std::move(templates)) {}

double SheetMethod::score(const MarkerField& field) {
    templates_.match(*table_, device_.shifts.shifted(field), rules_.max_template_shift);
    return templates_.score();
}

std::vector<PressEstimate> SheetMethod::estimate(const MarkerField& field) {
    const Rows3 moved = motion(field);
    const bool begins = !in_contact_, is_dragged = choice_.dragged;
    in_contact_ = false;
    if (field.seen().count() < rules_.min_markers) return choice_ = {}, std::vector<PressEstimate>();
    const double match = score(field);
    const bool stands_out = match >= rules_.stands_out;
    // A drag continues although the field matches no straight press.
    if (!stands_out && !is_dragged) return choice_ = {}, std::vector<PressEstimate>();
    in_contact_ = true;
    const MarkerField corrected = device_.shifts.shifted(field);
    const SheetFit fit = explained(seen(corrected, moved));
    if (begins && moved.size() && fit.misfit > rules_.strange) return {};
    std::vector<PressEstimate> touches;
    for (Eigen::Index k = 0; k < fit.presses.rows(); ++k) {
        if (!is_sure(fit, k)) continue;
        const PressEstimate found = touch(fit, k);
        // The residual field of a contact that has ended may be fitted by a very shallow press.
        if (is_seen(found, corrected) && (stands_out || found.depth > rules_.sure * found.depth_sigma)) touches.push_back(found);
    }
    if (!stands_out && touches.empty()) choice_ = {};
    if (fit.presses.rows() == 1 && touches.size() == 1) touches[0].wrench = wrench(fit, touches[0].position);
    return touches;
}

SheetMethod::Seen SheetMethod::seen(const MarkerField& field, const Rows3& motion) const {
    std::vector<Eigen::Index> index;
    for (Eigen::Index k = 0; k < field.shift.rows(); ++k)
        if (field.shift.row(k).allFinite() && field.camera_centre.row(k).allFinite()) index.push_back(k);
    const auto count = static_cast<Eigen::Index>(index.size());
    Seen found{{field.rest(index, Eigen::all), field.camera_centre(index, Eigen::all), device_.marker_radius,
                rules_.disc_pitches * device_.pitch.maxCoeff()},
               {values_of(field)(index, Eigen::all), Rows3::Zero(count, 3)}};
    if (motion.size()) found.frame.motion = motion(index, Eigen::all);
    return found;
}

// Change (K, 3) of shift and growth since the last frame of markers that a second camera observes, else 0; empty with one camera.
Rows3 SheetMethod::motion(const MarkerField& field) {
    if (device_.shifts.camera_centres.rows() < 2) return {};
    const Rows3 now = values_of(field);
    Rows3 moved = Rows3::Zero(now.rows(), 3);
    for (Eigen::Index k = 0; k < now.rows() && before_.rows() == now.rows(); ++k)
        if (device_.shifts.number(field.camera_centre.row(k)) > 0)
            moved.row(k) = (now.row(k) - before_.row(k)).unaryExpr([](double one) { return std::isfinite(one) ? one : 0.0; });
    before_ = now;
    return moved;
}

// The presses that explain a field.
SheetFit SheetMethod::explained(const Seen& seen) {
    const auto solve = [&](const Rows6& start, bool drags, const TipRadius& tip) {
        return fit_presses(*table_, seen.markers, seen.frame, device_.noise, {tip.mean, tip.sigma, drags}, start);
    };
    const TipRadius unknown{0, rules_.tip};
    const auto one = [&](const Rows6& start, bool drags) {
        return solve(start, drags, drags ? choice_.radius.value_or(unknown) : unknown);
    };
    // Two presses from those of the last frame, else straight from the best pair of starts and then dragged.
    const auto two = [&] {
        if (choice_.two) return solve(*choice_.two, true, unknown);
        SheetFit straight = solve(templates_.best_pair(table_->depth), false, unknown);
        if (!is_sure(straight, 0) || !is_sure(straight, 1)) return straight;
        return solve(straight.presses, true, unknown);  // each moves the sheet under the other
    };
    return choice_.explain({seen.frame.value.size(), rules_.ordinary, rules_.odds}, templates_.best(table_->depth), one, two);
}

// Whether the markers show press k, whose depth may still be uncertain, as in drags.
bool SheetMethod::is_sure(const SheetFit& fit, Eigen::Index k) const {
    const Eigen::Index depth = PRESS_SIZE * k + 2;
    return fit.presses(k, 2) > rules_.sure * std::sqrt(fit.covariance(depth, depth) * std::max(fit.misfit, 1.0));
}

// Whether markers around a contact are visible: if it starts between two exposures, one camera may show none.
bool SheetMethod::is_seen(const PressEstimate& touch, const MarkerField& field) const {
    for (Eigen::Index k = 0; k < field.rest.rows(); ++k) {
        const Vector2d distance = (field.rest.row(k).transpose() - touch.position.head<2>()).cwiseAbs().cwiseQuotient(device_.pitch);
        if (field.shift.row(k).allFinite() && distance.maxCoeff() < rules_.unseen) return true;
    }
    return false;
}

PressEstimate SheetMethod::touch(const SheetFit& fit, Eigen::Index k) const {
    const auto press = fit.presses.row(k);
    const double scale = device_.tip_radius, drag = std::hypot(press[4], press[5]);
    Matrix3d covariance = fit.covariance.block<3, 3>(PRESS_SIZE * k, PRESS_SIZE * k) * std::max(fit.misfit, 1.0);
    PressEstimate found;
    found.position << press[0], press[1], -press[2];
    found.depth = press[2], found.radius = scale * std::exp(press[3]);
    if (fit.presses.rows() == 1) {  // change of x, y and depth for an error of the radius by the model
        const Vector3d shift = rules_.radius[drag > 0] * fit.covariance.block<3, 1>(0, 3) / fit.covariance(3, 3);
        covariance += shift * shift.transpose();
    } else {
        centre(fit, k, found);
        const Vector3d lacks = scale * Vector3d(rules_.apart[0], rules_.apart[0], rules_.apart[1]);
        covariance.diagonal() += lacks.cwiseAbs2() * std::max(fit.misfit - 1, 0.0);
    }
    const Vector2d floor = (drag * rules_.dragged).cwiseMax(rules_.floor) * scale;
    const double aside = std::hypot(floor[0], device_.place_error), deeper = std::hypot(floor[1], device_.depth_share * found.depth);
    covariance.diagonal() += Vector3d(aside, aside, deeper).cwiseAbs2();
    const Vector3d turned(1, 1, -1);  // deeper is lower
    found.covariance = turned.asDiagonal() * covariance * turned.asDiagonal();
    found.depth_sigma = std::sqrt(found.covariance(2, 2)), found.lowest = found.position;
    const Vector2d at = found.position.head<2>();
    const bool outside =
        ((at - device_.lowest + device_.pitch).array() < 0).any() || ((at - device_.highest - device_.pitch).array() > 0).any();
    found.flags |= OUT_OF_RANGE * (outside || found.depth > rules_.max_relative_depth * device_.deepest);
    found.flags |= AT_EDGE * (at.array().abs() >= rules_.max_relative_reach * table_->reach.array()).any();
    found.flags |= AMBIGUOUS * (fit.misfit > rules_.unexplained);
    return found;
}

// Centre, m, of the contact of one of two presses, and its depth, m. The other press inclines the sheet, so that the lowest point lies
// downhill of the contact.
void SheetMethod::centre(const SheetFit& fit, Eigen::Index k, PressEstimate& touch) const {
    const Rows6 press = fit.presses.row(k);
    const SheetMarkers there{press.leftCols<2>(), Eigen::RowVector3d(press(0, 0), press(0, 1), -1)};
    const Rows9 by_other = show_presses(*table_, there, fit.presses, fit.interaction).shape - show_presses(*table_, there, press, 0).shape;
    const Matrix3d shape = Matrix3d::Map(by_other.data());
    const Vector2d slope = shape.block<1, 2>(2, 1).transpose();
    const Vector3d centre = fit.wrenches.block<1, 3>(k, 6).transpose();
    touch.depth = press(0, 2) - shape(2, 0) + 0.5 * touch.radius * slope.squaredNorm();
    touch.position << press.leftCols<2>().transpose() + shape.topLeftCorner<2, 1>() + centre.head<2>() - centre[2] * slope,
        centre[2] - touch.depth + slope.dot(0.5 * (touch.radius - centre[2]) * slope + centre.head<2>());
}

// Wrench at the origin, over shear modulus and thickness, m and m^2, of one press with its tip at a position, m.
Vector6 SheetMethod::wrench(const SheetFit& fit, const Vector3d& position) const {
    const auto numbers = fit.wrenches.row(0);
    const double push = fit.presses(0, 2) * std::exp(numbers[0]);
    const Vector3d force = push * Vector3d(numbers[1], numbers[2], -1), about = push * numbers.segment<3>(3).transpose();
    Vector6 found;
    found << force, position.cross(force) + about;
    return found;
}

}  // namespace tactile
