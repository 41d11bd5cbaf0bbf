// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/links.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/median.hpp"

namespace tactile {
namespace {

// Pairs of near image positions: each position is compared with those in its cell of a grid and in the eight cells around it.

constexpr double MOST_CELLS = 1 << 20;  // bounds the memory. Chosen

// A grid of square cells over the positions; each cell heads a linked list of the positions put into it.
class Cells {
 public:
    Cells(const double* places, std::ptrdiff_t count, double side) : cell_(count, -1), next_(count, -1) {
        double low[2] = {0, 0}, high[2] = {0, 0};
        bool any = false;
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            for (int axis = 0; axis < 2; ++axis) {
                low[axis] = any ? std::min(low[axis], places[2 * i + axis]) : places[2 * i + axis];
                high[axis] = any ? std::max(high[axis], places[2 * i + axis]) : places[2 * i + axis];
            }
            any = true;
        }
        side = std::max(side, std::sqrt((high[0] - low[0] + side) * (high[1] - low[1] + side) / MOST_CELLS));
        columns_ = static_cast<std::ptrdiff_t>((high[0] - low[0]) / side) + 3;  // a margin, so that each cell has eight neighbours
        first_.assign(columns_ * (static_cast<std::ptrdiff_t>((high[1] - low[1]) / side) + 3), -1);
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            const auto column = static_cast<std::ptrdiff_t>((places[2 * i] - low[0]) / side);
            cell_[i] = (static_cast<std::ptrdiff_t>((places[2 * i + 1] - low[1]) / side) + 1) * columns_ + column + 1;
        }
    }

    void put(std::int32_t i) {
        next_[i] = first_[cell_[i]];
        first_[cell_[i]] = i;
    }

    // Calls call(j) for each position j that was put into the cell of position i or into one of its eight neighbours.
    template <class Call>
    void around(std::ptrdiff_t i, Call call) const {
        for (const std::ptrdiff_t row : {-columns_, std::ptrdiff_t{0}, columns_}) {
            for (std::ptrdiff_t column = -1; column <= 1; ++column) {
                for (std::int32_t j = first_[cell_[i] + row + column]; j >= 0; j = next_[j]) call(j);
            }
        }
    }

 private:
    std::ptrdiff_t columns_;
    std::vector<std::ptrdiff_t> cell_;
    std::vector<std::int32_t> next_, first_;
};

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

// Median distance to the nearest other one of places (u, v, u, v, ...), 0 for fewer than two.
double spacing(const std::vector<double>& places) {
    std::vector<double> nearest;
    for (std::size_t i = 0; i < places.size(); i += 2) {
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t j = 0; j < places.size(); j += 2) {
            const double across = places[i] - places[j], down = places[i + 1] - places[j + 1];
            if (j != i) least = std::min(least, across * across + down * down);
        }
        nearest.push_back(least);
    }
    return places.size() > 2 ? std::sqrt(median(std::move(nearest))) : 0;
}

}  // namespace

std::vector<std::pair<std::int32_t, std::int32_t>> near_pairs(const double* places, std::ptrdiff_t count, double reach) {
    std::vector<std::pair<std::int32_t, std::int32_t>> found;
    found.reserve(8 * count);
    Cells cells(places, count, reach);
    for (std::int32_t i = 0; i < count; ++i) {
        std::int32_t near[MOST_NEIGHBOURS + 1];  // listed without a branch that would be mispredicted
        std::size_t met = 0;
        cells.around(i, [&](std::int32_t j) {
            near[met] = j;
            met += (std::abs(places[2 * i] - places[2 * j]) < reach) & (std::abs(places[2 * i + 1] - places[2 * j + 1]) < reach) &
                   (met < MOST_NEIGHBOURS);
        });
        for (std::size_t n = 0; n < met; ++n) found.emplace_back(near[n], i);
        cells.put(i);
    }
    return found;
}

