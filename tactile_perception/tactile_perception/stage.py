# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor's perception is: one object that its node, process_bag and evaluate run."""
from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import ClassVar, NamedTuple

from tactile_driver.parameters.table import Parameter

from .nodes.messages.conversions import stamp_seconds
from .pipeline.clock import StampClock


class Input(NamedTuple):
    """What a stage processes. topic, type: of its messages; depth: of the queue of a node; patience_s: s that a message may wait in it,
    None for the usual time."""

    topic: str
    type: type
    depth: int
    patience_s: float | None = None


class Stage(ABC):
    """Messages of a sensor in, estimates out. It holds what a message hands to the next.

    node: name of the node that runs it; parameters: its table; input: what it processes; outputs: topic -> type of what it estimates;
    takes_camera: whether camera_info belongs to it. values: of the parameters; a calibration that they name is read at once. A subclass
    computes the estimates in `estimate`.
    """

    node: ClassVar[str]
    parameters: ClassVar[Sequence[Parameter]]
    input: ClassVar[Input]
    outputs: ClassVar[Mapping[str, type]]
    takes_camera: ClassVar[bool] = False

    def __init__(self, values: Mapping):
        self.values = dict(values)
        self._clock = StampClock()

    def process(self, message, topics: Collection[str] | None = None) -> dict[str, list]:
        """Topic -> messages estimated from one message, for the topics, None for all. Stamps that begin again reset the stage.

        Raises BadFrame for a message that cannot be used, ClockSetBack for one whose stamp went back.
        """
        self.check(message)
        stamp_s = stamp_seconds(message.header)
        with self._clock.at(stamp_s) as begins_again:
            if begins_again:
                self.reset()
            return self.estimate(message, stamp_s, self.outputs if topics is None else topics)

    @abstractmethod
    def estimate(self, message, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """What process returns; stamp_s: of the message, s. Raises BadFrame."""

    @abstractmethod
    def set_reference(self) -> None:
        """Take the untouched reference from the next messages."""

    @abstractmethod
    def reset(self) -> None:
        """Drop all earlier messages."""

    def check(self, message) -> None:
        """Raise BadFrame for a message that cannot be used, whatever came before it."""

    def health(self) -> tuple[str, dict]:
        """A warning ('' for none) and name -> value, for /diagnostics."""
        return '', {}

    def covered_ns(self, message) -> int:
        """Duration of the samples of a message, ns; 0 where messages come at a fixed rate."""
        return 0

    def on_camera_info(self, message) -> None:
        """Take a camera's calibration; a sensor without a camera ignores it. Raises TactileError for an unusable one."""
