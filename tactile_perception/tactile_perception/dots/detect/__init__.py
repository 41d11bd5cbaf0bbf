# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Where an image becomes dots: detectors by name."""
