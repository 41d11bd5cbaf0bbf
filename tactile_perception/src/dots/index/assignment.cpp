// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Linear assignment by shortest augmenting paths (Jonker and Volgenant, A shortest augmenting path algorithm for dense and sparse linear
// assignment problems, 1987). Places and dots that are near each other form groups, each assigned by itself.
#include "dots/index/assignment.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace tactile {
namespace {

constexpr std::ptrdiff_t NONE = -1;

// Pairs (place, dot) closer than gate, sorted by place.
std::vector<Link> near_links(const double* places, std::ptrdiff_t place_count, const double* dots, std::ptrdiff_t dot_count, double gate) {
    std::vector<std::ptrdiff_t> order(dot_count);
    std::iota(order.begin(), order.end(), std::ptrdiff_t{0});
    std::sort(order.begin(), order.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return dots[2 * a] < dots[2 * b]; });
    std::vector<Link> found;
    for (std::ptrdiff_t i = 0; i < place_count; ++i) {
        const double u = places[2 * i], v = places[2 * i + 1];
        auto at = std::lower_bound(order.begin(), order.end(), u - gate, [&](std::ptrdiff_t a, double left) { return dots[2 * a] < left; });
        for (; at != order.end() && dots[2 * *at] <= u + gate; ++at) {
            const double across = dots[2 * *at] - u, down = dots[2 * *at + 1] - v;
            if (across * across + down * down < gate * gate) found.emplace_back(i, *at);
        }
    }
    return found;
}

// Group of each place, then of each dot: those that near pairs connect, directly or by others, have the same number.
std::vector<std::ptrdiff_t> groups(const std::vector<Link>& near, std::ptrdiff_t place_count, std::ptrdiff_t dot_count) {
    std::vector<std::ptrdiff_t> parent(place_count + dot_count);
    std::iota(parent.begin(), parent.end(), std::ptrdiff_t{0});
    const auto root = [&](std::ptrdiff_t at) {
        while (parent[at] != at) at = parent[at] = parent[parent[at]];
        return at;
    };
    for (const auto& [place, dot] : near) parent[root(place)] = root(place_count + dot);
    for (std::ptrdiff_t at = 0; at < place_count + dot_count; ++at) parent[at] = root(at);
    return parent;
}

// Appends the links of one group of near pairs to found.
void link_group(const std::vector<Link>& near, const double* places, const double* dots, double gate, std::vector<Link>& found) {
    if (near.size() == 1) return found.push_back(near[0]);
    std::vector<std::ptrdiff_t> rows, columns;
    for (const auto& [place, dot] : near) rows.push_back(place), columns.push_back(dot);
    for (std::vector<std::ptrdiff_t>* side : {&rows, &columns}) {
        std::sort(side->begin(), side->end());
        side->erase(std::unique(side->begin(), side->end()), side->end());
    }
    const auto index = [](const std::vector<std::ptrdiff_t>& side, std::ptrdiff_t value) {
        return std::lower_bound(side.begin(), side.end(), value) - side.begin();
    };
    const bool turned = rows.size() > columns.size();
    const auto height = static_cast<std::ptrdiff_t>(std::min(rows.size(), columns.size()));
    const auto width = static_cast<std::ptrdiff_t>(std::max(rows.size(), columns.size()));
    std::vector<double> cost(height * width, gate * gate);
    for (const auto& [place, dot] : near) {
        const std::ptrdiff_t r = index(rows, place), c = index(columns, dot);
        const double across = places[2 * place] - dots[2 * dot], down = places[2 * place + 1] - dots[2 * dot + 1];
        cost[turned ? c * width + r : r * width + c] = across * across + down * down;
    }
    const std::vector<std::ptrdiff_t> column = assign_least(cost, height, width);
    for (std::ptrdiff_t k = 0; k < height; ++k) {
        if (!(cost[k * width + column[k]] < gate * gate)) continue;
        found.emplace_back(rows[turned ? column[k] : k], columns[turned ? k : column[k]]);
    }
}

}  // namespace

std::vector<std::ptrdiff_t> assign_least(const std::vector<double>& cost, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    const double never = std::numeric_limits<double>::infinity();
    std::vector<double> row_price(rows, 0.0), column_price(columns, 0.0), least(columns);
    std::vector<std::ptrdiff_t> row_of(columns, NONE), column_of(rows, NONE), from(columns);
    std::vector<char> done(columns);
    for (std::ptrdiff_t start = 0; start < rows; ++start) {
        std::fill(least.begin(), least.end(), never);
        std::fill(done.begin(), done.end(), 0);
        std::ptrdiff_t row = start, last = NONE;  // the path's end: a row, and the column that it has
        while (true) {
            std::ptrdiff_t next = NONE;
            for (std::ptrdiff_t c = 0; c < columns; ++c) {
                if (done[c]) continue;
                const double reduced = cost[row * columns + c] - row_price[row] - column_price[c];
                if (reduced < least[c]) least[c] = reduced, from[c] = last;
                if (next == NONE || least[c] < least[next]) next = c;
            }
            const double step = least[next];
            row_price[start] += step;
            for (std::ptrdiff_t c = 0; c < columns; ++c) {
                if (done[c]) {
                    row_price[row_of[c]] += step;
                    column_price[c] -= step;
                } else {
                    least[c] -= step;
                }
            }
            done[next] = 1;
            last = next;
            if (row_of[next] == NONE) break;
            row = row_of[next];
        }
        while (last != NONE) {  // along the path back, each column takes the row of the one before
            const std::ptrdiff_t before = from[last];
            row_of[last] = before == NONE ? start : row_of[before];
            column_of[row_of[last]] = last;
            last = before;
        }
    }
    return column_of;
}

std::vector<Link> link_places(const double* places, std::ptrdiff_t place_count, const double* dots, std::ptrdiff_t dot_count, double gate) {
    std::vector<Link> near = near_links(places, place_count, dots, dot_count, gate), found;
    const std::vector<std::ptrdiff_t> group = groups(near, place_count, dot_count);
    std::stable_sort(near.begin(), near.end(), [&](const Link& a, const Link& b) { return group[a.first] < group[b.first]; });
    for (std::size_t k = 0; k < near.size();) {
        std::size_t end = k;
        while (end < near.size() && group[near[end].first] == group[near[k].first]) ++end;
        link_group({near.begin() + static_cast<std::ptrdiff_t>(k), near.begin() + static_cast<std::ptrdiff_t>(end)}, places, dots, gate,
                   found);
        k = end;
    }
    std::sort(found.begin(), found.end());
    return found;
}

}  // namespace tactile
