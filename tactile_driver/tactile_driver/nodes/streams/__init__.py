# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""An open source, read in one thread and published in another, by kind of data, with its health."""
