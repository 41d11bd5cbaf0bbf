// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tactile {

constexpr double PI = 3.14159265358979323846;

}  // namespace tactile
