# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Two cameras' views of one sheet as one picture."""
