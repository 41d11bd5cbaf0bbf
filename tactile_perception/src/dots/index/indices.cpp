// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Propagates row and column indices along links between neighbours: breadth-first over links that are a side of a closed cell, a
// quadrilateral of four dots whose four links agree.
#include <algorithm>
#include <iterator>
#include <limits>

#include "dots/index/lattice.hpp"

namespace tactile {
namespace {

using Links = std::vector<std::int32_t>;

constexpr int WAYS = 4;                // right, below, left, above
constexpr std::ptrdiff_t BRIDGES = 2;  // links that connect two parts of a grid without a closed cell between them. Chosen: one may err
constexpr std::ptrdiff_t NEVER = std::numeric_limits<std::ptrdiff_t>::min();  // number of links of a part whose links disagree
constexpr int OUTWARDS = 3;  // steps from closed cells along links. Chosen: round a dot that is lost beside another
constexpr std::int64_t ROW_STEP[WAYS] = {0, 1, 0, -1}, COLUMN_STEP[WAYS] = {1, 0, -1, 0};

struct Neighbours {
    Links to[WAYS];

    Neighbours(const Links& right, const Links& below) {
        to[0] = right;
        to[1] = below;
        for (int way = 0; way < 2; ++way) {
            to[way + 2].assign(right.size(), -1);
            for (std::size_t i = 0; i < right.size(); ++i) {
                if (to[way][i] >= 0) to[way + 2][to[way][i]] = static_cast<std::int32_t>(i);
            }
        }
    }

    // The links that are a side of a closed cell: right then below leads to the same dot as below then right.
    Neighbours sound() const {
        const Links &right = to[0], &below = to[1];
        Links sides[2] = {Links(right.size(), -1), Links(right.size(), -1)};
        for (std::size_t i = 0; i < right.size(); ++i) {
            if (right[i] < 0 || below[i] < 0) continue;
            const std::int32_t corner = below[right[i]];
            if (corner < 0 || corner != right[below[i]]) continue;
            sides[0][i] = right[i];
            sides[0][below[i]] = corner;
            sides[1][i] = below[i];
            sides[1][right[i]] = corner;
        }
        return {sides[0], sides[1]};
    }
};

struct Place {
    std::int64_t row, column;
    bool operator==(const Place& other) const { return row == other.row && column == other.column; }
};

std::uint64_t key(const Indices& found, std::size_t i) {
    return (static_cast<std::uint64_t>(found.row[i]) << 32) ^ (static_cast<std::uint64_t>(found.column[i]) & 0xffffffffu);
}

// The largest connected component of the links becomes members; indices are relative to each component's first dot, whose number (count) is
// returned for each dot.
std::vector<std::int32_t> spread(const Neighbours& links, Indices& found) {
    const std::size_t count = found.row.size();
    std::vector<std::int32_t> group(count, -1), members, largest;
    for (std::size_t start = 0; start < count; ++start) {
        if (group[start] >= 0) continue;
        members.assign(1, static_cast<std::int32_t>(start));
        group[start] = static_cast<std::int32_t>(start);
        for (std::size_t next = 0; next < members.size(); ++next) {
            const std::int32_t i = members[next];
            for (int way = 0; way < WAYS; ++way) {
                const std::int32_t j = links.to[way][i];
                if (j < 0 || group[j] >= 0) continue;
                group[j] = static_cast<std::int32_t>(start);
                found.row[j] = found.row[i] + ROW_STEP[way];
                found.column[j] = found.column[i] + COLUMN_STEP[way];
                members.push_back(j);
            }
        }
        if (members.size() > largest.size()) largest.swap(members);
    }
    for (const std::int32_t i : largest) found.member[i] = 1;
    return group;
}

// Number of members whose row and column another member has too.
std::ptrdiff_t doubles(const Indices& found) {
    std::vector<std::uint64_t> taken;
    taken.reserve(found.row.size());
    for (std::size_t i = 0; i < found.row.size(); ++i) {
        if (found.member[i]) taken.push_back(key(found, i));
    }
    std::sort(taken.begin(), taken.end());
    return std::distance(std::unique(taken.begin(), taken.end()), taken.end());
}

std::ptrdiff_t contradictions(const Neighbours& links, const Indices& found) {
    std::ptrdiff_t wrong = doubles(found);
    for (int way = 0; way < 2; ++way) {
        for (std::size_t i = 0; i < found.row.size(); ++i) {
            const std::int32_t j = links.to[way][i];
            if (j < 0 || !found.member[i]) continue;
            wrong += found.row[j] != found.row[i] + ROW_STEP[way] || found.column[j] != found.column[i] + COLUMN_STEP[way];
        }
    }
    return wrong;
}

// Adds components (groups, of spread) that no closed cell connects to the members, but BRIDGES links that all imply the same shift of their
// indices do.
void merge(const Neighbours& links, const std::vector<std::int32_t>& group, Indices& found) {
    std::vector<Place> shift(group.size(), Place{0, 0});
    std::vector<std::ptrdiff_t> bridges(group.size(), 0);  // of each group, NEVER where two of them disagree
    for (std::size_t i = 0; i < group.size(); ++i) {
        if (found.member[i]) continue;
        for (int way = 0; way < WAYS; ++way) {
            const std::int32_t j = links.to[way][i], of = group[i];
            if (j < 0 || !found.member[j]) continue;
            const Place here{found.row[j] - ROW_STEP[way] - found.row[i], found.column[j] - COLUMN_STEP[way] - found.column[i]};
            if (bridges[of] == 0) shift[of] = here;
            bridges[of] = here == shift[of] ? bridges[of] + 1 : NEVER;
        }
    }
    for (std::size_t i = 0; i < group.size(); ++i) {
        if (found.member[i] || bridges[group[i]] < BRIDGES) continue;
        found.row[i] += shift[group[i]].row, found.column[i] += shift[group[i]].column;
        found.member[i] = 1;
    }
}

// Adds dots outside closed cells whose links to members all imply the same row and column.
void join(const Neighbours& links, Indices& found) {
    const Indices before = found;
    for (std::size_t i = 0; i < found.row.size(); ++i) {
        if (before.member[i]) continue;
        bool heard = false, agree = true;
        Place said{0, 0};
        for (int way = 0; way < WAYS; ++way) {
            const std::int32_t j = links.to[way][i];
            if (j < 0 || !before.member[j]) continue;
            const Place place{before.row[j] - ROW_STEP[way], before.column[j] - COLUMN_STEP[way]};
            agree = agree && (!heard || place == said);
            said = place;
            heard = true;
        }
        if (!heard || !agree) continue;
        found.row[i] = said.row;
        found.column[i] = said.column;
        found.member[i] = 1;
    }
}

}  // namespace

Indices propagate_indices(const std::vector<std::int32_t>& right, const std::vector<std::int32_t>& below) {
    const std::size_t count = right.size();
    Indices found{std::vector<std::int64_t>(count, 0), std::vector<std::int64_t>(count, 0), std::vector<std::uint8_t>(count, 0), 0};
    const Neighbours links(right, below), sound = links.sound();
    const std::vector<std::int32_t> group = spread(sound, found);
    found.contradictions = contradictions(sound, found);
    if (!found.contradictions) {
        const Indices meshes = found;
        for (int step = 0; step < OUTWARDS; ++step) {
            join(links, found);
            merge(links, group, found);
        }
        if (contradictions(sound, found)) found = meshes;
    }
    for (std::size_t i = 0; i < count; ++i) {
        if (!found.member[i]) found.row[i] = found.column[i] = 0;
    }
    return found;
}

}  // namespace tactile
