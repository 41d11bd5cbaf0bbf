// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// How functions and structs of C++ become those of Python. A line describes each argument, member and result: its name, the shape of an
// array, and the range of its numbers.
//
//     def(module, "path_lengths -> (N), (N)", "What it does.", path_lengths, "path (7)", "points (N, 3)", "radius [0, 4096]");
//
// A letter stands for one length throughout a call; determine() gives those that an object knows. (N=2..100) bounds a length. The type of
// an array is that of the C++ parameter; const uint8_t* is a mask of booleans, as are results whose shape ends in "bool". What does not
// fit raises ValueError that begins with the argument's name. Other threads of Python run while C++ works.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/array.hpp"

namespace tactile::border {

namespace py = pybind11;

constexpr py::ssize_t ANY = -1;  // length

/// Lengths that letters stand for.
struct Lengths : std::array<py::ssize_t, 128> {
    Lengths() { fill(ANY); }
};

/// Notes the lengths that an object knows; overloaded for such classes.
template <class T>
void determine(const T&, Lengths&) {}

/// A number within bounds, both included; NaN is never within.
template <class T>
T within(T value, const std::string& name, double lowest, double highest) {
    if (static_cast<double>(value) >= lowest && static_cast<double>(value) <= highest) return value;
    throw py::value_error(name + ": a number from " + std::to_string(lowest) + " to " + std::to_string(highest) + " is needed, got " +
                          std::to_string(value));
}

inline void check_rows(const std::string& name, py::ssize_t rows, py::ssize_t needed) {
    if (rows != needed) throw py::value_error(name + ": " + std::to_string(needed) + " rows are needed, got " + std::to_string(rows));
}

/// A line of description: "name (N, 3) [lowest, highest]".
struct Rule {
    struct Length {
        unsigned char letter;
        py::ssize_t more, lowest, highest;  // more: than the letter stands for
    };
    std::string text, name;
    std::vector<Length> shape;
    bool is_mask;
    unsigned char letter = '\0';  // for which a number stands, after its name: "count L"
    double lowest = -INFINITY, highest = INFINITY;

    Rule(const char* line) : text(line), name(line, std::strcspn(line, " ")), is_mask(std::strstr(line, ") bool")) {
        if (text.size() > name.size() && std::isupper(static_cast<unsigned char>(text[name.size() + 1]))) letter = text[name.size() + 1];
        if (const char* at = std::strchr(line, '('))
            for (; *at != ')'; at += std::strcspn(at, ",)")) shape.push_back(length(at += 1 + std::strspn(at + 1, " ")));
        if (std::strchr(line, '[')) std::sscanf(std::strchr(line, '['), "[%lf, %lf", &lowest, &highest);
    }
    Rule(const py::arg& given) : Rule(given.name) {}
    Rule(const py::kw_only&) : Rule("") {}

    template <class Numbers>
    void check(const Numbers& numbers, py::ssize_t size) const {
        if (std::isfinite(lowest) || std::isfinite(highest))
            for (py::ssize_t k = 0; k < size; ++k) within(numbers[k], name, lowest, highest);
    }
    /// Whether it has the shape; notes the lengths of letters.
    bool fits_shape(const py::array& array, Lengths& lengths) const {
        bool fits = array.ndim() == static_cast<py::ssize_t>(shape.size());
        for (py::ssize_t axis = fits ? static_cast<py::ssize_t>(shape.size()) : 0; axis-- > 0;) {
            const auto& [letter, more, low, high] = shape[axis];
            py::ssize_t& known = lengths[letter];
            if (letter && known == ANY) known = array.shape(axis) - more;
            const bool is_right = letter ? array.shape(axis) == known + more : low < high || array.shape(axis) == low;
            if (fits && axis == 0 && letter && !is_right) check_rows(name, array.shape(0), known + more);
            fits = fits && is_right;
            if (fits) within(array.shape(axis), name, static_cast<double>(low), static_cast<double>(high));
        }
        return fits;
    }
    [[noreturn]] void refuse(const std::string& type, const std::string& got) const {
        const std::string wanted = text.substr(std::min(text.size(), name.size() + 1));
        throw py::value_error(name + ": an array " + wanted + " of " + type + " is needed, got " + got);
    }
    /// The lengths of a result; one letter may be unknown.
    std::vector<py::ssize_t> shape_of(py::ssize_t size, const Lengths& lengths) const {
        std::vector<py::ssize_t> found;
        py::ssize_t known = 1;
        for (const auto& [letter, more, low, high] : shape)
            found.push_back(!letter ? low : lengths[letter] == ANY ? ANY : lengths[letter] + more);
        for (const py::ssize_t one : found) known *= one == ANY ? 1 : one;
        std::replace(found.begin(), found.end(), ANY, size / std::max<py::ssize_t>(known, 1));
        return found.empty() ? std::vector{size} : found;
    }

