# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The contact methods of the finger, by name."""
from __future__ import annotations

from collections.abc import Callable, Mapping

from ..errors import BadArgument
from .finger import FingerSettings, PsdFinger
from .model import FingerModel
from .published import PaperFinger


def _map(model: FingerModel, values: Mapping) -> PsdFinger:
    return PsdFinger(model, _settings(values))


def _paper(model: FingerModel, values: Mapping) -> PsdFinger:
    return PaperFinger(model, _settings(values), values['paper.threshold'])


def _settings(values: Mapping) -> FingerSettings:
    return FingerSettings(values['radius'], values['saturation'], values['reference.seconds'], values['reference.fastest_drift'])


PSD_METHODS: dict[str, Callable[[FingerModel, Mapping], PsdFinger]] = {'map': _map, 'paper': _paper}


def make_finger(name: str, model: FingerModel, values: Mapping) -> PsdFinger:
    """The named method for a finger; values: of PSD_PARAMETERS. Raises BadArgument for an unknown name."""
    if name not in PSD_METHODS:
        raise BadArgument(f'method {name!r} is unknown; choose one of {", ".join(sorted(PSD_METHODS))}')
    return PSD_METHODS[name](model, values)
