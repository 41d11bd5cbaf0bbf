// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactile {
namespace {

constexpr double NOTHING = std::numeric_limits<double>::quiet_NaN();
enum Sum { X, Y, TOTAL, CROSS };

struct Place {
    double x, y;
};

// Eq 1 without its offset, clipped to the detector: noise takes weak light beyond it.
Place place_of(const double* sums) {
    const auto along = [&](Sum axis) { return std::min(std::max(sums[axis] / sums[TOTAL], -1.0), 1.0); };
    return {along(X), along(Y)};
}

// The cell that holds a place: its lower node, and the place within it, 0 to 1.
struct Cell {
    const double* node;
    std::ptrdiff_t right, up;  // steps to the neighbouring nodes
    double s, t;

    Cell(const PlaceTable& table, Place at) : right(table.channels), up(table.channels * table.nodes) {
        const std::ptrdiff_t column = locate(at.x, table.nodes, s), row = locate(at.y, table.nodes, t);
        node = table.values + row * up + column * right;
    }

    double value(std::ptrdiff_t channel) const { return (1 - t) * along_x(channel, 0) + t * along_x(channel, up); }
    // Slopes along x and y, per cell.
    double slope_x(std::ptrdiff_t k) const { return (1 - t) * (node[right + k] - node[k]) + t * (node[up + right + k] - node[up + k]); }
    double slope_y(std::ptrdiff_t channel) const { return along_x(channel, up) - along_x(channel, 0); }

 private:
    double along_x(std::ptrdiff_t channel, std::ptrdiff_t row) const {
        return (1 - s) * node[row + channel] + s * node[row + right + channel];
    }

    static std::ptrdiff_t locate(double at, std::ptrdiff_t nodes, double& within) {
        const double scaled = std::min(std::max(0.5 * (at + 1) * static_cast<double>(nodes - 1), 0.0), static_cast<double>(nodes - 1));
        const std::ptrdiff_t cell = std::min(static_cast<std::ptrdiff_t>(scaled), nodes - 2);
        within = scaled - static_cast<double>(cell);
        return cell;
    }
};

// Covariance of the normal: that of the place, through the slopes across the normal. scale: cells for a place, over the vector's length.
std::array<double, 9> spread(const Cell& cell, double scale, const std::array<double, 3>& normal,
                             const std::array<double, 3>& place) {
    double slope[3][2], radial[2] = {0, 0};
    for (int i = 0; i < 3; ++i) {
        slope[i][0] = scale * cell.slope_x(i);
        slope[i][1] = scale * cell.slope_y(i);
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
        const double x1 = given[0] - rest[0], y1 = given[1] - rest[1], x2 = given[2] - rest[2], y2 = given[3] - rest[3];
        double* sums = &found.sums[4 * k];
        sums[X] = (y1 + x2) - (x1 + y2);
        sums[Y] = (x2 + y2) - (x1 + y1);
        sums[TOTAL] = (x1 + y1) + (x2 + y2);
        sums[CROSS] = (x1 + x2) - (y1 + y2);
        for (int i = 0; i < 4; ++i) found.saturated[k] |= given[i] >= limits.saturation;
        found.known += std::isfinite(given[0]) && std::isfinite(given[1]) && std::isfinite(given[2]) && std::isfinite(given[3]);
        const Place place = place_of(sums);
        if (sums[TOTAL] > limits.lit && !std::isnan(place.x + place.y)) {
            found.place[2 * k] = place.x;
            found.place[2 * k + 1] = place.y;
            found.over[k] = sums[TOTAL] - std::max(limits.least, Cell(table, place).value(limits.level));
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

FingerContact finger_contact(const double* sums, const std::uint8_t* used, std::ptrdiff_t count, const PlaceTable& table,
                             const double* noise, double shot) {
    FingerContact found;
    found.sums.fill(0);
    std::ptrdiff_t chosen = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        if (!used[k]) continue;
        for (int i = 0; i < 4; ++i) found.sums[i] += sums[4 * k + i];
        ++chosen;
    }
    for (double& sum : found.sums) sum /= static_cast<double>(chosen);
    const Place place = place_of(found.sums.data());
    found.place = {place.x, place.y};
    found.normal.fill(NOTHING);
    found.covariance.fill(NOTHING);
    found.row.assign(table.channels, NOTHING);
    if (!(found.sums[TOTAL] > 0) || std::isnan(place.x + place.y)) {
        found.place.fill(NOTHING);
        return found;
    }
    const Cell cell(table, place);
    for (std::ptrdiff_t channel = 0; channel < table.channels; ++channel) found.row[channel] = cell.value(channel);
    const double length = std::sqrt(found.row[0] * found.row[0] + found.row[1] * found.row[1] + found.row[2] * found.row[2]);
    for (int i = 0; i < 3; ++i) found.normal[i] = found.row[i] / length;
    std::array<double, 3> of_place = place_covariance(place.x, place.y, found.sums[TOTAL], noise, shot);
    for (double& part : of_place) part /= static_cast<double>(chosen);
    found.covariance = spread(cell, 0.5 * static_cast<double>(table.nodes - 1) / length, found.normal, of_place);
    return found;
}

std::vector<double> place_values(const double* places, std::ptrdiff_t count, const PlaceTable& table) {
    std::vector<double> found(count * table.channels, NOTHING);
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        const Place place{places[2 * k], places[2 * k + 1]};
        if (!std::isfinite(place.x) || !std::isfinite(place.y)) continue;
        const Cell cell(table, place);
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
