// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Candidate dots: peaks of a smoothed image above its local background. The search prefers false candidates to missed dots; the fit
// rejects false ones.
#include "dots/peaks.hpp"

#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {
namespace {

// Rows of the image, or of the sums of its blocks of two by two pixels, as whole-numbered floats; a ring buffer keeps the last few.
// Borders are replicated: outer columns fill the margin left and right, outer rows stand for rows above and below.
class Rows {
 public:
    Rows(const Image& image, int step, std::ptrdiff_t margin_, std::ptrdiff_t kept)
        : count(image.rows / step),
          columns(image.columns / step),
          margin(margin_),
          stride(columns + 2 * margin),
          image_(image),
          step_(step),
          kept_(kept),
          values_(kept * stride) {}

    // The left end of row k with its margin; k is less than the number of kept rows behind the last row requested.
    const float* row(std::ptrdiff_t k) {
        k = std::clamp<std::ptrdiff_t>(k, 0, count - 1);
        while (next_ <= k) make(next_++);
        return values_.data() + (k % kept_) * stride;
    }
    const std::ptrdiff_t count, columns, margin, stride;

 private:
    TACTILE_WIDE void make(std::ptrdiff_t k) {
        float *row = values_.data() + (k % kept_) * stride, *out = row + margin;
        const std::uint8_t *first = image_.pixels + step_ * k * image_.columns, *second = first + image_.columns;
        if (step_ == 1) {
            for (std::ptrdiff_t c = 0; c < columns; ++c) out[c] = first[c];
        } else {
            for (std::ptrdiff_t c = 0; c < columns; ++c) {
                out[c] = static_cast<float>(first[2 * c] + first[2 * c + 1] + second[2 * c] + second[2 * c + 1]);
            }
        }
        std::fill(row, out, out[0]);
        std::fill(out + columns, row + stride, out[columns - 1]);
    }

    const Image image_;
    const int step_;
    const std::ptrdiff_t kept_;
    std::vector<float> values_;
    std::ptrdiff_t next_ = 0;
};

// Weights of a Gaussian over 2 half + 1 pixels, from the centre outwards; its standard deviation is 0.3 half + 0.5 px.
std::vector<float> gaussian(int half) {
    const double sigma = 0.3 * half + 0.5;
    std::vector<double> weights(half + 1);
    double total = 0;
    for (int k = 0; k <= half; ++k) {
        weights[k] = std::exp(-0.5 * k * k / (sigma * sigma));
        total += k == 0 ? weights[k] : 2 * weights[k];
    }
    std::vector<float> found(half + 1);
    std::transform(weights.begin(), weights.end(), found.begin(), [total](double w) { return static_cast<float>(w / total); });
    return found;
}

// Contrast of each smoothed pixel to the mean of the square around it, grey levels, row by row.
class Relief {
 public:
    Relief(Rows& rows, const PeakSearch& search)
        : rows_(rows),
          reach_(search.box / 2),
          weights_(gaussian(search.smooth / 2)),
          level_(static_cast<float>(search.sign) / static_cast<float>(search.step * search.step)),
          share_(level_ / static_cast<float>(search.box * search.box)),
          down_(rows.stride, 0),
          across_(rows.columns),
          smooth_(rows.stride) {
        for (std::ptrdiff_t k = -reach_ - 1; k < reach_; ++k) {
            const float* row = rows.row(k);
            for (std::ptrdiff_t c = 0; c < rows.stride; ++c) down_[c] += static_cast<std::int32_t>(row[c]);
        }
    }

    // Writes row r to out; rows must be requested in order.
    void row(std::ptrdiff_t r, float* out) {
        smooth(r, out);
        sum_square(r);
        const float level = level_, share = share_;
        const std::int32_t* across = across_.data();
        for (std::ptrdiff_t c = 0; c < rows_.columns; ++c) out[c] = level * out[c] - share * static_cast<float>(across[c]);
    }

 private:
    // Running sums over the rows, then over the columns, of the square around each pixel; integers, so that no rounding accumulates.
    TACTILE_WIDE void sum_square(std::ptrdiff_t r) {
        const float *leaves = rows_.row(r - reach_ - 1), *enters = rows_.row(r + reach_);
        std::int32_t *down = down_.data(), *across = across_.data();
        for (std::ptrdiff_t c = 0; c < rows_.stride; ++c) down[c] += static_cast<std::int32_t>(enters[c] - leaves[c]);
        const std::int32_t *first = down + rows_.margin - reach_, *last = first + 2 * reach_;
        std::int32_t sum = 0;
        for (const std::int32_t* c = first; c <= last; ++c) sum += *c;
        across[0] = sum;
        for (std::ptrdiff_t c = 1; c < rows_.columns; ++c) across[c] = last[c] - first[c - 1];
        for (std::ptrdiff_t c = 1; c < rows_.columns; ++c) across[c] = sum += across[c];
    }

