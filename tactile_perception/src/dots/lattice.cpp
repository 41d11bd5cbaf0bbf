// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/lattice.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <limits>
#include <utility>

#include "common/median.hpp"
#include "dots/near_pairs.hpp"

namespace tactile {
namespace {

// Propagates row and column indices along links between neighbours: breadth-first over links that are a side of a closed cell, a
// quadrilateral of four dots whose four links agree.

using Links = std::vector<std::int32_t>;

constexpr int DIRECTIONS = 4;  // right, below, left, above
constexpr std::int64_t ROW_STEP[DIRECTIONS] = {0, 1, 0, -1}, COLUMN_STEP[DIRECTIONS] = {1, 0, -1, 0};

// member: dots that links reach; contradictions: number of links that disagree with the indices, and of dots with the indices of another.
struct Indices {
    std::vector<std::int64_t> row, column;
    std::vector<std::uint8_t> member;
    std::ptrdiff_t contradictions = 0;
};

struct Neighbours {
    Links to[DIRECTIONS];

    Neighbours(const Links& right, const Links& below) {
        to[0] = right;
        to[1] = below;
        for (int direction = 0; direction < 2; ++direction) {
            to[direction + 2].assign(right.size(), -1);
            for (std::size_t i = 0; i < right.size(); ++i) {
                if (to[direction][i] >= 0) to[direction + 2][to[direction][i]] = static_cast<std::int32_t>(i);
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

std::uint64_t key(const Indices& found, std::size_t i) {
    return (static_cast<std::uint64_t>(found.row[i]) << 32) ^ (static_cast<std::uint64_t>(found.column[i]) & 0xffffffffu);
}

// The largest connected component of the links becomes members; indices are relative to its first dot.
void spread(const Neighbours& links, Indices& found) {
    const std::size_t count = found.row.size();
    std::vector<std::uint8_t> reached(count, 0);
    std::vector<std::int32_t> members, largest;
    for (std::size_t start = 0; start < count; ++start) {
        if (reached[start]) continue;
        members.assign(1, static_cast<std::int32_t>(start));
        reached[start] = 1;
        for (std::size_t next = 0; next < members.size(); ++next) {
            const std::int32_t i = members[next];
            for (int direction = 0; direction < DIRECTIONS; ++direction) {
                const std::int32_t j = links.to[direction][i];
                if (j < 0 || reached[j]) continue;
                reached[j] = 1;
                found.row[j] = found.row[i] + ROW_STEP[direction];
                found.column[j] = found.column[i] + COLUMN_STEP[direction];
                members.push_back(j);
            }
        }
        if (members.size() > largest.size()) largest.swap(members);
    }
    for (const std::int32_t i : largest) found.member[i] = 1;
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
    for (int direction = 0; direction < 2; ++direction) {
        for (std::size_t i = 0; i < found.row.size(); ++i) {
            const std::int32_t j = links.to[direction][i];
            if (j < 0 || !found.member[i]) continue;
            wrong += found.row[j] != found.row[i] + ROW_STEP[direction] || found.column[j] != found.column[i] + COLUMN_STEP[direction];
        }
    }
    return wrong;
}

// Indices propagated along links; right, below (count): the neighbour in that direction, -1 for none.
Indices propagate_indices(const std::vector<std::int32_t>& right, const std::vector<std::int32_t>& below) {
    const std::size_t count = right.size();
    Indices found{std::vector<std::int64_t>(count, 0), std::vector<std::int64_t>(count, 0), std::vector<std::uint8_t>(count, 0), 0};
    const Neighbours sound = Neighbours(right, below).sound();
    spread(sound, found);
    found.contradictions = contradictions(sound, found);
    for (std::size_t i = 0; i < count; ++i) {
        if (!found.member[i]) found.row[i] = found.column[i] = 0;
    }
    return found;
}

// Neighbours of dots on a printed grid, from one image alone. Near pairs of dots give a field of row directions. Two dots are linked as
// left and right neighbour if each is the other's best match and their distance is close to the local mean step. Plane vectors are complex
// numbers u + iv, so that a rotation is a product.

using Complex = std::complex<double>;

constexpr double PAIR_DISTANCE = 1.9;         // median nearest distances. Derived: reaches a full pitch where the median is 0.6 of it
constexpr double TOLERANCES[] = {0.3, 0.21};  // of the local step, for a link; the second if the first contradicts itself
constexpr double ACROSS_WEIGHT = 4.0;         // weight of the squared step across against the squared step along
constexpr double MIN_COHERENCE = 0.15;        // mean resultant length of the directions below which dots form no grid
constexpr double CELL_SIDE = 2.0;             // pitches, side of the cells; steps are averaged over three by three cells
constexpr double DIRECTION_DISTANCE = 1.3;    // pitches: longer pairs are not used for directions: less than a diagonal
constexpr std::ptrdiff_t MAX_CELLS = 16;      // per dot. Derived: a grid needs a quarter of a cell per dot, dots on one line more
constexpr std::ptrdiff_t PITCH_SAMPLE = 40;   // dots from whose nearest neighbours the pitch is estimated
constexpr double WHOLE_WEIGHT = 1e-3;         // of the mean of all cells against that of three by three cells

// Product of finite numbers: the operator's also handles infinite ones, at twice the time.
Complex times(Complex a, Complex b) {
    return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

struct Pair {
    std::int32_t from = 0, to = 0;
    Complex step;  // px; after turn_upright real along a row or column
};

using Positions = Eigen::Map<const Eigen::Array2Xd>;  // u and v, px

// Width and height of the rectangle around positions.
Eigen::Array2d size_of(const Positions& positions) {
    return positions.rowwise().maxCoeff() - positions.rowwise().minCoeff();
}

// Mean values over blocks of three by three cells of the image, which dilute a single outlier.
class CellMeans {
 public:
    CellMeans(const Positions& positions, double side) : at_(positions.cols()) {
        const Eigen::Array2d size = size_of(positions), corner = positions.rowwise().minCoeff();
        side = std::max(side, std::sqrt((size + side).prod() / static_cast<double>(MAX_CELLS * positions.cols())));
        columns_ = static_cast<std::ptrdiff_t>(size[0] / side) + 3;  // a margin, so that each cell has eight neighbours
        rows_ = static_cast<std::ptrdiff_t>(size[1] / side) + 3;
        for (std::ptrdiff_t i = 0; i < positions.cols(); ++i) {
            const Eigen::Array2d cell = (positions.col(i) - corner) / side;
            at_[i] = (static_cast<std::ptrdiff_t>(cell[1]) + 1) * columns_ + static_cast<std::ptrdiff_t>(cell[0]) + 1;
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

// Median distance to the nearest other dot, px, over a sample of the dots.
double typical_distance(const double* positions, std::ptrdiff_t count) {
    std::vector<double> squares;
    for (std::ptrdiff_t i = 0; i < count; i += std::max<std::ptrdiff_t>(count / PITCH_SAMPLE, 1)) {
        double least = std::numeric_limits<double>::infinity();
        for (std::ptrdiff_t j = 0; j < count; ++j) {
            const double across = positions[2 * j] - positions[2 * i], down = positions[2 * j + 1] - positions[2 * i + 1];
            least = std::min(least, j == i ? least : across * across + down * down);
        }
        squares.push_back(least);
    }
    return std::sqrt(smallest(squares, static_cast<std::ptrdiff_t>(squares.size() / 2)));
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
    Search(const double* positions, std::ptrdiff_t count) : positions_(positions), count_(count) {}

    Lattice run() {
        Lattice lattice;
        if (count_ < 4 || !find_pairs()) return lattice;
        if (!find_direction(lattice.angle)) return lattice;
        turn_upright(lattice.angle);
        CellMeans cells({positions_, 2, count_}, CELL_SIDE * pitch_);
        std::vector<Complex> steps[2];
        for (int axis = 0; axis < 2; ++axis) {
            if (!typical_steps(axes_[axis], cells, steps[axis])) return lattice;
        }
        for (const double tolerance : TOLERANCES) {
            const Indices found = propagate_indices(links(axes_[0], steps[0], tolerance), links(axes_[1], steps[1], tolerance));
            if (found.contradictions) continue;
            lattice.found = true, lattice.pitch = pitch_, lattice.member = found.member;
            for (std::ptrdiff_t i = 0; i < count_; ++i) lattice.rc.insert(lattice.rc.end(), {found.row[i], found.column[i]});
            return lattice;
        }
        return lattice;
    }

 private:
    Complex position(std::ptrdiff_t i) const { return {positions_[2 * i], positions_[2 * i + 1]}; }

    // Finds the pairs within reach; false if there are none, or if the dots are too far apart for a grid of their pitch.
    bool find_pairs() {
        pitch_ = typical_distance(positions_, count_);
        const double wide = size_of({positions_, 2, count_}).maxCoeff();
        if (!(pitch_ > 0) || !(pitch_ * static_cast<double>(count_) > wide)) return false;  // wider than count dots in one row
        const auto near = near_pairs(positions_, count_, PAIR_DISTANCE * pitch_);
        pairs_.reserve(near.size());
        for (const auto& [i, j] : near) {
            const Complex step = position(j) - position(i);
            if (std::norm(step) < PAIR_DISTANCE * PAIR_DISTANCE * pitch_ * pitch_) pairs_.push_back({i, j, step});
        }
        return !pairs_.empty();
    }

    // Estimates the angle of the grid, within 45 degrees; false if the directions of its pairs are not coherent.
    bool find_direction(double& angle) const {
        Complex total = 0;  // of fourth powers of the directions: rows and columns add up
        double weight = 0;
        for (const Pair& pair : pairs_) {
            const double square = std::norm(pair.step);
            if (!(square < DIRECTION_DISTANCE * DIRECTION_DISTANCE * pitch_ * pitch_)) continue;
            const double near = std::exp(-square / (pitch_ * pitch_));
            const Complex twice = times(pair.step, pair.step);
            total += times(twice, twice) * (near / std::max(square * square, 1e-24));
            weight += near;
        }
        if (std::abs(total) < MIN_COHERENCE * weight) return false;
        angle = std::arg(total) / 4;
        return true;
    }

    // Splits pairs into rows, left dot first, and columns, upper dot first; rotates steps by the grid's angle, and steps of columns by
    // another -90 degrees.
    void turn_upright(double angle) {
        const Complex upright = std::polar(1.0, -angle);
        std::ptrdiff_t counts[2] = {0, 0};
        for (std::vector<Pair>& axis : axes_) axis.resize(pairs_.size());
        for (const Pair& pair : pairs_) {  // without branches, which would be mispredicted
            const Complex step = times(pair.step, upright);
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
            cost[k] = along * along + ACROSS_WEIGHT * across * across;
        }
        const std::vector<std::int32_t> best_pairs = mutual(pairs, cost, count_);
        cells.clear();
        for (const std::int32_t k : best_pairs) cells.add(pairs[k].from, pairs[k].step);
        steps = cells.means();
        return best_pairs.size() >= 2;
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

    const double* positions_;
    const std::ptrdiff_t count_;
    double pitch_ = 0;
    std::vector<Pair> pairs_, axes_[2];  // along rows, along columns
};

// Row and column are locally nearly linear in image position. A linear fit to the nearest indexed dots predicts the index of a dot without
// one. A prediction far from a whole number, or with a high leverage, is rejected. This repeats until no dot is added.

constexpr std::size_t MAX_MEMBERS = 8;   // indexed dots in a fit
constexpr std::size_t MIN_MEMBERS = 4;   // of them: one more than a plane has unknowns
constexpr double MEMBER_DISTANCE = 2.9;  // pitches, dots further away are excluded
constexpr double LEVERAGES[] = {1.0,
                                3.0};     // largest variance of a prediction per variance of a dot: the second only if the first adds none
constexpr double MAX_RESIDUAL = 0.15;     // rows, largest RMS residual of a fit
constexpr double MAX_INDEX_ERROR = 0.25;  // rows, largest distance of a prediction from a whole number
constexpr double RIDGE = 1e-6;            // of the normal equations: keeps collinear dots solvable

using Node = std::pair<std::int64_t, std::int64_t>;

struct Prediction {
    bool sure = false;
    double row = 0, column = 0;
};

class Growth {
 public:
    Growth(const double* positions, Lattice& lattice)
        : positions_(positions),
          count_(static_cast<std::ptrdiff_t>(lattice.member.size())),
          pitch_(lattice.pitch),
          rc_(lattice.rc),
          member_(lattice.member) {}

    void run() {
        while (std::any_of(std::begin(LEVERAGES), std::end(LEVERAGES), [this](double leverage) { return wave(leverage); })) {
        }
    }

 private:
    // Adds dots that fits of at most this leverage predict, at nodes that no other has or claims; returns whether any were added.
    bool wave(double leverage) {
        if (members() <= MAX_MEMBERS) return false;
        std::vector<std::pair<std::ptrdiff_t, Node>> predicted;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            if (member_[i]) continue;
            const Prediction found = predict(i, leverage);
            if (found.sure && off(found, std::rint(found.row), std::rint(found.column)) < MAX_INDEX_ERROR)
                predicted.push_back({i, {std::llrint(found.row), std::llrint(found.column)}});
        }
        const std::vector<std::uint8_t> before(member_);
        for (const auto& [i, index] : predicted) {
            std::ptrdiff_t claims = std::count_if(predicted.begin(), predicted.end(), [&](const auto& one) { return one.second == index; });
            for (std::ptrdiff_t j = 0; j < count_; ++j) claims += before[j] && rc_[2 * j] == index.first && rc_[2 * j + 1] == index.second;
            if (claims > 1) continue;
            rc_[2 * i] = index.first, rc_[2 * i + 1] = index.second;
            member_[i] = 1;
        }
        return member_ != before;
    }

    std::size_t members() const { return static_cast<std::size_t>(std::count(member_.begin(), member_.end(), 1)); }

    static double off(const Prediction& found, double row, double column) {
        return std::max(std::abs(found.row - row), std::abs(found.column - column));
    }

    // The nearest members within reach of dot i, itself excepted, nearest first.
    void find_near(std::ptrdiff_t i) {
        near_.clear();
        const double u = positions_[2 * i], v = positions_[2 * i + 1], reach = MEMBER_DISTANCE * pitch_;
        for (std::ptrdiff_t j = 0; j < count_; ++j) {
            const double across = positions_[2 * j] - u, down = positions_[2 * j + 1] - v;
            if (std::abs(across) >= reach || std::abs(down) >= reach || !member_[j] || j == i) continue;
            const double square = across * across + down * down;
            if (square < reach * reach) near_.push_back({square, j});
        }
        const std::size_t kept = std::min(near_.size(), MAX_MEMBERS);
        std::partial_sort(near_.begin(), near_.begin() + static_cast<std::ptrdiff_t>(kept), near_.end());
        near_.resize(kept);
    }

    // Row and column at dot i by a plane through its neighbours' indices, relative to the nearest one's, which the ridge hardly biases.
    Prediction predict(std::ptrdiff_t i, double leverage) {
        find_near(i);
        if (near_.size() < MIN_MEMBERS) return {};
        const std::int64_t* origin = &rc_[2 * near_[0].second];
        Eigen::Vector3d terms[MAX_MEMBERS];
        Eigen::RowVector2d index[MAX_MEMBERS];
        Eigen::Matrix3d square = RIDGE * Eigen::Matrix3d::Identity();
        Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
        for (std::size_t n = 0; n < near_.size(); ++n) {
            const std::ptrdiff_t j = near_[n].second;
            terms[n] << 1, (positions_[2 * j] - positions_[2 * i]) / pitch_, (positions_[2 * j + 1] - positions_[2 * i + 1]) / pitch_;
            for (int axis = 0; axis < 2; ++axis) index[n][axis] = static_cast<double>(rc_[2 * j + axis] - origin[axis]);
            square += terms[n] * terms[n].transpose(), right += terms[n] * index[n];
        }
        const Eigen::Matrix3d inverse = square.inverse();
        const Eigen::Matrix<double, 3, 2> fit = inverse * right;
        double residual = 0;
        for (std::size_t n = 0; n < near_.size(); ++n) residual += (terms[n].transpose() * fit - index[n]).squaredNorm();
        residual /= static_cast<double>(std::max<std::size_t>(near_.size(), 4) - 3);
        return {inverse(0, 0) < leverage && residual < 2 * MAX_RESIDUAL * MAX_RESIDUAL, fit(0, 0) + static_cast<double>(origin[0]),
                fit(0, 1) + static_cast<double>(origin[1])};
    }

    const double* positions_;
    const std::ptrdiff_t count_;
    const double pitch_;
    std::vector<std::int64_t>& rc_;
    std::vector<std::uint8_t>& member_;
    std::vector<std::pair<double, std::ptrdiff_t>> near_;  // squared distance and index
};

}  // namespace

Lattice find_lattice(const double* positions, std::ptrdiff_t count) {
    Lattice lattice = Search(positions, count).run();
    if (!lattice.found) {
        lattice.rc.assign(2 * count, 0);
        lattice.member.assign(count, 0);
    } else if (std::count(lattice.member.begin(), lattice.member.end(), 0)) {
        Growth(positions, lattice).run();
    }
    return lattice;
}

}  // namespace tactile
