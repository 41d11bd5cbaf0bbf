# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Mechanics of an inflated dome that a round tip presses: membrane and gas, library of presses, fit to a frame."""
