// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// How the bindings of a subject, in its own folder, become part of the module.
#pragma once

#include <pybind11/pybind11.h>

#include <map>
#include <string>

namespace tactile::border {

// A static object of this type adds a function that binds a subject.
struct Subject {
    using Bind = void (*)(pybind11::module_&);
    Subject(const char* name, Bind bind) { all()[name] = bind; }
    // By name.
    static std::map<std::string, Bind>& all() {
        static std::map<std::string, Bind> subjects;
        return subjects;
    }
};

}  // namespace tactile::border
