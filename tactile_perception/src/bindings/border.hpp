// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// How functions and structs of C++ become those of Python. A line describes each argument, member and result: its name, the shape of an
// array, and the range of its numbers.
//
//     def(module, "path_lengths -> (N), (N)", "What it does.", {"path (7)", "points (N, 3)", "radius [0, 4096]"}, path_lengths);
//
// A letter stands for one length throughout a call; determine gives those that an object knows. (N=2..100) bounds a length. The type of
// an array is that of the C++ parameter; const uint8_t* is a mask of booleans, as are results whose shape ends in "bool". What does not
// fit raises BadArgument that begins with the argument's name. Other threads of Python run while C++ works.
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
#include <numeric>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/array.hpp"

namespace tactile::border {

namespace py = pybind11;

constexpr py::ssize_t ANY = -1;  // length

using Lines = std::vector<std::string>;  // descriptions

/// Lengths that letters stand for.
struct Lengths : std::array<py::ssize_t, 128> {
    Lengths() { fill(ANY); }
};

/// Notes the lengths that an object of a class knows; the bindings of such a class set it.
template <class T>
void (*determine)(const T&, Lengths&) = nullptr;
template <class T>
Lengths lengths_of(const T& object) {
    Lengths known;
    if (determine<T>) determine<T>(object, known);
    return known;
}

/// Raises an error of the package by its name.
[[noreturn]] inline void refuse(const std::string& text, const char* error = "BadArgument") {
    const py::gil_scoped_acquire interpreter;
    PyErr_SetString(py::module_::import("tactile_perception.core.errors").attr(error).ptr(), text.c_str());
    throw py::error_already_set();
}

/// A number within bounds, both included; NaN is never within.
template <class T>
T within(T value, const std::string& name, double lowest, double highest) {
    if (static_cast<double>(value) >= lowest && static_cast<double>(value) <= highest) return value;
    refuse(name + ": a number from " + std::to_string(lowest) + " to " + std::to_string(highest) + " is needed, got " +
           std::to_string(value));
}

inline void check_rows(const std::string& name, py::ssize_t rows, py::ssize_t needed) {
    if (rows != needed) refuse(name + ": " + std::to_string(needed) + " rows are needed, got " + std::to_string(rows));
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

    Rule(const char* line) : Rule(std::string(line)) {}
    Rule(const std::string& all) : text(all), name(all, 0, all.find(' ')), is_mask(all.find(") bool") != all.npos) {
        const char* line = text.c_str();
        if (text.size() > name.size() && std::isupper(static_cast<unsigned char>(text[name.size() + 1]))) letter = text[name.size() + 1];
        if (const char* at = std::strchr(line, '('))
            for (; *at != ')'; at += std::strcspn(at, ",)")) shape.push_back(length(at += 1 + std::strspn(at + 1, " ")));
        if (std::strchr(line, '[')) std::sscanf(std::strchr(line, '['), "[%lf, %lf", &lowest, &highest);
    }

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
    [[noreturn]] void refuse_array(const std::string& type, const std::string& got) const {
        const std::string wanted = text.substr(std::min(text.size(), name.size() + 1));
        refuse(name + ": an array " + wanted + " of " + type + " is needed, got " + got);
    }
    /// The lengths of a result; one letter may be unknown.
    std::vector<py::ssize_t> shape_of(py::ssize_t size, const Lengths& lengths) const {
        std::vector<py::ssize_t> found;
        py::ssize_t known = 1;
        for (const auto& [letter, more, low, high] : shape)
            found.push_back(!letter ? low : lengths[letter] == ANY ? ANY : lengths[letter] + more);
        for (const py::ssize_t one : found) known *= one == ANY ? 1 : one;
        std::replace(found.begin(), found.end(), ANY, size / std::max<py::ssize_t>(known, 1));
        if (found.empty()) found = {size};
        if (std::accumulate(found.begin(), found.end(), py::ssize_t{1}, std::multiplies<>()) != size)
            throw std::logic_error("the result " + text + " has " + std::to_string(size) + " numbers");
        return found;
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
    const auto refuse = [&](const std::string& got) { rule.refuse_array(py::str(py::dtype::of<T>().attr("name")), got); };
    if (!py::isinstance<py::array>(given)) refuse(py::str(py::type::of(given).attr("__name__")));
    if (!py::isinstance<py::array_t<T>>(given)) refuse(py::str(given.attr("dtype")));
    py::array array = given;
    if (!rule.fits_shape(array, lengths)) refuse("the shape " + std::string(py::str(array.attr("shape"))));
    constexpr int AS_NEEDED = py::array::c_style | py::detail::npy_api::NPY_ARRAY_ALIGNED_;
    if ((array.flags() & AS_NEEDED) != AS_NEEDED) array = py::array_t<T, AS_NEEDED>::ensure(array);
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
template <class T>
using Shown = std::conditional_t<std::is_same_v<T, std::uint8_t>, bool, T>;  // masks
template <class P, class T>
struct Taken<P, std::vector<T>, std::enable_if_t<std::is_arithmetic_v<T>>> : Taken<Array<Shown<T>>> {
    using Taken<Array<Shown<T>>>::Taken;
    std::vector<T> get() const { return {this->value.data, this->value.data + this->value.size}; }
};
template <class P, class T>
struct Taken<P, const T*, std::enable_if_t<std::is_arithmetic_v<T>>> {
    using Given = py::object;
    py::array kept;
    Taken(const py::object& given, const Rule* rule, Lengths& lengths) : kept(checked<Shown<T>>(given, *rule, lengths)) {}
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
            refuse("start: rising numbers from 0 to the number of vertices are needed");
}

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
template <class T>
py::list shown(std::vector<std::vector<T>>&& found, const Rule* rule, const Lengths& lengths) {
    py::list all;
    for (std::vector<T>& one : found) all.append(shown(std::move(one), rule, lengths));
    return all;
}
template <class... T>
auto shown(std::tuple<T...>&& found, const Rule* rule, const Lengths& lengths) {
    return std::apply([&](auto&... each) { return std::tuple{shown(std::move(each), rule++, lengths)...}; }, found);
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

// ---- Functions.

/// What Python calls for a C++ function: SELF of its parameters, 0 or 1, are the object of a method.
template <std::size_t SELF, class R, class... P>
auto callable(std::function<R(P...)> call, std::vector<Rule> rules, std::vector<Rule> results) {
    return [=](typename Taken<P>::Given... given) {
        Lengths lengths;
        if constexpr (SELF == 1) lengths = lengths_of(std::get<0>(std::tie(given...)));
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

struct Description {
    const char *results, *text;
    Lines arguments;
};

/// Calls bind with what Python calls, the documentation and the arguments, of which the last have defaults.
template <std::size_t SELF, class Bind, class R, class... P, std::size_t... I, std::size_t... J, class... Default>
void describe(const Bind& bind, const Description& of, const std::function<R(P...)>& call, std::index_sequence<I...>,
              std::index_sequence<J...>, const Default&... defaults) {
    std::vector<Rule> rules(of.arguments.begin(), of.arguments.end()), found;
    std::string text = of.text;
    for (const Rule& one : rules) text += "\n" + one.text;
    for (const char* at = std::strchr(of.results, '('); at; at = std::strchr(at + 1, '(')) found.emplace_back(' ' + std::string(at));
    if (!found.empty()) text += "\nreturns " + found[0].text;
    found.resize(std::max<std::size_t>(found.size(), 10), Rule(""));
    bind(callable<SELF>(call, rules, found), text.c_str(), py::arg(rules.at(I).name.c_str())...,
         (py::arg(rules.at(sizeof...(I) + J).name.c_str()) = defaults)...);
}
template <std::size_t SELF, std::size_t DEFAULTS, class R, class... P>
std::make_index_sequence<sizeof...(P) - SELF - DEFAULTS> required(const std::function<R(P...)>&) {
    return {};
}

/// Binds a function of a module, or a method of a class; lines: of its arguments; defaults: of the last of them.
template <class Scope, class F, class... Default>
void def(Scope& scope, const char* name, const char* text, const Lines& lines, const F& function, const Default&... defaults) {
    constexpr std::size_t SELF = !std::is_same_v<Scope, py::module_>;
    const auto bind = [&](const auto&... more) { scope.def(Rule(name).name.c_str(), more...); };
    const auto call = function_of(function);
    describe<SELF>(bind, {name, text, lines}, call, required<SELF, sizeof...(Default)>(call), std::index_sequence_for<Default...>(),
                   defaults...);
}
/// Binds a function that makes an object of a class.
template <class T, class... Options, class F, class... Default>
void init(py::class_<T, Options...>& bound, const Lines& lines, const F& made, const Default&... defaults) {
    const auto bind = [&](const auto& called, const auto&... more) { bound.def(py::init(called), more...); };
    const auto call = function_of(made);
    describe<0>(bind, {"", "", lines}, call, required<0, sizeof...(Default)>(call), std::index_sequence_for<Default...>(), defaults...);
}

// ---- Structs and classes.

template <class T, class = void>
constexpr bool HAS_FIELDS = false;
template <class T>
constexpr bool HAS_FIELDS<T, std::void_t<decltype(T::FIELDS)>> = true;

/// The rule of the next member, of type V, by lines for several each, "name name (N, 3) [lowest, highest]", without a name for all others.
/// A vector or matrix that no line describes has the shape of its type.
template <class V>
Rule rule_of(std::istream& names, const Lines& lines) {
    std::string name, rest;
    std::getline(names >> std::ws, name, ',');
    for (const std::string& line : lines) {
        const std::size_t end = std::min(line.find_first_of("(["), line.size());
        const std::string named = ' ' + line.substr(0, end) + ' ';
        if (named.find_first_not_of(' ') != named.npos && named.find(' ' + name + ' ') == named.npos) continue;
        rest = ' ' + line.substr(end);
        break;
    }
    if constexpr (std::is_base_of_v<Eigen::EigenBase<V>, V>) {
        const auto length = [](int fixed, const char* letter) { return fixed < 0 ? letter : std::to_string(fixed); };
        const std::string columns = V::ColsAtCompileTime == 1 ? "" : ", " + length(V::ColsAtCompileTime, "M");
        if (rest.find('(') == rest.npos) rest = " (" + length(V::RowsAtCompileTime, "N") + columns + ')' + rest;
    }
    return name + rest;
}
template <class... V>
std::vector<Rule> rules_of(std::tuple<V&...>*, const char* fields, const Lines& lines) {
    std::istringstream names(fields);
    return {rule_of<V>(names, lines)...};
}
template <class T>
std::vector<Rule> rules_of(const Lines& lines) {
    decltype(std::declval<T&>().fields())* types = nullptr;
    return rules_of(types, T::FIELDS, lines);
}

/// Sets a member; a number that is not given keeps its default, of which NaN stands for none.
template <class V>
void take(V& member, const py::object& given, const Rule& rule, Lengths& lengths) try {
    using Given = std::decay_t<typename Taken<const V&>::Given>;
    if (given)
        member = Taken<const V&>(given.cast<Given>(), &rule, lengths).get();
    else if constexpr (std::is_arithmetic_v<V>)
        rule.check(&member, member == member);
    else
        refuse(rule.name + ": required");
} catch (const py::cast_error&) {
    refuse(rule.name + ": a number is needed, got " + std::string(py::str(py::type::of(given).attr("__name__"))));
}
/// A struct of what given(name) returns for each of its members; a number without any keeps its default.
template <class T, class Given>
T made_of(const std::vector<Rule>& rules, const Given& given, Lengths& lengths) {
    T made{};
    auto rule = rules.begin();
    std::apply([&](auto&... member) { ((take(member, given(rule->name), *rule, lengths), ++rule), ...); }, made.fields());
    return made;
}
/// A struct of the attributes of a Python object.
template <class T>
T from_attributes(const py::object& owner, const Lines& lines, Lengths& lengths) {
    const auto attribute = [&](const std::string& name) -> py::object { return owner.attr(name.c_str()); };
    return made_of<T>(rules_of<T>(lines), attribute, lengths);
}

/// Adds a property that is read: a method without arguments, or a function of the object. line: "name (N, 3)".
template <class T, class... Options, class Of>
void get(py::class_<T, Options...>& bound, const Rule& rule, const char* text, const Of& of) {
    const auto read = [=](const T& one) {
        return shown(std::decay_t<decltype(std::invoke(of, one))>(std::invoke(of, one)), &rule, lengths_of(one));
    };
    bound.def_property_readonly(rule.name.c_str(), read, (rule.text.substr(rule.name.size()) + ' ' + text).c_str());
}
template <class T, class... Options, std::size_t... I>
void get_fields(py::class_<T, Options...>& bound, const std::vector<Rule>& rules, std::index_sequence<I...>) {
    const auto add = [&](auto number) {
        using V = std::decay_t<std::tuple_element_t<decltype(number)::value, decltype(std::declval<T&>().fields())>>;
        const auto member = [](const T& one) -> const V& { return std::get<decltype(number)::value>(one.fields()); };
        if constexpr (std::is_same_v<decltype(shown(std::declval<V>(), nullptr, Lengths())), V>)
            bound.def_property_readonly(rules[number].name.c_str(), member);
        else
            get(bound, rules[number], "", member);
    };
    (add(std::integral_constant<std::size_t, I>()), ...);
}

/// A class whose objects can be copied, with the members that TACTILE_FIELDS names.
template <class T, class... Options>
py::class_<T, Options...> class_of(py::module_& module, const char* name, const char* text, const Lines& lines = {}) {
    py::class_<T, Options...> bound(module, name, text);
    if constexpr (HAS_FIELDS<T>)
        get_fields(bound, rules_of<T>(lines), std::make_index_sequence<std::tuple_size_v<decltype(std::declval<T&>().fields())>>());
    bound.def("__copy__", [](const T& one) { return one; }).def("__deepcopy__", [](const T& one, const py::dict&) { return one; });
    return bound;
}

/// A struct that Python makes of its members by name. Members that are arrays are required.
template <class T>
py::class_<T> record(py::module_& module, const char* name, const char* text, const Lines& lines = {}) {
    const auto make = [name, rules = rules_of<T>(lines)](const py::kwargs& given) {
        for (const auto& one : given)
            if (std::none_of(rules.begin(), rules.end(), [&](const Rule& rule) { return rule.name == one.first.cast<std::string>(); }))
                throw py::type_error(one.first.cast<std::string>() + ": " + name + " has only " + T::FIELDS);
        Lengths lengths;
        const auto value = [&](const std::string& of) {
            return py::reinterpret_borrow<py::object>(PyDict_GetItemString(given.ptr(), of.c_str()));
        };
        return made_of<T>(rules, value, lengths);
    };
    const std::string shown_as = std::string(name) + "()";
    return class_of<T>(module, name, text, lines).def(py::init(make), T::FIELDS).def("__repr__", [=](const T&) { return shown_as; });
}

}  // namespace tactile::border
