# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""`ros2 launch`, used where the package ros2launch is absent: the same command line, over the same launch service."""

import pathlib
import signal
import sys

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from launch import LaunchContext, LaunchDescription, LaunchService, launch_service
from launch.actions import IncludeLaunchDescription, RegisterEventHandler
from launch.event_handlers import OnProcessExit, OnShutdown
from launch.launch_description_sources import AnyLaunchDescriptionSource
from launch.utilities import AsyncSafeSignalManager
from ros2cli.command import CommandExtension

INTERRUPTED = (-2, 130)  # exit codes of a process that ended by our own SIGINT
FAILED = 1  # exit code: a process failed, or the launch file, or what it was given, is wrong, as of ros2launch


class LaunchCommand(CommandExtension):
    """Run a launch file."""

    def add_arguments(self, parser, cli_name):
        """Declare the command line."""
        parser.add_argument('-n', '--noninteractive', action='store_true', help='Run without a terminal')
        parser.add_argument('-s', '--show-args', '--show-arguments', action='store_true', help='Show the arguments of the launch file')
        parser.add_argument('package_name', help='Package that holds the launch file, or path of a launch file')
        parser.add_argument('launch_file_name', nargs='?', help='Name of the launch file, when a package was given')
        parser.add_argument('launch_arguments', nargs='*', help='Arguments as name:=value')

    def main(self, *, parser, args):
        """Find the file, then show its arguments or run it; return the exit code."""
        try:
            path, words = find_launch_file(args.package_name, args.launch_file_name, args.launch_arguments)
            arguments = parse_arguments(words)
        except ValueError as error:
            print(error, file=sys.stderr)
            return FAILED
        source = AnyLaunchDescriptionSource(str(path))
        if args.show_args:
            show_arguments(source.get_launch_description(LaunchContext(argv=words)))
            return 0
        return run(IncludeLaunchDescription(source, launch_arguments=arguments), words, args.noninteractive)


def find_launch_file(first, second, rest):
    """Return (path, words that are left for the launch file); ValueError when there is no such package or file."""
    if pathlib.Path(first).is_file():
        return pathlib.Path(first), ([second] if second else []) + rest
    try:
        share = pathlib.Path(get_package_share_directory(first))
    except (PackageNotFoundError, ValueError):
        raise ValueError(f"'{first}' is neither an installed package nor a launch file") from None
    found = sorted(share.rglob(second)) if second else []
    if len(found) == 1:
        return found[0], rest
    known = ' '.join(sorted({path.name for path in share.rglob('*launch.*')})) or 'none'
    reason = 'several files' if found else 'no launch file'
    raise ValueError(f"{reason} '{second or ''}' in package '{first}', which has: {known}")


def parse_arguments(words):
    """Return [(name, value), ...] of words such as name:=value; ValueError for any other word."""
    for word in words:
        if ':=' not in word.lstrip(':='):
            raise ValueError(f"launch argument '{word}' is not of the form name:=value")
    return [tuple(word.split(':=', 1)) for word in words]


def show_arguments(description):
    """Print name, text and default of each argument that the launch description declares."""
    declared = description.get_launch_arguments()
    print("Arguments (pass arguments as '<name>:=<value>'):" if declared else 'No arguments.')
    for argument in declared:
        print(f"\n    '{argument.name}':\n        {argument.description}")
        if argument.default_value is not None:
            print(f"        (default: {' + '.join(part.describe() for part in argument.default_value)})")


def signals_that_end(service):
    """Return launch's signal manager, but SIGTERM ends the processes of the launch too: launch would leave them running."""
    class SignalManager(AsyncSafeSignalManager):
        def handle(self, signum, handler):
            """See AsyncSafeSignalManager."""
            if handler and signum == signal.SIGTERM:
                return super().handle(signum, lambda _: service.shutdown(force_sync=True))
            return super().handle(signum, handler)
    return SignalManager


def run(entity, words, noninteractive):
    """Run the entity until all its processes have ended; the exit code: 0, or FAILED where a process or launch itself did."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job of a shell starts with SIGINT ignored
    signal.signal(signal.SIGTERM, lambda *_: None)  # launch hears only of signals for which Python has a handler
    failed, ends = [], []  # names of processes that did not end cleanly; whether the launch ends

    def on_exit(event, _context):
        """Take down what did not end cleanly."""
        if event.returncode and not (ends and event.returncode in INTERRUPTED):
            failed.append(event.process_name)
    service = LaunchService(argv=words, noninteractive=noninteractive)
    service.include_launch_description(LaunchDescription([
        RegisterEventHandler(OnProcessExit(on_exit=on_exit)),
        RegisterEventHandler(OnShutdown(on_shutdown=lambda *_: ends.append(True))), entity]))
    launch_service.AsyncSafeSignalManager = signals_that_end(service)
    return FAILED if service.run() or failed else 0
