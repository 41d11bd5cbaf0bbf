# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The methods of the papers, a file for each paper, registered by name in the method tables of the sensors' folders."""
