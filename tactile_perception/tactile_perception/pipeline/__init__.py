# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""From a raw message's content to every estimate, per sensor type."""
