// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/blobs.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/median.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr double LOW = 0.2, HIGH = 0.8;  // shares of the step from ground to plateau, between which a weight rises from 0 to 1
constexpr double TURN = 0.8416;          // standard deviations of the blur at which an edge reaches HIGH. Derived: normal quantile of HIGH
constexpr double WIDTH = 0.2673;  // sum of w (1 - w) across a straight edge of weights w, per px of blur. Derived for a Gaussian edge
constexpr double EDGE = TURN / (HIGH - LOW);  // px shift of an edge per relative change of brightness and px of blur. Derived
constexpr double EDGE_BLUR = 1.247;           // reduction of that shift by blur, on sloping light. Derived for a Gaussian edge
constexpr float MAX_WEIGHT = 1.7f;            // ramp units (the plateau is at 1.33), above which a pixel of the small image is glare
constexpr double MODEL_SIGMA = 0.003;         // px, error of a position by shapes and light that are not modelled
constexpr double SHIFT_SIGMA = 0.1;           // relative uncertainty of the correction for sloping light
constexpr double SHAPE_SIGMA = 0.7;           // radii of uncertainty per unit of missing solidity
constexpr double MIN_PLATEAU_AREA = 20;       // px of plateau, for its slope
constexpr double MAX_PLATEAU_SLOPE = 0.05;    // per px, bound of the plateau's relative slope
constexpr double TO_PLATEAU = 2.0, HALF_PIXEL = 0.65;  // blurs from edge to plateau, and px for the pixels of the small image
constexpr double MAX_GROUND_DEVIATION = 0.25;          // of the amplitude, from the ground level: beyond it a sample is left out
constexpr double SOLIDITY_LOSS = 0.9;                  // loss of solidity by a soft edge, per square of blur over radius
constexpr double GROUND_DISTANCE = 3.5;                // px from a region's border to its samples of the ground
constexpr int RING = 12, PLATEAU = 21;                 // samples of the ground, on a ring, and of the plateau, on a diamond
constexpr double SAMPLE_SPACING = 0.11;                // of a region's size, between samples of the plateau
constexpr int GROUND_RANK = 4, PLATEAU_RANK = 12;      // of the sorted samples: robust to neighbours, glare and border
constexpr int NOISE_ROW = 7;                           // px in the middle of a marker from which the noise is measured

constexpr BlobLimits LIMITS;

// A region of a small image, px of it: box, centre, and its number among the labels.
struct BlobRegion {
    std::ptrdiff_t left, top, width, height;
    double u, v;
    std::uint16_t label;
};

// A marker: position, px, area, px^2, standard deviation of u and of v, px, grey levels over the ground, and area over that of the ellipse
// with the same second moments.
struct Blob {
    double u, v, area, sigma, amplitude, solidity;
};

// Moments of weights about a marker's patch: area, centroid, central second moments.
struct Moments {
    double area, x, y, xx, xy, yy, squares;  // squares: sum of the squared weights

    Moments() = default;
    // sums: of weights times 1, x, y, x x, x y, y y.
    explicit Moments(const double* sums, double squared = 0) : area(std::max(sums[0], 1e-6)), squares(squared) {
        x = sums[1] / area, y = sums[2] / area;
        xx = std::max(sums[3] / area - x * x, 1e-6), yy = std::max(sums[5] / area - y * y, 1e-6);
        xy = sums[4] / area - x * y;
    }
    double radius() const { return std::sqrt(area / M_PI); }
    double determinant() const { return xx * yy - xy * xy; }
    double solidity() const { return area / (4 * M_PI * std::sqrt(std::max(determinant(), 1e-6))); }
    // Semi-axes of the ellipse with these moments.
    double major() const { return 2 * std::sqrt((xx + yy) / 2 + std::hypot((xx - yy) / 2, xy)); }
    double minor() const { return 2 * std::sqrt(std::max((xx + yy) / 2 - std::hypot((xx - yy) / 2, xy), 0.0)); }
    // Ramanujan's first formula.
    double perimeter() const {
        const double a = major(), b = minor();
        return M_PI * (3 * (a + b) - std::sqrt((3 * a + b) * (a + 3 * b)));
    }
};

