// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels that find and number dots; see bindings.cpp, whose length they would exceed.
#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "dots/detect/blob_fit.hpp"
#include "dots/detect/blob_regions.hpp"
#include "dots/detect/disc_correlation.hpp"
#include "dots/detect/dot_judge.hpp"
#include "dots/detect/peaks.hpp"
#include "dots/detect/worn_disc.hpp"
#include "dots/index/extrapolate.hpp"
#include "dots/index/grid_anchor.hpp"
#include "dots/index/grid_outliers.hpp"
#include "dots/index/lattice.hpp"

namespace tactile::border {
namespace {

constexpr int LARGEST_SIDE = 255;  // px, of the filters of find_peaks. Chosen: sums over the square stay within 32-bit integers

Image as_image(const Input<std::uint8_t>& image) {
    return {image.data(), image.length(0), image.length(1)};
}

int odd(int value, const char* name) {
    within(value, name, 1, LARGEST_SIDE);
    if (value % 2 == 0) throw py::value_error(std::string(name) + ": an odd number is needed, got " + std::to_string(value));
    return value;
}

py::array_t<double> peaks(const py::object& image, int step, int smooth, int box, int sign, double lowest) {
    const Input<std::uint8_t> pixels(image, "image", {ANY, ANY});
    within(step, "step", 1, 2);
    if (sign != 1 && sign != -1) throw py::value_error("sign: 1 or -1 is needed, got " + std::to_string(sign));
    within(lowest, "lowest", 0, 1e6);
    const PeakSearch search{step, odd(smooth, "smooth"), odd(box, "box"), sign, static_cast<float>(lowest)};
    std::vector<double> found;
    {
        py::gil_scoped_release others_run;
        found = find_peaks(as_image(pixels), search);
    }
    return output(found, {static_cast<py::ssize_t>(found.size() / 2), 2});
}

py::tuple blob_regions(const py::object& mask, std::int64_t speck, double least, double most) {
    const Input<std::uint8_t> pixels(mask, "mask", {ANY, ANY});
    const MarkerSizes sizes{within(least, "least", 0, 1e6), within(most, "most", 0, 1e6),
                            within(speck, "speck", std::int64_t{0}, std::int64_t{1} << 40)};
    BlobRegions found;
    {
        py::gil_scoped_release others_run;
        found = find_blob_regions(as_image(pixels), sizes);
    }
    const auto count = static_cast<py::ssize_t>(found.label.size());
    return py::make_tuple(output(found.box, {count, 4}), output(found.centre, {count, 2}), output(found.area, {count}),
                          output(found.label, {count}), kept(std::move(found.labels), {pixels.length(0), pixels.length(1)}));
}

py::tuple blobs(const py::object& image, const py::object& small, const py::object& labels, const py::object& box, const py::object& centre,
                const py::object& label, int step) {
    const Input<std::uint8_t> pixels(image, "image", {ANY, ANY}), few(small, "small", {ANY, ANY});
    const Input<std::uint16_t> named(labels, "labels", {few.length(0), few.length(1)});
    const Input<std::int32_t> boxes(box, "box", {ANY, 4});
    const Input<double> centres(centre, "centre", {boxes.length(), 2});
    const Input<std::uint16_t> names(label, "label", {boxes.length()});
    within(step, "step", 1, 2);
    check_places(centres, "centre");
    std::vector<BlobRegion> regions;
    for (py::ssize_t n = 0; n < boxes.length(); ++n) {
        const std::int32_t* at = boxes.data() + 4 * n;
        for (int axis = 0; axis < 2; ++axis) {
            const double length = static_cast<double>(few.length(1 - axis));
            within(at[axis], "box", 1, length - 2);
            within(at[2 + axis], "box", 1, length - 1 - at[axis]);
        }
        regions.push_back({at[0], at[1], at[2], at[3], centres.data()[2 * n], centres.data()[2 * n + 1], names.data()[n]});
    }
    Blobs found;
    {
        py::gil_scoped_release others_run;
        found = fit_blobs(as_image(pixels), as_image(few), step, named.data(), regions);
    }
    std::vector<double> rows;
    for (const Blob& b : found.blobs) rows.insert(rows.end(), {b.u, b.v, b.area, b.sigma, b.amplitude, b.solidity});
    return py::make_tuple(output(rows, {boxes.length(), 6}), found.blur);
}

py::object lattice(const py::object& places, double angle_hint) {
    const Input<double> given(places, "places", {ANY, 2});
    const py::ssize_t count = given.length();
    within(angle_hint, "angle_hint", -1e3, 1e3);
    check_places(given, "places");
    Lattice found;
    {
        py::gil_scoped_release others_run;
        found = find_lattice(given.data(), count, angle_hint);
    }
    if (!found.found) return py::none();
    py::array_t<std::int64_t> indices({count, py::ssize_t{2}});
    std::int64_t* out = indices.mutable_data();
    for (py::ssize_t i = 0; i < count; ++i) {
        out[2 * i] = found.row[i];
        out[2 * i + 1] = found.column[i];
    }
    const std::vector<bool> member(found.member.begin(), found.member.end());
    return py::make_tuple(indices, output<bool>(member, {count}), found.angle, found.pitch);
}

constexpr double LARGEST_DISC = 200, LARGEST_LEVEL = 1e6;  // px, grey levels. Chosen: beyond any dot, and far from overflow

py::tuple measured_dots(const py::object& image, const py::object& places, const py::object& basis, const py::object& estimators,
                        const py::object& modes, const py::object& gains, const py::object& levers, const py::object& profile, int half,
                        double per_square, double smallest, double largest, double blur, double typical, double contrast, int ground,
                        double noise, double usual) {
    const Input<std::uint8_t> pixels(image, "image", {ANY, ANY});
    const Input<double> given(places, "places", {ANY, 2});
    const Input<float> rows(estimators, "estimators", {ANY, ANY, ANY, ESTIMATES, DIMENSIONS});
    const py::ssize_t sizes = rows.length(0), phases = rows.length(1);
    if (sizes < 2 || phases < 2 || rows.length(2) != phases)
        throw py::value_error("estimators: at least two sizes and as many phases down as across are needed");
    const Input<float> shapes(modes, "modes", {sizes, phases, phases, MODES, DIMENSIONS});
    const Input<double> gain(gains, "gains", {sizes, phases, phases}), lever(levers, "levers", {sizes, 2});
    within(half, "half", 1, LARGEST_HALF);
    const Input<std::int16_t> base(basis, "basis", {DIMENSIONS, padded((half + 1) * (half + 1))});
    const Input<float> along(profile, "profile", {ANY, ANY});
    within(std::min(along.length(0), along.length(1)), "profile", 2, 1e6);
    within(smallest, "smallest", 0.1, LARGEST_DISC), within(largest, "largest", smallest + 1e-3, 2 * LARGEST_DISC);
    DiscModel model{half, smallest, largest, within(blur, "blur", 0, LARGEST_DISC), sizes, phases};
    model.basis = base.data(), model.estimators = rows.data(), model.modes = shapes.data();
    model.gains = gain.data(), model.levers = lever.data();
    model.profiles = along.length(0), model.profile_length = along.length(1), model.profile = along.data();
    model.per_square = within(per_square, "per_square", 1e-3, 1e3);
    const DotLook look{within(typical, "typical", 0.5, LARGEST_DISC), within(contrast, "contrast", -LARGEST_LEVEL, LARGEST_LEVEL),
                       within(ground, "ground", 0, 255), within(noise, "noise", 0, LARGEST_LEVEL)};
    JudgedDots judged;
    {
        py::gil_scoped_release others_run;
        const Image seen = as_image(pixels);
        judged = judge_dots(seen, fit_dots(seen, given.data(), given.length(), model, look), model, look, usual);
    }
    py::array_t<double> dots({static_cast<py::ssize_t>(judged.dots.size()), py::ssize_t{4}});
    double* out = dots.mutable_data();
    for (const Dot& dot : judged.dots) *out++ = dot.u, *out++ = dot.v, *out++ = dot.area, *out++ = dot.sigma;
    return py::make_tuple(dots, judged.outgrown, judged.usual);
}

constexpr double LARGEST_RING = 128;  // px. Chosen: bounds the time

py::array_t<double> disc_peaks(const py::object& image, const py::object& inside, const py::object& support, double least, int apart,
                               double margin, double radius, double line) {
    const Input<float> pixels(image, "image", {ANY, ANY}), disc(inside, "inside", {ANY, ANY});
    const py::ssize_t side = disc.length();
    within(side, "inside", 1, LARGEST_RING);
    if (disc.length(1) != side) throw py::value_error("inside: as many rows as columns are needed");
    const Input<float> both(support, "support", {side, side});
    const DiscPeakRules rules{within(least, "least", -1, 1), within(apart, "apart", 0, LARGEST_RING), within(margin, "margin", -1, 1e6),
                              within(radius, "radius", 0, 1e6), within(line, "line", 0, 1)};
    std::vector<double> found;
    {
        py::gil_scoped_release others_run;
        for (const DiscPeak& peak :
             find_disc_peaks({pixels.data(), pixels.length(0), pixels.length(1)}, {side - 1, disc.data(), both.data()}, rules)) {
            found.insert(found.end(), {static_cast<double>(peak.column), static_cast<double>(peak.row), peak.correlation, peak.amplitude});
        }
    }
    return output(found, {static_cast<py::ssize_t>(found.size() / 4), 4});
}

py::array_t<double> worn_discs(const py::object& image, const py::object& places, double radius, double ring) {
    const Input<float> pixels(image, "image", {ANY, ANY});
    const Input<double> given(places, "places", {ANY, 2});
    within(radius, "radius", 0.5, LARGEST_RING / 4), within(ring, "ring", 1, 4);
    check_places(given, "places");
    std::vector<double> found;
    {
        py::gil_scoped_release others_run;
        for (const WornDisc& disc :
             fit_worn_discs({pixels.data(), pixels.length(0), pixels.length(1)}, given.data(), given.length(), radius, ring)) {
            found.insert(found.end(), {disc.u, disc.v, disc.radius, disc.sigma});
        }
    }
    return output(found, {static_cast<py::ssize_t>(found.size() / 4), 4});
}

constexpr double LARGEST_INDEX = 1e9;  // Chosen: beyond any grid, and differences stay far from overflow

py::tuple extrapolated(const py::object& places, const py::object& rc, const py::object& member, double pitch) {
    const Input<double> given(places, "places", {ANY, 2});
    const py::ssize_t count = given.length();
    const Input<std::int64_t> indices(rc, "rc", {count, 2});
    const Input<bool> members(member, "member", {count});
    within(pitch, "pitch", 1e-3, LARGEST_PLACE);
    for (py::ssize_t k = 0; k < 2 * count; ++k) {
        within(given.data()[k], "places", -LARGEST_PLACE, LARGEST_PLACE);
        within(indices.data()[k], "rc", -LARGEST_INDEX, LARGEST_INDEX);
    }
    std::vector<std::int64_t> numbers(indices.data(), indices.data() + 2 * count);
    std::vector<std::uint8_t> known(members.data(), members.data() + count);
    {
        py::gil_scoped_release others_run;
        extrapolate_indices(given.data(), count, pitch, numbers, known);
    }
    return py::make_tuple(output(numbers, {count, 2}), output<bool>({known.begin(), known.end()}, {count}));
}

constexpr double LONGEST_GRID = 2000, FARTHEST_INDEX = 1e6;  // rows, columns. Chosen: bound the memory

void check_ids(const Input<std::int64_t>& id, const char* name, std::int64_t least, std::int64_t rows, std::int64_t columns) {
    within(rows, "rows", 1, LONGEST_GRID), within(columns, "columns", 1, LONGEST_GRID);
    for (py::ssize_t k = 0; k < id.length(); ++k) {
        within(id.data()[k], name, static_cast<double>(least), static_cast<double>(rows * columns - 1));
    }
}

py::tuple anchored(const py::object& places, const py::object& rc, const py::object& member, const py::object& before,
                   const py::object& before_id, std::int64_t rows, std::int64_t columns, double pitch, double width, double height) {
    const Input<double> given(places, "places", {ANY, 2}), earlier(before, "before", {ANY, 2});
    const py::ssize_t count = given.length();
    const Input<std::int64_t> indices(rc, "rc", {count, 2}), id(before_id, "before_id", {earlier.length()});
    const Input<bool> members(member, "member", {count});
    check_places(given, "places"), check_places(earlier, "before");
    check_ids(id, "before_id", 0, rows, columns);
    for (py::ssize_t k = 0; k < 2 * count; ++k) within(indices.data()[k], "rc", -FARTHEST_INDEX, FARTHEST_INDEX);
    const GridView view{{rows, columns},
                        within(pitch, "pitch", 1e-3, LARGEST_PLACE),
                        within(width, "width", 0, LARGEST_PLACE),
                        within(height, "height", 0, LARGEST_PLACE)};
    Anchor anchor;
    std::vector<std::int64_t> numbers(count, -1);
    {
        py::gil_scoped_release others_run;
        IndexedDots dots, last{{earlier.data(), earlier.data() + 2 * earlier.length()}, {}};
        for (py::ssize_t i = 0; i < count; ++i) {
            if (!members.data()[i]) continue;
            dots.places.insert(dots.places.end(), given.data() + 2 * i, given.data() + 2 * i + 2);
            dots.rc.insert(dots.rc.end(), indices.data() + 2 * i, indices.data() + 2 * i + 2);
        }
        for (py::ssize_t i = 0; i < id.length(); ++i) last.rc.insert(last.rc.end(), {id.data()[i] / columns, id.data()[i] % columns});
        anchor = anchor_lattice(dots, last, view);
        for (py::ssize_t i = 0; i < count && anchor.fault == AnchorFault::NONE; ++i) {
            const std::int64_t row = indices.data()[2 * i] + anchor.offset[0], column = indices.data()[2 * i + 1] + anchor.offset[1];
            const bool inside = members.data()[i] && row >= 0 && column >= 0 && row < rows && column < columns;
            if (inside) numbers[i] = row * columns + column;
        }
    }
    return py::make_tuple(output(numbers, {count}), static_cast<int>(anchor.fault), anchor.axis, anchor.seen);
}

py::array_t<std::int64_t> without_outliers(const py::object& id, const py::object& places, std::int64_t rows, std::int64_t columns) {
    const Input<double> given(places, "places", {ANY, 2});
    const Input<std::int64_t> indices(id, "id", {given.length()});
    check_places(given, "places"), check_ids(indices, "id", -1, rows, columns);
    std::vector<std::int64_t> kept(indices.data(), indices.data() + indices.length());
    {
        py::gil_scoped_release others_run;
        reject_outliers(kept.data(), given.data(), given.length(), rows, columns);
    }
    return output(kept, {given.length()});
}

}  // namespace

void bind_dots(py::module_& module) {
    module.def(
        "find_peaks", &peaks, py::arg("image"), py::kw_only(), py::arg("step"), py::arg("smooth"), py::arg("box"), py::arg("sign"),
        py::arg("lowest"),
        "Rough places (N, 2) float64 of dots, px, in an image (H, W) uint8: peaks against their local ground.\n\n"
        "step: 1, or 2 to average two by two pixels into one first; smooth, box: px after that, odd: sides of the Gaussian that\n"
        "takes the noise off and of the square whose mean is the ground; sign: 1 for bright dots, -1 for dark; lowest: grey levels.");
    module.def(
        "measure_dots", &measured_dots, py::arg("image"), py::arg("places"), py::kw_only(), py::arg("basis"), py::arg("estimators"),
        py::arg("modes"), py::arg("gains"), py::arg("levers"), py::arg("profile"), py::arg("half"), py::arg("per_square"),
        py::arg("smallest"), py::arg("largest"), py::arg("blur"), py::arg("typical"), py::arg("contrast"), py::arg("ground"),
        py::arg("noise"), py::arg("usual"),
        "Dots (M, 4) float64 near places (N, 2) float64, px, in an image (H, W) uint8: u, v, px, area, px^2, standard deviation of u and "
        "v,\n"
        "px; whether larger ones than the model's were left out; median ratio of residual to contrast when usual was NaN, else usual.\n\n"
        "basis, estimators, modes, gains, levers, profile, half, per_square, smallest, largest, blur: tables and numbers of "
        "disc_model.DiscModel;\n"
        "typical, contrast, ground, noise: of the dots, appearance.Look.");
    module.def(
        "find_blob_regions", &blob_regions, py::arg("mask"), py::kw_only(), py::arg("speck"), py::arg("least"), py::arg("most"),
        "Connected regions of a mask (H, W) uint8 that its border does not cut, with areas between least and most times the upper median "
        "of\n"
        "those above speck px: box (N, 4) int32 left, top, width, height; centre (N, 2) float64; area (N,) int64; label (N,) uint16; and\n"
        "labels (H, W) uint16 of all regions, 0 ground.");
    module.def(
        "fit_blobs", &blobs, py::arg("image"), py::arg("small"), py::arg("labels"), py::arg("box"), py::arg("centre"), py::arg("label"),
        py::kw_only(), py::arg("step"),
        "Large bright markers (N, 6) float64 of an image (H, W) uint8: u, v, px, area, px^2, standard deviation of u and v, px, grey\n"
        "levels over the ground, area over that of the ellipse with the same moments; and the edges' blur, px.\n\n"
        "small: (h, w) uint8, the image reduced by step (1 or 2); labels: (h, w) uint16, its regions, which are grown by a pixel,\n"
        "except where two would meet; box: (N, 4) int32, left, top, width, height, inside it by a pixel or more;\n"
        "centre: (N, 2) float64; label: (N,) uint16, of each region.");
    module.def(
        "find_disc_peaks", &disc_peaks, py::arg("image"), py::arg("inside"), py::arg("support"), py::kw_only(), py::arg("least"),
        py::arg("apart"), py::arg("margin"), py::arg("radius"), py::arg("line"),
        "Peaks (N, 4) float64 of the normalised correlation of an image (H, W) float32 with bright discs: column, row, correlation,\n"
        "amplitude over the ring.\n\n"
        "inside, support: (n, n) float32, quadrants of disc, and disc and ring, from the centre outwards; least: correlation; apart: px "
        "to\n"
        "the nearest higher pixel; margin: px to the border; radius: px, where at most the share `line` of the correlation is left.");
    module.def(
        "fit_worn_discs", &worn_discs, py::arg("image"), py::arg("places"), py::kw_only(), py::arg("radius"), py::arg("ring"),
        "Bright discs (N, 4) float64 fitted to an image (H, W) float32 from finite places (N, 2) float64, px: u, v, radius, standard\n"
        "deviation of u and v, px. radius: px, typical; ring: outer radius of disc and ground over that of the disc.");
    module.def(
        "find_lattice", &lattice, py::arg("places"), py::arg("angle_hint") = 0.0,
        "Rows and columns (N, 2) int64 relative to each other of dots at finite places (N, 2) float64, px, on a printed grid; which\n"
        "of them are members (N,) bool; the angle of the rows against u, rad, within 45 degrees of angle_hint; the pitch, px. None\n"
        "where the dots form no grid, or one that contradicts itself.");
    module.def(
        "extrapolate_indices", &extrapolated, py::arg("places"), py::arg("rc"), py::arg("member"), py::kw_only(), py::arg("pitch"),
        "Rows and columns (N, 2) int64 and membership (N,) bool, extended from members to more dots at finite places (N, 2) float64, px;\n"
        "dots inconsistent with their neighbours lose membership. pitch: px.");
    module.def(
        "anchor_lattice", &anchored, py::arg("places"), py::arg("rc"), py::arg("member"), py::arg("before"), py::arg("before_id"),
        py::kw_only(), py::arg("rows"), py::arg("columns"), py::arg("pitch"), py::arg("width"), py::arg("height"),
        "Indices (N,) int64 on a printed grid, row * columns + column or -1, of dots at finite places (N, 2) float64, px; fault: 0, or 1\n"
        "too few dots, 2 another pattern, 3 border and last frame disagree, 4 ambiguous, and then its axis, 0 for rows, 1 for columns,\n"
        "and the number of them that is seen.\n\n"
        "rc: (N, 2) int64, relative rows and columns of members (N,) bool; before, before_id: (M, 2) float64, px, and (M,) int64, dots of\n"
        "the last indexed frame; pitch: px; width, height: of the image, px, 0 if unknown.");
    module.def(
        "reject_outliers", &without_outliers, py::arg("id"), py::arg("places"), py::kw_only(), py::arg("rows"), py::arg("columns"),
        "Indices (N,) int64 on a grid, row * columns + column or -1, of dots at finite places (N, 2) float64, px, with -1 for dots at and\n"
        "next to steps unlike those around them, and for dots off their node.");
}

}  // namespace tactile::border
