// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Functions of the place of light on a PSD, tabulated on a square grid over -1 to 1 half widths and bilinear between its nodes.
#pragma once

#include <algorithm>
#include <cstddef>

namespace tactile {

struct PlaceTable {
    const double* values;     // (nodes, nodes, channels), rows along y
    std::ptrdiff_t nodes;     // along each axis, 2 or more
    std::ptrdiff_t channels;  // the first three are the normal
};

// The channels of a finger's table, in the order of tactile_perception/psd/model.py.
enum FingerChannel : std::ptrdiff_t { NORMAL, DEVIATION = 3, INSIDE, LEVEL, CROSS_PART, FORCE, DEPTH, LIGHT, BEND, FINGER_CHANNELS = 13 };

struct Place {
    double x, y;  // half widths
};

// The cell of a table that holds a place: its lower node, and the place within it, 0 to 1. The place is clipped to the square and not NaN.
struct TableCell {
    const double* node;
    std::ptrdiff_t right, up;  // steps to the neighbouring nodes
    double s, t;

    TableCell(const PlaceTable& table, Place at) : right(table.channels), up(table.channels * table.nodes) {
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

}  // namespace tactile
