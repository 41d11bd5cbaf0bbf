// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/touch_region.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {
namespace {

constexpr double STEEPEST = 0.95;   // largest contact radius over tip radius. Chosen: below a hemisphere's 1, where the slope is infinite
constexpr int HALVINGS = 30;        // of the bracket: to 1e-9 of it
constexpr double LEAST = 1e-9;      // m, of a contact radius: a region has a centre
constexpr double AT_CLAMP = 0.499;  // of a side: places are no nearer to the clamp

bool is_dome(const ClampedSkin& skin) {
    return !(std::min(skin.size[0], skin.size[1]) > 0);
}

double curvature(const ClampedSkin& skin) {
    return 2 * skin.height / (skin.rim_radius * skin.rim_radius + skin.height * skin.height);
}

// Unit normal, outwards, of the untouched skin over a place; outside a dome's rim that at the rim.
Vec3 normal_at(const ClampedSkin& skin, double x, double y) {
    if (!is_dome(skin)) return {0, 0, 1};
    const double bend = curvature(skin), across = std::hypot(x, y) * bend;
    const double share = bend * std::min(1.0, skin.rim_radius * bend / std::max(across, 1e-12));
    return {share * x, share * y, std::sqrt(std::max(1 - share * share * (x * x + y * y), 0.0))};
}

}  // namespace

double contact_radius(double depth, double tip_radius, double clearance) {
    double low = 0, high = std::max(std::min(STEEPEST * tip_radius, clearance), LEAST);
    for (int turn = 0; turn < HALVINGS; ++turn) {
        const double middle = 0.5 * (low + high);
        const double deeper = middle * middle / tip_radius * (0.5 + std::log(clearance / middle));
        (deeper < depth ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

double clearance(const ClampedSkin& skin, double x, double y) {
    if (is_dome(skin)) return std::max(skin.rim_radius * skin.rim_radius - (x * x + y * y), 0.0) / skin.rim_radius;
    double sum = 0;
    for (int axis = 0; axis < 2; ++axis) {
        const double at = std::clamp((axis ? y : x) / skin.size[axis], -AT_CLAMP, AT_CLAMP);
        sum += std::pow(2 * skin.size[axis] / M_PI * std::cos(M_PI * at), -4);
    }
    return std::pow(sum, -0.25);
}

ContactDisc contact_disc(const ClampedSkin& skin, const RoundTip& tip) {
    const double bend = is_dome(skin) ? curvature(skin) : 0.0;  // a convex skin leaves the tip sooner
    const double radius = contact_radius(tip.depth, 1 / (1 / tip.radius + bend), clearance(skin, tip.place.x, tip.place.y));
    const double share = 1 / (1 + tip.radius * bend);
    const Vec3 normal = normal_at(skin, tip.place.x * share, tip.place.y * share);
    const Vec3 middle{tip.place.x, tip.place.y, tip.place.z + tip.radius};
    return {middle - std::sqrt(std::max(tip.radius * tip.radius - radius * radius, 0.0)) * normal, normal, radius};
}

void disc_outline(const ContactDisc& disc, double* outline) {
    const double across = std::hypot(disc.normal.x, disc.normal.z);
    const Vec3 along = across > 0 ? Vec3{disc.normal.z / across, 0, -disc.normal.x / across} : Vec3{1, 0, 0};
    const Vec3 beside = cross(disc.normal, along);
    for (int k = 0; k < CORNERS; ++k) {
        const double turn = 2 * M_PI * k / CORNERS;
        store(outline, k, disc.centre + disc.radius * (std::cos(turn) * along + std::sin(turn) * beside));
    }
}

MarkersUnder markers_under(const std::vector<ContactDisc>& discs, const ViewedMarkers& markers) {
    MarkersUnder found;
    for (std::ptrdiff_t k = 0; k < markers.count; ++k) {
        const double *rest = markers.rest + 2 * k, *shift = markers.shift + 2 * k, *eye = markers.eye + 3 * k;
        if (!std::isfinite(shift[0]) || !std::isfinite(shift[1])) continue;
        bool under = false;
        for (const ContactDisc& disc : discs) {  // as the eye sees it in the viewing plane
            const double share = (markers.plane - eye[2]) / (disc.centre.z - eye[2]);
            const double x = eye[0] + share * (disc.centre.x - eye[0]), y = eye[1] + share * (disc.centre.y - eye[1]);
            under = under || std::hypot(rest[0] + shift[0] - x, rest[1] + shift[1] - y) <= disc.radius;
        }
        found.id.push_back(k);
        found.under.push_back(under);
    }
    return found;
}

}  // namespace tactile
