# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Lets the tests here import taxel_pictures."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
