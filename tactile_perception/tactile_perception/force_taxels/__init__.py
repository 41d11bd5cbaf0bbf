# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Taxels that measure a force vector each, as XELA uSkin, Paxini and PapillArray: contact, slip, wrench."""
