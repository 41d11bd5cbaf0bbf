// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Forces by the paper taxel_array_image_processing, equations 5 to 9.
#include "taxel/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "common/region_moments.hpp"
#include "taxel/constants.hpp"

namespace tactile::taxel {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();

// Covariance of a motion in the x-y plane from that of x, y and the rotation about z: the others are 0 by definition.
Matrix6 planar(const Eigen::Matrix3d& covariance) {
    constexpr int AXES[] = {0, 1, 5};
    Matrix6 whole = Matrix6::Zero();
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) whole(AXES[i], AXES[j]) = covariance(i, j);
    return whole;
}

std::array<double, 6> total_of(const Regions& regions) {
    std::array<double, 6> sum{};
    for (const Region& region : regions.all)
        for (int k = 0; k < 6; ++k) sum[k] += region.integrals[k];
    return sum;
}

// Lengths and direction of the ellipse of the regions' moments.
Vector3d axes_of(const std::array<double, 6>& total, const Found& found, double sigma) {
    std::vector<double> points;
    std::vector<std::int64_t> start{0};
    for (const auto* loops : {&found.outlines, &found.holes}) {
        for (const std::vector<double>& loop : *loops) {
            points.insert(points.end(), loop.begin(), loop.end());
            start.push_back(static_cast<std::int64_t>(points.size() / 3));
        }
    }
    const auto length = [](const auto& numbers) { return static_cast<std::ptrdiff_t>(numbers.size()); };
    return region_axes({total.data(), {6}, 6}, {points.data(), {length(points) / 3, 3}, length(points)},
                       {start.data(), {length(start)}, length(start)}, sigma);
}

// Wrench of the object whose pressure acts at pressure_centre and whose friction acts at contact. Friction is half of the weight
// (equations 6 and 7); without the weight, tangential forces and the moment about the normal are NaN. The friction of each finger also
// holds half of the weight's moment about the common normal of the fingers, which equation 9 omits; the pressure centre accounts for the
// other moments.
Eigen::Matrix<double, 6, 1> wrench_of(double normal, const Vector2d& pressure_centre, const Vector3d& contact, const Grasped& grasped) {
    Eigen::Matrix<double, 6, 1> wrench;
    wrench << UNKNOWN, UNKNOWN, -normal, -pressure_centre.y() * normal, pressure_centre.x() * normal, UNKNOWN;
    const Vector3d half = 0.5 * grasped.weight;
    if (!half.allFinite()) return wrench;
    wrench.head<2>() = half.head<2>();
    wrench[3] += -contact[2] * half[1];
    wrench[4] += contact[2] * half[0];
    const Vector3d& arm = grasped.centre_of_mass.allFinite() ? grasped.centre_of_mass : contact;
    wrench[5] = arm[0] * half[1] - arm[1] * half[0];
    return wrench;
}

}  // namespace

Estimator::Estimator(const EstimatorSettings& settings, SignalSettings signal_settings, const MotionLimits& limits)
    : signal(std::move(signal_settings), settings.pad.rows, settings.pad.columns),
      settings_(settings),
      mechanics_(settings.pad, limits, settings.known) {}

void Estimator::set_reference() {
    signal.set_reference(), mechanics_.reset(), tracker_.reset();
}

Found Estimator::process(Load load) {
    Observation observation = mechanics_.process(load.pressure.data(), load.noise, load.full.data(), load.stamp, grasped.can_roll);
    return complete(std::move(load), std::move(observation), Vector2d::Constant(UNKNOWN));
}

Found Estimator::complete(Load load, Observation observation, const Vector2d& centre) {
    const Regions& regions = observation.regions;
    signal.follow(load, regions.touched.data());
    Found found;
    for (const Region& region : regions.all) found.normal.push_back(regions.broken ? UNKNOWN : normal_force(region));
    add_region(observation, load.interval, found);
    if (!regions.all.empty() && !centre.hasNaN()) found.centroid.head<2>() = centre;
    add_contacts(observation, load, found);
    if (observation.motion) found.sliding = sliding(observation);
    found.observation = std::move(observation);
    add_wrench(load, centre, found);
    found.pressure = std::move(load.pressure);
    found.columns = settings_.pad.columns;
    return found;
}

