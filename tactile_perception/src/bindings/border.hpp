// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Checks of arguments from Python. A wrong argument raises ValueError with its name.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace tactile::border {

namespace py = pybind11;

constexpr py::ssize_t ANY = -1;  // any length

template <class T>
std::string type_name() {
    return py::str(py::dtype::of<T>().attr("name"));
}

inline std::string shape_name(std::initializer_list<py::ssize_t> shape) {
    std::string text = "(";
    for (const py::ssize_t length : shape)
        text += (text.size() > 1 ? ", " : "") + (length == ANY ? std::string("any") : std::to_string(length));
    return text + ")";
}

// An array argument of exactly type T and the given shape, in row-major order (copied if it is not contiguous).
template <class T>
class Input {
 public:
    Input(const py::object& given, const char* name, std::initializer_list<py::ssize_t> shape) {
        const auto refused = [&](const std::string& got) {
            return py::value_error(std::string(name) + ": an array " + shape_name(shape) + " of " + type_name<T>() + " is needed, got " +
                                   got);
        };
        if (!py::isinstance<py::array>(given)) throw refused(py::str(py::type::of(given).attr("__name__")));
        if (!py::isinstance<py::array_t<T>>(given)) throw refused(py::str(given.attr("dtype")));
        const py::array array = given;
        bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
        py::ssize_t axis = 0;
        for (const py::ssize_t length : shape) fits = fits && (length == ANY || array.shape(axis) == length), ++axis;
        if (!fits) throw refused("the shape " + std::string(py::str(given.attr("shape"))));
        constexpr int AS_NEEDED = py::array::c_style | py::detail::npy_api::NPY_ARRAY_ALIGNED_;
        array_ = (array.flags() & AS_NEEDED) == AS_NEEDED ? py::reinterpret_borrow<Rows>(array) : Rows::ensure(array);
        if (!array_) throw py::error_already_set();
    }
    const T* data() const { return array_.data(); }
    py::ssize_t length(py::ssize_t axis = 0) const { return array_.shape(axis); }

 private:
    using Rows = py::array_t<T, py::array::c_style | py::array::forcecast>;
    Rows array_;
};

// Returns a number within bounds, both included; NaN is never within.
template <class T>
T within(T value, const char* name, double least, double most) {
    if (!(static_cast<double>(value) >= least && static_cast<double>(value) <= most)) {
        throw py::value_error(std::string(name) + ": a number from " + std::to_string(least) + " to " + std::to_string(most) +
                              " is needed, got " + std::to_string(value));
    }
    return value;
}

constexpr double LARGEST_PLACE = 1e12;  // px. Chosen: beyond any image, and squares stay far from overflow

// Checks the coordinates of places (N, 2).
inline void check_places(const Input<double>& places, const char* name) {
    for (py::ssize_t k = 0; k < 2 * places.length(); ++k) within(places.data()[k], name, -LARGEST_PLACE, LARGEST_PLACE);
}

// Checks the first vertex of each of several polygons, and their number.
inline void check_starts(const Input<std::int64_t>& start, py::ssize_t count) {
    for (py::ssize_t k = 0; k < start.length(); ++k) {
        const bool last = k + 1 == start.length();
        if ((k == 0 && start.data()[k] != 0) || (last ? start.data()[k] != count : start.data()[k] >= start.data()[k + 1]))
            throw py::value_error("start: rising numbers from 0 to the number of vertices are needed");
    }
}

// A new array of the given shape, filled with the values.
template <class T>
py::array_t<T> output(const std::vector<T>& values, std::vector<py::ssize_t> shape) {
    py::array_t<T> array(std::move(shape));
    std::copy(values.begin(), values.end(), array.mutable_data());
    return array;
}

// The same, of many values without a copy: the array keeps the vector.
template <class T>
py::array_t<T> kept(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
    auto* owned = new std::vector<T>(std::move(values));
    return py::array_t<T>(std::move(shape), owned->data(), py::capsule(owned, [](void* one) { delete static_cast<std::vector<T>*>(one); }));
}

template <class T, std::size_t N>
py::array_t<T> output(const std::array<T, N>& values, std::vector<py::ssize_t> shape) {
    return output(std::vector<T>(values.begin(), values.end()), std::move(shape));
}

// A new array (N,), and (N, width).
template <class T>
py::array_t<T> row_of(const std::vector<T>& values) {
    return output(values, {static_cast<py::ssize_t>(values.size())});
}
template <class T>
py::array_t<T> rows_of(const std::vector<T>& values, py::ssize_t width = 3) {
    return output(values, {static_cast<py::ssize_t>(values.size()) / width, width});
}

// A mask as bytes, and one from bytes.
inline const std::uint8_t* marks(const Input<bool>& mask) {
    return reinterpret_cast<const std::uint8_t*>(mask.data());
}
inline py::array_t<bool> mask(const std::vector<std::uint8_t>& marked) {
    return row_of(std::vector<bool>(marked.begin(), marked.end()));
}

// Properties that are such arrays of a member.
template <class Owner, class T>
auto row(std::vector<T> Owner::*member) {
    return [=](const Owner& one) { return row_of(one.*member); };
}
template <class Owner, class T>
auto rows(std::vector<T> Owner::*member, py::ssize_t width = 3) {
    return [=](const Owner& one) { return rows_of(one.*member, width); };
}
template <class Owner>
auto marked(std::vector<std::uint8_t> Owner::*member) {
    return [=](const Owner& one) { return mask(one.*member); };
}

// Raises an error of the package by its name.
[[noreturn]] inline void refuse(const char* error, const std::string& text) {
    PyErr_SetString(py::module_::import("tactile_perception.errors").attr(error).ptr(), text.c_str());
    throw py::error_already_set();
}

// What work returns, while other threads of Python run.
template <class Work>
auto without_gil(const Work& work) {
    const py::gil_scoped_release others_run;
    return work();
}

// What work returns that changes an object. It works on a copy, which replaces the object at the end: after an exception that is as it was.
template <class Object, class Work>
auto change(Object& object, const Work& work) {
    Object next = object;
    auto found = without_gil([&] { return work(next); });
    object = std::move(next);
    return found;
}

// A class whose objects can be copied.
template <class T, class... Options>
py::class_<T, Options...> copyable(py::class_<T, Options...> bound) {
    bound.def("__copy__", [](const T& one) { return one; }).def("__deepcopy__", [](const T& one, const py::dict&) { return one; });
    return bound;
}

}  // namespace tactile::border