// Grey levels of ground and of plateau over it; slope of the ground, of the amplitude per px.
struct Levels {
    float ground, amplitude;
    double slope_x, slope_y;
};

// Relative slope of a plateau per px, and its noise.
struct PlateauSlope {
    double x = 0, y = 0, noise = 0;
};

// Rows of a region, each padded to stride, a multiple of WIDE, with pixels that are not its own. level: grey levels; own: all bits of
// pixels of the region, else none; weight = level * scale - offset, 0 to 1; y: of the first row.
struct RegionRows {
    const std::uint16_t* level;
    const std::int16_t* own;
    std::ptrdiff_t rows, stride;
    float scale, offset, y;
};

constexpr std::ptrdiff_t WIDE = 8;  // columns that an instruction handles at once

// Sums down the columns (stride): weights, weights times y and times y y, and squared weights.
TACTILE_WIDE void add_columns(const RegionRows& region, float* weight, float* by_y, float* by_yy, float* squared) {
    typedef std::uint16_t Levels __attribute__((vector_size(2 * WIDE)));  // of bytes the compiler makes no vector instructions
    typedef std::int16_t Masks __attribute__((vector_size(2 * WIDE)));
    typedef std::int32_t Ints __attribute__((vector_size(4 * WIDE)));
    typedef float Floats __attribute__((vector_size(4 * WIDE)));
    const float scale = region.scale, offset = region.offset;
    const Floats none{}, all = none + 1;
    for (std::ptrdiff_t column = 0; column < region.stride; column += WIDE) {
        Floats sum{}, sum_y{}, sum_yy{}, squares{};
        for (std::ptrdiff_t row = 0; row < region.rows; ++row) {
            Levels levels;
            Masks own;
            std::memcpy(&levels, region.level + row * region.stride + column, sizeof levels);
            std::memcpy(&own, region.own + row * region.stride + column, sizeof own);
            const Floats ramp = __builtin_convertvector(__builtin_convertvector(levels, Ints), Floats) * scale - offset;
            const Floats above = ramp > none ? ramp : none, share = above < all ? above : all;
            const Floats w = __builtin_convertvector(own, Ints) ? share : none;
            const float y = region.y + static_cast<float>(row);
            sum += w;
            sum_y += w * y;
            sum_yy += w * (y * y);
            squares += w * w;
        }
        std::memcpy(weight + column, &sum, sizeof sum);
        std::memcpy(by_y + column, &sum_y, sizeof sum_y);
        std::memcpy(by_yy + column, &sum_yy, sizeof sum_yy);
        std::memcpy(squared + column, &squares, sizeof squares);
    }
}

// All bits of the pixels of a region, STEP of them for each label (count), else none.
template <std::ptrdiff_t STEP>
void mark_own(const std::uint16_t* labels, std::uint16_t label, std::ptrdiff_t count, std::int16_t* own) {
    for (std::ptrdiff_t k = 0; k < count; ++k)
        for (std::ptrdiff_t part = 0; part < STEP; ++part) own[STEP * k + part] = static_cast<std::int16_t>(-(labels[k] == label));
}

double upper_median(const std::vector<double>& values) {
    return smallest(values, static_cast<std::ptrdiff_t>(values.size() / 2));
}

// Fits regions that are inside the small image by a pixel or more; labels: of its pixels, the regions grown by a pixel.
class Fitter {
 public:
    Fitter(const Image& image, const Image& small, int step, const std::uint16_t* labels, const std::vector<BlobRegion>& regions)
        : image_(image), small_(small), step_(step), labels_(labels), regions_(regions) {
        for (const BlobRegion& region : regions) side_ = std::max({side_, region.width + 2, region.height + 2});
        for (int k = 0; k < RING; ++k) ring_[k][0] = std::cos(k * M_PI / 6) / 2, ring_[k][1] = std::sin(k * M_PI / 6) / 2;
    }