 private:
    static Length length(const char* at) {
        const unsigned char letter = std::isupper(static_cast<unsigned char>(*at)) ? *at : '\0';
        Length found{letter, 0, 0, PTRDIFF_MAX};
        if (letter && at[1] == '+') found.more = std::atoi(at + 2);
        if ((!letter || at[1] == '=') && std::sscanf(at + (letter ? 2 : 0), "%td..%td", &found.lowest, &found.highest) == 1)
            found.highest = found.lowest;
        return found;
    }
};

// ---- Arguments.

template <class T>
py::array checked(const py::object& given, const Rule& rule, Lengths& lengths) {
    const auto refuse = [&](const std::string& got) { rule.refuse(py::str(py::dtype::of<T>().attr("name")), got); };
    if (!py::isinstance<py::array>(given)) refuse(py::str(py::type::of(given).attr("__name__")));
    if (!py::isinstance<py::array_t<T>>(given)) refuse(py::str(given.attr("dtype")));
    py::array array = given;
    if (!rule.fits_shape(array, lengths)) refuse("the shape " + std::string(py::str(array.attr("shape"))));
    constexpr int AS_NEEDED = py::array::c_style | py::detail::npy_api::NPY_ARRAY_ALIGNED_;
    if ((array.flags() & AS_NEEDED) != AS_NEEDED) array = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array);
    if (!array) throw py::error_already_set();
    if constexpr (!std::is_same_v<T, bool>) rule.check(static_cast<const T*>(array.data()), array.size());
    return array;
}

/// A parameter of type P, made of what Python gives: a number, or an object of a bound class.
template <class P, class T = std::decay_t<P>, class = void>
struct Taken {
    using Given = P;
    P value;
    Taken(P given, const Rule* rule, Lengths& lengths) : value(std::forward<P>(given)) {
        if constexpr (std::is_arithmetic_v<T>) {
            if (rule) rule->check(&value, 1);
            if (rule && rule->letter) lengths[rule->letter] = static_cast<py::ssize_t>(value);
        }
    }
    P&& get() { return std::forward<P>(value); }
};
template <class P, class T>
struct Taken<P, Array<T>> {
    using Given = py::object;
    py::array kept;
    Array<T> value;
    Taken(const py::object& given, const Rule* rule, Lengths& lengths) : kept(checked<T>(given, *rule, lengths)) {
        value.data = static_cast<const T*>(kept.data()), value.size = kept.size();
        std::copy_n(kept.shape(), kept.ndim(), value.lengths.begin());
    }
    const Array<T>& get() const { return value; }
};
template <class P, class T>
struct Taken<P, const T*, std::enable_if_t<std::is_arithmetic_v<T>>> {
    using Given = py::object;
    py::array kept;
    Taken(const py::object& given, const Rule* rule, Lengths& lengths)
        : kept(checked<std::conditional_t<std::is_same_v<T, std::uint8_t>, bool, T>>(given, *rule, lengths)) {}
    const T* get() const { return static_cast<const T*>(kept.data()); }
};
template <class P, class T>
struct Taken<P, T, std::enable_if_t<std::is_base_of_v<Eigen::EigenBase<T>, T>>> {
    using Given = py::object;
    using Number = typename T::Scalar;
    T value;
    Taken(const py::object& given, const Rule* rule, Lengths& lengths) {
        const py::array kept = checked<Number>(given, *rule, lengths);
        const auto* data = static_cast<const Number*>(kept.data());
        if constexpr (T::ColsAtCompileTime == 1)
            value = Eigen::Map<const T>(data, kept.size());
        else
            value = Eigen::Map<const Eigen::Matrix<Number, -1, -1, Eigen::RowMajor>>(data, kept.shape(0), kept.shape(1));
    }
    T& get() { return value; }
};

/// Checks the first vertex of each of several polygons, and their number.
inline void check_starts(const Array<std::int64_t>& start, py::ssize_t count) {
    for (py::ssize_t k = 0; k < start.length(); ++k)
        if ((k == 0 && start[k] != 0) || (k + 1 == start.length() ? start[k] != count : start[k] >= start[k + 1]))
            throw py::value_error("start: rising numbers from 0 to the number of vertices are needed");
}

/// Attributes of a Python object, taken like parameters.
struct Attributes {
    py::object owner;
    Lengths lengths{};
    template <class P>
    Taken<P> take(const char* line) {
        const Rule rule(line);
        return {owner.attr(rule.name.c_str()).template cast<typename Taken<P>::Given>(), &rule, lengths};
    }
};

// ---- Results.

