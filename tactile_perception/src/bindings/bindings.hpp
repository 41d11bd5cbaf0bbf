// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Bindings of subjects that have a file of their own.
#pragma once

#include <pybind11/pybind11.h>

namespace tactile::border {

void bind_dots(pybind11::module_& module);
void bind_force_taxels(pybind11::module_& module);
void bind_touchpad(pybind11::module_& module);
void bind_common(pybind11::module_& module);
void bind_finger(pybind11::module_& module);
void bind_press(pybind11::module_& module);
void bind_taxel(pybind11::module_& module);

}  // namespace tactile::border
