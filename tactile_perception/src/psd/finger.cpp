// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "psd/finger.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactile {
namespace {

constexpr double NOTHING = std::numeric_limits<double>::quiet_NaN();
constexpr double CROSS_LIMIT = 6;   // standard deviations of the cross term for one contact; more are several contacts. Chosen
constexpr double LARGEST_LOG = 50;  // keeps exp finite
constexpr double DARK = 1e-6;       // V, least light of which a logarithm is taken
constexpr int LOAD_TERMS = 8;

// Light over that of a typical contact at its place, less 1 and at most 1 in size.
double relative_light(const TableCell& cell, double total) {
    return std::min(std::max(total / cell.value(LIGHT) - 1, -1.0), 1.0);
}

// Covariance of the normal: that of the place, through the slopes across the normal. scale: cells for a place, over the vector's length;
// relative: light, see relative_light.
std::array<double, 9> spread(const TableCell& cell, double scale, double relative, const std::array<double, 3>& normal,
                             const std::array<double, 3>& place) {
    double slope[3][2], radial[2] = {0, 0};
    for (int i = 0; i < 3; ++i) {
        slope[i][0] = scale * (cell.slope_x(i) + relative * cell.slope_x(BEND + i));
        slope[i][1] = scale * (cell.slope_y(i) + relative * cell.slope_y(BEND + i));
        for (int axis = 0; axis < 2; ++axis) radial[axis] += normal[i] * slope[i][axis];
    }
    for (int i = 0; i < 3; ++i) {
        for (int axis = 0; axis < 2; ++axis) slope[i][axis] -= normal[i] * radial[axis];
    }
    std::array<double, 9> found;
    for (int i = 0; i < 3; ++i) {
        const double x = slope[i][0] * place[0] + slope[i][1] * place[1], y = slope[i][0] * place[1] + slope[i][1] * place[2];
        for (int j = 0; j < 3; ++j) found[3 * i + j] = x * slope[j][0] + y * slope[j][1];
    }
    return found;
}

// The mean of the samples that tell the contact, and their number; NaN without any.
double mean_of_used(const double* sums, const std::uint8_t* in_contact, const std::uint8_t* saturated, std::ptrdiff_t count,
                    FingerSums& mean, FingerTouch& found) {
    double used = 0;
    mean.fill(0);
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        found.samples += in_contact[k] != 0;
        if (saturated[k]) found.flags = SATURATED;
        if (!in_contact[k] || saturated[k]) continue;
        for (int i = 0; i < 4; ++i) mean[i] += sums[4 * k + i];
        ++used;
    }
    for (double& sum : mean) sum /= used;
    return used;
}

// Adds to the covariance of a place (xx, xy, yy) that of light of the room which is taken off wrongly: it moves the place towards or away
// from the room's centroid.
void add_room(std::array<double, 3>& covariance, Place place, double total, const FingerRules& finger) {
    const Place room = place_of(finger.room.data());
    if (std::isnan(room.x + room.y)) return;
    const double part = finger.room_volts / total, x = part * (room.x - place.x), y = part * (room.y - place.y);
    covariance[0] += x * x;
    covariance[1] += x * y;
    covariance[2] += y * y;
}

// Adds what the place would move by without the light that may be a lamp's.
void add_lamp(std::array<double, 3>& covariance, Place place, const FingerSums& mean, const FingerSums& lamp) {
    FingerSums rest;
    for (int i = 0; i < 4; ++i) rest[i] = mean[i] - lamp[i];
    if (!(rest[TOTAL] > 0)) return;
    const Place without = place_of(rest.data());
    const double x = without.x - place.x, y = without.y - place.y;
    covariance[0] += x * x;
    covariance[1] += x * y;
    covariance[2] += y * y;
}

// Position, normal and covariance: that of the light's noise and of the room's light, and the deviation of the map along the surface.
void place_touch(const TableCell& cell, const FingerSums& mean, double used, Place place, const FingerRules& finger, FingerTouch& found) {
    const double relative = relative_light(cell, mean[TOTAL]), deviation = cell.value(DEVIATION);
    double row[3];
    for (int i = 0; i < 3; ++i) row[i] = cell.value(NORMAL + i) + relative * cell.value(BEND + i);
    const double length = std::sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]), square = finger.radius * finger.radius;
    for (int i = 0; i < 3; ++i) {
        found.normal[i] = row[i] / length;
        found.position[i] = finger.radius * found.normal[i];
    }
    std::array<double, 3> of_place = place_covariance(place.x, place.y, mean[TOTAL], finger.noise, finger.shot);
    for (double& part : of_place) part /= used;
    add_room(of_place, place, mean[TOTAL], finger);
    add_lamp(of_place, place, mean, finger.lamp);
    found.covariance = spread(cell, 0.5 * static_cast<double>(finger.table.nodes - 1) / length, relative, found.normal, of_place);
    for (int k = 0; k < 9; ++k) {
        const double along = (k % 4 == 0) - found.normal[k / 3] * found.normal[k % 3];
        found.covariance[k] = square * (found.covariance[k] + deviation * deviation * along);
    }
}