// Jonker and Volgenant, A shortest augmenting path algorithm for dense and sparse linear assignment problems, 1987.
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
    const double never = std::numeric_limits<double>::infinity();
    std::vector<double> of_place(place_count, never), of_dot(dot_count, never);
    std::vector<std::ptrdiff_t> dot_of(place_count, NONE), place_of(dot_count, NONE);
    for (const auto& [place, dot] : near_links(places, place_count, dots, dot_count, gate)) {
        const double across = places[2 * place] - dots[2 * dot], down = places[2 * place + 1] - dots[2 * dot + 1];
        const double square = across * across + down * down;
        if (square < of_place[place]) of_place[place] = square, dot_of[place] = dot;
        if (square < of_dot[dot]) of_dot[dot] = square, place_of[dot] = place;
    }
    std::vector<Link> found;
    for (std::ptrdiff_t place = 0; place < place_count; ++place) {
        if (dot_of[place] != NONE && place_of[dot_of[place]] == place) found.emplace_back(place, dot_of[place]);
    }
    return found;
}

Linker::Linker(double gate, std::int64_t confirm, double keep_s) : gate_(gate), confirm_(confirm), keep_s_(keep_s) {}

std::vector<std::int64_t> Linker::update(const double* places, std::ptrdiff_t count, double stamp_s) {
    const bool first = tracks_.empty();
    std::vector<std::int64_t> id(count, -1);
    std::vector<std::uint8_t> taken(count, 0), missed(tracks_.size(), 1);
    for (const auto& [k, dot] : best_links(places, count, stamp_s)) {
        Track& track = tracks_[k];
        follow(track, {places[2 * dot], places[2 * dot + 1]}, stamp_s);
        taken[dot] = 1, missed[k] = 0;
        if (track.state == State::TRACKED) id[dot] = track.id;
    }
    std::vector<Track> kept;
    for (std::size_t k = 0; k < tracks_.size(); ++k) {
        Track& track = tracks_[k];
        if (missed[k] && track.state == State::NEW) continue;  // dropped at the first miss
        if (missed[k]) track.state = State::LOST;
        if (track.state != State::LOST || stamp_s - track.seen_s <= keep_s_) kept.push_back(track);
    }
    const std::int64_t seen = first ? confirm_ : 1;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (taken[i]) continue;
        const Eigen::Vector2d uv(places[2 * i], places[2 * i + 1]);
        const State state = seen >= confirm_ ? State::TRACKED : State::NEW;
        if (state == State::TRACKED) id[i] = next_id_;
        kept.push_back({next_id_++, uv, uv, Eigen::Vector2d::Zero(), seen, stamp_s, state});
    }
    tracks_ = std::move(kept);
    return id;
}

// By the best of three predictions: constant velocity, last and first positions. The first positions cover a press that ends between two
// frames.
std::vector<Link> Linker::best_links(const double* places, std::ptrdiff_t count, double stamp_s) const {
    const auto known = static_cast<std::ptrdiff_t>(tracks_.size());
    std::vector<double> expected[3];
    for (const Track& track : tracks_) {
        const double ahead = track.state == State::LOST ? 0 : std::min(stamp_s - track.seen_s, keep_s_);
        const Eigen::Vector2d moved = track.uv + track.velocity * ahead, *uv[] = {&moved, &track.uv, &track.first};
        for (int k = 0; k < 3; ++k) expected[k].insert(expected[k].end(), {uv[k]->x(), uv[k]->y()});
    }
    const double gate = gate_ * spacing(expected[1]);
    std::vector<Link> best;
    double least = std::numeric_limits<double>::infinity();
    for (const std::vector<double>& from : expected) {
        std::vector<Link> links = link_places(from.data(), known, places, count, gate);
        double cost = -static_cast<double>(links.size()) * gate * gate;
        for (const auto& [k, dot] : links) {
            cost += std::pow(from[2 * k] - places[2 * dot], 2) + std::pow(from[2 * k + 1] - places[2 * dot + 1], 2);
        }
        if (cost < least) least = cost, best = std::move(links);
    }
    return best;
}

void Linker::follow(Track& track, const Eigen::Vector2d& uv, double stamp_s) const {
    const double elapsed = stamp_s - track.seen_s;
    const bool steady = track.state != State::LOST && elapsed > 0;
    track.velocity = steady ? Eigen::Vector2d((uv - track.uv) / elapsed) : Eigen::Vector2d::Zero();
    track.uv = uv;
    track.seen_s = stamp_s;
    track.state = ++track.seen >= confirm_ ? State::TRACKED : State::NEW;
}

}  // namespace tactile
