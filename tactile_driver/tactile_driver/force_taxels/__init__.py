# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxels that measure a force vector each: layout, sources, messages, driver, emulator."""
from .layout import TaxelFrame, TaxelLayout, read_layout, tangents, taxel_frame

__all__ = ['TaxelFrame', 'TaxelLayout', 'read_layout', 'tangents', 'taxel_frame']
