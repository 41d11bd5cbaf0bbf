// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels. Each function checks its arguments (border.hpp), releases the GIL, and returns new arrays.
#include "bindings/bindings.hpp"

PYBIND11_MODULE(_core, module) {
    module.doc() = "Compiled kernels of tactile_perception: arrays in, arrays out. A wrong argument raises BadArgument with its name.";
    for (const auto& [name, bind] : tactile::border::Subject::all()) bind(module);
}
