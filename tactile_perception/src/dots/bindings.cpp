// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots for Python, as module _core.dots.
#include "bindings/bindings.hpp"

#include <memory>
#include <optional>

#include "bindings/border.hpp"
#include "dots/blobs.hpp"
#include "dots/finder.hpp"
#include "dots/lattice.hpp"
#include "dots/links.hpp"
#include "dots/number.hpp"
#include "dots/reference.hpp"

namespace tactile::border {
namespace {

constexpr double LARGEST_DISC = 100, LARGEST_LEVEL = 1e6;  // px, grey levels: beyond any dot, and far from overflow
constexpr double LONGEST_GRID = 2000;                      // rows, columns: bounds the memory
constexpr double FARTHEST_TRACK = 1e9;                     // px: positions beyond it are invalid
constexpr double LONGEST_S = 1e12;                         // of a stamp or a time constant

Image as_image(const Input<std::uint8_t>& image) {
    return {image.data(), image.length(0), image.length(1)};
}

// Rows of places (N, 2) that are positions: finite and nearer than this; which: their indices.
struct Places {
    std::vector<double> uv;
    std::vector<py::ssize_t> which;
    py::ssize_t given;

    Places(const py::object& places, const char* name, double most) {
        const Input<double> all(places, name, {ANY, 2});
        given = all.length();
        for (py::ssize_t i = 0; i < given; ++i) {
            const double u = all.data()[2 * i], v = all.data()[2 * i + 1];
            if (std::abs(u) <= most && std::abs(v) <= most) uv.insert(uv.end(), {u, v}), which.push_back(i);
        }
    }
    py::ssize_t count() const { return static_cast<py::ssize_t>(which.size()); }
    // Numbers of all rows, -1 for those that are no positions.
    py::array_t<std::int64_t> numbers(const std::vector<std::int64_t>& found) const {
        py::array_t<std::int64_t> all(given);
        std::fill_n(all.mutable_data(), given, -1);
        for (std::size_t k = 0; k < which.size(); ++k) all.mutable_data()[which[k]] = found[k];
        return all;
    }
};

template <class T>
std::vector<T> table(const py::object& model, const char* name, std::initializer_list<py::ssize_t> shape) {
    const Input<T> values(model.attr(name), name, shape);
    py::ssize_t count = 1, axis = 0;
    for ([[maybe_unused]] const py::ssize_t length : shape) count *= values.length(axis++);
    return {values.data(), values.data() + count};
}

double number(const py::object& owner, const char* name, double least, double most) {
    return within(owner.attr(name).cast<double>(), name, least, most);
}

// The tables of tactile_perception.dots.fit.DiscModel.
std::shared_ptr<const DiscModel> as_model(const py::object& given) {
    const Input<float> rows(given.attr("estimators"), "estimators", {ANY, ANY, ANY, ESTIMATES, DIMENSIONS});
    const Input<float> profile(given.attr("profile"), "profile", {ANY, ANY});
    const py::ssize_t sizes = rows.length(0), phases = rows.length(1);
    if (sizes < 2 || phases < 2) throw py::value_error("estimators: at least two sizes and phases are needed");
    within(std::min(profile.length(0), profile.length(1)), "profile", 2, 1e6);
    DiscModel model{};
    model.half = static_cast<py::ssize_t>(number(given, "half", 1, LARGEST_HALF));
    model.smallest = number(given, "smallest", 0.1, LARGEST_DISC);
    model.largest = number(given, "largest", model.smallest + 1e-3, 2 * LARGEST_DISC);
    model.blur = number(given, "blur", 0, LARGEST_DISC);
    model.diameters = sizes, model.phases = phases;
    model.basis = table<std::int16_t>(given, "basis", {DIMENSIONS, padded((model.half + 1) * (model.half + 1))});
    model.estimators = table<float>(given, "estimators", {sizes, phases, phases, ESTIMATES, DIMENSIONS});
    model.modes = table<float>(given, "modes", {sizes, phases, phases, MODES, DIMENSIONS});
    model.gains = table<double>(given, "gains", {sizes, phases, phases});
    model.levers = table<double>(given, "levers", {sizes, 2});
    model.profiles = profile.length(0), model.profile_length = profile.length(1);
    model.profile = table<float>(given, "profile", {ANY, ANY});
    model.per_square = number(given, "per_square", 1e-3, 1e3);
    return std::make_shared<DiscModel>(std::move(model));
}

// The numbers of tactile_perception.dots.look.Look.
DotLook as_look(const py::object& given) {
    return {number(given, "typical", 0.5, LARGEST_DISC), number(given, "contrast", -LARGEST_LEVEL, LARGEST_LEVEL),
            static_cast<int>(std::nearbyint(number(given, "ground", 0, 255))), number(given, "noise", 0, LARGEST_LEVEL),
            static_cast<int>(number(given, "step", 1, 1e3))};
}

FoundDots found_dots(DotFinder& finder, const py::object& image, const py::object& candidates) {
    const Input<std::uint8_t> pixels(image, "image", {ANY, ANY});
    const Places places(candidates, "candidates", LARGEST_PLACE);
    return change(finder, [&](DotFinder& next) { return next.find(as_image(pixels), places.uv); });
}

template <class Result>
py::array_t<double> each(const std::vector<Result>& results, double Result::*field) {
    py::array_t<double> values(static_cast<py::ssize_t>(results.size()));
    for (std::size_t i = 0; i < results.size(); ++i) values.mutable_data()[i] = results[i].*field;
    return values;
}

template <class Result>
py::array_t<double> positions(const std::vector<Result>& results) {
    py::array_t<double> values({static_cast<py::ssize_t>(results.size()), py::ssize_t{2}});
    for (std::size_t i = 0; i < results.size(); ++i)
        values.mutable_data()[2 * i] = results[i].u, values.mutable_data()[2 * i + 1] = results[i].v;
    return values;
}

Blobs blobs(const py::object& image, const py::object& small, const py::object& labels, const py::object& box, const py::object& centre,
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
    return without_gil([&] { return fit_blobs(as_image(pixels), as_image(few), step, named.data(), regions); });
}

Lattice lattice(const py::object& places, double angle_hint) {
    const Input<double> given(places, "places", {ANY, 2});
    within(angle_hint, "angle_hint", -1e3, 1e3);
    check_places(given, "places");
    return without_gil([&] { return find_lattice(given.data(), given.length(), angle_hint); });
}

GridNumbering make_numbering(std::int64_t rows, std::int64_t columns) {
    if (rows < 2 || columns < 2 || static_cast<double>(std::max(rows, columns)) > LONGEST_GRID) {
        refuse("BadArgument", "a grid has at least 2 rows and 2 columns, not " + std::to_string(rows) + " x " + std::to_string(columns) +
                                  "; use rows = columns = 0 with the tracker for other patterns");
    }
    return {rows, columns};
}

struct Numbers {
    py::array_t<std::int64_t> id;
    std::string reason;
    double pitch;
};

Numbers numbered(GridNumbering& numbering, const py::object& uv, double, double) {
    const Places places(uv, "uv", LARGEST_PLACE);
    GridNumbers found = change(numbering, [&](GridNumbering& next) { return next.number(places.uv.data(), places.count()); });
    return {places.numbers(found.id), std::move(found.reason), found.pitch};
}

void remembered(GridNumbering& numbering, const py::object& uv, const py::object& id) {
    const Input<double> places(uv, "uv", {ANY, 2});
    const Input<std::int64_t> ids(id, "id", {places.length()});
    check_places(places, "uv");
    for (py::ssize_t k = 0; k < ids.length(); ++k) within(ids.data()[k], "id", -1, static_cast<double>(numbering.count() - 1));
    numbering.remember(places.data(), ids.data(), ids.length());
}

Linker make_linker(double gate, std::int64_t confirm, double keep_s) {
    if (!(gate > 0 && gate < 1e6 && confirm >= 1 && keep_s >= 0)) {
        refuse("BadArgument", "gate > 0, confirm >= 1 and keep_s >= 0 are needed, not " + std::to_string(gate) + ", " +
                                  std::to_string(confirm) + ", " + std::to_string(keep_s));
    }
    return {gate, confirm, keep_s};
}

py::array_t<std::int64_t> linked(Linker& linker, const py::object& uv, double stamp_s) {
    const Places places(uv, "uv", FARTHEST_TRACK);
    within(stamp_s, "stamp_s", -LONGEST_S, LONGEST_S);
    return places.numbers(change(linker, [&](Linker& next) { return next.update(places.uv.data(), places.count(), stamp_s); }));
}

py::array_t<std::int64_t> links(const py::object& places, const py::object& dots, double gate) {
    const Input<double> from(places, "places", {ANY, 2}), to(dots, "dots", {ANY, 2});
    check_places(from, "places"), check_places(to, "dots");
    within(gate, "gate", 0, LARGEST_PLACE);
    std::vector<std::int64_t> found;
    for (const auto& [place, dot] : without_gil([&] { return link_places(from.data(), from.length(), to.data(), to.length(), gate); }))
        found.insert(found.end(), {place, dot});
    return rows_of(found, 2);
}

Reference make_reference(double time_constant_s, std::int64_t frames) {
    if (!(time_constant_s > 0 && frames >= 1)) {
        refuse("BadArgument",
               "time_constant_s > 0 and frames >= 1 are needed, not " + std::to_string(time_constant_s) + " and " + std::to_string(frames));
    }
    return {time_constant_s, frames};
}

void begin(Reference& reference, const py::object& id, const py::object& uv, const py::object& frames) {
    const Input<std::int64_t> ids(id, "id", {ANY}), counts(frames, "frames", {ids.length()});
    const Input<double> places(uv, "uv", {ids.length(), 2});
    check_places(places, "uv");
    for (py::ssize_t k = 0; k < counts.length(); ++k) within(counts.data()[k], "frames", 0, 1e9);
    reference.begin(ids.data(), places.data(), counts.data(), ids.length());
}

// Rows whose position is not finite count as not seen.
py::array_t<double> displaced(Reference& reference, const py::object& id, const py::object& uv, const py::object& sigma, double stamp_s,
                              std::optional<bool> touched) {
    const Places places(uv, "uv", LARGEST_PLACE);
    const Input<std::int64_t> ids(id, "id", {places.given});
    const Input<double> noise(sigma, "sigma", {places.given});
    SeenDots dots{{}, places.uv, {}};
    for (const py::ssize_t k : places.which) dots.id.push_back(ids.data()[k]), dots.sigma.push_back(noise.data()[k]);
    const std::vector<double> moved = change(reference, [&](Reference& next) { return next.update(dots, stamp_s, touched); });
    py::array_t<double> all({places.given, py::ssize_t{2}});
    std::fill_n(all.mutable_data(), 2 * places.given, NAN);
    for (std::size_t k = 0; k < places.which.size(); ++k) std::copy_n(moved.data() + 2 * k, 2, all.mutable_data() + 2 * places.which[k]);
    return all;
}

py::array_t<double> places_of(const Reference& reference, const py::object& id) {
    const Input<std::int64_t> ids(id, "id", {ANY});
    return rows_of(reference.places(ids.data(), ids.length()), 2);
}

void bind_detection(py::module_& module) {
    py::class_<FoundDots>(module, "FoundDots", "Dots of an image.")
        .def_property_readonly(
            "uv", [](const FoundDots& found) { return positions(found.dots); }, "(N, 2) px")
        .def_property_readonly(
            "area", [](const FoundDots& found) { return each(found.dots, &Dot::area); }, "(N,) px^2")
        .def_property_readonly(
            "sigma", [](const FoundDots& found) { return each(found.dots, &Dot::sigma); }, "(N,) px, per axis")
        .def_readonly("outgrown", &FoundDots::outgrown, "whether larger ones than the model's were left out");
    py::class_<DotFinder> finder(
        module, "DotFinder",
        "Finds dots by a maximum-likelihood fit of each candidate, and its judgement. model: dots.fit.DiscModel; look:\n"
        "dots.look.Look. The first image tells how much dots differ from discs. It can be copied.");
    finder.def(py::init([](const py::object& model, const py::object& look) { return DotFinder(as_model(model), as_look(look)); }),
               py::arg("model"), py::arg("look"));
    finder.def("find", &found_dots, py::arg("image"), py::arg("candidates"),
               "Dots near candidates (N, 2) float64, px, of an image (H, W) uint8, reduced as the look says, in px of the whole image.");
    copyable(finder);
    py::class_<Blobs>(module, "Blobs", "Large bright markers.")
        .def_property_readonly(
            "uv", [](const Blobs& found) { return positions(found.blobs); }, "(N, 2) px")
        .def_property_readonly(
            "area", [](const Blobs& found) { return each(found.blobs, &Blob::area); }, "(N,) px^2")
        .def_property_readonly(
            "sigma", [](const Blobs& found) { return each(found.blobs, &Blob::sigma); }, "(N,) px, per axis")
        .def_property_readonly(
            "amplitude", [](const Blobs& found) { return each(found.blobs, &Blob::amplitude); }, "(N,) grey levels over the ground")
        .def_property_readonly(
            "solidity", [](const Blobs& found) { return each(found.blobs, &Blob::solidity); },
            "(N,) area over that of the ellipse with the same second moments")
        .def_readonly("blur", &Blobs::blur, "px, of the edges");
    module.def(
        "fit_blobs", &blobs, py::arg("image"), py::arg("small"), py::arg("labels"), py::arg("box"), py::arg("centre"), py::arg("label"),
        py::kw_only(), py::arg("step"),
        "Large bright markers of an image (H, W) uint8, by moments of weights that rise from ground to plateau on a marker's edge.\n\n"
        "small: (h, w) uint8, the image reduced by step (1 or 2); labels: (h, w) uint16, its regions, grown by a pixel; box: (N, 4)\n"
        "int32, left, top, width, height of the regions as they were, inside it by a pixel or more; centre: (N, 2) float64; label:\n"
        "(N,) uint16, of each region.");
}

void bind_numbers(py::module_& module) {
    py::class_<Lattice>(module, "Lattice", "Relative indices of dots on a printed grid.")
        .def_readonly("found", &Lattice::found, "whether the dots form a grid that does not contradict itself")
        .def_property_readonly(
            "rc", [](const Lattice& one) { return rows_of(one.rc, 2); }, "(N, 2) int64, row and column, valid for members")
        .def_property_readonly(
            "member", [](const Lattice& one) { return mask(one.member); }, "(N,) bool")
        .def_readonly("angle", &Lattice::angle, "rad, of the rows from u")
        .def_readonly("pitch", &Lattice::pitch, "px");
    module.def(
        "find_lattice", &lattice, py::arg("places"), py::arg("angle_hint") = 0.0,
        "Lattice of dots at finite places (N, 2) float64, px; of the four possible directions of its rows the one within 45 degrees\n"
        "of angle_hint, rad.");
    py::class_<Numbers>(module, "GridNumbers", "Indices of N dots on a printed grid.")
        .def(py::init([](const py::array_t<std::int64_t>& id, const std::string& reason, double pitch) {
                 return Numbers{id, reason, pitch};
             }),
             py::arg("id"), py::arg("reason") = "", py::arg("pitch") = std::nan(""))
        .def_readonly("id", &Numbers::id, "(N,) int64, row * columns + column, -1 where not certain")
        .def_readonly("reason", &Numbers::reason, "empty, or why no dot is indexed")
        .def_readonly("pitch", &Numbers::pitch, "px, NaN where unknown")
        .def_property_readonly(
            "certain", [](const Numbers& one) { return one.reason.empty(); },
            "whether the frame is indexed; single dots may still have -1");
    py::class_<GridNumbering> numbering(
        module, "GridNumbering",
        "Row and column of dots on a printed grid of rows x columns; row 0 on top, column 0 left. Rows may be rotated by up to 38 "
        "degrees.\n"
        "Each frame is numbered anew; the last certain one tells which rows are seen where some are hidden. It can be copied. Raises "
        "BadArgument for\n"
        "a grid smaller than 2 x 2.");
    numbering.def(py::init(&make_numbering), py::arg("rows"), py::arg("columns"));
    numbering.def("number", &numbered, py::arg("uv"), py::arg("width") = 0.0, py::arg("height") = 0.0,
                  "GridNumbers of dots at uv (N, 2) float64, px, in any order; rows that are no positions get -1. The published method\n"
                  "needs width and height of the image; this one does not.");
    numbering.def("remember", &remembered, py::arg("uv"), py::arg("id"),
                  "Take dots at uv (N, 2) float64, px, with indices id (N,) int64, -1 for none, as the last certain frame.");
    copyable(numbering);
    py::class_<Linker> linker(
        module, "Linker",
        "Tracks of dots from frame to frame by mutual nearest neighbours with a constant velocity prediction; ids are never used again. It "
        "can be\n"
        "copied. gate: search range, median spacings from the predicted position; confirm: frames in a row before a dot that appears "
        "later\n"
        "is reported; keep_s: s that a lost track is kept. Raises BadArgument for values out of range.");
    linker.def(py::init(&make_linker), py::arg("gate") = 0.7, py::arg("confirm") = 3, py::arg("keep_s") = 2.0);
    linker.def(
        "update", &linked, py::arg("uv"), py::arg("stamp_s"),
        "Track id (N,) int64 of each dot at uv (N, 2) float64, px, -1 while new and for rows that are no positions; stamp_s, s, must\n"
        "increase.");
    linker.def("reset", &Linker::reset, "Drop all tracks; ids go on.");
    copyable(linker);
    module.def(
        "link_places", &links, py::arg("places"), py::arg("dots"), py::kw_only(), py::arg("gate"),
        "Links (K, 2) int64, place and dot, between places (M, 2) and dots (N, 2) float64, px, that are each other's nearest and closer\n"
        "than gate, px.");
}

void bind_reference(py::module_& module) {
    py::class_<Reference> reference(
        module, "Reference",
        "Untouched positions of numbered dots: averaged over the first frames, followed with time_constant_s, s, as they drift, held "
        "during\n"
        "contact. It can be copied. Raises BadArgument for a time constant that is not positive or frames below 1.");
    reference.def(py::init(&make_reference), py::arg("time_constant_s") = 30.0, py::arg("frames") = 10);
    reference.def("reset", &Reference::reset, "Drop all positions.");
    reference.def(
        "begin", &begin, py::arg("id"), py::arg("uv"), py::arg("frames"),
        "Replace the positions by uv (N, 2) float64, px, of dots id (N,) int64; frames: (N,) int64, as how many averaged frames each\n"
        "counts. Earlier contacts are forgotten.");
    reference.def(
        "update", &displaced, py::arg("id"), py::arg("uv"), py::arg("sigma"), py::arg("stamp_s"), py::arg("touched") = py::none(),
        "Displacements (N, 2) px of dots id (N,) int64 at uv (N, 2) with standard deviations sigma (N,) float64, px; NaN without a\n"
        "reference position. touched: as known by a later stage, None to decide by the dots.");
    reference.def("places", &places_of, py::arg("id"), "Reference positions (N, 2) px of dots id (N,) int64, NaN where unknown.");
    reference.def_property_readonly(
        "id", [](const Reference& one) { return row_of(one.id()); }, "(K,) int64, rising");
    reference.def_property_readonly(
        "uv", [](const Reference& one) { return rows_of(one.uv(), 2); }, "(K, 2) px");
    reference.def_property_readonly("touched", &Reference::touched, "whether something touched in the last frame");
    reference.def_property_readonly("grown", &Reference::grown, "whether the last frame added dots");
    copyable(reference);
}

}  // namespace

void bind_dots(py::module_& parent) {
    py::module_ module = parent.def_submodule("dots", "Dots: detection, numbers, tracks, reference.");
    bind_detection(module);
    bind_numbers(module);
    bind_reference(module);
}

}  // namespace tactile::border
