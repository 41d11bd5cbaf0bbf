// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels that compare markers with their untouched positions; see bindings.cpp.
#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "dots/reference.hpp"
#include "press/marker_field.hpp"

namespace tactile::border {
namespace {

// Markers of one frame.
struct Tracks {
    const Input<std::int64_t> id;
    const Input<double> uv, duv, area;

    Tracks(const py::object& id_, const py::object& uv_, const py::object& duv_, const py::object& area_)
        : id(id_, "id", {ANY}), uv(uv_, "uv", {id.length(), 2}), duv(duv_, "duv", {id.length(), 2}), area(area_, "area", {id.length()}) {}
    SeenTracks operator*() const { return {id.length(), id.data(), uv.data(), duv.data(), area.data()}; }
};

py::tuple followed_markers(const py::object& id, const py::object& uv, const py::object& duv, const py::object& area,
                           const py::object& known_uv, const py::object& known_area, const py::object& frames, double moved, double still,
                           double most_frames) {
    const Input<double> areas(known_area, "known_area", {ANY}), places(known_uv, "known_uv", {areas.length(), 2});
    const Input<double> counted(frames, "frames", {areas.length()});
    const py::ssize_t markers = areas.length();
    const Tracks tracks(id, uv, duv, area);
    const FollowedBy by{within(moved, "moved", 0, 1e6), within(still, "still", 0, 1e6), within(most_frames, "most_frames", 1, 1e9)};
    UntouchedMarkers rest{
        {places.data(), places.data() + 2 * markers}, {areas.data(), areas.data() + markers}, {counted.data(), counted.data() + markers}};
    {
        py::gil_scoped_release others_run;
        follow_markers(*tracks, by, rest);
    }
    return py::make_tuple(output(rest.uv, {markers, 2}), output(rest.area, {markers}), output(rest.frames, {markers}));
}

py::tuple field_of_markers(const py::object& id, const py::object& uv, const py::object& duv, const py::object& area,
                           const py::object& sigma, const py::object& places, const py::object& eye, const py::object& known_area,
                           double metres_per_px) {
    const Input<double> areas(known_area, "known_area", {ANY});
    const py::ssize_t markers = areas.length();
    const Tracks tracks(id, uv, duv, area);
    const py::ssize_t count = tracks.id.length();
    for (py::ssize_t i = 0; i < count; ++i) within(tracks.id.data()[i], "id", 0, static_cast<double>(markers) - 1);
    const Input<double> apparent(places, "places", {2 * count, 3}), eyes(eye, "eye", {ANY, 3});
    if (eyes.length() != 1 && eyes.length() < count) throw py::value_error("eye: one, or one for each marker, is needed");
    const Input<double> noise(sigma, "sigma", {count});
    FieldArrays field;
    {
        py::gil_scoped_release others_run;
        field = make_field(
            *tracks, {apparent.data(), apparent.data() + 3 * count, eyes.data(), eyes.length() == 1 ? 0 : 3, noise.data(), metres_per_px},
            areas.data(), markers);
    }
    return py::make_tuple(output(field.rest, {markers, 2}), output(field.shift, {markers, 2}), output(field.growth, {markers}),
                          output(field.eye, {markers, 3}), output(field.sigma, {markers}), output(field.uv, {markers, 2}),
                          output(field.duv, {markers, 2}), output(field.area, {markers}));
}

bool any_rest_moved(const py::object& id, const py::object& places, const py::object& motions, const py::object& known, double limit) {
    const Input<std::int64_t> numbers(id, "id", {ANY});
    const Input<double> given(places, "places", {numbers.length(), 2}), moves(motions, "motions", {numbers.length(), 2});
    const Input<double> still(known, "known", {ANY, 2});
    for (py::ssize_t i = 0; i < numbers.length(); ++i) within(numbers.data()[i], "id", 0, static_cast<double>(still.length()) - 1);
    return rest_moved(numbers.data(), given.data(), moves.data(), numbers.length(), still.data(), within(limit, "limit", 0, LARGEST_PLACE));
}

}  // namespace

void bind_links(py::module_& module) {
    module.def("follow_markers", &followed_markers, py::arg("id"), py::arg("uv"), py::arg("duv"), py::arg("area"), py::arg("known_uv"),
               py::arg("known_area"), py::arg("frames"), py::kw_only(), py::arg("moved"), py::arg("still"), py::arg("most_frames"),
               "Untouched positions (K, 2), px, mean areas (K,), px^2, and numbers of frames in the means (K,), updated with a frame's\n"
               "markers (N): see RestMarkers in press/field.py.");
    module.def(
        "marker_field", &field_of_markers, py::arg("id"), py::arg("uv"), py::arg("duv"), py::arg("area"), py::arg("sigma"),
        py::arg("places"), py::arg("eye"), py::arg("known_area"), py::kw_only(), py::arg("metres_per_px"),
        "rest, shift, growth, eye, sigma, uv, duv, area of a MarkerField (K), from a frame's markers (N): places: (2 N, 3) apparent\n"
        "x, y, m, and area of a pixel, m^2, now, then untouched; eye: (N or more, 3) m, or (1, 3) of all; known_area: (K,) px^2, "
        "untouched.");
    module.def("rest_moved", &any_rest_moved, py::arg("id"), py::arg("places"), py::arg("motions"), py::arg("known"), py::kw_only(),
               py::arg("limit"),
               "Whether any dot id (N,) int64 at places less motions (N, 2), px, is farther than limit, px, along an axis from its known\n"
               "place (K, 2), px, or that is NaN; dots that are not finite do not count.");
}

}  // namespace tactile::border
