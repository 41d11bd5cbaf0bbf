# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Processing stages per sensor type: from the content of a raw message to all estimates."""