    std::vector<Blob> run() {
        std::vector<Levels> levels;
        std::vector<Moments> moments;
        std::vector<double> bends, soft, perimeters;
        const std::ptrdiff_t count = static_cast<std::ptrdiff_t>(regions_.size());
        for (std::ptrdiff_t n = 0; n < count; ++n) {
            levels.push_back(levels_of(regions_[n]));
            moments.push_back(moments_of(regions_[n], levels[n]));
            add_bends(regions_[n], bends);
            perimeters.push_back(moments[n].perimeter());
            soft.push_back((moments[n].area - moments[n].squares) / perimeters[n]);
        }
        std::vector<Blob> found;
        if (!count) return found;
        const double blur = upper_median(soft) / WIDTH;
        const double noise = bends.empty() ? 0 : upper_median(bends) / (0.6745 * std::sqrt(6.0));
        for (std::ptrdiff_t n = 0; n < count; ++n)
            found.push_back(blob(regions_[n], levels[n], moments[n], perimeters[n], blur, noise / levels[n].amplitude));
        return found;
    }

 private:
    // Corner of a region's patch, which has side_ pixels of the small image.
    std::ptrdiff_t left(const BlobRegion& region) const { return region.left + region.width / 2 - side_ / 2; }
    std::ptrdiff_t top(const BlobRegion& region) const { return region.top + region.height / 2 - side_ / 2; }
    // From a corner of a patch to its centre, px of the image.
    double half() const { return (static_cast<double>(step_ * side_) - 1) / 2; }