// Load, N or m, of light, V, at a place whose part of the logarithm is known (response.features); NaN where not calibrated.
double load(const double* terms, double at_place, Place place, double light) {
    const double log = std::log(std::max(light, DARK)), square = place.x * place.x + place.y * place.y;
    const double whole = at_place + (terms[1] + terms[7] * square + terms[2] * log) * log;
    return std::isnan(whole) ? NOTHING : std::exp(std::min(whole, LARGEST_LOG));
}

}  // namespace

FingerSamples finger_samples(const double* volts, std::ptrdiff_t count, const FingerLimits& limits, const PlaceTable& table) {
    constexpr double FAR = std::numeric_limits<double>::infinity();
    FingerSamples found;
    found.sums.resize(4 * count);
    found.place.assign(2 * count, NOTHING);
    found.over.assign(count, -FAR);
    found.saturated.assign(count, 0);
    found.lowest = found.least_over = FAR;
    found.highest = -FAR;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        const double *given = volts + 4 * k, *rest = limits.offset.data();
        const double net[4] = {given[0] - rest[0], given[1] - rest[1], given[2] - rest[2], given[3] - rest[3]};
        double* sums = &found.sums[4 * k];
        mix(net, sums);
        for (int i = 0; i < 4; ++i) found.saturated[k] |= given[i] >= limits.saturation;
        found.known += std::isfinite(given[0]) && std::isfinite(given[1]) && std::isfinite(given[2]) && std::isfinite(given[3]);
        const Place place = place_of(sums);
        if (sums[TOTAL] > limits.lit && !std::isnan(place.x + place.y)) {
            found.place[2 * k] = place.x;
            found.place[2 * k + 1] = place.y;
            found.over[k] = sums[TOTAL] - std::max(limits.least, TableCell(table, place).value(limits.level));
        }
        found.lowest = std::min(found.lowest, sums[TOTAL]);
        found.highest = std::max(found.highest, sums[TOTAL]);
        found.least_over = std::min(found.least_over, found.over[k]);
    }
    return found;
}

void count_repeats(const double* volts, std::ptrdiff_t count, double saturation, double* last, double* same) {
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        for (int i = 0; i < 4; ++i) {
            const double now = volts[4 * k + i];
            same[i] = now < saturation ? (now == last[i] ? same[i] + 1 : 1) : 0;
            last[i] = now;
        }
    }
}

FingerTouch finger_touch(const double* sums, const std::uint8_t* in_contact, const std::uint8_t* saturated, std::ptrdiff_t count,
                         const FingerRules& finger) {
    FingerTouch found;
    FingerSums mean;
    const double used = mean_of_used(sums, in_contact, saturated, count, mean, found);
    const Place place = place_of(mean.data());
    found.position.fill(NOTHING);
    found.normal.fill(NOTHING);
    found.covariance.fill(NOTHING);
    found.force = found.depth = NOTHING;
    if (finger.stuck && used > 0) found.flags |= AMBIGUOUS;
    if (finger.stuck || !(mean[TOTAL] > 0) || std::isnan(place.x + place.y)) return found;
    const TableCell cell(finger.table, place);
    place_touch(cell, mean, used, place, finger, found);
    if (cell.value(INSIDE) < 0.5 || std::max(std::abs(place.x), std::abs(place.y)) >= 1) found.flags |= OUT_OF_RANGE;
    const double apart = mean[CROSS] - cell.value(CROSS_PART) * mean[TOTAL];
    if (std::abs(apart) > CROSS_LIMIT * std::hypot(std::sqrt(finger.noise[4 * CROSS + CROSS] / used), finger.cross_volts))
        found.flags |= AMBIGUOUS;
    found.force = load(finger.loads, cell.value(FORCE), place, mean[TOTAL]);
    found.depth = load(finger.loads + LOAD_TERMS, cell.value(DEPTH), place, mean[TOTAL]);
    return found;
}

std::vector<double> place_values(const double* places, std::ptrdiff_t count, const PlaceTable& table) {
    std::vector<double> found(count * table.channels, NOTHING);
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        const Place place{places[2 * k], places[2 * k + 1]};
        if (!std::isfinite(place.x) || !std::isfinite(place.y)) continue;
        const TableCell cell(table, place);
        for (std::ptrdiff_t channel = 0; channel < table.channels; ++channel) found[k * table.channels + channel] = cell.value(channel);
    }
    return found;
}

std::array<double, 3> place_covariance(double x, double y, double total, const double* noise, double shot) {
    const double xx = noise[0], xy = noise[1], xt = noise[2], yy = noise[5], yt = noise[6], tt = noise[10], square = total * total;
    return {(xx - 2 * x * xt + x * x * tt + shot * total * (1 - x * x)) / square, (xy - x * yt - y * xt + x * y * tt) / square,
            (yy - 2 * y * yt + y * y * tt + shot * total * (1 - y * y)) / square};
}

}  // namespace tactile
