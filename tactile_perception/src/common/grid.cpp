// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/grid.hpp"

#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {
namespace {

// Weights of a Gaussian from its centre outwards.
std::vector<float> gaussian(double sigma) {
    const auto half = static_cast<std::ptrdiff_t>(std::ceil(4 * sigma));
    std::vector<double> weights(half + 1);
    double total = 0;
    for (std::ptrdiff_t k = 0; k <= half; ++k) {
        weights[k] = std::exp(-0.5 * static_cast<double>(k * k) / (sigma * sigma));
        total += k == 0 ? weights[k] : 2 * weights[k];
    }
    std::vector<float> found(half + 1);
    std::transform(weights.begin(), weights.end(), found.begin(), [total](double w) { return static_cast<float>(w / total); });
    return found;
}

// One axis after the other: out = first + weights on both sides, along rows of a copy with margins.
TACTILE_INLINE void add_shifted(const float* before, const float* after, float weight, float* out, std::ptrdiff_t count) {
    for (std::ptrdiff_t k = 0; k < count; ++k) out[k] += weight * (before[k] + after[k]);
}

// Whether a row has anything that is not zero: most have nothing, and this loop becomes vector instructions.
bool any_in(const std::uint8_t* row, std::ptrdiff_t columns) {
    std::uint8_t any = 0;
    for (std::ptrdiff_t c = 0; c < columns; ++c) any |= row[c];
    return any != 0;
}

// Marked taxels side by side in a row; root: a run of the same component that is not later, the first one's is itself.
struct Run {
    std::ptrdiff_t row, begin, end;
    std::int32_t root;
};

std::int32_t root(std::vector<Run>& runs, std::int32_t at) {
    while (runs[at].root != at) at = runs[at].root = runs[runs[at].root].root;
    return at;
}

}  // namespace

Box Box::grown(std::ptrdiff_t margin, std::ptrdiff_t image_rows, std::ptrdiff_t image_columns) const {
    return {std::max<std::ptrdiff_t>(top - margin, 0), std::max<std::ptrdiff_t>(left - margin, 0), std::min(bottom + margin, image_rows),
            std::min(right + margin, image_columns)};
}

Box box_around(const std::uint8_t* mask, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    Box box{rows, columns, 0, 0};
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        const std::uint8_t *row = mask + r * columns, *end = row + columns;
        if (!any_in(row, columns)) continue;
        const std::uint8_t* first = std::find_if(row, end, [](std::uint8_t value) { return value != 0; });
        while (end[-1] == 0) --end;
        box = {std::min(box.top, r), std::min(box.left, first - row), r + 1, std::max(box.right, end - row)};
    }
    return box.bottom ? box : Box{0, 0, 0, 0};
}

TACTILE_WIDE void blur(std::vector<float>& values, std::ptrdiff_t rows, std::ptrdiff_t columns, double sigma, Outside outside) {
    const std::vector<float> weights = gaussian(sigma);
    const auto half = static_cast<std::ptrdiff_t>(weights.size()) - 1;
    std::vector<float> wide(columns + 2 * half), down(rows * columns);
    const std::vector<float> nothing(columns);
    const auto row_at = [&](std::ptrdiff_t r) -> const float* {
        if (outside == Outside::zero && (r < 0 || r >= rows)) return nothing.data();
        return values.data() + std::clamp<std::ptrdiff_t>(r, 0, rows - 1) * columns;
    };
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        float* out = down.data() + r * columns;
        for (std::ptrdiff_t c = 0; c < columns; ++c) out[c] = weights[0] * row_at(r)[c];
        for (std::ptrdiff_t k = 1; k <= half; ++k) add_shifted(row_at(r - k), row_at(r + k), weights[k], out, columns);
    }
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        const float* in = down.data() + r * columns;
        std::fill(wide.begin(), wide.begin() + half, outside == Outside::zero ? 0.0f : in[0]);
        std::copy(in, in + columns, wide.begin() + half);
        std::fill(wide.end() - half, wide.end(), outside == Outside::zero ? 0.0f : in[columns - 1]);
        float* out = values.data() + r * columns;
        const float* middle = wide.data() + half;
        for (std::ptrdiff_t c = 0; c < columns; ++c) out[c] = weights[0] * middle[c];
        for (std::ptrdiff_t k = 1; k <= half; ++k) add_shifted(middle - k, middle + k, weights[k], out, columns);
    }
}