    // From the centre of a patch to a pixel of the small image, px of the image; and the first pixel of the patch at so much or more.
    double from_centre(std::ptrdiff_t pixel) const { return step_ * (static_cast<double>(pixel) - (static_cast<double>(side_) - 1) / 2); }
    std::ptrdiff_t first_within(double distance) const {
        return std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(std::ceil(distance / step_ + (static_cast<double>(side_) - 1) / 2)), 0);
    }

    bool is_own(const BlobRegion& region, std::ptrdiff_t row, std::ptrdiff_t column) const {
        return row >= 0 && column >= 0 && row < small_.rows && column < small_.columns &&
               labels_[row * small_.columns + column] == region.label;
    }

    // Nearest pixel of the small image to the sample at a share of a region's size, and so many px more, from its centre.
    std::uint8_t sample(const BlobRegion& region, double x, double y, double more) const {
        const auto whole = [](double at, std::ptrdiff_t length) {
            return static_cast<std::ptrdiff_t>(std::clamp(at + 0.5, 0.0, static_cast<double>(length - 1)));
        };
        const std::ptrdiff_t row = whole(region.v + (static_cast<double>(region.height) + more) * y, small_.rows);
        return small_.pixels[row * small_.columns + whole(region.u + (static_cast<double>(region.width) + more) * x, small_.columns)];
    }

    Levels levels_of(const BlobRegion& region) const {
        const double outside = 2 * GROUND_DISTANCE / step_;
        std::uint8_t around[RING], sorted[RING], plateau[PLATEAU];
        for (int k = 0; k < RING; ++k) {
            sorted[k] = around[k] = sample(region, ring_[k][0], ring_[k][1], outside);
        }
        int count = 0;
        for (int a = -2; a <= 2; ++a)
            for (int b = -2; b <= 2; ++b)
                if (std::abs(a) + std::abs(b) <= 3) plateau[count++] = sample(region, a * SAMPLE_SPACING, b * SAMPLE_SPACING, 0);
        std::sort(sorted, sorted + RING);
        std::sort(plateau, plateau + PLATEAU);
        const float ground = sorted[GROUND_RANK], amplitude = std::max(static_cast<float>(plateau[PLATEAU_RANK]) - ground, 1.0f);
        double x = 0, y = 0;
        for (int k = 0; k < RING; ++k) {
            const double deviation = (around[k] - ground) / amplitude;
            if (std::abs(deviation) <= MAX_GROUND_DEVIATION) x += deviation * ring_[k][0], y += deviation * ring_[k][1];
        }
        const double share = 8.0 / RING / step_;
        return {ground, amplitude, x * share / (static_cast<double>(region.width) + outside),
                y * share / (static_cast<double>(region.height) + outside)};
    }

    // Moments of the region, grown by a pixel, from the centre of its patch.
    Moments moments_of(const BlobRegion& region, const Levels& levels) {
        const std::ptrdiff_t first = step_ * (region.left - 1), top_row = step_ * (region.top - 1);
        const std::ptrdiff_t rows = std::clamp<std::ptrdiff_t>(image_.rows - top_row, 0, step_ * (region.height + 2));
        const std::ptrdiff_t count = std::clamp<std::ptrdiff_t>(image_.columns - first, 0, step_ * (region.width + 2));
        const std::ptrdiff_t stride = (count + WIDE - 1) / WIDE * WIDE;
        levels_.assign(rows * stride, 0);
        own_.assign(rows * stride, 0);
        for (std::ptrdiff_t row = 0; row < rows; ++row) {
            const std::uint16_t* label = labels_ + (region.top - 1 + row / step_) * small_.columns + region.left - 1;
            std::copy_n(image_.pixels + (top_row + row) * image_.columns + first, count, levels_.data() + row * stride);
            std::int16_t* own = own_.data() + row * stride;
            if (row % step_ > 0)
                std::copy_n(own - stride, stride, own);
            else
                (step_ == 2 ? mark_own<2> : mark_own<1>)(label, region.label, (count + step_ - 1) / step_, own);
        }
        sums_.resize(4 * stride);
        float *by_one = sums_.data(), *by_y = by_one + stride, *by_yy = by_y + stride, *squared = by_yy + stride;
        const auto scale = static_cast<float>(1 / ((HIGH - LOW) * levels.amplitude));
        const double corner_x = static_cast<double>(first - step_ * left(region)) - half();
        const double corner_y = static_cast<double>(top_row - step_ * top(region)) - half();
        add_columns({levels_.data(), own_.data(), rows, stride, scale, static_cast<float>(levels.ground + LOW * levels.amplitude) * scale,
                     static_cast<float>(corner_y)},
                    by_one, by_y, by_yy, squared);
        double sums[6] = {}, squares = 0;
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            const double x = static_cast<double>(k) + corner_x;
            const double parts[] = {by_one[k], by_one[k] * x, by_y[k], by_one[k] * x * x, by_y[k] * x, by_yy[k]};
            for (int s = 0; s < 6; ++s) sums[s] += parts[s];
            squares += squared[k];
        }
        return Moments(sums, squares);
    }

    // Adds the sizes of the second differences along the middle row of a region's patch.
    void add_bends(const BlobRegion& region, std::vector<double>& bends) const {
        const std::ptrdiff_t side = step_ * side_, v = step_ * top(region) + side / 2, u = step_ * left(region);
        const std::ptrdiff_t first = std::max<std::ptrdiff_t>(side / 2 - NOISE_ROW / 2, 0),
                             last = std::min(side / 2 + NOISE_ROW / 2 + 1, side);
        const auto pixel = [&](std::ptrdiff_t k) {
            const bool own =
                v >= 0 && u + k >= 0 && v < image_.rows && u + k < image_.columns && is_own(region, v / step_, (u + k) / step_);
            return own ? static_cast<double>(image_.pixels[v * image_.columns + u + k]) : 0.0;
        };
        for (std::ptrdiff_t k = first; k + 2 < last; ++k) bends.push_back(std::abs(pixel(k + 2) - 2 * pixel(k + 1) + pixel(k)));
    }

    // 0 where too little of the plateau is seen.
    PlateauSlope plateau_slope(const BlobRegion& region, const Levels& levels, const Moments& moments, double blur, double noise) const {
        const double distance = TO_PLATEAU * blur + HALF_PIXEL * (step_ - 1);
        const double scale = std::max(1 - distance / std::max(moments.minor(), 1e-6), 0.0), safe = std::max(moments.determinant(), 1e-6);
        const auto span = static_cast<float>(1 / ((HIGH - LOW) * levels.amplitude));
        const float offset = static_cast<float>(levels.ground + LOW * levels.amplitude) * span;
        double seen[6] = {}, sums[3] = {};
        const double reach_x = 2 * scale * std::sqrt(moments.xx), reach_y = 2 * scale * std::sqrt(moments.yy);
        for (std::ptrdiff_t row = first_within(moments.y - reach_y); row < side_ && from_centre(row) <= moments.y + reach_y; ++row) {
            const double y = from_centre(row), dy = y - moments.y;
            const std::ptrdiff_t v = top(region) + row, from = first_within(moments.x - reach_x);
            double count = 0, by_x = 0, by_xx = 0, lit = 0, lit_x = 0;
            for (std::ptrdiff_t column = from; column < side_ && from_centre(column) <= moments.x + reach_x; ++column) {
                const double x = from_centre(column), dx = x - moments.x;
                if (!(moments.yy * dx * dx - 2 * moments.xy * dx * dy + moments.xx * dy * dy < 4 * scale * scale * safe)) continue;
                count += 1, by_x += x, by_xx += x * x;
                const std::ptrdiff_t u = left(region) + column;
                if (!is_own(region, v, u)) continue;
                const double weight = std::clamp(small_.pixels[v * small_.columns + u] * span - offset, 0.0f, MAX_WEIGHT);
                lit += weight, lit_x += weight * x;
            }
            const double parts[] = {count, by_x, count * y, by_xx, by_x * y, count * y * y};
            for (int s = 0; s < 6; ++s) seen[s] += parts[s];
            sums[0] += lit, sums[1] += lit_x, sums[2] += lit * y;
        }
        for (double& sum : seen) sum *= step_ * step_;
        for (double& sum : sums) sum *= step_ * step_;
        const Moments whole(seen);
        if (whole.area < MIN_PLATEAU_AREA) return {};
        const double x = sums[1] - sums[0] * whole.x, y = sums[2] - sums[0] * whole.y;
        const double share = (HIGH - LOW) / std::max(whole.area * whole.determinant(), 1e-6);
        PlateauSlope slope{std::clamp((whole.yy * x - whole.xy * y) * share, -MAX_PLATEAU_SLOPE, MAX_PLATEAU_SLOPE),
                           std::clamp((whole.xx * y - whole.xy * x) * share, -MAX_PLATEAU_SLOPE, MAX_PLATEAU_SLOPE),
                           noise * std::sqrt(4 * M_PI) / std::max(whole.area, 1.0)};
        const double square = slope.x * slope.x + slope.y * slope.y, sure = square / (square + 2 * slope.noise * slope.noise + 1e-12);
        slope.x *= sure, slope.y *= sure;
        return slope;
    }

    // noise: of a pixel, of the amplitude.
    Blob blob(const BlobRegion& region, const Levels& levels, const Moments& moments, double perimeter, double blur, double noise) const {
        const PlateauSlope slope = plateau_slope(region, levels, moments, blur, noise);
        const double radius = moments.radius(), near = EDGE * radius - EDGE_BLUR * blur, far = EDGE * radius + EDGE_BLUR * blur;
        const double lever_x = slope.x * near + levels.slope_x * far, lever_y = slope.y * near + levels.slope_y * far;
        const double share = 4 * blur / (radius * radius);
        const double shift_x = (moments.xx * lever_x + moments.xy * lever_y) * share;
        const double shift_y = (moments.xy * lever_x + moments.yy * lever_y) * share;
        const double soft = blur * perimeter / (2 * moments.area), solidity = moments.solidity() * (1 + SOLIDITY_LOSS * soft * soft);
        const double by_shift = SHIFT_SIGMA * std::hypot(shift_x, shift_y), by_shape = SHAPE_SIGMA * radius * (solidity - 1);
        const double model = std::sqrt(MODEL_SIGMA * MODEL_SIGMA + by_shift * by_shift + by_shape * by_shape);
        const double pixels = 2 * TURN * blur * perimeter;  // on the edge, whose second moment is twice the area's
        const double by_edge = noise / (HIGH - LOW) * std::sqrt(pixels * (moments.xx + moments.yy)) / moments.area;
        const double by_noise = std::hypot(by_edge, EDGE * blur * radius * slope.noise);
        return {static_cast<double>(step_ * left(region)) + half() + moments.x - shift_x,
                static_cast<double>(step_ * top(region)) + half() + moments.y - shift_y,
                moments.area + M_PI * blur * blur,
                std::hypot(by_noise, model),
                levels.amplitude,
                solidity};
    }

    const Image &image_, &small_;
    const int step_;
    const std::uint16_t* labels_;
    const std::vector<BlobRegion>& regions_;
    std::ptrdiff_t side_ = 0;            // of the regions' patches, px of the small image
    double ring_[RING][2];               // samples of the ground from a region's centre, of its size
    std::vector<std::uint16_t> levels_;  // of one region
    std::vector<std::int16_t> own_;
    std::vector<float> sums_;  // of its columns
};

