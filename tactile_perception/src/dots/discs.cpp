// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/discs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/cells.hpp"
#include "common/median.hpp"
#include "common/wide.hpp"
#include "dots/disc.hpp"

namespace tactile {
namespace {

constexpr double NOISE = 1.0;  // grey levels, of a pixel, at least: a flat region correlates with nothing

// Correlates discs of one shape with patches of an image.
class Correlator {
 public:
    Correlator(const Plane& image, const DiscShape& shape)
        : image_(image),
          side_(shape.side),
          count_((side_ * side_ + LANES - 1) / LANES * LANES),
          contrast_(count_),
          weight_(count_),
          patch_(count_) {
        double disc = 0;
        for (std::ptrdiff_t k = 0; k < side_ * side_; ++k) disc += shape.disc[k], total_ += shape.both[k];
        share_ = disc / total_;
        for (std::ptrdiff_t k = 0; k < side_ * side_; ++k) {
            weight_[k] = shape.both[k];
            contrast_[k] = shape.disc[k] - static_cast<float>(share_) * shape.both[k];
            norm_ += contrast_[k] * contrast_[k];
        }
    }

    TACTILE_WIDE FoundDisc at(std::ptrdiff_t column, std::ptrdiff_t row) {
        cut(column, row);
        const double projection = product(patch_.data(), contrast_.data(), count_), amplitude = projection / norm_;
        const double mean = product(patch_.data(), weight_.data(), count_) / total_;
        for (std::ptrdiff_t k = 0; k < side_ * side_; ++k) {  // what follows weighs nothing, and stays 0
            const float rest = patch_[k] - static_cast<float>(mean);
            patch_[k] = rest * rest;
        }
        const double variance = product(patch_.data(), weight_.data(), count_) + total_ * NOISE * NOISE;
        return {column, row, projection / std::sqrt(variance * norm_), amplitude, mean - amplitude * share_};
    }