void Estimator::add_region(const Observation& observation, double interval, Found& found) const {
    for (Vector3d* one : {&found.centroid, &found.axes, &found.motion_translation}) one->setConstant(UNKNOWN);
    found.motion_rotation.setConstant(UNKNOWN), found.motion_covariance.setConstant(UNKNOWN);
    found.motion_interval = UNKNOWN;
    const Regions& regions = observation.regions;
    if (regions.all.empty()) return;
    for (const Region& region : regions.all) {
        found.outlines.insert(found.outlines.end(), region.outlines.begin(), region.outlines.end());
        found.holes.insert(found.holes.end(), region.holes.begin(), region.holes.end());
    }
    const std::array<double, 6> total = total_of(regions);
    found.area = total[0];
    found.centroid = {total[1] / total[0], total[2] / total[0], 0};
    if (!regions.broken) found.axes = axes_of(total, found, TAXEL.outline_sigma * settings_.pad.pitch);
    if (const auto& motion = observation.motion; motion && std::isfinite(motion->step_turn) && interval > 0) {
        found.motion_translation = {motion->step.x(), motion->step.y(), 0};
        found.motion_rotation = {0, 0, std::sin(0.5 * motion->step_turn), std::cos(0.5 * motion->step_turn)};
        found.motion_interval = interval;
        found.motion_covariance = planar(motion->step_covariance);
    }
}

// Contacts, largest first: one that is small and new may be a piece of another.
void Estimator::add_contacts(const Observation& observation, const Load& load, Found& found) {
    const Regions& regions = observation.regions;
    const double pitch = settings_.pad.pitch, thickness = settings_.pad.thickness * pitch;
    std::vector<TrackedRegion> to_track;
    for (const Region& one : regions.all) to_track.push_back({one.label, one.centroid(), one.integrals[0]});
    const auto tracked = tracker_.assign(regions.labels, to_track, TAXEL.max_step * pitch, load.stamp);
    // The lead is anywhere from none to that which is subtracted. It follows from a balance of moments of a pad of the stated thickness and
    // from a traction that no taxel measures: a thinner pad, or an object that creeps, has less of it.
    const Vector2d lead = 1 / std::sqrt(3.0) * mechanics_.tracker.lead;
    for (std::size_t k = 0; k < tracked.size(); ++k) {
        const Region& region = regions.all[k];
        if (!(k == 0 || tracked[k].is_persistent() || region.peak >= TAXEL.min_peak_sigmas * load.noise)) continue;
        double depth = grasped.depth > 0 ? grasped.depth : UNKNOWN;
        if (!std::isfinite(depth) && settings_.known) depth = region.peak * thickness / settings_.stiffness;
        const double light = thickness * std::pow(TAXEL.roughness_sigmas * load.noise / region.peak, 3);
        const double alone = std::pow(TAXEL.centroid_sigma * pitch, 2) + light * light;
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Constant(UNKNOWN);
        covariance.topLeftCorner<2, 2>() = alone * Eigen::Matrix2d::Identity() + lead * lead.transpose();
        Vector3d position = to_track[k].centroid;
        position[2] = -depth;
        const int flags = (tracked[k].merged || regions.broken ? AMBIGUOUS : 0) | (region.at_edge ? AT_EDGE : 0) |
                          (region.saturated ? SATURATED : 0);
        found.contacts.push_back({tracked[k].number, position, depth, found.normal[k], covariance, flags});
    }
}

// From calibrated pressure, else from depth and area (equation 5); NaN if both are unknown. Saturated taxels show too little: there the
// larger of the two is used.
double Estimator::normal_force(const Region& region) const {
    const double thickness = settings_.pad.thickness * settings_.pad.pitch;
    const double by_depth = grasped.depth > 0 ? settings_.stiffness / thickness * grasped.depth * region.integrals[0] : UNKNOWN;
    const double by_pressure = settings_.known ? std::max(region.force, 0.0) : UNKNOWN;
    if (region.saturated) return std::fmax(by_pressure, by_depth);
    const double preferred = settings_.by_depth ? by_depth : by_pressure;
    return std::isfinite(preferred) ? preferred : settings_.by_depth ? by_pressure : by_depth;
}

void Estimator::add_wrench(const Load& load, const Vector2d& centre, Found& found) const {
    if (found.normal.empty()) {
        found.wrench.setConstant(settings_.known || std::isfinite(grasped.depth) ? 0 : UNKNOWN);
        return;
    }
    const double normal = std::accumulate(found.normal.begin(), found.normal.end(), 0.0);
    Vector3d contact = found.centroid;
    contact[2] = grasped.depth > 0 ? -grasped.depth : 0;
    if (!centre.hasNaN()) {  // all forces act at the centre of the contact (equation 9)
        Grasped there = grasped;
        there.centre_of_mass.setConstant(UNKNOWN);
        found.wrench = wrench_of(normal, centre, contact, there);
        return;
    }
    const SurfaceShear& shear = mechanics_.tracker.shear;
    std::array<double, 2> friction{};
    if (settings_.known) {
        const Vector2d half = 0.5 * grasped.weight.head<2>();
        friction = half.allFinite() ? std::array<double, 2>{half.x(), half.y()} : shear.force();  // from the object's motion
    }
    const auto acts_at = shear.pressure_centre(load.pressure.data(), found.observation.regions.touched.data(), friction);
    found.wrench = wrench_of(normal, {acts_at[0], acts_at[1]}, contact, grasped);
}

