# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as data sets for learning. h5py, zarr and pyarrow are optional extras, imported where a data set is written."""