 private:
    // Copies the pixels around one; those outside the image are mirrored at its border.
    void cut(std::ptrdiff_t column, std::ptrdiff_t row) {
        const std::ptrdiff_t half = side_ / 2, left = column - half;
        const bool is_inside = left >= 0 && left + side_ <= image_.columns;
        for (std::ptrdiff_t r = 0; r < side_; ++r) {
            const float* line = image_.values + mirrored(row - half + r, image_.rows) * image_.columns;
            float* out = patch_.data() + r * side_;
            if (is_inside) {
                std::copy_n(line + left, side_, out);
            } else {
                for (std::ptrdiff_t c = 0; c < side_; ++c) out[c] = line[mirrored(left + c, image_.columns)];
            }
        }
    }
    static std::ptrdiff_t mirrored(std::ptrdiff_t at, std::ptrdiff_t count) {
        at = at < 0 ? -1 - at : at;
        return std::clamp<std::ptrdiff_t>(at < count ? at : 2 * count - 1 - at, 0, count - 1);
    }
    const Plane image_;
    const std::ptrdiff_t side_, count_;
    std::vector<float> contrast_, weight_, patch_;
    double total_ = 0, share_ = 0, norm_ = 0;
};

// Of centroids, in diameters from a dot's centre: radius of the window in which the excess counts, whose edge falls over a step; ring of
// ground around it; and distance of the samples.
constexpr double WINDOW = 0.65, GROUND[2] = {0.6, 0.9}, STEP = 0.15;
constexpr int ROUNDS = 3;          // of centroids, each in a window about the last
constexpr double MIN_LEVEL = 1.0;  // grey levels of excess that count as a whole dot, at least

struct Sample {
    double across, down, weight;
};

// The level of an image between its pixels, at least 2 x 2; beyond its border, that of the outermost ones.
inline double level(const Image& image, double u, double v) {
    const auto split = [](double at, std::ptrdiff_t count) {
        at = std::clamp(at, 0.0, static_cast<double>(count - 1));
        const auto low = std::min(static_cast<std::ptrdiff_t>(at), count - 2);
        return std::pair(low, at - static_cast<double>(low));
    };
    const auto [column, right] = split(u, image.columns);
    const auto [row, below] = split(v, image.rows);
    const std::uint8_t *up = image.pixels + row * image.columns + column, *down = up + image.columns;
    return (up[0] + right * (up[1] - up[0])) * (1 - below) + (down[0] + right * (down[1] - down[0])) * below;
}

}  // namespace

std::vector<FoundDisc> correlate(const Plane& image, const std::int64_t* column, const std::int64_t* row, std::ptrdiff_t count,
                                 const DiscShape& shape) {
    Correlator correlator(image, shape);
    std::vector<FoundDisc> found;
    found.reserve(count);
    for (std::ptrdiff_t i = 0; i < count; ++i) found.push_back(correlator.at(column[i], row[i]));
    return found;
}

std::vector<FoundDisc> find_discs(const Plane& image, const float* relief, const DiscShape& shape, const DiscSearch& search) {
    const auto sign = static_cast<float>(search.sign), lowest = static_cast<float>(search.height);
    const std::ptrdiff_t columns = image.columns, reach = search.reach, margin = std::max(search.margin, reach);
    std::vector<std::ptrdiff_t> peaks;
    for (std::ptrdiff_t row = margin; row < image.rows - margin; ++row) {
        for (std::ptrdiff_t column = margin; column < columns - margin; ++column) {
            const float *top = relief + row * columns + column, height = sign * *top;
            if (!(height >= lowest) || sign * top[-1] > height || sign * top[1] > height) continue;
            bool is_peak = true;
            for (std::ptrdiff_t r = -reach; r <= reach && is_peak; ++r) {
                for (std::ptrdiff_t c = -reach; c <= reach; ++c) is_peak &= sign * top[r * columns + c] <= height;
            }
            if (is_peak) peaks.push_back(row * columns + column);
        }
    }
    const auto higher = [&](std::ptrdiff_t a, std::ptrdiff_t b) { return sign * relief[a] > sign * relief[b]; };
    if (static_cast<std::ptrdiff_t>(peaks.size()) > search.most) {
        std::stable_sort(peaks.begin(), peaks.end(), higher);
        peaks.resize(search.most);
    }
    Correlator correlator(image, shape);
    std::vector<FoundDisc> found;
    for (const std::ptrdiff_t peak : peaks) {
        const FoundDisc disc = correlator.at(peak % columns, peak / columns);
        if (search.sign * disc.amplitude > search.contrast && search.sign * disc.correlation > search.correlation) found.push_back(disc);
    }
    return found;
}

std::vector<Centroid> centroids(const Image& image, int sign, const double* positions, const double* diameter, std::ptrdiff_t count) {
    std::vector<Sample> ring, disc;
    for (int row = -6; row <= 6; ++row) {  // as far as the ring
        for (int column = -6; column <= 6; ++column) {
            const Sample sample{STEP * column, STEP * row, 0};
            const double far = std::hypot(sample.across, sample.down), weight = std::clamp((WINDOW - far) / STEP + 0.5, 0.0, 1.0);
            if (far > GROUND[0] && far < GROUND[1]) ring.push_back(sample);
            if (weight > 0) disc.push_back({sample.across, sample.down, weight});
        }
    }
    std::vector<Centroid> found;
    std::vector<double> levels(ring.size()), excess(disc.size());
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const double size = diameter[i];
        double u = positions[2 * i], v = positions[2 * i + 1], total = 0;
        for (std::size_t k = 0; k < ring.size(); ++k) levels[k] = level(image, u + size * ring[k].across, v + size * ring[k].down);
        const double ground = median(levels);
        for (int round = 0; round < ROUNDS; ++round) {
            double along_u = 0, along_v = 0;
            total = 0;
            for (std::size_t k = 0; k < disc.size(); ++k) {
                const auto& [across, down, weight] = disc[k];
                excess[k] = weight * std::max(sign * (level(image, u + size * across, v + size * down) - ground), 0.0);
                total += excess[k], along_u += excess[k] * across, along_v += excess[k] * down;
            }
            total = std::max(total, 1e-3);
            u += size * along_u / total, v += size * along_v / total;
        }
        double square = 0, samples = 0;
        for (const double each : excess) square += each * each;
        for (const double each : excess) samples += std::min(each / std::max(square / total, MIN_LEVEL), 1.0);
        found.push_back({u, v, samples * STEP * STEP * size * size});
    }
    return found;
}

std::vector<std::uint8_t> without_doubles(const double* positions, const double* score, const double* apart, std::ptrdiff_t count) {
    std::vector<std::uint8_t> kept(count, 1);
    if (!count) return kept;
    const Cells cells(positions, count);
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        cells.within(positions[2 * i], positions[2 * i + 1], apart[i], [&](std::ptrdiff_t j, double) {
            const auto [first, second] = std::minmax(i, j);
            if (first != second) kept[score[first] < score[second] ? first : second] = 0;
        });
    }
    return kept;
}

}  // namespace tactile