TACTILE_WIDE void spread_largest(std::vector<float>& values, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t reach) {
    const std::vector<float> given = values;
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        float* out = values.data() + r * columns;
        for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(r - reach, 0); k < std::min(r + reach + 1, rows); ++k) {
            const float* in = given.data() + k * columns;
            for (std::ptrdiff_t c = 0; c < columns; ++c) out[c] = std::max(out[c], in[c]);
        }
    }
    std::vector<float> line(columns + 2 * reach);
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        float* out = values.data() + r * columns;
        std::fill(line.begin(), line.begin() + reach, out[0]);
        std::copy(out, out + columns, line.begin() + reach);
        std::fill(line.end() - reach, line.end(), out[columns - 1]);
        for (std::ptrdiff_t k = 0; k <= 2 * reach; ++k) {
            for (std::ptrdiff_t c = 0; c < columns; ++c) out[c] = std::max(out[c], line[c + k]);
        }
    }
}

std::vector<std::uint8_t> spread_mask(const std::uint8_t* mask, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t reach) {
    std::vector<std::uint8_t> along(rows * columns), near(rows * columns);
    const Box box = box_around(mask, rows, columns);
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        std::ptrdiff_t marked = 0;  // columns before this one are done
        for (std::ptrdiff_t c = box.left; c < box.right; ++c) {
            if (!mask[r * columns + c]) continue;
            const std::ptrdiff_t last = std::min(c + reach + 1, columns);
            const std::ptrdiff_t first = std::max<std::ptrdiff_t>({c - reach, marked, 0});
            std::fill(along.begin() + r * columns + first, along.begin() + r * columns + last, 1);
            marked = last;
        }
    }
    const Box wide = box.grown(reach, rows, columns);
    for (std::ptrdiff_t r = wide.top; r < wide.bottom; ++r) {
        std::uint8_t* out = near.data() + r * columns;
        for (std::ptrdiff_t at = std::max(r - reach, box.top); at < std::min(r + reach + 1, box.bottom); ++at) {
            for (std::ptrdiff_t c = wide.left; c < wide.right; ++c) out[c] |= along[at * columns + c];
        }
    }
    return near;
}

std::vector<Component> components(const std::uint8_t* mask, std::ptrdiff_t rows, std::ptrdiff_t columns, bool by_corners,
                                  std::vector<std::int32_t>& labels) {
    labels.assign(rows * columns, 0);
    const Box inside = box_around(mask, rows, columns);
    const std::ptrdiff_t beside = by_corners ? 1 : 0;
    std::vector<Run> runs;
    std::size_t above = 0, first = 0;  // first runs of the row above and of this one
    for (std::ptrdiff_t r = inside.top; r < inside.bottom; ++r) {
        for (std::ptrdiff_t c = inside.left; c < inside.right; ++c) {
            if (!mask[r * columns + c]) continue;
            Run run{r, c, c, static_cast<std::int32_t>(runs.size())};
            while (run.end < inside.right && mask[r * columns + run.end]) ++run.end;
            c = run.end;
            runs.push_back(run);
            while (above < first && runs[above].end + beside <= run.begin) ++above;
            for (std::size_t k = above; k < first && runs[k].begin < run.end + beside; ++k) {
                const std::int32_t one = root(runs, static_cast<std::int32_t>(k)), other = root(runs, runs.back().root);
                runs[std::max(one, other)].root = std::min(one, other);
            }
        }
        above = first;
        first = runs.size();
    }
    std::vector<Component> found;
    std::vector<std::int32_t> numbers(runs.size());
    for (std::size_t k = 0; k < runs.size(); ++k) {
        const Run& run = runs[k];
        const auto at = static_cast<std::size_t>(root(runs, static_cast<std::int32_t>(k)));
        if (at == k) {
            found.push_back({{run.row, run.begin, 0, 0}, 0});
            numbers[k] = static_cast<std::int32_t>(found.size());
        }
        Component& one = found[numbers[at] - 1];
        one.box = {one.box.top, std::min(one.box.left, run.begin), run.row + 1, std::max(one.box.right, run.end)};
        one.count += run.end - run.begin;
        std::fill(labels.begin() + run.row * columns + run.begin, labels.begin() + run.row * columns + run.end, numbers[at]);
    }
    return found;
}

}  // namespace tactile
