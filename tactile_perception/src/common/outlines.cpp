// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/outlines.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {
namespace {

enum Edge : std::int8_t { NONE = -1, TOP, RIGHT, BOTTOM, LEFT };
struct Segment {
    Edge from, to;
};
// Segment of a cell by which corners are inside (1 top left, 2 top right, 4 bottom left, 8 bottom right), so that outlines turn from
// +column to +row. Cells with two diagonal corners (9, 6) have two: see SADDLES.
constexpr Segment SEGMENTS[16] = {{NONE, NONE},  {TOP, LEFT},     {RIGHT, TOP},    {RIGHT, LEFT}, {LEFT, BOTTOM}, {TOP, BOTTOM},
                                  {NONE, NONE},  {RIGHT, BOTTOM}, {BOTTOM, RIGHT}, {NONE, NONE},  {BOTTOM, TOP},  {BOTTOM, LEFT},
                                  {LEFT, RIGHT}, {TOP, RIGHT},    {LEFT, TOP},     {NONE, NONE}};
// Codes of the two segments of a saddle: where its middle is outside, then inside.
constexpr int SADDLE_9[2][2] = {{1, 8}, {11, 13}}, SADDLE_6[2][2] = {{2, 4}, {7, 14}};

using Loop = std::vector<double>;  // (M, 2)

class Contours {
 public:
    Contours(const double* field, std::ptrdiff_t rows, std::ptrdiff_t columns, double level)
        : field_(field), rows_(rows), columns_(columns), level_(level), next_(2 * rows * columns, -1) {
        for (std::ptrdiff_t row = 0; row + 1 < rows; ++row) {
            for (std::ptrdiff_t column = 0; column + 1 < columns; ++column) add_cell(row, column);
        }
    }

    std::vector<Loop> trace() {
        std::vector<Loop> loops;
        for (std::size_t first = 0; first < next_.size(); ++first) {
            if (next_[first] < 0) continue;
            Loop loop;
            for (std::ptrdiff_t edge = static_cast<std::ptrdiff_t>(first); next_[edge] >= 0;) {
                add_crossing(edge, loop);
                const std::ptrdiff_t after = next_[edge];
                next_[edge] = -1;
                edge = after;
            }
            loops.push_back(std::move(loop));
        }
        return loops;
    }

 private:
    bool above(std::ptrdiff_t row, std::ptrdiff_t column) const {
        return row > 0 && column > 0 && row + 1 < rows_ && column + 1 < columns_ && field_[row * columns_ + column] > level_;
    }

    // Edge 2 n leaves node n along its row, edge 2 n + 1 along its column.
    std::ptrdiff_t number(std::ptrdiff_t node, Edge edge) const {
        const std::ptrdiff_t step[4] = {0, 3, 2 * columns_, 1};
        return 2 * node + step[edge];
    }

    void add_segment(std::ptrdiff_t node, int code) { next_[number(node, SEGMENTS[code].from)] = number(node, SEGMENTS[code].to); }

    void add_cell(std::ptrdiff_t row, std::ptrdiff_t column) {
        const std::ptrdiff_t node = row * columns_ + column;
        const int code = above(row, column) + 2 * above(row, column + 1) + 4 * above(row + 1, column) + 8 * above(row + 1, column + 1);
        if (code == 6 || code == 9) {
            const double* here = field_ + node;
            const bool inside = (here[0] + here[1] + here[columns_] + here[columns_ + 1]) / 4 > level_;
            for (const int part : (code == 9 ? SADDLE_9 : SADDLE_6)[inside]) add_segment(node, part);
        } else if (SEGMENTS[code].from != NONE) {
            add_segment(node, code);
        }
    }

    void add_crossing(std::ptrdiff_t edge, Loop& loop) const {
        const std::ptrdiff_t node = edge / 2, other = edge % 2 == 0 ? node + 1 : node + columns_;
        const double share = (level_ - field_[node]) / (field_[other] - field_[node]);
        const double along = share >= 0 ? std::min(share, 1.0) : 0.0;  // also where a node is not finite
        loop.push_back(static_cast<double>(node / columns_) + (edge % 2 == 0 ? 0 : along));
        loop.push_back(static_cast<double>(node % columns_) + (edge % 2 == 0 ? along : 0));
    }

