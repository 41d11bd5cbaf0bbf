# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Camera, light, printed pattern and the picture that they make."""
