# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Contact: loads, states of dots, regions, contacts, slip."""