Vector2d Estimator::position(std::ptrdiff_t taxel) const {
    const ShearPad& pad = settings_.pad;
    return {(static_cast<double>(taxel % pad.columns) - 0.5 * static_cast<double>(pad.columns - 1)) * pad.pitch,
            (static_cast<double>(taxel / pad.columns) - 0.5 * static_cast<double>(pad.rows - 1)) * pad.pitch};
}

Sliding Estimator::sliding(const Observation& observation) const {
    const ObjectMotion& motion = *observation.motion;
    const std::vector<std::uint8_t>& touched = observation.regions.touched;
    Sliding found{};
    const double turn = std::isnan(motion.turn) ? 0 : motion.turn;
    Vector2d sum = Vector2d::Zero();
    double count = 0;
    for (std::size_t k = 0; k < touched.size(); ++k) {
        if (!touched[k]) continue;
        const Vector2d at = position(static_cast<std::ptrdiff_t>(k));
        sum += at, ++count;
        if (!motion.slipping[k]) continue;
        found.x.push_back(at.x()), found.y.push_back(at.y());
        found.vx.push_back(motion.linear.x() - turn * at.y()), found.vy.push_back(motion.linear.y() + turn * at.x());
    }
    found.slipping_fraction = static_cast<double>(found.x.size()) / count;
    found.unseen = motion.unseen;
    found.linear = {motion.linear.x(), motion.linear.y(), 0};
    found.angular = {0, 0, motion.turn};
    found.velocity_covariance = planar(motion.velocity_covariance);
    found.rotation_center.setConstant(UNKNOWN);
    if (turn != 0) {  // else a translation, or the rotation is not observable
        const Vector2d centre(-motion.linear.y() / turn, motion.linear.x() / turn);
        if ((centre - sum / count).norm() < TAXEL.max_turn_radius * std::sqrt(count / M_PI) * settings_.pad.pitch)
            found.rotation_center = {centre.x(), centre.y(), 0};
    }
    return found;
}

// The array measures pressure alone: tangential forces and displacements are NaN. Each region's normal force is distributed by pressure.
Points Estimator::points(const Found& found, bool slips) const {
    const Regions& regions = found.observation.regions;
    const std::vector<float>& surface = found.observation.surface;
    const bool has_forces = !regions.broken && (settings_.known || grasped.depth > 0);
    std::vector<double> per_load(regions.all.size());  // force over load of each region
    std::vector<std::size_t> region_of(surface.size(), regions.all.size());
    for (std::size_t n = 0; has_forces && n < regions.all.size(); ++n) {
        double load = 0;
        for (std::size_t k = 0; k < surface.size(); ++k) {
            if (regions.near[k] != regions.all[n].label) continue;
            region_of[k] = n;
            load += std::max(surface[k], 0.0f);
        }
        per_load[n] = load > 0 ? found.normal[n] / load : UNKNOWN;
    }
    const double yielded = settings_.known ? settings_.pad.thickness * settings_.pad.pitch / settings_.stiffness : UNKNOWN;  // m/Pa
    Points points{std::vector<double>(3 * surface.size(), UNKNOWN), std::vector<double>(3 * surface.size(), UNKNOWN),
                  std::vector<double>(surface.size(), has_forces ? 0 : UNKNOWN), std::vector<std::uint8_t>(surface.size(), NON_CONTACT)};
    for (std::size_t k = 0; k < surface.size(); ++k) {
        if (region_of[k] < per_load.size()) points.normal_force[k] = std::max(surface[k], 0.0f) * per_load[region_of[k]];
        points.force[3 * k + 2] = -points.normal_force[k];
        points.displacement[3 * k + 2] = -surface[k] * yielded;
        if (!regions.touched[k]) continue;
        const auto& motion = found.observation.motion;
        points.state[k] = motion ? (motion->slipping[k] ? SLIPPING : STICKING) : slips ? UNKNOWN_STATE : STICKING;
    }
    return points;
}

}  // namespace tactile::taxel
