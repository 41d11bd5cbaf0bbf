# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated camera sensors and their scenes. Constants without a source are those of the simulated specimen."""
