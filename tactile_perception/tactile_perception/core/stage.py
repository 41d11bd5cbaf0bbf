# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stage: perception of a sensor as one object, which its node, process_bag, evaluate and scripts run."""
from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import ClassVar, NamedTuple

from tactile_driver.parameters.table import Parameter
from tactile_driver.stitching.calibration import Stitching

from .clock import StampClock
from .messages import check_message, stamp_seconds


class Input(NamedTuple):
    """Messages that a stage processes.

    Parameters
    ----------
    topic : str
        Topic of the messages.
    type : type
        Type of the messages.
    depth : int
        Depth of the node's queue.
    patience_s : float, optional
        Time in s that a message may wait in the queue; None for the default.
    latched : bool
        Whether the last message before the subscription counts.
    """

    topic: str
    type: type
    depth: int
    patience_s: float | None = None
    latched: bool = False


class Stage(ABC):
    """Base class of stages: messages of a sensor in, estimates out. A stage holds the state between messages.

    A subclass computes the estimates in `estimate`.

    Parameters
    ----------
    values : Mapping
        Values of the parameters. A calibration that they name is read at once.

    Attributes
    ----------
    node : str
        Name of the node that runs the stage.
    parameters : sequence of Parameter
        Table of its parameters.
    input : Input
        Messages that it processes, known once it is made.
    outputs : Mapping
        Topic to type of its estimates, known once it is made.
    has_reference : bool
        Whether it can take a new undeformed reference.
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
        """Inputs besides the main one, for `take`."""
        return ()

    def take(self, topic: str, message) -> None:
        """Take a message of a side input.

        Parameters
        ----------
        topic : str
            Topic of the message.
        message : object
            The message.

        Raises
        ------
        TactileError
            If the message cannot be used.
        """

    @property
    def waits(self) -> bool:
        """Whether the first message should wait for a side input."""
        return False

    def process(self, message, topics: Collection[str] | None = None) -> dict[str, list]:
        """Estimate from one message. A stamp that goes back resets the stage.

        Parameters
        ----------
        message : object
            Message of the input.
        topics : collection of str, optional
            Topics that are needed; None for all.

        Returns
        -------
        dict
            Topic to list of messages, each of the type in `outputs` or a WrittenMessage of it.

        Raises
        ------
        BadFrame
            If the message cannot be used; `BadFrame.partial` has what could be estimated.
        ClockSetBack
            If the stamp of the message went back.
        """
        self.check(message)
        stamp_s = stamp_seconds(message.header)
        with self._clock.at(stamp_s) as restarts:
            if restarts:
                check_message(message)  # one that is refused resets nothing
                self.reset()
            return self.estimate(message, stamp_s, self.outputs if topics is None else topics)

    @abstractmethod
    def estimate(self, message, stamp_s: float, topics: Collection[str]) -> dict[str, list]:
        """Compute what `process` returns.

        Parameters
        ----------
        message : object
            Message of the input.
        stamp_s : float
            Its stamp, in s.
        topics : collection of str
            Topics that are needed.

        Returns
        -------
        dict
            Topic to list of messages, each of the type in `outputs` or a WrittenMessage of it.

        Raises
        ------
        BadFrame
            If the message cannot be used.
        """

    @abstractmethod
    def reset(self) -> None:
        """Forget all earlier messages."""

    def set_reference(self) -> None:
        """Take the undeformed reference from the next messages."""

    def check(self, message) -> None:
        """Check a message independently of earlier ones.

        Parameters
        ----------
        message : object
            Message of the input.

        Raises
        ------
        BadFrame
            If the message cannot be used.
        """

    def use_frame(self, frame_id: str) -> None:
        """Set the name of the sensor frame, in which results are. A stage whose input names it ignores this.

        Parameters
        ----------
        frame_id : str
            Name of the frame.
        """

    def check_change(self, values: Mapping) -> None:
        """Check whether values of the parameters fit together.

        Parameters
        ----------
        values : Mapping
            Values of all parameters.

        Raises
        ------
        BadArgument
            If they do not.
        """

    def change(self, values: Mapping) -> None:
        """Take new values of parameters that may change while the stage runs.

        Parameters
        ----------
        values : Mapping
            The changed values.

        Raises
        ------
        BadArgument
            If a value cannot be used.
        """

    def health(self) -> tuple[str, dict]:
        """Report the state for /diagnostics.

        Returns
        -------
        tuple of str and dict
            A warning, empty for none, and named values.
        """
        return '', {}

    def covered_ns(self, message) -> int:
        """Duration of the samples of a message.

        Parameters
        ----------
        message : object
            Message of the input.

        Returns
        -------
        int
            Duration in ns; 0 where messages come at a fixed rate.
        """
        return 0
