// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Normalised correlation with a disc on a ring of ground (Lewis, Fast normalized cross-correlation, 1995), and its peaks.
#include "dots/detect/disc_correlation.hpp"

#include <algorithm>
#include <cmath>

#include "common/pi.hpp"

namespace tactile {
namespace {

constexpr float NOISE = 1.0f;        // grey levels, regularises the normalisation of flat regions. Chosen
constexpr std::ptrdiff_t LINES = 8;  // axes through a peak along which its correlation is followed. Chosen

// Index of the pixel that a mirror at the border shows.
std::ptrdiff_t mirrored(std::ptrdiff_t at, std::ptrdiff_t count) {
    while (at < 0 || at >= count) at = at < 0 ? -at - 1 : 2 * count - at - 1;
    return at;
}

// Weighted sums over discs around all pixels. A row of the template differs from the next outer one only at its ends: a row of the image is
// summed over the outermost row of the template first, and the others follow by few additions.
class DiscSums {
 public:
    DiscSums(const float* weights, std::ptrdiff_t half, std::ptrdiff_t rows, std::ptrdiff_t columns)
        : half_(half), rows_(rows), columns_(columns), changes_(half + 1), row_(columns), sums_(rows * columns) {
        const auto weight = [&](std::ptrdiff_t down, std::ptrdiff_t across) {
            return down > half ? 0.0f : weights[down * (half + 1) + across];
        };
        for (std::ptrdiff_t down = 0; down <= half; ++down) {
            for (std::ptrdiff_t across = 0; across <= half; ++across) {
                const float change = weight(down, across) - weight(down + 1, across);
                if (change != 0) changes_[down].push_back({across, change});
            }
        }
    }

    // Adds a row of the image to the sums around row r and its neighbours; r may be outside the image. pairs: (half + 1, columns), sums of
    // the pixels at each distance left and right.
    void add(std::ptrdiff_t r, const std::vector<float>& pairs) {
        std::fill(row_.begin(), row_.end(), 0.0f);
        for (std::ptrdiff_t down = half_; down >= 0; --down) {
            for (const Change& change : changes_[down]) {
                const float *pair = pairs.data() + change.across * columns_, weight = change.weight;
                for (std::ptrdiff_t c = 0; c < columns_; ++c) row_[c] += weight * pair[c];
            }
            add_to(r - down);
            if (down > 0) add_to(r + down);
        }
    }

    const std::vector<float>& sums() const { return sums_; }

 private:
    struct Change {
        std::ptrdiff_t across;
        float weight;
    };

    void add_to(std::ptrdiff_t r) {
        if (r < 0 || r >= rows_) return;
        float* out = sums_.data() + r * columns_;
        for (std::ptrdiff_t c = 0; c < columns_; ++c) out[c] += row_[c];
    }

    const std::ptrdiff_t half_, rows_, columns_;
    std::vector<std::vector<Change>> changes_;  // by distance down
    std::vector<float> row_, sums_;
};

// Sums (half + 1, columns) of the pixels of a row at each distance left and right.
void add_pairs(const std::vector<float>& row, std::ptrdiff_t half, std::ptrdiff_t columns, std::vector<float>& pairs) {
    const float* middle = row.data() + half;
    std::copy(middle, middle + columns, pairs.begin());
    for (std::ptrdiff_t k = 1; k <= half; ++k) {
        float* out = pairs.data() + k * columns;
        for (std::ptrdiff_t c = 0; c < columns; ++c) out[c] = middle[c - k] + middle[c + k];
    }
}

class Correlation {
 public:
    Correlation(const FloatImage& image, const DiscTemplate& disc) : rows(image.rows), columns(image.columns) {
        DiscSums inside(disc.inside, disc.half, rows, columns), plain(disc.support, disc.half, rows, columns),
            square(disc.support, disc.half, rows, columns);
        const float mean = mean_of(image);  // of sums of squares in single precision little is left otherwise
        std::vector<float> row(columns + 2 * disc.half), pairs((disc.half + 1) * columns);
        for (std::ptrdiff_t r = -disc.half; r < rows + disc.half; ++r) {
            const float* pixels = image.pixels + mirrored(r, rows) * columns;
            for (std::ptrdiff_t c = 0; c < columns + 2 * disc.half; ++c) row[c] = pixels[mirrored(c - disc.half, columns)] - mean;
            add_pairs(row, disc.half, columns, pairs);
            inside.add(r, pairs);
            plain.add(r, pairs);
            for (float& value : row) value *= value;
            add_pairs(row, disc.half, columns, pairs);
            square.add(r, pairs);
        }
        normalise(disc, inside.sums(), plain.sums(), square.sums());
    }

    const std::ptrdiff_t rows, columns;
    std::vector<float> correlation, amplitude;

    float at(std::ptrdiff_t row, std::ptrdiff_t column) const {
        return correlation[std::clamp<std::ptrdiff_t>(row, 0, rows - 1) * columns + std::clamp<std::ptrdiff_t>(column, 0, columns - 1)];
    }