// Each block of 2 x 2 pixels averaged into one.
TACTILE_WIDE std::vector<std::uint8_t> halved(const Image& image, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    std::vector<std::uint8_t> found(rows * columns);
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        const std::uint8_t *up = image.pixels + 2 * r * image.columns, *down = up + image.columns;
        std::uint8_t* out = found.data() + r * columns;
        for (std::ptrdiff_t c = 0; c < columns; ++c)
            out[c] = static_cast<std::uint8_t>((up[2 * c] + up[2 * c + 1] + down[2 * c] + down[2 * c + 1] + 2) >> 2);
    }
    return found;
}

// Marks the pixels of an image that exceed the rounded mean of a square around each by more than so many grey levels; the image is mirrored
// at its outermost pixels.
TACTILE_WIDE std::vector<std::uint8_t> above_mean(const Image& image, std::ptrdiff_t box, std::int32_t excess) {
    const auto mirrored = [](std::ptrdiff_t at, std::ptrdiff_t count) {
        while (at < 0 || at >= count) at = at < 0 ? -at : 2 * count - 2 - at;
        return at;
    };
    const std::ptrdiff_t half = box / 2, columns = image.columns;
    const auto area = static_cast<std::int32_t>(box * box);
    std::vector<std::int32_t> sums(columns), before(columns + box);  // of each column; of the columns before
    std::vector<std::uint8_t> mask(image.rows * columns);
    const auto row = [&](std::ptrdiff_t r) { return image.pixels + mirrored(r, image.rows) * columns; };
    for (std::ptrdiff_t r = -half; r < half; ++r) {
        const std::uint8_t* pixels = row(r);
        for (std::ptrdiff_t c = 0; c < columns; ++c) sums[c] += pixels[c];
    }
    for (std::ptrdiff_t r = 0; r < image.rows; ++r) {
        const std::uint8_t *enters = row(r + half), *leaves = row(r - half), *pixels = image.pixels + r * columns;
        std::uint8_t* out = mask.data() + r * columns;
        for (std::ptrdiff_t c = 0; c < columns; ++c) sums[c] += enters[c];
        std::int32_t all = 0;
        const auto add = [&](std::ptrdiff_t c, std::ptrdiff_t from) { before[c + half + 1] = all += sums[from]; };
        for (std::ptrdiff_t c = -half; c < 0; ++c) add(c, mirrored(c, columns));
        for (std::ptrdiff_t c = 0; c < columns; ++c) add(c, c);
        for (std::ptrdiff_t c = columns; c < columns + half; ++c) add(c, mirrored(c, columns));
        const std::int32_t *first = before.data(), *last = first + box;
        for (std::ptrdiff_t c = 0; c < columns; ++c)  // the area is odd: no mean is half a level
            out[c] = 2 * (last[c] - first[c]) + area < 2 * area * (pixels[c] - excess);
        for (std::ptrdiff_t c = 0; c < columns; ++c) sums[c] -= leaves[c];
    }
    return mask;
}

