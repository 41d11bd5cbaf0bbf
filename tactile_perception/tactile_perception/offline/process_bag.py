# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag: every estimate that the live nodes would publish, for each raw message of a recording, as fast as it can be computed."""
from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import BadFrame, BadRecording, TactileError
from ..nodes.serialization import MessageCodec
from ..nodes.touchpad_stages import ContactMessages, DotMessages
from ..pipeline.parameter_file import read_parameters
from ..pipeline.parameters import DOT_PARAMETERS, REGION_PARAMETERS
from .bags import BagReader, BagWriter, RawMessage
from .progress import Progress

_KEPT = ('camera_info', 'ground_truth/contacts', 'ground_truth/contact_region', 'ground_truth/slip', 'ground_truth/wrench')


@dataclass
class Summary:
    """What was done: frames read, results written by topic, refused frames by reason, s of computing."""

    frames: int = 0
    written: Counter = field(default_factory=Counter)
    refused: Counter = field(default_factory=Counter)
    seconds: float = 0.0


class TouchpadReplay:
    """The touchpad's nodes without a middleware: messages in, (topic, message) out. Values of the two nodes' parameters."""

    def __init__(self, dot_values: dict, region_values: dict):
        self._dots = DotMessages(dot_values)
        self._contact = ContactMessages(region_values) if self._dots.sensor.cap is not None else None

    def on_camera_info(self, message) -> None:
        """As the nodes do."""
        self._dots.on_camera_info(message)
        if self._contact is not None:
            self._contact.on_camera_info(message)

    def on_image(self, message) -> Iterator[tuple[str, object]]:
        """Every estimate for one image. Raises TactileError where a node would refuse it."""
        dots = self._dots.on_image(message)
        yield 'dots', dots
        if self._contact is not None:
            yield from self._contact.on_dots(dots).items()


def process_bag(source: Path, target: Path, dot_values: dict, region_values: dict, namespace: str = '') -> Summary:
    """Write the estimates for source to target, a new bag; stamps are source's. Raises TactileError for a bag or parameters that
    cannot be used.
    """
    codec, summary = MessageCodec(), Summary()
    replay = TouchpadReplay(dot_values, region_values)
    with BagReader(source) as reader:
        prefix = find_prefix(reader.topics, namespace)
        with BagWriter(target, codec.store) as writer:
            for message in Progress(reader.messages({prefix + name for name in (*_KEPT, 'image_raw')}), 'messages'):
                begin = time.perf_counter()
                for topic, type_name, data in _results(message, message.topic.removeprefix(prefix), replay, codec, summary):
                    writer.write(prefix + topic, type_name, message.stamp_ns, data)
                    summary.written[topic] += 1
                summary.seconds += time.perf_counter() - begin
    return summary


def find_prefix(topics: dict[str, str], namespace: str) -> str:
    """'/ns/' of the sensor in a bag with these topics. Raises BadRecording where there is none, or more than one and none is named."""
    found = sorted(
        t.removesuffix('image_raw') for t, kind in topics.items() if t.endswith('/image_raw') and kind == 'sensor_msgs/msg/Image'
    )
    wanted = f'/{namespace.strip("/")}/'.replace('//', '/')
    if namespace and wanted not in found:
        raise BadRecording(f'no {wanted}image_raw in the bag; it has {", ".join(p + "image_raw" for p in found) or "no image_raw at all"}')
    if not namespace and len(found) != 1:
        raise BadRecording(f'the bag has {len(found)} topics image_raw ({", ".join(found) or "none"}): name one with --namespace')
    return wanted if namespace else found[0]


def _results(message: RawMessage, topic: str, replay: TouchpadReplay, codec: MessageCodec, summary: Summary):
    """(topic, type, bytes) that come of one message: of an image its estimates, of the rest itself."""
    if topic != 'image_raw':
        if topic == 'camera_info':
            replay.on_camera_info(codec.decode(message.data, message.type_name))
        yield topic, message.type_name, message.data
        return
    summary.frames += 1
    try:
        for name, result in replay.on_image(codec.decode(message.data, message.type_name)):
            yield (name, *codec.encode(result))
    except BadFrame as error:
        summary.refused[str(error)] += 1


def report(summary: Summary, target: Path) -> str:
    """The summary in words."""
    lines = [
        f'{target}: {summary.frames} frames in {summary.seconds:.1f} s ({1e3 * summary.seconds / max(summary.frames, 1):.1f} ms a frame); '
        + ', '.join(f'{n} {topic}' for topic, n in sorted(summary.written.items()))
    ]
    lines += [f'  refused {n} frames: {reason}' for reason, n in summary.refused.most_common()]
    return '\n'.join(lines)


def main(args: list[str] | None = None) -> int:
    """The command process_bag; exit code 0, or 1 with one line that says what is wrong."""
    parser = argparse.ArgumentParser(prog='process_bag', description=__doc__)
    parser.add_argument('input', type=Path, help='rosbag2 recording (MCAP or sqlite3)')
    parser.add_argument('output', type=Path, help='new rosbag2 folder for the estimates')
    parser.add_argument('--params', type=Path, required=True, help='parameter file of the sensor, as the launch file takes it')
    parser.add_argument('--calibration', type=Path, help='calibration file; without it the one named in the parameters')
    parser.add_argument('--namespace', default='', help='of the sensor, where the recording holds several')
    given = parser.parse_args(args)
    try:
        dot_values = read_parameters(given.params, 'dot_tracker_node', DOT_PARAMETERS)
        region_values = read_parameters(given.params, 'contact_region_node', REGION_PARAMETERS)
        if given.calibration:
            dot_values['calibration'] = region_values['calibration'] = str(given.calibration)
        summary = process_bag(given.input, given.output, dot_values, region_values, given.namespace)
    except TactileError as error:
        print(f'process_bag: {error}', file=sys.stderr)
        return 1
    print(report(summary, given.output))
    return 0


if __name__ == '__main__':
    sys.exit(main())