 private:
    static float mean_of(const FloatImage& image) {
        double sum = 0;
        for (std::ptrdiff_t k = 0; k < image.rows * image.columns; ++k) sum += image.pixels[k];
        return static_cast<float>(sum / static_cast<double>(image.rows * image.columns));
    }

    // Correlation with the contrast of disc and ring, the disc minus the mean share of it in both.
    void normalise(const DiscTemplate& disc, const std::vector<float>& inside, const std::vector<float>& plain,
                   const std::vector<float>& square) {
        double ink = 0, total = 0, squares = 0;
        const auto copies = [](std::ptrdiff_t k) { return k == 0 ? 1.0 : 2.0; };  // quadrants that share a pixel of the template
        const auto sum_over = [&](auto value) {
            double sum = 0;
            for (std::ptrdiff_t r = 0; r <= disc.half; ++r) {
                for (std::ptrdiff_t c = 0; c <= disc.half; ++c) sum += copies(r) * copies(c) * value(r * (disc.half + 1) + c);
            }
            return sum;
        };
        ink = sum_over([&](std::ptrdiff_t k) { return static_cast<double>(disc.inside[k]); });
        total = std::max(sum_over([&](std::ptrdiff_t k) { return static_cast<double>(disc.support[k]); }), 1e-9);
        const double share = ink / total;
        squares = sum_over([&](std::ptrdiff_t k) { return std::pow(disc.inside[k] - share * disc.support[k], 2); });
        const auto part = static_cast<float>(share), per_total = static_cast<float>(1 / total), norm = static_cast<float>(squares),
                   floor = static_cast<float>(total) * NOISE * NOISE;
        correlation.resize(inside.size());
        amplitude.resize(inside.size());
        for (std::size_t k = 0; k < inside.size(); ++k) {
            const float product = inside[k] - part * plain[k];
            const float variance = std::max(square[k] - plain[k] * plain[k] * per_total, 0.0f) + floor;
            correlation[k] = product / std::sqrt(variance * norm);
            amplitude[k] = product / norm;
        }
    }
};

class Peaks {
 public:
    Peaks(const Correlation& map, const DiscPeakRules& rules) : map_(map), rules_(rules) {
        for (std::ptrdiff_t down = 0; down <= rules.apart; ++down) {
            widths_.push_back(std::lround(std::sqrt(static_cast<double>(rules.apart * rules.apart - down * down))));
        }
        for (std::ptrdiff_t k = 0; k < LINES; ++k) {
            const double angle = static_cast<double>(k) * PI / LINES;
            steps_.emplace_back(std::lround(rules.radius * std::cos(angle)), std::lround(rules.radius * std::sin(angle)));
        }
    }

    bool is_disc(std::ptrdiff_t row, std::ptrdiff_t column) const {
        return map_.at(row, column) > static_cast<float>(rules_.least) && is_whole(row, map_.rows) && is_whole(column, map_.columns) &&
               is_highest(row, column) && has_ends(row, column);
    }

 private:
    bool is_whole(std::ptrdiff_t at, std::ptrdiff_t count) const {
        return static_cast<double>(at) >= rules_.margin && static_cast<double>(at) <= static_cast<double>(count - 1) - rules_.margin;
    }

    bool is_highest(std::ptrdiff_t row, std::ptrdiff_t column) const {
        const float own = map_.at(row, column);
        for (std::ptrdiff_t down = 0; down <= rules_.apart; ++down) {
            for (std::ptrdiff_t across = -widths_[down]; across <= widths_[down]; ++across) {
                if (map_.at(row + down, column + across) > own || map_.at(row - down, column + across) > own) return false;
            }
        }
        return true;
    }

    // Whether the correlation has fallen a radius away, on one side at least of each axis.
    bool has_ends(std::ptrdiff_t row, std::ptrdiff_t column) const {
        const double most = rules_.line * map_.at(row, column);
        return std::all_of(steps_.begin(), steps_.end(), [&](const std::pair<std::ptrdiff_t, std::ptrdiff_t>& step) {
            return std::min(map_.at(row + step.second, column + step.first), map_.at(row - step.second, column - step.first)) < most;
        });
    }

    const Correlation& map_;
    const DiscPeakRules rules_;
    std::vector<std::ptrdiff_t> widths_;
    std::vector<std::pair<std::ptrdiff_t, std::ptrdiff_t>> steps_;
};

}  // namespace

std::vector<DiscPeak> find_disc_peaks(const FloatImage& image, const DiscTemplate& disc, const DiscPeakRules& rules) {
    std::vector<DiscPeak> found;
    if (image.rows == 0 || image.columns == 0) return found;
    const Correlation map(image, disc);
    const Peaks peaks(map, rules);
    for (std::ptrdiff_t r = 0; r < map.rows; ++r) {
        for (std::ptrdiff_t c = 0; c < map.columns; ++c) {
            const std::ptrdiff_t k = r * map.columns + c;
            if (map.correlation[k] > static_cast<float>(rules.least) && peaks.is_disc(r, c)) {
                found.push_back({c, r, map.correlation[k], map.amplitude[k]});
            }
        }
    }
    return found;
}

}  // namespace tactile