// Pixels of a row from first to last, that excluded, of a component.
struct Run {
    std::ptrdiff_t row, first, last;
    std::int32_t component;
};

// Connected pixels of a mask. order: smaller for those whose first block of 2 x 2 pixels comes first, row by row.
struct Component {
    std::ptrdiff_t left, top, right, bottom, area, sum_u, sum_v, order;
    std::uint16_t label = 0;  // of a marker

    void add(const Run& run, std::ptrdiff_t columns) {
        const std::ptrdiff_t length = run.last - run.first;
        left = std::min(left, run.first), right = std::max(right, run.last);
        top = std::min(top, run.row), bottom = std::max(bottom, run.row + 1);
        area += length, sum_u += length * (run.first + run.last - 1) / 2, sum_v += length * run.row;
        order = std::min(order, run.row / 2 * columns + run.first / 2);
    }
};

// The regions of markers in a mask, and the labels of its pixels.
class Regions {
 public:
    Regions(const std::vector<std::uint8_t>& mask, std::ptrdiff_t rows, std::ptrdiff_t columns) : rows_(rows), columns_(columns) {
        find_runs(mask);
        for (std::size_t k = 0; k < runs_.size(); ++k) {  // a run that it is connected with is earlier, and has its component by now
            const auto before = static_cast<std::size_t>(runs_[k].component);
            runs_[k].component = before < k ? runs_[before].component : static_cast<std::int32_t>(components_.size());
            if (before == k) components_.push_back({columns, rows, 0, 0, 0, 0, 0, rows * columns});
            components_[static_cast<std::size_t>(runs_[k].component)].add(runs_[k], columns);
        }
    }

