// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels that link dots to each other and compare them with their reference; see bindings.cpp.
#include <algorithm>
#include <limits>

#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "dots/index/assignment.hpp"
#include "dots/index/neighbours.hpp"
#include "dots/reference/reference_drift.hpp"
#include "press/marker_field.hpp"

namespace tactile::border {
namespace {

// Indices of ids among known ids, which must rise.
std::vector<std::ptrdiff_t> found_ids(const Input<std::int64_t>& id, const Input<std::int64_t>& known) {
    if (!std::is_sorted(known.data(), known.data() + known.length())) throw py::value_error("known_id: numbers that rise are needed");
    return find_ids(id.data(), id.length(), known.data(), known.length());
}

py::array_t<double> placed(const py::object& id, const py::object& known_id, const py::object& known_places) {
    const Input<std::int64_t> wanted(id, "id", {ANY}), known(known_id, "known_id", {ANY});
    const Input<double> given(known_places, "known_places", {known.length(), 2});
    const std::vector<std::ptrdiff_t> at = found_ids(wanted, known);
    std::vector<double> places(2 * wanted.length(), std::numeric_limits<double>::quiet_NaN());
    for (py::ssize_t i = 0; i < wanted.length(); ++i) {
        if (at[i] >= 0) std::copy_n(given.data() + 2 * at[i], 2, places.data() + 2 * i);
    }
    return output(places, {wanted.length(), 2});
}

py::tuple followed(const py::object& id, const py::object& places, const py::object& known_id, const py::object& known_places,
                   const py::object& counts, std::int64_t frames, double slow) {
    const Input<std::int64_t> wanted(id, "id", {ANY}), known(known_id, "known_id", {ANY}), number(counts, "counts", {known.length()});
    const Input<double> given(places, "places", {wanted.length(), 2}), rest(known_places, "known_places", {known.length(), 2});
    within(frames, "frames", 1, 1e9), within(slow, "slow", 0, 1);
    for (py::ssize_t k = 0; k < number.length(); ++k) within(number.data()[k], "counts", 0, 1e15);
    const std::vector<std::ptrdiff_t> at = found_ids(wanted, known);
    std::vector<double> moved(rest.data(), rest.data() + 2 * rest.length());
    std::vector<std::int64_t> frames_seen(number.data(), number.data() + number.length());
    follow_drift(moved.data(), frames_seen.data(), at.data(), given.data(), wanted.length(), frames, slow);
    return py::make_tuple(output(moved, {known.length(), 2}), output(frames_seen, {known.length()}));
}

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

py::tuple deviation(const py::object& places, const py::object& motions, const py::object& sigma) {
    const Input<double> given(places, "places", {ANY, 2}), moves(motions, "motions", {given.length(), 2});
    const Input<double> noise(sigma, "sigma", {given.length()});
    Deviation found;
    {
        py::gil_scoped_release others_run;
        found = deviation_from_drift(given.data(), moves.data(), noise.data(), given.length());
    }
    return py::make_tuple(found.moved, found.size);
}

bool stayed(const py::object& id, const py::object& places, const py::object& sigma, const py::object& before_id,
            const py::object& before) {
    const Input<std::int64_t> now(id, "id", {ANY}), then(before_id, "before_id", {ANY});
    const Input<double> given(places, "places", {now.length(), 2}), noise(sigma, "sigma", {now.length()});
    const Input<double> earlier(before, "before", {then.length(), 2});
    py::gil_scoped_release others_run;
    return have_stayed({now.data(), given.data(), now.length()}, noise.data(), {then.data(), earlier.data(), then.length()});
}

py::array_t<std::int64_t> assigned(const py::object& cost) {
    const Input<double> given(cost, "cost", {ANY, ANY});
    const py::ssize_t rows = given.length(0), columns = given.length(1);
    if (rows > columns) throw py::value_error("cost: at least as many columns as rows are needed");
    for (py::ssize_t k = 0; k < rows * columns; ++k)
        within(given.data()[k], "cost", -LARGEST_PLACE * LARGEST_PLACE, LARGEST_PLACE * LARGEST_PLACE);
    std::vector<std::ptrdiff_t> found;
    {
        py::gil_scoped_release others_run;
        found = assign_least({given.data(), given.data() + rows * columns}, rows, columns);
    }
    return output<std::int64_t>({found.begin(), found.end()}, {rows});
}

py::array_t<std::int64_t> linked(const py::object& places, const py::object& dots, double gate) {
    const Input<double> from(places, "places", {ANY, 2}), to(dots, "dots", {ANY, 2});
    check_places(from, "places"), check_places(to, "dots");
    within(gate, "gate", 0, LARGEST_PLACE);
    std::vector<std::int64_t> found;
    {
        py::gil_scoped_release others_run;
        for (const auto& [place, dot] : link_places(from.data(), from.length(), to.data(), to.length(), gate)) {
            found.insert(found.end(), {place, dot});
        }
    }
    return output(found, {static_cast<py::ssize_t>(found.size() / 2), 2});
}

py::tuple nearest(const py::object& places, int count) {
    const Input<double> given(places, "places", {ANY, 2});
    check_places(given, "places"), within(count, "count", 1, MOST_NEIGHBOURS);
    std::vector<Neighbour> found;
    {
        py::gil_scoped_release others_run;
        found = nearest_others(given.data(), given.length(), count);
    }
    std::vector<std::int64_t> index;
    std::vector<double> distance;
    for (const Neighbour& near : found) index.push_back(near.index), distance.push_back(near.distance);
    return py::make_tuple(output(index, {given.length(), count}), output(distance, {given.length(), count}));
}

}  // namespace

void bind_links(py::module_& module) {
    module.def(
        "reference_places", &placed, py::arg("id"), py::arg("known_id"), py::arg("known_places"),
        "Places (N, 2) float64 of ids (N,) int64 among known ids (K,) int64, which rise, at known places (K, 2) float64; NaN for others.");
    module.def(
        "follow_drift", &followed, py::arg("id"), py::arg("places"), py::arg("known_id"), py::arg("known_places"), py::arg("counts"),
        py::kw_only(), py::arg("frames"), py::arg("slow"),
        "Known places (K, 2) float64, moved towards places (N, 2) float64, px, of the dots id (N,) int64: to their mean over the first\n"
        "frames, afterwards by the share `slow`; and counts (K,) int64, the number of frames of each, increased. known_id: (K,) int64, "
        "rises.");
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
    module.def("deviation_from_drift", &deviation, py::arg("places"), py::arg("motions"), py::arg("sigma"),
               "Whether more dots than outliers deviate from the common affine motion, or all moved farther than drift; and the largest\n"
               "deviation without outliers, px. places, motions: (N, 2) float64, px, motions NaN where unknown; sigma: (N,) float64, px "
               "per axis.");
    module.def(
        "have_stayed", &stayed, py::arg("id"), py::arg("places"), py::arg("sigma"), py::arg("before_id"), py::arg("before"),
        "Whether nearly all dots id (N,) int64 at places (N, 2) float64, px, with standard deviations sigma (N,) float64, px, are where\n"
        "the dots before_id (M,) int64 were, at before (M, 2) float64, px.");
    module.def("assign_least", &assigned, py::arg("cost"),
               "The column (N,) int64 of each row, one to one, with the least sum of finite costs (N, M) float64, N <= M.");
    module.def(
        "link_places", &linked, py::arg("places"), py::arg("dots"), py::kw_only(), py::arg("gate"),
        "One-to-one links (K, 2) int64, place and dot, between places (M, 2) and dots (N, 2) float64, px, closer than gate, px, with the\n"
        "least sum of squares; an unlinked place costs the gate squared.");
    module.def(
        "nearest_others", &nearest, py::arg("places"), py::kw_only(), py::arg("count"),
        "Indices (N, count) int64 and distances (N, count) float64, px, of the nearest other places of each of places (N, 2) float64, px,\n"
        "the nearest first; -1 and infinite where there are fewer.");
}

}  // namespace tactile::border