/// The Python object of a result. A vector of numbers becomes an array, without a copy but for masks.
template <class R>
auto shown(R&& found, const Rule*, const Lengths&) {
    return std::forward<R>(found);
}
template <class T>
auto shown(std::vector<T>&& found, const Rule* rule, const Lengths& lengths) {
    if constexpr (!std::is_arithmetic_v<T>) {
        return std::move(found);
    } else {
        const auto shape = rule->shape_of(static_cast<py::ssize_t>(found.size()), lengths);
        if (std::is_same_v<T, std::uint8_t> && rule->is_mask) return py::array(py::dtype::of<bool>(), shape, found.data());
        auto* owned = new std::vector<T>(std::move(found));
        return py::array(shape, owned->data(), py::capsule(owned, [](void* one) { delete static_cast<std::vector<T>*>(one); }));
    }
}
template <class... T>
auto shown(std::tuple<T...>&& found, const Rule* rule, const Lengths& lengths) {
    return std::apply([&](auto&... each) { return std::tuple{shown(std::move(each), rule++, lengths)...}; }, found);
}

/// The members of a struct of two or four.
template <int N, class T>
auto members(T&& of) {
    if constexpr (N == 2) {
        auto& [a, b] = of;
        return std::tuple(std::move(a), std::move(b));
    } else {
        auto& [a, b, c, d] = of;
        return std::tuple(std::move(a), std::move(b), std::move(c), std::move(d));
    }
}

/// What work returns, while other threads of Python run.
template <class Work>
decltype(auto) without_gil(const Work& work) {
    const py::gil_scoped_release others_run;
    return work();
}

/// What work on an object returns. It works on a copy, which replaces the object at the end: after an exception that is as it was.
template <class Object, class Work>
auto change(Object& object, const Work& work) {
    Object next = object;
    auto found = work(next);
    object = std::move(next);
    return found;
}

/// Raises an error of the package by its name.
[[noreturn]] inline void refuse(const char* error, const std::string& text) {
    const py::gil_scoped_acquire interpreter;
    PyErr_SetString(py::module_::import("tactile_perception.core.errors").attr(error).ptr(), text.c_str());
    throw py::error_already_set();
}

// ---- Functions.

/// What Python calls for a C++ function: SELF of its parameters, 0 or 1, are the object of a method.
template <std::size_t SELF, class R, class... P>
auto callable(std::function<R(P...)> call, std::vector<Rule> rules, std::vector<Rule> results) {
    return [=](typename Taken<P>::Given... given) {
        Lengths lengths;
        if constexpr (SELF == 1) determine(std::get<0>(std::tie(given...)), lengths);
        std::size_t k = 0;  // braces take the arguments in order
        std::tuple<Taken<P>...> taken{
            Taken<P>(std::forward<typename Taken<P>::Given>(given), k++ < SELF ? nullptr : &rules[k - 1 - SELF], lengths)...};
        const auto work = [&]() -> R { return std::apply([&](auto&... each) -> R { return call(each.get()...); }, taken); };
        if constexpr (std::is_void_v<R>)
            without_gil(work);
        else if constexpr ((std::is_base_of_v<py::handle, std::decay_t<P>> || ...) || std::is_base_of_v<py::handle, R>)
            return shown(std::decay_t<R>(work()), results.data(), lengths);
        else
            return shown(std::decay_t<R>(without_gil(work)), results.data(), lengths);
    };
}

template <class F>
auto function_of(const F& call) {
    return std::function(call);
}
template <class T, class R, class... P>
std::function<R(T&, P...)> function_of(R (T::*call)(P...)) {
    return call;
}
template <class T, class R, class... P>
std::function<R(const T&, P...)> function_of(R (T::*call)(P...) const) {
    return call;
}

inline py::arg named(const char*, const Rule& rule) {
    return py::arg(rule.name.c_str());
}
template <class T>
const T& named(const T& given, const Rule&) {
    return given;
}
/// Calls bind with what Python calls, the documentation and the descriptions as pybind11 wants them.
template <std::size_t SELF, class Bind, class F, std::size_t... I, class... Line>
void describe(const Bind& bind, const char* name, std::string text, const F& function, std::index_sequence<I...>, const Line&... lines) {
    const std::array<Rule, sizeof...(Line)> all{Rule(lines)...};
    std::vector<Rule> rules, results;
    text += text.empty() ? "" : "\n";
    for (const Rule& one : all)
        if (!one.name.empty()) rules.push_back(one), text += "\n" + one.text;
    for (const char* at = std::strchr(name, '('); at; at = std::strchr(at + 1, '(')) results.emplace_back((' ' + std::string(at)).c_str());
    if (!results.empty()) text += "\nreturns " + results[0].text;
    results.resize(std::max<std::size_t>(results.size(), 10), Rule(""));
    bind(callable<SELF>(function_of(function), rules, results), text.c_str(), named(lines, all[I])...);
}