    // Those of about an area, px, that the border does not cut, from top to bottom; labels: their numbers on the pixels of the mask, grown by
    // a pixel, 0 elsewhere; where grown components overlap, that of the higher order counts.
    std::vector<BlobRegion> select(double area, std::vector<std::uint16_t>& labels) {
        std::vector<BlobRegion> found;
        for (Component& one : components_) {
            const auto pixels = static_cast<double>(one.area);
            if (one.left == 0 || one.top == 0 || one.right == columns_ || one.bottom == rows_ || !(pixels > LIMITS.min_area * area) ||
                !(pixels < LIMITS.max_area * area) || found.size() == std::numeric_limits<std::uint16_t>::max())
                continue;
            one.label = static_cast<std::uint16_t>(found.size() + 1);
            found.push_back({one.left, one.top, one.right - one.left, one.bottom - one.top, static_cast<double>(one.sum_u) / pixels,
                             static_cast<double>(one.sum_v) / pixels, one.label});
        }
        std::sort(found.begin(), found.end(),
                  [](const BlobRegion& a, const BlobRegion& b) { return std::pair(a.top, a.left) < std::pair(b.top, b.left); });
        std::stable_sort(runs_.begin(), runs_.end(), [this](const Run& a, const Run& b) { return of(a).order < of(b).order; });
        labels.assign(rows_ * columns_, 0);
        for (const Run& run : runs_)
            for (std::ptrdiff_t row = std::max<std::ptrdiff_t>(run.row - 1, 0); row < std::min(run.row + 2, rows_); ++row)
                std::fill(labels.begin() + row * columns_ + std::max<std::ptrdiff_t>(run.first - 1, 0),
                          labels.begin() + row * columns_ + std::min(run.last + 1, columns_), of(run).label);
        return found;
    }

