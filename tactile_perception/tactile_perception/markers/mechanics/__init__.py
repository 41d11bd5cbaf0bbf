# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Touches of a sheet by its mechanics: membrane FEM, reduced model, inverse problem."""
