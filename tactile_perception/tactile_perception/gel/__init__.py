# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Flat elastic layers with dots: contacts from the dots' displacements."""