    // The Gaussian down and then across: the middle and its neighbours in one pass over the row, farther ones in one pass each.
    TACTILE_WIDE void smooth(std::ptrdiff_t r, float* out) {
        const auto half = static_cast<std::ptrdiff_t>(weights_.size()) - 1;
        const float* middle = rows_.row(r);
        const float first = weights_[0], second = half > 0 ? weights_[1] : 0.0f;
        float* smooth = smooth_.data();
        {
            const float *up = rows_.row(r - 1), *down = rows_.row(r + 1);
            for (std::ptrdiff_t c = 0; c < rows_.stride; ++c) smooth[c] = first * middle[c] + second * (up[c] + down[c]);
        }
        for (std::ptrdiff_t k = 2; k <= half; ++k) {
            const float *up = rows_.row(r - k), *down = rows_.row(r + k), weight = weights_[k];
            for (std::ptrdiff_t c = 0; c < rows_.stride; ++c) smooth[c] += weight * (up[c] + down[c]);
        }
        const float *across = smooth + rows_.margin, *left = across - (half > 0), *right = across + (half > 0);
        for (std::ptrdiff_t c = 0; c < rows_.columns; ++c) out[c] = first * across[c] + second * (left[c] + right[c]);
        for (std::ptrdiff_t k = 2; k <= half; ++k) {
            const float weight = weights_[k];
            for (std::ptrdiff_t c = 0; c < rows_.columns; ++c) out[c] += weight * (across[c - k] + across[c + k]);
        }
    }

    Rows& rows_;
    const std::ptrdiff_t reach_;
    const std::vector<float> weights_;
    const float level_, share_;
    std::vector<std::int32_t> down_, across_;
    std::vector<float> smooth_;
};

// Vertex of the parabola through three neighbours, px from the middle one.
double top(float before, float middle, float after) {
    const double bend = std::max(2.0 * middle - before - after, 1.0);  // at least one grey level: flat tops stay in their pixel
    return std::clamp((static_cast<double>(after) - before) / (2 * bend), -1.0, 1.0);
}

// Finds the peaks of the middle one of three adjacent rows, px of the rows.
class PeakRow {
 public:
    PeakRow(std::ptrdiff_t columns, float lowest) : columns_(columns), lowest_(lowest), is_peak_(columns) {}

    // Appends column and row of each peak in row r to found. Of equal neighbours, the first is the peak.
    TACTILE_WIDE void find(const float* up, const float* row, const float* down, std::ptrdiff_t r, std::vector<double>& found) {
        for (std::ptrdiff_t block = 1; block < columns_ - 1; block += BLOCK) {
            const std::ptrdiff_t end = std::min(block + BLOCK, columns_ - 1);
            if (!any_reaches(row, block, end)) continue;
            int any = 0;
            for (std::ptrdiff_t c = block; c < end; ++c) {
                const float before = std::max(std::max(up[c - 1], up[c]), std::max(up[c + 1], row[c - 1]));
                const float after = std::max(std::max(down[c - 1], down[c]), std::max(down[c + 1], row[c + 1]));
                is_peak_[c] = (row[c] > before) & (row[c] >= after) & (row[c] >= lowest_);
                any |= is_peak_[c];
            }
            for (std::ptrdiff_t c = block; any && c < end; ++c) {
                if (!is_peak_[c]) continue;
                found.push_back(c + top(row[c - 1], row[c], row[c + 1]));
                found.push_back(r + top(up[c], row[c], down[c]));
            }
        }
    }

 private:
    // Whether any pixel of a block is as high as the lowest peak.
    bool any_reaches(const float* row, std::ptrdiff_t begin, std::ptrdiff_t end) const {
        int any = 0;
        for (std::ptrdiff_t c = begin; c < end; ++c) any |= row[c] >= lowest_;
        return any != 0;
    }

    static constexpr std::ptrdiff_t BLOCK = 16;  // pixels tested together, since most blocks have no peak. Chosen
    const std::ptrdiff_t columns_;
    const float lowest_;
    std::vector<int> is_peak_;
};

}  // namespace

std::vector<double> find_peaks(const Image& image, const PeakSearch& search) {
    std::vector<double> found;
    if (image.rows < 3 * search.step || image.columns < 3 * search.step) return found;
    const std::ptrdiff_t margin = std::max(search.smooth, search.box) / 2;
    Rows rows(image, search.step, margin, 2 * margin + 3);
    Relief relief(rows, search);
    PeakRow peaks(rows.columns, search.lowest);
    std::vector<float> three(3 * rows.columns);
    const auto kept = [&](std::ptrdiff_t r) { return three.data() + (r % 3) * rows.columns; };
    for (std::ptrdiff_t r = 0; r < rows.count; ++r) {
        relief.row(r, kept(r));
        if (r >= 2) peaks.find(kept(r - 2), kept(r - 1), kept(r), r - 1, found);
    }
    for (double& place : found) place = (place + 0.5) * search.step - 0.5;
    return found;
}

}  // namespace tactile