 private:
    const Component& of(const Run& run) const { return components_[static_cast<std::size_t>(run.component)]; }

    // Until all runs are known, the component of a run is an earlier run that it is connected with, or itself.
    std::int32_t root_of(std::int32_t k) {
        auto& parent = runs_[static_cast<std::size_t>(k)].component;
        while (parent != runs_[static_cast<std::size_t>(parent)].component) parent = runs_[static_cast<std::size_t>(parent)].component;
        return parent;
    }

    void find_runs(const std::vector<std::uint8_t>& mask) {
        std::size_t above = 0, begin = 0;  // first run of the row above, and of this one
        for (std::ptrdiff_t row = 0; row < rows_; ++row) {
            above = begin, begin = runs_.size();
            std::size_t at = above;
            const std::uint8_t *pixels = mask.data() + row * columns_, *end = pixels + columns_;
            const auto next = [&](const std::uint8_t* from, int wanted) {
                const void* found = from < end ? std::memchr(from, wanted, static_cast<std::size_t>(end - from)) : nullptr;
                return found ? static_cast<const std::uint8_t*>(found) : end;
            };
            for (const std::uint8_t* first = next(pixels, 1); first != end;) {
                const std::uint8_t* last = next(first, 0);
                const auto own = static_cast<std::int32_t>(runs_.size());
                runs_.push_back({row, first - pixels, last - pixels, own});
                while (at < begin && runs_[at].last < first - pixels) ++at;
                for (std::size_t k = at; k < begin && runs_[k].first <= last - pixels; ++k) {
                    const std::int32_t a = root_of(own), b = root_of(static_cast<std::int32_t>(k));
                    runs_[static_cast<std::size_t>(std::max(a, b))].component = std::min(a, b);
                }
                first = next(last, 1);
            }
        }
    }

    const std::ptrdiff_t rows_, columns_;
    std::vector<Run> runs_;
    std::vector<Component> components_;
};

}  // namespace

FoundDots BlobFinder::find(const Image& whole) const {
    std::vector<std::uint8_t> inverted;
    if (look_.sign < 0) {
        inverted.resize(whole.rows * whole.columns);
        std::transform(whole.pixels, whole.pixels + inverted.size(), inverted.begin(), [](std::uint8_t level) { return 255 - level; });
    }
    const Image image{look_.sign < 0 ? inverted.data() : whole.pixels, whole.rows, whole.columns};
    const std::ptrdiff_t rows = image.rows / look_.step, columns = image.columns / look_.step;
    const std::vector<std::uint8_t> reduced = look_.step == 2 ? halved(image, rows, columns) : std::vector<std::uint8_t>();
    const Image small = look_.step == 2 ? Image{reduced.data(), rows, columns} : image;
    std::vector<std::uint16_t> labels;
    const std::vector<BlobRegion> regions =
        Regions(above_mean(small, look_.box, static_cast<std::int32_t>(look_.threshold)), rows, columns).select(look_.area, labels);
    const std::vector<Blob> blobs = Fitter(image, small, look_.step, labels.data(), regions).run();
    FoundDots found;
    if (blobs.empty()) return found;
    std::vector<double> amplitudes;
    for (const Blob& one : blobs) amplitudes.push_back(one.amplitude);
    const double faintest = LIMITS.faint * upper_median(amplitudes);
    const double low = look_.step == 2 ? LIMITS.min_solidity : LIMITS.min_small_solidity;
    const double high = look_.step == 2 ? LIMITS.max_solidity : LIMITS.max_small_solidity;
    for (const Blob& one : blobs)
        if (one.solidity > low && one.solidity < high && one.amplitude > faintest) found.add({one.u, one.v, one.area, one.sigma});
    return found;
}

}  // namespace tactile
