# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import tactile_driver  # noqa: F401, for what it does about Ctrl-C
