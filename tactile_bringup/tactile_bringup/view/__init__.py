# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sensors seen in Rerun, live or from a recording. Only entities.py, layout.py, tuning.py and viewer.py import rerun, an optional extra."""
from importlib.util import find_spec

#: What to do where Rerun is not installed, '' where it is.
MISSING = '' if find_spec('rerun') else 'Rerun is not installed: python3 -m pip install rerun-sdk==0.41.0'
