// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <limits>

#include "common/lanes.hpp"
#include "common/wide.hpp"
#include "dots/links.hpp"

namespace tactile {
namespace {

// Propagates row and column indices along links between neighbours: breadth-first over links that are a side of a closed cell, a
// quadrilateral of four dots whose four links agree.

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

// Neighbours of dots on a printed grid, from one image alone. Near pairs of dots give a field of row directions. Two dots are linked as
// left and right neighbour if each is the other's best match and their distance is close to the local mean step. Plane vectors are complex
// numbers u + iv, so that a rotation is a product.

using Complex = std::complex<double>;

constexpr double REACH = 1.9;                 // median nearest distances. Derived: reaches a full pitch where the median is 0.6 of it
constexpr double TOLERANCES[] = {0.3, 0.21};  // of the local step, for a link; the second if the first contradicts itself. Chosen
constexpr double SLOPE = 4.0;                 // weight of the squared step across against the squared step along. Chosen
constexpr double COHERENCE = 0.15;            // mean resultant length of the directions below which dots form no grid. Chosen
constexpr double CELL = 2.0;                  // pitches, side of the cells; steps are averaged over three by three cells. Chosen
constexpr double LOCAL = 1.3;                 // pitches: longer pairs are not used for directions. Chosen: less than a diagonal
constexpr std::ptrdiff_t MOST_CELLS = 16;     // per dot. Derived: a grid needs a quarter of a cell per dot, dots on one line more
constexpr std::ptrdiff_t SAMPLE = 40;         // dots from whose nearest neighbours the pitch is estimated. Chosen
constexpr double WHOLE_WEIGHT = 1e-3;         // of the mean of all cells against that of three by three cells. Chosen

// Product of finite numbers: the operator's also handles infinite ones, at twice the time.
Complex times(Complex a, Complex b) {
    return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

// The unit number with half of a number's argument.
Complex root(Complex a) {
    const double size = std::sqrt(std::norm(a)), share = size > 0 ? a.real() / size : 1.0;
    return {std::sqrt(std::max(0.5 + 0.5 * share, 0.0)), std::copysign(std::sqrt(std::max(0.5 - 0.5 * share, 0.0)), a.imag())};
}

struct Pair {
    std::int32_t from = 0, to = 0;
    Complex step;  // px; after turn_upright real along a row or column
};

// Mean values over blocks of three by three cells of the image, which dilute a single outlier.
class CellMeans {
 public:
    CellMeans(const double* places, std::ptrdiff_t count, double side) : at_(count) {
        double low[2], high[2];
        for (int axis = 0; axis < 2; ++axis) {
            low[axis] = high[axis] = places[axis];
            for (std::ptrdiff_t i = 0; i < count; ++i) {
                low[axis] = std::min(low[axis], places[2 * i + axis]);
                high[axis] = std::max(high[axis], places[2 * i + axis]);
            }
        }
        const double area = (high[0] - low[0] + side) * (high[1] - low[1] + side);
        side = std::max(side, std::sqrt(area / static_cast<double>(MOST_CELLS * count)));
        columns_ = static_cast<std::ptrdiff_t>((high[0] - low[0]) / side) + 3;  // a margin, so that each cell has eight neighbours
        rows_ = static_cast<std::ptrdiff_t>((high[1] - low[1]) / side) + 3;
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            const auto column = static_cast<std::ptrdiff_t>((places[2 * i] - low[0]) / side) + 1;
            at_[i] = (static_cast<std::ptrdiff_t>((places[2 * i + 1] - low[1]) / side) + 1) * columns_ + column;
        }
        clear();
    }

    void clear() {
        sums_.assign(rows_ * columns_, {0.0, 0.0});
        weights_.assign(rows_ * columns_, 0.0);
    }
    void add(std::int32_t dot, Complex value) {
        sums_[at_[dot]] += value;
        weights_[at_[dot]] += 1.0;
    }
    // The mean around each dot.
    std::vector<Complex> means() const {
        Complex all = 0;
        double weight = 0;
        for (std::size_t k = 0; k < sums_.size(); ++k) all += sums_[k], weight += weights_[k];
        std::vector<Complex> cells(sums_.size());
        for (std::ptrdiff_t r = 1; r < rows_ - 1; ++r) {
            for (std::ptrdiff_t c = 1; c < columns_ - 1; ++c) {
                Complex sum = WHOLE_WEIGHT * all;
                double near = WHOLE_WEIGHT * weight;
                for (std::ptrdiff_t k = -1; k <= 1; ++k) {
                    for (std::ptrdiff_t j = -1; j <= 1; ++j) {
                        sum += sums_[(r + k) * columns_ + c + j];
                        near += weights_[(r + k) * columns_ + c + j];
                    }
                }
                cells[r * columns_ + c] = sum / std::max(near, 1e-9);
            }
        }
        std::vector<Complex> found(at_.size());
        for (std::size_t i = 0; i < at_.size(); ++i) found[i] = cells[at_[i]];
        return found;
    }

 private:
    std::vector<std::ptrdiff_t> at_;
    std::ptrdiff_t rows_, columns_;
    std::vector<Complex> sums_;
    std::vector<double> weights_;
};

// Least squared distance of places from (u, v), four places at once.
TACTILE_INLINE double least_square(const std::vector<double>& across, const std::vector<double>& down, double u, double v) {
    Four least(std::numeric_limits<double>::infinity());
    std::size_t j = 0;
    for (; j + FOUR <= across.size(); j += FOUR) {
        const Four x = Four(&across[j]) - u, y = Four(&down[j]) - v;
        least = lesser(x * x + y * y, least);
    }
    double found[FOUR];
    least.store(found);
    for (; j < across.size(); ++j) {
        const double x = across[j] - u, y = down[j] - v;
        found[0] = std::min(found[0], x * x + y * y);
    }
    return *std::min_element(found, found + FOUR);
}

// Median distance to the nearest other dot, px, over a sample of the dots.
TACTILE_WIDE double typical_distance(const double* places, std::ptrdiff_t count) {
    std::vector<double> across(count), down(count), squares;
    for (std::ptrdiff_t j = 0; j < count; ++j) across[j] = places[2 * j], down[j] = places[2 * j + 1];
    for (std::ptrdiff_t i = 0; i < count; i += std::max<std::ptrdiff_t>(count / SAMPLE, 1)) {
        const double u = across[i], v = down[i];
        across[i] = std::numeric_limits<double>::infinity();  // not its own neighbour
        squares.push_back(least_square(across, down, u, v));
        across[i] = u;
    }
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    return std::sqrt(*middle);
}

// Indices of the pairs with the least cost at both of their dots; infinite cost: no pair. The first of equal costs wins.
std::vector<std::int32_t> mutual(const std::vector<Pair>& pairs, const std::vector<double>& cost, std::ptrdiff_t count) {
    const double never = std::numeric_limits<double>::infinity();
    std::vector<double> least_ahead(count, never), least_behind(count, never);
    std::vector<std::int32_t> ahead(count, -1), behind(count, -1), found;
    const auto keep = [](double cost, std::size_t k, double& least, std::int32_t& best) {  // without a branch that would be mispredicted
        const bool less = cost < least;
        best = less ? static_cast<std::int32_t>(k) : best;
        least = less ? cost : least;
    };
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        keep(cost[k], k, least_ahead[pairs[k].from], ahead[pairs[k].from]);
        keep(cost[k], k, least_behind[pairs[k].to], behind[pairs[k].to]);
    }
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (ahead[i] >= 0 && behind[pairs[ahead[i]].to] == ahead[i]) found.push_back(ahead[i]);
    }
    return found;
}