/// Binds a function of a module, or a method of a class; lines: of its arguments, or py::arg with a usual value, or py::kw_only().
template <class Scope, class F, class... Line>
void def(Scope& scope, const char* name, const char* text, const F& function, const Line&... lines) {
    describe<!std::is_same_v<Scope, py::module_>>(
        [&](const auto& called, const auto&... more) { scope.def(Rule(name).name.c_str(), called, more...); }, name, text, function,
        std::index_sequence_for<Line...>(), lines...);
}
/// Binds a function that makes an object of a class.
template <class T, class... Options, class F, class... Line>
void init(py::class_<T, Options...>& bound, const F& made, const Line&... lines) {
    describe<0>([&](const auto& called, const auto&... more) { bound.def(py::init(called), more...); }, "", "", made,
                std::index_sequence_for<Line...>(), lines...);
}

// ---- Structs and classes.

/// A property that is read: a member, a method without arguments, or a function of the object. line: "name (N, 3)".
template <class Of>
struct Get {
    const char* line;
    Of of;
    const char* text;

    template <class T, class... Options>
    void add(py::class_<T, Options...>& bound) const {
        const Rule rule(line);
        const std::string all = rule.text.substr(rule.name.size()) + ' ' + text;
        if constexpr (std::is_member_object_pointer_v<Of>) {
            using V = std::decay_t<decltype(std::declval<T>().*of)>;
            if constexpr (std::is_same_v<decltype(shown(std::declval<V>(), &rule, Lengths())), V>) {
                bound.def_readonly(rule.name.c_str(), of, all.c_str());
                return;
            }
        }
        bound.def_property_readonly(
            rule.name.c_str(),
            [of = of, rule](const T& one) {
                Lengths lengths;
                determine(one, lengths);
                return shown(std::decay_t<decltype(std::invoke(of, one))>(std::invoke(of, one)), &rule, lengths);
            },
            all.c_str());
    }
};
template <class Of>
Get<Of> get(const char* line, Of of, const char* text = "") {
    return {line, of, text};
}

/// A class with such properties, whose objects can be copied.
template <class T, class... Options, class... Parts>
py::class_<T, Options...> class_of(py::module_& module, const char* name, const char* text, const Parts&... parts) {
    py::class_<T, Options...> bound(module, name, text);
    (parts.add(bound), ...);
    bound.def("__copy__", [](const T& one) { return one; }).def("__deepcopy__", [](const T& one, const py::dict&) { return one; });
    return bound;
}

/// A member that Python gives and reads. line: "name (N, 3) [lowest, highest]".
template <class T, class V>
struct Field {
    Rule rule;
    V T::*member;
    const char* text;
    static constexpr bool IS_ARRAY = std::is_base_of_v<Eigen::EigenBase<V>, V>;
    using Given = std::conditional_t<IS_ARRAY, py::object, V>;

    void set(T& owner, const Given& given, Lengths&& lengths = {}) const { owner.*member = Taken<const V&>(given, &rule, lengths).get(); }
    py::arg_v argument() const {
        if constexpr (IS_ARRAY)
            return py::arg_v(rule.name.c_str(), py::none(), "required");
        else
            return py::arg(rule.name.c_str()) = T{}.*member;
    }
    void add(py::class_<T>& bound) const {
        const std::string all = rule.text.substr(rule.name.size()) + ' ' + text;
        if constexpr (IS_ARRAY)
            bound.def_readonly(rule.name.c_str(), member, all.c_str());
        else
            bound.def_property(
                rule.name.c_str(), [of = member](const T& one) { return one.*of; }, [*this](T& one, V value) { set(one, value); },
                all.c_str());
    }
};
template <class T, class V>
Field<T, V> field(const char* line, V T::*member, const char* text = "") {
    return {line, member, text};
}

/// A struct that Python makes of its members by name; it can be copied and pickled. Members that are arrays are required.
template <class T, class... V>
py::class_<T> record(py::module_& module, const char* name, const char* text, const Field<T, V>&... fields) {
    py::class_<T> bound(module, name, text);
    bound.def(py::init([=](const typename Field<T, V>::Given&... given) {
                  T made;
                  Lengths lengths;
                  (fields.set(made, given, std::move(lengths)), ...);
                  return made;
              }),
              py::kw_only(), fields.argument()...);
    (fields.add(bound), ...);
    bound.def(py::pickle([=](const T& one) { return std::tuple(one.*fields.member...); },
                         [=](const std::tuple<V...>& state) {
                             T made;
                             std::tie(made.*fields.member...) = state;
                             return made;
                         }));
    return bound;
}

}  // namespace tactile::border
