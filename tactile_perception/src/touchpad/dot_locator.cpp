// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/dot_locator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/dot_surface.hpp"
#include "common/vectors.hpp"

namespace tactile {
namespace {

constexpr double NONE = std::numeric_limits<double>::quiet_NaN();
constexpr double MAX_MEAN_CHANGE = 1e-3;  // m; water is constant: presses to 5 mm change the mean range by 0.35 mm, an outside lamp by 0.75
constexpr double MIN_EXTENT = 1.0;        // px; if all dots lie nearer to the first one, the tracks are wrong and show no shape
constexpr double VIEW = 0.4;              // tangent at the border of the image

// Polynomial over the image at a unit ray: degree 2, and degree 4 along the radius (vignetting).
double polynomial(const Eigen::Matrix<double, 7, 1>& field, const double* ray) {
    const double x = ray[0] / ray[2] / VIEW, y = ray[1] / ray[2] / VIEW, square = x * x + y * y;
    return field[0] + field[1] * x + field[2] * y + field[3] * x * x + field[4] * x * y + field[5] * y * y + field[6] * square * square;
}

// Mean of the values in the shortest interval that holds half of them (shorth; Andrews et al. 1972); NaN is left out. 0 of less than two.
double shorth(std::vector<double> values) {
    values.erase(std::remove_if(values.begin(), values.end(), [](double one) { return !std::isfinite(one); }), values.end());
    const auto size = static_cast<std::ptrdiff_t>(values.size()), half = std::max<std::ptrdiff_t>(size / 2, 1);
    if (size < half + 1) return 0;
    std::sort(values.begin(), values.end());
    std::ptrdiff_t best = 0;
    for (std::ptrdiff_t k = 1; k + half < size; ++k) {
        if (values[k + half] - values[k] < values[best + half] - values[best]) best = k;
    }
    double sum = 0;
    for (std::ptrdiff_t k = best; k <= best + half; ++k) sum += values[k];
    return sum / static_cast<double>(half + 1);
}

// Whether all of two or more dots at uv (N, 2), px, coincide.
bool coincide(const Array<double>& uv) {
    const auto is_near = [&](std::ptrdiff_t k) {
        return std::abs(uv[2 * k] - uv[0]) < MIN_EXTENT && std::abs(uv[2 * k + 1] - uv[1]) < MIN_EXTENT;
    };
    std::ptrdiff_t k = 0;
    while (k < uv.length() && is_near(k)) ++k;
    return uv.length() > 1 && k == uv.length();
}

}  // namespace

DotLocator::DotLocator(const Camera& camera, const Membrane& membrane, std::vector<double> rest)
    : camera_(camera), membrane_(membrane), rest_(std::move(rest)) {}

void DotLocator::set_rest(const Membrane& membrane, std::vector<double> rest) {
    membrane_.set_rest(membrane.skin());
    rest_ = std::move(rest);
    if (water_) set_light();
}

void DotLocator::set_water(const PadWater& water, const std::optional<PadGlare>& glare, double scale_sigma) {
    water_ = water, glare_ = glare;
    membrane_.reset(scale_sigma);
    set_light();
}

void DotLocator::set_light() {
    const Eigen::Vector3d eye = light_path(water_->path.data()).centre, centre(0, 0, water_->cap_z);
    const std::ptrdiff_t size = membrane_.skin().grid.size();
    rest_ranges_.resize(size), rest_normals_.resize(3 * size);
    for (std::ptrdiff_t k = 0; k < size; ++k) {
        rest_ranges_[k] = (vec3_at(rest_.data(), k) - eye).norm();
        store(rest_normals_.data(), k, (vec3_at(rest_.data(), k) - centre) / water_->cap_radius);
    }
    if (glare_) rest_lengths_ = light_on(rest_).lengths;
}

// Light on the skin through positions (K, 3), m. Dots at the border or beside a gap keep their undeformed normals.
DotLocator::Light DotLocator::light_on(const std::vector<double>& positions) const {
    const Grid grid = membrane_.skin().grid;
    const Array<double> surface{positions.data(), {grid.rows, grid.columns, 3}, 3 * grid.size()},
        points{positions.data(), {grid.size(), 3}, 3 * grid.size()};
    std::vector<double> normals = grid_normals(surface);
    each_dot(grid, [&](std::ptrdiff_t k, bool inner) {
        for (std::ptrdiff_t i = 3 * k; i < 3 * k + 3; ++i) normals[i] = inner && !std::isnan(normals[i]) ? normals[i] : rest_normals_[i];
    });
    auto [lengths, slopes, irradiance] = path_lengths(light_path(water_->path.data()), points, normals.data());
    return {std::move(lengths), std::move(irradiance)};
}

// Adds the glare of this frame, from the shape of the skin in the last one.
void DotLocator::add_glare(const std::vector<double>& brightness, const std::vector<double>& rays, const std::vector<std::int64_t>& id,
                           DotColours& seen) const {
    const Light light = light_on(membrane_.state().xyz.empty() ? rest_ : membrane_.state().xyz);
    const Eigen::Vector2d& absorptions = water_->colour.absorptions;
    const auto count = static_cast<std::ptrdiff_t>(id.size());
    std::vector<double> excess(count);
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const std::ptrdiff_t k = id[i];
        const double longer = light.lengths[k] - rest_lengths_[k];
        excess[i] = brightness[i] - (polynomial(glare_->field, &rays[3 * i]) + std::log(light.irradiance[k]) -
                                     glare_->red * absorptions[0] * longer);
        seen.colour.row(i) = glare_->colour.transpose();
        for (int c = 0; c < 2 && glare_->dry; ++c)
            seen.colour(i, c) *= std::exp(std::clamp(absorptions[c] * light.lengths[k], 0.0, -std::log(glare_->min_ratio)));
    }
    const double gain = shorth(excess);  // of the frame
    for (std::ptrdiff_t i = 0; i < count; ++i) seen.excess[i] = excess[i] - gain;
    seen.excess_sigma.setConstant(glare_->shading);
}

