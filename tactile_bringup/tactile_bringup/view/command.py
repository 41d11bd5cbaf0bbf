# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""view: shows sensors in Rerun: live, or recordings.

    ros2 run tactile_bringup view [BAG ...] [--web] [--save FILE.rrd]
"""
from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from tactile_driver.errors import BadArgument, reports_errors
from tactile_driver.frame_names import sensor_frame
from tactile_driver.nodes.runtime.run import make_room_for_images
from tactile_driver.recordings.reader import BagReader
from tactile_perception.common.progress import progress
from tactile_perception.tools.many import recordings

from . import MISSING
from .topics import COMMON, sensor_topics

if TYPE_CHECKING:
    from rerun import RecordingStream

    from .entities import Entities

@reports_errors('view')
def main(args: list[str] | None = None) -> int:
    """Run the command; exit code 0, or 1 with a one-line error."""
    parser = argparse.ArgumentParser(prog='view', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('bag', type=Path, nargs='*', help='recordings, or folders of them, such as those of a hand, or raw data and '
                        'what process_bag made of them, in one view; default: the running sensors')
    parser.add_argument('--web', action='store_true', help='show it in a browser instead of a window')
    parser.add_argument('--save', type=Path, help='.rrd file to write instead of opening a viewer')
    parser.add_argument('--namespace', action='append', default=[], help='namespace of a sensor to show (may be repeated); default: all')
    parser.add_argument('--frame', default='', help="frame in which all is shown; default: the sensor's, with several sensors hand")
    parser.add_argument('--rate', type=float, default=10.0, help='images per second of a topic, 0 for all; every number is plotted')
    parser.add_argument('--bind', default='127.0.0.1', help='address on which the viewer listens (default: %(default)s)')
    parser.add_argument('--tune', type=Path, metavar='FILE', help='also show candidates and mask of running dot_tracker_nodes, and write '
                        'what ros2 param set changes to this parameter file')
    given = parser.parse_args(remove_ros_args(sys.argv if args is None else ['view', *args])[1:])
    if given.tune and given.bag:
        raise BadArgument('--tune is for running sensors: ros2 launch tactile_bringup dots.launch.py source:=bag path:=BAG loop:=true')
    if MISSING:
        raise BadArgument(MISSING)
    from .viewer import Viewer, to_file
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        if given.save:
            with to_file(given.save) as stream:
                _show(given, stream, lambda: True)
            return 0
        with Viewer(given.web, given.bind) as viewer:
            _show(given, viewer.stream, lambda: viewer.is_open)
            if given.bag:
                viewer.wait()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    return 0


def _show(given: argparse.Namespace, stream: RecordingStream, is_open: Callable[[], bool]) -> None:
    from .entities import Entities
    shown = Entities(stream, given.rate)
    (_show_bags if given.bag else _show_live)(given, stream, shown, is_open)
    stream.flush()
    if shown.refused:
        print(f'  left out: {shown.refused} damaged messages')


def _lay_out(sensors: dict[str, dict[str, str]], frame: str, stream: RecordingStream, shown: Entities) -> None:
    from .layout import blueprint, line_styles
    shown.topics |= {topic for topics in sensors.values() for topic in topics}
    for path, style in line_styles(sensors).items():
        stream.log(path, style, static=True)
    frame = frame or (sensor_frame(next(iter(sensors))) if len(sensors) == 1 else 'hand')
    stream.send_blueprint(blueprint(sensors, frame))


def _show_bags(given: argparse.Namespace, stream: RecordingStream, shown: Entities, is_open: Callable[[], bool]) -> None:
    topics: dict[str, str] = {}
    bags = [bag for path in given.bag for bag in recordings([path]).values()]  # raw data and results may have the same name
    for bag in bags:
        with BagReader(bag) as reader:
            topics |= reader.topics
    spaces = {f'/{space.strip("/")}' for space in given.namespace}
    sensors = {space: own for space, own in sensor_topics(topics).items() if not spaces or space in spaces}
    if not sensors:
        raise BadArgument(f'no sensor in the recording; it has {", ".join(sorted(topics))}')
    _lay_out(sensors, given.frame, stream, shown)
    wanted = {*COMMON, *(topic for own in sensors.values() for topic in own)}
    for bag in bags:
        with BagReader(bag) as reader:
            for message in progress(reader.messages(wanted), f'messages of {bag.name}'):
                shown.add(message)
                if not is_open():
                    return
            for line in reader.left_out.lines():
                print(f'  left out: {line}')


def _show_live(given: argparse.Namespace, stream: RecordingStream, shown: Entities, is_open: Callable[[], bool]) -> None:
    from .live import ViewNode
    make_room_for_images()
    rclpy.init(args=None, signal_handler_options=SignalHandlerOptions.NO)
    takers = [shown.add]
    node = ViewNode(given.namespace, lambda message: [take(message) for take in takers],
                    lambda sensors: _lay_out(sensors, given.frame, stream, shown))
    if given.tune:
        from .tuning import Tuning
        tuning = Tuning(stream, given.tune)
        tuning.follow(node)
        takers.append(tuning.take)
    try:
        with SingleThreadedExecutor() as executor:
            executor.add_node(node)
            while is_open():
                executor.spin_once(timeout_sec=0.5)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