    const double* field_;
    std::ptrdiff_t rows_, columns_;
    double level_;
    std::vector<std::ptrdiff_t> next_;
};

// Positive where the loop turns from +column to +row.
double signed_area(const Loop& loop) {
    double sum = 0;
    const double row = loop[0], column = loop[1];
    for (std::size_t i = 0; i + 3 < loop.size(); i += 2) {
        sum += (loop[i + 1] - column) * (loop[i + 2] - row) - (loop[i + 3] - column) * (loop[i] - row);
    }
    return sum / 2;
}

// Whether the loop encloses a point: an odd number of its sides are crossed along the row.
bool encloses(const Loop& loop, double row, double column) {
    bool inside = false;
    for (std::size_t i = 0, j = loop.size() - 2; i < loop.size(); j = i, i += 2) {
        if ((loop[i] > row) == (loop[j] > row)) continue;
        inside ^= column < loop[i + 1] + (row - loop[i]) / (loop[j] - loop[i]) * (loop[j + 1] - loop[i + 1]);
    }
    return inside;
}

void append(Loops& all, const Loop& loop, std::int64_t region) {
    all.vertices.insert(all.vertices.end(), loop.begin(), loop.end());
    all.start.push_back(static_cast<std::int64_t>(all.vertices.size() / 2));
    all.region.push_back(region);
}

Loops grouped(const std::vector<Loop>& loops) {
    std::vector<double> area;
    std::vector<std::size_t> outer;
    for (const Loop& loop : loops) area.push_back(signed_area(loop));
    for (std::size_t k = 0; k < loops.size(); ++k) {
        if (area[k] > 0) outer.push_back(k);
    }
    std::stable_sort(outer.begin(), outer.end(), [&](std::size_t a, std::size_t b) { return area[a] > area[b]; });
    std::vector<std::size_t> around(loops.size(), loops.size());  // of each hole: the smallest loop that encloses it
    for (std::size_t hole = 0; hole < loops.size(); ++hole) {
        if (!(area[hole] < 0)) continue;
        for (const std::size_t k : outer) {
            if (area[k] > -area[hole] && encloses(loops[k], loops[hole][0], loops[hole][1])) around[hole] = k;
        }
    }
    Loops all;
    for (std::size_t region = 0; region < outer.size(); ++region) {
        append(all, loops[outer[region]], static_cast<std::int64_t>(region));
        for (std::size_t hole = 0; hole < loops.size(); ++hole) {
            if (around[hole] == outer[region]) append(all, loops[hole], static_cast<std::int64_t>(region));
        }
    }
    return all;
}

}  // namespace

Loops find_contours(const double* field, std::ptrdiff_t rows, std::ptrdiff_t columns, double level) {
    return grouped(Contours(field, rows, columns, level).trace());
}

Loops find_outlines(const Array<double>& score, double level, std::ptrdiff_t refine) {
    const std::ptrdiff_t rows = score.length(0), columns = score.length(1);
    std::ptrdiff_t top = rows, bottom = -1, left = columns, right = -1;  // of what is above level
    for (std::ptrdiff_t k = 0; k < rows * columns; ++k) {
        if (!(score[k] > level)) continue;
        top = std::min(top, k / columns), bottom = std::max(bottom, k / columns);
        left = std::min(left, k % columns), right = std::max(right, k % columns);
    }
    if (bottom < 0) return {};
    // That part with a margin of two nodes, of which the outer one, as all nodes off the grid, is 0.
    const std::ptrdiff_t height = bottom - top + 5, width = right - left + 5;
    std::vector<double> part(height * width);
    for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(top - 1, 0); r <= std::min(bottom + 1, rows - 1); ++r) {
        for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(left - 1, 0); c <= std::min(right + 1, columns - 1); ++c) {
            const double value = score[r * columns + c];
            part[(r - top + 2) * width + c - left + 2] = value > 0 ? std::min(value, 1.0) : 0.0;
        }
    }
    const std::vector<double> fine = refined_field(part, height, width, refine);
    Loops loops = find_contours(fine.data(), (height - 1) * refine + 1, (width - 1) * refine + 1, level);
    for (std::size_t i = 0; i < loops.vertices.size(); ++i) {
        loops.vertices[i] = loops.vertices[i] / static_cast<double>(refine) + static_cast<double>((i % 2 == 0 ? top : left) - 2);
    }
    return loops;
}

std::vector<double> points_of(const Loops& loops, const Nodes& wide, std::ptrdiff_t refine) {
    std::vector<double> points(loops.vertices.size() / 2 * 3);
    const auto fine = static_cast<double>(refine);
    for (std::size_t i = 0; i < loops.vertices.size() / 2; ++i) {
        add_along_line(wide, (loops.vertices[2 * i] + BEYOND) * fine, (loops.vertices[2 * i + 1] + BEYOND) * fine, refine, 1,
                       &points[3 * i]);
    }
    return points;
}

}  // namespace tactile
