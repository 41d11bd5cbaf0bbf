// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of cameras, and of colour and range at a touchpad's dots.
#include <array>
#include <cmath>

#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "common/camera_view.hpp"
#include "touchpad/optics/glare.hpp"
#include "touchpad/optics/ring_colour.hpp"
#include "touchpad/optics/water_ranges.hpp"

namespace tactile::border {
namespace {

constexpr double LARGEST_RADIUS = 4096;  // px. Chosen: no ring is that large

py::tuple colours(const py::object& image, const py::object& uv, double radius) {
    const Input<std::uint8_t> pixels(image, "image", {ANY, ANY, 3});
    const Input<double> places(uv, "uv", {ANY, 2});
    within(radius, "radius", 0, LARGEST_RADIUS);
    RingColours found;
    {
        py::gil_scoped_release others_run;
        found = ring_colours({pixels.data(), pixels.length(0), pixels.length(1)}, places.data(), places.length(), radius);
    }
    const py::ssize_t count = places.length();
    return py::make_tuple(output(found.ratios, {count, 2}), output(found.brightness, {count}), output(found.count, {count}),
                          output(found.patchiness, {count}));
}

LightPath as_path(const Input<double>& path) {
    const double* given = path.data();
    return {given[0], given[1], given[2], given[3], {given[4], given[5], given[6]}};
}

py::tuple path_lengths(const py::object& path, const py::object& places, const py::object& normals, const py::object& rays) {
    const Input<double> light(path, "path", {7}), at(places, "places", {ANY, 3});
    const py::ssize_t count = at.length();
    const Input<double> facing(normals, "normals", {count, 3}), along(rays, "rays", {count, 3});
    std::vector<double> metres(count), slopes(count), irradiance(count);
    {
        py::gil_scoped_release others_run;
        const LightPath way = as_path(light);
        for (py::ssize_t k = 0; k < count; ++k) {
            const Vec3 place = vec3_at(at.data(), k), ray = vec3_at(along.data(), k);
            const Vec3 normal = vec3_at(facing.data(), k);
            const Incidence lit = incidence(way, place, normal, ray);
            const Length found = length_at(way, place.z, ray.z, lit);
            metres[k] = found.metres;
            slopes[k] = found.slope;
            irradiance[k] = lit.irradiance;
        }
    }
    return py::make_tuple(output(metres, {count}), output(slopes, {count}), output(irradiance, {count}));
}

py::tuple light_on_skin(const py::object& path, const py::object& places, const py::object& border_normals, py::ssize_t rows,
                        py::ssize_t columns) {
    const Input<double> light(path, "path", {7});
    within(rows, "rows", 0, 4096);
    within(columns, "columns", 0, 4096);
    const Input<double> at(places, "places", {rows * columns, 3}), facing(border_normals, "border_normals", {rows * columns, 3});
    SkinLight found;
    {
        py::gil_scoped_release others_run;
        found = skin_light(as_path(light), at.data(), facing.data(), rows, columns);
    }
    const py::ssize_t dots = rows * columns;
    return py::make_tuple(output(found.irradiance, {dots}), output(found.lengths, {dots}));
}

py::tuple lengths_of_colours(const py::object& ratios, const py::object& count, const py::object& patchiness, const py::object& excess,
                             const py::object& excess_sigma, const py::object& colour, std::array<double, 2> constants,
                             std::array<double, 2> absorptions, std::array<double, 4> noise, double probability, double size) {
    const Input<double> logs(ratios, "ratios", {ANY, 2});
    const py::ssize_t dots = logs.length();
    const Input<std::int64_t> points(count, "count", {dots});
    const Input<double> patchy(patchiness, "patchiness", {dots}), bright(excess, "excess", {dots}),
        sigma(excess_sigma, "excess_sigma", {dots}), tints(colour, "colour", {dots, 2});
    const WaterColour water{{constants[0], constants[1]},
                            {within(absorptions[0], "absorptions", 1e-6, 1e6), within(absorptions[1], "absorptions", 1e-6, 1e6)},
                            {noise[0], noise[1], noise[2], noise[3]}};
    within(noise[0] * noise[3] - noise[1] * noise[2], "noise", 1e-300, 1e300);
    const Glare glare{within(probability, "probability", 1e-6, 1), within(size, "size", 1e-6, 1e3)};
    WaterLengths found;
    {
        py::gil_scoped_release others_run;
        found = water_lengths(water, glare, {logs.data(), points.data(), patchy.data(), bright.data(), sigma.data(), tints.data(), dots});
    }
    return py::make_tuple(output(found.lengths, {dots}), output(found.sigma, {dots}));
}

py::tuple ranges(const py::object& path, const py::object& lengths, const py::object& rays, const py::object& id,
                 const py::object& rest_ranges, const py::object& rest_normals, py::ssize_t rows, py::ssize_t columns, double ring_share) {
    const Input<double> light(path, "path", {7}), metres(lengths, "lengths", {ANY});
    const py::ssize_t count = metres.length();
    const Input<double> along(rays, "rays", {count, 3}), rest(rest_ranges, "rest_ranges", {count}),
        facing(rest_normals, "rest_normals", {count, 3});
    const Input<std::int64_t> numbers(id, "id", {count});
    within(rows, "rows", 0, 4096);
    within(columns, "columns", 0, 4096);
    within(ring_share, "ring_share", 0, 10);
    const bool grid = rows > 2 && columns > 2;
    for (py::ssize_t k = 0; grid && k < count; ++k) within(numbers.data()[k], "id", 0, rows * columns - 1);
    WaterRanges found;
    {
        py::gil_scoped_release others_run;
        found = water_ranges(as_path(light), {numbers.data(), along.data(), rest.data(), facing.data(), count, rows, columns},
                             metres.data(), ring_share);
    }
    return py::make_tuple(output(found.ranges, {count}), output(found.slopes, {count}));
}

// px, and m: numbers of a camera. Chosen: beyond any camera, and squares stay far from overflow.
constexpr double LARGEST_OF_CAMERA = 1e9;

Camera as_camera(const py::object& matrix, const py::object& distortion, const py::object& rotation, double farthest) {
    const Input<double> lens(matrix, "matrix", {3, 3}), bends(distortion, "distortion", {5}), turn(rotation, "rotation", {3, 3});
    const double* k = lens.data();
    for (const int focal : {0, 4}) within(k[focal], "matrix", 1 / LARGEST_OF_CAMERA, LARGEST_OF_CAMERA);
    for (const int middle : {2, 5}) within(k[middle], "matrix", -LARGEST_OF_CAMERA, LARGEST_OF_CAMERA);
    Camera camera{{k[0], k[4]}, {k[2], k[5]}, {}, within(farthest, "farthest", 0, INFINITY), {}};
    for (int i = 0; i < 5; ++i) camera.distortion[i] = within(bends.data()[i], "distortion", -LARGEST_OF_CAMERA, LARGEST_OF_CAMERA);
    for (int i = 0; i < 9; ++i) camera.rotation[i / 3][i % 3] = within(turn.data()[i], "rotation", -2, 2);
    return camera;
}

py::array_t<double> rays_through(const py::object& uv, const py::object& matrix, const py::object& distortion, const py::object& rotation,
                                 double farthest) {
    const Input<double> pixels(uv, "uv", {ANY, 2});
    const Camera camera = as_camera(matrix, distortion, rotation, farthest);
    std::vector<double> rays(3 * pixels.length());
    {
        py::gil_scoped_release others_run;
        camera_rays(camera, pixels.data(), pixels.length(), rays.data());
    }
    return output(rays, {pixels.length(), 3});
}

py::array_t<double> back_projected(const py::object& uv, const py::object& matrix, const py::object& distortion, const py::object& rotation,
                                   const py::object& centre, double farthest, double plane_z) {
    const Input<double> pixels(uv, "uv", {ANY, 2}), place(centre, "centre", {3});
    const Camera camera = as_camera(matrix, distortion, rotation, farthest);
    ViewedPlane plane{{}, within(plane_z, "plane_z", -LARGEST_OF_CAMERA, LARGEST_OF_CAMERA)};
    for (int i = 0; i < 3; ++i) plane.centre[i] = within(place.data()[i], "centre", -LARGEST_OF_CAMERA, LARGEST_OF_CAMERA);
    std::vector<double> seen(3 * pixels.length());
    {
        py::gil_scoped_release others_run;
        back_project(camera, plane, pixels.data(), pixels.length(), seen.data());
    }
    return output(seen, {pixels.length(), 3});
}

}  // namespace

void bind_optics(py::module_& module) {
    module.def(
        "camera_rays", &rays_through, py::arg("uv"), py::kw_only(), py::arg("matrix"), py::arg("distortion"), py::arg("rotation"),
        py::arg("farthest"),
        "Unit vectors (N, 3) in the sensor frame through pixels uv (N, 2); NaN: the lens images nothing there.\n\n"
        "matrix: (3, 3) K, px; distortion: (5,) k1 k2 p1 p2 k3; rotation: (3, 3), camera from sensor; farthest: square of the normalised\n"
        "radius in the image beyond which the lens images nothing.");
    module.def(
        "back_project", &back_projected, py::arg("uv"), py::kw_only(), py::arg("matrix"), py::arg("distortion"), py::arg("rotation"),
        py::arg("centre"), py::arg("farthest"), py::arg("plane_z"),
        "(N, 3): x, y, m, where pixels uv (N, 2) lie in the plane at plane_z, m, and the area of a pixel there, m^2; NaN: nowhere.\n\n"
        "centre: (3,) m; the other arguments: as for camera_rays.");
    module.def(
        "ring_colours", &colours, py::arg("image"), py::arg("uv"), py::arg("radius"),
        "Background around dots at uv (N, 2) float64, px, in an image (H, W, 3) uint8, blue, green, red, on rings of radius px: ratios\n"
        "(N, 2) ln(blue / red), ln(green / red); brightness (N,) ln(red); count (N,) of 16 ring points used; patchiness (N,).");
    module.def(
        "path_lengths", &path_lengths, py::arg("path"), py::arg("places"), py::arg("normals"), py::arg("rays"),
        "Lengths (N,), m, of the light's path in the water to places (N, 3), m, their derivatives (N,) along unit rays (N, 3), and the\n"
        "irradiance (N,) in units of the lamps' power.\n\n"
        "path: (7,) window_z, lamp_z, lamp_radius, m, ambient, and the camera's centre, m; normals: (N, 3), unit, outward.");
    module.def("skin_light", &light_on_skin, py::arg("path"), py::arg("places"), py::arg("border_normals"), py::kw_only(), py::arg("rows"),
               py::arg("columns"),
               "Irradiance (K,) of a skin through a grid of places (K, 3), m, and lengths (K,), m, of the light's paths in the water.\n\n"
               "path: as for path_lengths; border_normals: (K, 3), unit, of places at the grid's border or with a missing neighbour.");
    module.def(
        "water_lengths", &lengths_of_colours, py::arg("ratios"), py::arg("count"), py::arg("patchiness"), py::arg("excess"),
        py::arg("excess_sigma"), py::arg("colour"), py::kw_only(), py::arg("constants"), py::arg("absorptions"), py::arg("noise"),
        py::arg("probability"), py::arg("size"),
        "Path lengths (N,), m, in the water, and their standard deviations (N,).\n\n"
        "ratios (N, 2), count (N,) int64, patchiness (N,): of ring_colours; excess: (N,) ln of the red light over that expected without\n"
        "glare, with excess_sigma (N,), and colour: (N, 2) ratios of glare over those of scattered light, NaN: unknown; constants,\n"
        "absorptions (1/m), noise (4,): of the water's log ratios; probability: of glare; size: standard deviation of red glare over\n"
        "scattered red.");
    module.def(
        "water_ranges", &ranges, py::arg("path"), py::arg("lengths"), py::kw_only(), py::arg("rays"), py::arg("id"), py::arg("rest_ranges"),
        py::arg("rest_normals"), py::arg("rows"), py::arg("columns"), py::arg("ring_share"),
        "Ranges (N,), m, at which the light's paths have the lengths (N,), m, and the lengths' derivatives (N,) there.\n\n"
        "path: as for path_lengths; rays: (N, 3), unit; id: (N,) int64, of the dots on the grid of rows x columns; rest_ranges (N,), m,\n"
        "rest_normals (N, 3), unit: at rest; ring_share: radius of the ring around a dot whose mean a length is, over the dots' pitch.");
}

}  // namespace tactile::border
