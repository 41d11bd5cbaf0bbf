# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stages of each sensor type from message to message: live nodes and process_bag run the same."""
