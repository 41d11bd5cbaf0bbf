# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""papers: the experiments of the five papers on the simulated sensors."""
