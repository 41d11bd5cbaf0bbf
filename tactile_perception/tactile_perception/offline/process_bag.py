# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""process_bag: every estimate that the live nodes would publish, for each raw message of a recording, as fast as it can be computed."""
from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import BadFrame, TactileError
from ..nodes.serialization import MessageCodec
from .bags import BagReader, BagWriter, RawMessage
from .progress import Progress
from .replay import Replay, make_replay
from .stamped import find_prefix
from .stitched_bag import bag_opener

_KEPT = ('camera_info', 'ground_truth/contacts', 'ground_truth/contact_region', 'ground_truth/slip', 'ground_truth/wrench')


@dataclass
class Summary:
    """What was done: frames read, results written by topic, refused frames by reason, s of computing."""

    frames: int = 0
    written: Counter = field(default_factory=Counter)
    refused: Counter = field(default_factory=Counter)
    seconds: float = 0.0


def process_bag(source: Path, target: Path, replay: Replay, namespace: str = '',
                open_bag: Callable[[Path], BagReader] = BagReader) -> Summary:
    """Write the estimates of replay for source to target, a new bag; stamps are source's; open_bag: reads source. Raises TactileError for
    a bag that cannot be used.
    """
    codec, summary = MessageCodec(), Summary()
    with open_bag(source) as reader:
        prefix = find_prefix(reader.topics, namespace, replay.raw, replay.raw_type)
        with BagWriter(target, codec.store) as writer:
            for message in Progress(reader.messages({prefix + name for name in (*_KEPT, replay.raw)}), 'messages'):
                begin = time.perf_counter()
                for topic, type_name, data in _results(message, message.topic.removeprefix(prefix), replay, codec, summary):
                    writer.write(prefix + topic, type_name, message.stamp_ns, data)
                    summary.written[topic] += 1
                summary.seconds += time.perf_counter() - begin
    return summary


def _results(message: RawMessage, topic: str, replay: Replay, codec: MessageCodec, summary: Summary):
    """(topic, type, bytes) that come of one message: of a raw one its estimates, of the rest itself."""
    if topic != replay.raw:
        if topic == 'camera_info':
            replay.on_camera_info(codec.decode(message.data, message.type_name))
        yield topic, message.type_name, message.data
        return
    summary.frames += 1
    try:
        for name, result in replay.on_raw(codec.decode(message.data, message.type_name)):
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
        replay = make_replay(given.params, given.calibration)
        summary = process_bag(given.input, given.output, replay, given.namespace, bag_opener(given.params, replay.stitching))
    except TactileError as error:
        print(f'process_bag: {error}', file=sys.stderr)
        return 1
    print(report(summary, given.output))
    return 0


if __name__ == '__main__':
    sys.exit(main())
