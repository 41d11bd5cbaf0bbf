# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The stages of a sensor one after the other, without ROS middleware: what live nodes do, on messages of a recording."""
from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from tactile_driver.parameters.table import Parameter
from tactile_driver.recordings.serialization import type_name_of
from tactile_driver.stitching.calibration import Stitching

from ..errors import BadArgument, TactileError
from ..parameters.file import read_parameters
from ..sensors import SENSOR_TYPES, load
from ..stage import Stage

#: The parameter by which a file says of what sensor it is.
SENSOR_TYPE = (Parameter('sensor_type', str, 'touchpad', '', 'kind of sensor'),)
_SURFACE = (Parameter('surface', str, 'cap', '', 'untouched shape'),)


class Chain:
    """Stages of which each takes what the one before estimates; at least one. raw, raw_type: topic and type of the driver's output."""

    def __init__(self, stages: Sequence[Stage]):
        self.stages = list(stages)
        self.raw, self.raw_type = stages[0].input.topic, type_name_of(stages[0].input.type)

    @property
    def stitching(self) -> Stitching | None:
        """Of the two cameras that the images come from."""
        return self.stages[0].stitching

    @property
    def side_topics(self) -> set[str]:
        """Topics beside the raw one that the stages take."""
        return {side.topic for stage in self.stages for side in stage.side_inputs}

    def use_frame(self, frame_id: str) -> None:
        """Name the sensor frame, in which all results are; '' leaves what the stages have."""
        for stage in self.stages:
            stage.use_frame(frame_id)

    def take(self, topic: str, message) -> None:
        """Pass a message of a side topic to the stages that take it. Raises TactileError for one that cannot be used."""
        for stage in self.stages:
            if topic in (side.topic for side in stage.side_inputs):
                stage.take(topic, message)

    def process(self, message, number: int = 0, topics: Collection[str] | None = None) -> Iterator[tuple[Stage, str, object]]:
        """Yield (stage, topic, estimate) of all that the stages from a number on estimate from one message, and (stage, its input, error)
        where a stage refuses its message; topics: those that are wanted, None for all."""
        stage = self.stages[number]
        try:
            found = stage.process(message, topics and self._needed(stage, topics))
        except TactileError as error:
            yield stage, stage.input.topic, error
            return
        for topic, results in found.items():
            for result in results:
                yield stage, topic, result
                if number + 1 < len(self.stages) and topic == self.stages[number + 1].input.topic:
                    yield from self.process(result, number + 1, topics)

    def _needed(self, stage: Stage, topics: Collection[str]) -> list[str]:
        """The outputs of a stage that are wanted, or are another stage's input."""
        return [topic for topic in stage.outputs if topic in topics or any(topic == each.input.topic for each in self.stages)]


def make_chain(params: Path, calibration: Path | None = None) -> Chain:
    """The stages that a parameter file describes, without those whose parameters are not enough for them; calibration: replaces the file
    that params names. Raises TactileError."""
    name = read_parameters(params, 'dot_tracker_node', SENSOR_TYPE)['sensor_type']
    if name not in SENSOR_TYPES and read_parameters(params, 'dot_tracker_node', _SURFACE)['surface'] in ('none', 'pins'):
        name = 'touchpad'  # a camera over dots of another sensor, as touchpad.launch.py plays it
    if name not in SENSOR_TYPES:
        raise BadArgument(f'{params}: sensor_type {name!r} is unknown; choose one of {", ".join(SENSOR_TYPES)}')
    kinds = [load(node) for node in SENSOR_TYPES[name].perception]
    own = {'calibration': str(calibration)} if calibration else {}
    values = [read_parameters(params, kind.node, kind.parameters) | own for kind in kinds]
    return Chain([kind(given) for kind, given in zip(kinds, values) if kind.can_run(given)])