class Search {
 public:
    Search(const double* places, std::ptrdiff_t count) : places_(places), count_(count) {}

    Lattice run(double hint) {
        Lattice lattice;
        if (count_ < 4 || !find_pairs()) return lattice;
        CellMeans cells(places_, count_, CELL * pitch_);
        if (!find_directions(cells, hint, lattice.angle)) return lattice;
        turn_upright();
        std::vector<Complex> steps[2];
        for (int axis = 0; axis < 2; ++axis) {
            if (!typical_steps(axes_[axis], cells, steps[axis])) return lattice;
        }
        for (const double tolerance : TOLERANCES) {
            const Indices found = propagate_indices(links(axes_[0], steps[0], tolerance), links(axes_[1], steps[1], tolerance));
            if (found.contradictions) continue;
            return {true, found.row, found.column, found.member, lattice.angle, pitch_};
        }
        return lattice;
    }

 private:
    Complex place(std::ptrdiff_t i) const { return {places_[2 * i], places_[2 * i + 1]}; }

    // Finds the pairs within reach; false if there are none, or if the dots are too far apart for a grid of their pitch.
    bool find_pairs() {
        double low[2] = {places_[0], places_[1]}, high[2] = {places_[0], places_[1]};
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            for (int axis = 0; axis < 2; ++axis) {
                low[axis] = std::min(low[axis], places_[2 * i + axis]);
                high[axis] = std::max(high[axis], places_[2 * i + axis]);
            }
        }
        pitch_ = typical_distance(places_, count_);
        const double wide = std::max(high[0] - low[0], high[1] - low[1]);
        if (!(pitch_ > 0) || !(pitch_ * static_cast<double>(count_) > wide)) return false;  // wider than count dots in one row
        const auto near = near_pairs(places_, count_, REACH * pitch_);
        pairs_.reserve(near.size());
        for (const auto& [i, j] : near) {
            const Complex step = place(j) - place(i);
            if (std::norm(step) < REACH * REACH * pitch_ * pitch_) pairs_.push_back({i, j, step});
        }
        return !pairs_.empty();
    }

    // Estimates the angle of the whole grid, within 45 degrees of the hint, and for each dot the rotation that aligns the local row with u;
    // false if the directions are not coherent.
    bool find_directions(CellMeans& cells, double hint, double& angle) {
        std::vector<std::int32_t> local(pairs_.size());  // pairs along rows and columns; listed without a branch that would be mispredicted
        std::size_t count = 0;
        for (std::size_t k = 0; k < pairs_.size(); ++k) {
            local[count] = static_cast<std::int32_t>(k);
            count += std::norm(pairs_[k].step) < LOCAL * LOCAL * pitch_ * pitch_;
        }
        std::vector<Complex> fourfold(count);  // fourth powers of the directions: rows and columns add up
        Complex total = 0;
        double weight = 0;
        for (std::size_t k = 0; k < count; ++k) {
            const Complex step = pairs_[local[k]].step, twice = times(step, step);
            const double square = std::norm(step), near = std::exp(-square / (pitch_ * pitch_));
            fourfold[k] = times(twice, twice) * (near / std::max(square * square, 1e-24));
            total += fourfold[k];
            weight += near;
        }
        if (std::abs(total) < COHERENCE * weight) return false;
        angle = hint + std::arg(total * std::polar(1.0, -4 * hint)) / 4;
        const Complex back = std::polar(1.0, -4 * angle);
        for (std::size_t k = 0; k < count; ++k) {
            const Complex turn = times(fourfold[k], back);
            cells.add(pairs_[local[k]].from, turn);
            cells.add(pairs_[local[k]].to, turn);
        }
        turns_ = cells.means();
        const Complex upright = std::polar(1.0, -angle);
        for (Complex& turn : turns_) turn = times(upright, std::conj(root(root(turn))));
        return true;
    }

    // Splits pairs into rows, left dot first, and columns, upper dot first; rotates steps by the local row direction, and steps of columns
    // by another -90 degrees.
    void turn_upright() {
        std::ptrdiff_t counts[2] = {0, 0};
        for (std::vector<Pair>& axis : axes_) axis.resize(pairs_.size());
        for (const Pair& pair : pairs_) {  // without branches, which would be mispredicted
            const Complex step = times(pair.step, turns_[pair.from]);
            const int column = std::abs(step.real()) <= std::abs(step.imag());
            const double along = column ? step.imag() : step.real(), across = column ? -step.real() : step.imag();
            const bool ahead = along > 0;
            axes_[column][counts[column]++] = {ahead ? pair.from : pair.to, ahead ? pair.to : pair.from,
                                               ahead ? Complex(along, across) : Complex(-along, -across)};
        }
        for (int axis = 0; axis < 2; ++axis) axes_[axis].resize(counts[axis]);
    }

    // Computes the local mean step to the next dot around each dot; false with fewer than two steps.
    bool typical_steps(const std::vector<Pair>& pairs, CellMeans& cells, std::vector<Complex>& steps) const {
        std::vector<double> cost(pairs.size());
        for (std::size_t k = 0; k < pairs.size(); ++k) {
            const double along = pairs[k].step.real(), across = pairs[k].step.imag();
            cost[k] = along * along + SLOPE * across * across;
        }
        const std::vector<std::int32_t> chosen = mutual(pairs, cost, count_);
        cells.clear();
        for (const std::int32_t k : chosen) cells.add(pairs[k].from, pairs[k].step);
        steps = cells.means();
        return chosen.size() >= 2;
    }

    // Each dot's next dot along the axis, -1 for none: the mutually best pairs within the tolerance of the local mean step.
    std::vector<std::int32_t> links(const std::vector<Pair>& pairs, const std::vector<Complex>& steps, double tolerance) const {
        std::vector<double> cost(pairs.size());
        for (std::size_t k = 0; k < pairs.size(); ++k) {
            const Complex expected = steps[pairs[k].from];
            cost[k] = std::norm(pairs[k].step - expected);
            if (!(cost[k] < tolerance * tolerance * std::norm(expected))) cost[k] = std::numeric_limits<double>::infinity();
        }
        std::vector<std::int32_t> next(count_, -1);
        for (const std::int32_t k : mutual(pairs, cost, count_)) next[pairs[k].from] = pairs[k].to;
        return next;
    }

    const double* places_;
    const std::ptrdiff_t count_;
    double pitch_ = 0;
    std::vector<Pair> pairs_, axes_[2];  // along rows, along columns
    std::vector<Complex> turns_;
};

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

Lattice find_lattice(const double* places, std::ptrdiff_t count, double hint) {
    Lattice lattice = Search(places, count).run(hint);
    if (!lattice.found) {
        lattice.row.assign(count, 0);
        lattice.column.assign(count, 0);
        lattice.member.assign(count, 0);
    }
    return lattice;
}

}  // namespace tactile
