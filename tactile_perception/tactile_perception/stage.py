# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor's perception is: one object that its node, process_bag, evaluate and the Python face run."""
from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import ClassVar, NamedTuple

from tactile_driver.parameters.table import Parameter
from tactile_driver.stitching.calibration import Stitching

from .clock import StampClock
from .nodes.messages.conversions import check_message, stamp_seconds


class Input(NamedTuple):
    """What a stage processes. topic, type: of its messages; depth: of the queue of a node; patience_s: s that a message may wait in it,
    None for the usual time; latched: whether the last message from before the subscription counts."""

    topic: str
    type: type
    depth: int
    patience_s: float | None = None
    latched: bool = False


class Stage(ABC):
    """Messages of a sensor in, estimates out. It holds what a message hands to the next.

    node: name of the node that runs it; parameters: its table. values: of the parameters; a calibration that they name is read at once, and
    then are known, at the latest: input, what it processes; outputs, topic -> type of what it estimates; has_reference, whether it can take
    a new untouched reference. A subclass computes the estimates in `estimate`.
    """

    node: ClassVar[str]
    parameters: ClassVar[Sequence[Parameter]]
    input: Input
    outputs: Mapping[str, type]
    has_reference: bool = True
    stitching: Stitching | None = None  #: of the two cameras that the images come from

    def __init__(self, values: Mapping):
        self.values = dict(values)
        self._clock = StampClock()

    @property
    def side_inputs(self) -> Sequence[Input]:
        """What arrives beside the input, for `take`."""
        return ()

    def take(self, topic: str, message) -> None:
        """Take a message of a side input. Raises TactileError for one that cannot be used."""

    @property
    def waits(self) -> bool:
        """Whether the first message should wait for a side input."""
        return False

    def process(self, message, topics: Collection[str] | None = None) -> dict[str, list]:
        """Topic -> messages estimated from one message, for the topics, None for all. A stamp that goes back resets the stage.

        Raises BadFrame for a message that cannot be used, with what could be estimated before; ClockSetBack for one whose stamp went back.
        """
        self.check(message)
        stamp_s = stamp_seconds(message.header)
        with self._clock.at(stamp_s) as begins_again:
            if begins_again:
                check_message(message)  # one that is refused resets nothing
                self.reset()
            return self.estimate(message, stamp_s, self.outputs if topics is None else topics)

    @abstractmethod
    def estimate(self, message, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """What process returns; stamp_s: of the message, s. Raises BadFrame."""

    @abstractmethod
    def reset(self) -> None:
        """Drop all earlier messages."""

    def set_reference(self) -> None:
        """Take the untouched reference from the next messages."""

    def check(self, message) -> None:
        """Raise BadFrame for a message that cannot be used, whatever came before it."""

    def use_frame(self, frame_id: str) -> None:
        """Name the sensor frame, in which results are; a stage whose input names it ignores this."""

    def check_change(self, values: Mapping) -> None:
        """Raise BadArgument for values of the parameters that do not fit together."""

    def change(self, values: Mapping) -> None:
        """Take new values of the parameters that may change while it runs. Raises BadArgument."""

    def health(self) -> tuple[str, dict]:
        """A warning ('' for none) and name -> value, for /diagnostics."""
        return '', {}

    def covered_ns(self, message) -> int:
        """Duration of the samples of a message, ns; 0 where messages come at a fixed rate."""
        return 0
