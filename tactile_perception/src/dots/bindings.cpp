// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots for Python, as module _core.dots.
#include "bindings/bindings.hpp"

#include <memory>

#include "bindings/border.hpp"
#include "dots/blobs.hpp"
#include "dots/finder.hpp"
#include "dots/lattice.hpp"
#include "dots/links.hpp"

namespace tactile::border {
namespace {

constexpr double LARGEST_DISC = 100, LARGEST_LEVEL = 1e6;  // px, grey levels: beyond any dot, and far from overflow

Image as_image(const Input<std::uint8_t>& image) {
    return {image.data(), image.length(0), image.length(1)};
}

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
    model.basis = table<float>(given, "basis", {(model.half + 1) * (model.half + 1), DIMENSIONS});
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

FoundDots found_dots(const DotFinder& finder, const py::object& image) {
    const Input<std::uint8_t> pixels(image, "image", {ANY, ANY});
    return without_gil([&] { return finder.find(as_image(pixels)); });
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

Lattice lattice(const py::object& places) {
    const Input<double> given(places, "places", {ANY, 2});
    check_places(given, "places");
    return without_gil([&] { return find_lattice(given.data(), given.length()); });
}

Positions columns(const Input<double>& given, const char* name) {
    check_places(given, name);
    return Eigen::Map<const Positions>(given.data(), 2, given.length());
}

TrackLinks links(const py::object& last, const py::object& predicted, const py::object& first, const py::object& seen,
                 const py::object& dots, const std::array<double, 2>& size) {
    const Input<double> at(last, "last", {ANY, 2}), next(predicted, "predicted", {at.length(), 2}), begun(first, "first", {at.length(), 2});
    const Input<double> found(dots, "dots", {ANY, 2});
    const Input<bool> shown(seen, "seen", {at.length()});
    within(at.length(), "last", 2, 1e6);
    within(found.length(), "dots", 1, 1e6);
    for (const double length : size) within(length, "size", 0, std::numeric_limits<double>::infinity());
    const TracksBefore tracks{columns(at, "last"), columns(next, "predicted"), columns(begun, "first"),
                              {shown.data(), shown.data() + shown.length()}};
    within(std::count(tracks.seen.begin(), tracks.seen.end(), 1), "seen", 1, 1e6);
    const Positions uv = columns(found, "dots");
    return without_gil([&] { return link_tracks(tracks, uv, {size[0], size[1]}); });
}

void bind_detection(py::module_& module) {
    py::class_<FoundDots>(module, "FoundDots", "Dots of an image.")
        .def_property_readonly(
            "uv", [](const FoundDots& found) { return positions(found.dots); }, "(N, 2) px")
        .def_property_readonly(
            "area", [](const FoundDots& found) { return each(found.dots, &Dot::area); }, "(N,) px^2")
        .def_property_readonly(
            "sigma", [](const FoundDots& found) { return each(found.dots, &Dot::sigma); }, "(N,) px, per axis")
        .def_property_readonly("candidates", rows(&FoundDots::candidates, 2), "(N, 2) px, of peaks that were fitted")
        .def_readonly("outgrown", &FoundDots::outgrown, "whether larger ones than the model's were left out");
    py::class_<DotLimits>(module, "DotLimits", "What decides what is a dot: docs/constants.md.")
        .def(py::init())
        .def_readwrite("same", &DotLimits::same)
        .def_readwrite("met", &DotLimits::met)
        .def_readwrite("farthest", &DotLimits::farthest)
        .def_readwrite("faintest", &DotLimits::faintest)
        .def_readwrite("noise", &DotLimits::noise)
        .def_readwrite("plain", &DotLimits::plain)
        .def_readwrite("usual", &DotLimits::usual)
        .def_readwrite("unlikest", &DotLimits::unlikest);
    py::class_<DotFinder> finder(
        module, "DotFinder",
        "Finds dots by a maximum-likelihood fit of each candidate, and its judgement. model: dots.fit.DiscModel; look:\n"
        "dots.look.Look; limits: DotLimits. It can be copied.");
    finder.def(py::init([](const py::object& model, const py::object& look, const DotLimits& limits) {
                   return DotFinder(as_model(model), as_look(look), limits);
               }),
               py::arg("model"), py::arg("look"), py::arg_v("limits", DotLimits(), "DotLimits()"));
    finder.def("find", &found_dots, py::arg("image"), "Dots of an image (H, W) uint8, reduced as the look says, in px of the whole image.");
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

void bind_lattice(py::module_& module) {
    py::class_<Lattice>(module, "Lattice", "Relative indices of dots on a printed grid.")
        .def_readonly("found", &Lattice::found, "whether the dots form a grid that does not contradict itself")
        .def_property_readonly("rc", rows(&Lattice::rc, 2), "(N, 2) int64, row and column, valid for members")
        .def_property_readonly("member", marked(&Lattice::member), "(N,) bool")
        .def_readonly("angle", &Lattice::angle, "rad, of the rows from u")
        .def_readonly("pitch", &Lattice::pitch, "px");
    module.def(
        "find_lattice", &lattice, py::arg("places"),
        "Lattice of dots at finite places (N, 2) float64, px; of the four possible directions of its rows the one within 45 degrees\n"
        "of u.");
}

void bind_links(py::module_& module) {
    py::class_<TrackLinks>(module, "TrackLinks", "Links from tracks to the dots of a frame.")
        .def_property_readonly("dot", row(&TrackLinks::dot), "(M,) int32, of each track, -1 for none")
        .def_property_readonly("position", rows(&TrackLinks::position, 2), "(M, 2) px, of tracks without a link as their neighbours move")
        .def_readonly("spacing", &TrackLinks::spacing, "px, typical distance of neighbours")
        .def_readonly("ambiguous", &TrackLinks::ambiguous, "tracks without a link that a dot without one may continue");
    module.def("link_tracks", &links, py::arg("last"), py::arg("predicted"), py::arg("first"), py::arg("seen"), py::arg("dots"),
               py::arg("size"),
               "Links at least two tracks, at (M, 2) float64 px, with dots (N, 2) px; seen: (M,) bool, by the last frame; size: px of the\n"
               "image. A link that another probable motion of the pattern contradicts is none.");
}

}  // namespace

void bind_dots(py::module_& parent) {
    py::module_ module = parent.def_submodule("dots", "Dots: detection, and their lattice.");
    bind_detection(module);
    bind_lattice(module);
    bind_links(module);
}

}  // namespace tactile::border
