# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Elastic layers with printed dots: contacts, shear and slip from the dots' displacements. Knows no sensor."""
