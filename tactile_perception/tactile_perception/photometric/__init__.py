# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Gels without markers: the shape of the gel from the colours of its light."""