LocatedDots DotLocator::locate(const Array<std::uint8_t>& image, const Array<double>& uv, const std::vector<std::int64_t>& id) {
    const auto count = static_cast<std::ptrdiff_t>(id.size());
    LocatedDots found{std::vector<double>(3 * count, NONE)};
    if (!water_ || coincide(uv)) return found;
    const std::vector<double> rays = camera_rays(camera_, uv);
    const RingColours colours = ring_colours(image, uv, water_->ring, water_->ink, water_->glare);
    const Eigen::VectorXd unknown = Eigen::VectorXd::Constant(count, NONE);
    DotColours seen{Eigen::Map<const Rows2>(colours.ratios.data(), count, 2), Eigen::Map<const Numbers>(colours.count.data(), count),
                    Eigen::Map<const Eigen::VectorXd>(colours.patchiness.data(), count), unknown, unknown, Rows2::Ones(count, 2)};
    if (glare_) add_glare(colours.brightness, rays, id, seen);
    const WaterLengths lengths = water_lengths(water_->colour, glare_ ? glare_->kind : Glare{0.5, 1}, seen);
    SeenDots dots{Eigen::Map<const Numbers>(id.data(), count), Eigen::Map<const Rows3>(rays.data(), count, 3), Eigen::VectorXd(count),
                  Rows3(count, 3)};
    for (std::ptrdiff_t i = 0; i < count; ++i)
        dots.rest_ranges[i] = rest_ranges_[id[i]], dots.rest_normals.row(i) = vec3_at(rest_normals_.data(), id[i]).transpose();
    const WaterRanges ranges =
        water_ranges(light_path(water_->path.data()), dots, membrane_.skin().grid, lengths.lengths.data(), water_->ring_share);
    std::vector<double> sigma(count);
    double change = 0, known = 0, any = 0;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        sigma[i] = lengths.sigma[i] / ranges.slopes[i];
        any += std::isfinite(ranges.ranges[i]);
        if (const double one = ranges.ranges[i] - dots.rest_ranges[i]; std::isfinite(one)) change += one, known += 1;
    }
    if (any == 0) return found;
    found.is_known = true, found.is_lit_otherwise = !(std::abs(change / known) < MAX_MEAN_CHANGE);
    if (found.is_lit_otherwise) return found;
    const MembraneState& state = membrane_.solve({id.data(), rays.data(), ranges.ranges.data(), sigma.data(), count});
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (!std::isnan(rest_[3 * id[i]])) store(found.xyz.data(), i, vec3_at(state.xyz.data(), id[i]));
    }
    return found;
}

}  // namespace tactile
