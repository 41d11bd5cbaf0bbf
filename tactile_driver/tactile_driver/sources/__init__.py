# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where frames come from: device, file, bag, simulation."""
