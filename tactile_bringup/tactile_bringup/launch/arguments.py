# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The launch file of any sensor type, from the table of sensor types: its arguments, its nodes, and the processes that run them.

An exception ends a launch, which prints its message: one line for the user.
"""
from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml
from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, LogInfo, OpaqueFunction, Shutdown
from launch.events.process import ProcessExited
from launch.logging import launch_config
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from tactile_driver.errors import BadArgument, TactileError
from tactile_driver.frame_names import sensor_frame
from tactile_driver.nodes.runtime.run import EXIT_FAILURE
from tactile_driver.parameters.table import Parameter
from tactile_perception.core.parameter_files import check_sections, read_parameters
from tactile_perception.core.sensor_type import NODES, SENSOR_TYPES

from ..sensor_files import parameter_file, rviz_file, simulated_calibration
from ..view import MISSING

Texts = Mapping[str, tuple[str, str]]  # of the arguments of a launch file: name -> default and text
#: Arguments of every launch file with sensors.
VIEW: Texts = {'view': ('false', 'show it in Rerun: true or false'),
               'web': ('false', 'show it in Rerun, in a browser: true or false')}
_RESPAWN = {'respawn': True, 'respawn_delay': 0.5}  # s
_BOOLEANS = {'true': True, 'false': False}


def description(texts: Texts, actions: Callable[[dict[str, str]], list]) -> LaunchDescription:
    """A launch file with these arguments; `actions` makes actions of their values, and reports wrong ones: launch would do so twice."""
    declared = [DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in texts.items()]
    return LaunchDescription([*declared, OpaqueFunction(function=lambda context: actions(values_of(context, list(texts))))])


def values_of(context: LaunchContext, known: Sequence[str]) -> dict[str, str]:
    """Name -> value of the known arguments. Raises BadArgument for another one."""
    # launch ignores undeclared names. A launch file that includes this one may have arguments of its own.
    file = Path(getattr(context.locals, 'current_launch_file_path', 'none')).name if context.argv else ''
    unknown = [word for word in context.argv if word.partition(':=')[0] not in known]
    if unknown and any(Path(word).name == file for word in sys.argv):
        raise BadArgument(f'{unknown[0]}: there is no launch argument {unknown[0].partition(":=")[0]}; known are {", ".join(known)}')
    return {name: LaunchConfiguration(name).perform(context) for name in known}


@dataclass(frozen=True)
class SensorPlan:
    """The nodes of one sensor. frame: the sensor frame; params: parameter file of all nodes; nodes: name -> parameters that override the
    file; bag: to record, '' for none; ends: whether the launch is over when the sensor's recording is; note: a line that launch logs."""

    frame: str
    namespace: str
    params: str
    nodes: Mapping[str, Mapping[str, object]]
    bag: str = ''
    ends: bool = False
    note: str = ''


class Playing:
    """The sensors of a launch whose recordings are not over yet; with the last of them the launch ends. count: their number."""

    def __init__(self, count: int):
        self._left = count

    def on_exit(self, event: ProcessExited, context: LaunchContext) -> list:
        """The actions when the process that plays a recording exits.

        Raises BadArgument if the recording was not over: a restarted process would play it from the beginning.
        """
        end_if_wrong(event, context)
        if context.is_shutdown:
            return []
        if event.returncode:
            raise BadArgument(f'{event.process_name}: died with exit code {event.returncode} while it played a recording')
        self._left -= 1
        over = 'the recording is over; stay:=true keeps the nodes, loop:=true plays it again'
        return [] if self._left else [LogInfo(msg=over), Shutdown(reason='the recording is over')]


def end_if_wrong(event: ProcessExited, context: LaunchContext) -> None:
    """End the launch when a process exits because of a wrong parameter or file. Raises BadArgument, with which launch fails."""
    if event.returncode == EXIT_FAILURE and not context.is_shutdown:
        raise BadArgument(f'{event.process_name}: a parameter or a file is wrong, see its message above')


def processes(plan: SensorPlan, composed: bool, playing: Playing, apart: str = '') -> list[Node]:
    """The processes of the sensor: one for all nodes, or one per node; apart: a node that has its own in any case.

    The recorder is always a process of its own, since a slow or full disk must not delay the sensor; it is not restarted, since its bag
    exists.
    """
    given = {'namespace': plan.namespace, 'output': 'screen', 'parameters': [plan.params, _own_parameters(plan)], 'on_exit': end_if_wrong}
    again = {**given, **_RESPAWN}
    driver = {**given, 'on_exit': playing.on_exit} if plan.ends else again
    started = [Node(package='tactile_bringup', executable='sensor_nodes', exec_name=plan.frame,
                    arguments=[name for name in plan.nodes if name != apart], **driver)] if composed else []
    started += [Node(package=NODES.package(name), executable=name, exec_name=f'{plan.frame}/{name}',
                     **(driver if name == next(iter(plan.nodes)) else again))
                for name in plan.nodes if not composed or name == apart]
    if plan.bag:
        # Another node in the driver's process consumes the raw data, so no subscriber is visible and the recorder does not wait for one.
        own = {'bag': plan.bag, **({'patience': 0.0} if composed else {})}
        started.append(Node(package='tactile_bringup', executable='record_node', **given | {'parameters': [plan.params, own]}))
    return started


def hand_node(hand: str | Path, **parameters: bool) -> Node:
    """The process that publishes frames, contacts and the held object of a hand; hand: its file; the others: parameters of the node."""
    return Node(package='tactile_bringup', executable='hand_node', output='screen', **_RESPAWN, on_exit=end_if_wrong,
                parameters=[{'hand': absolute(hand), **parameters}])


def absolute(path: str | Path) -> str:
    """The path of a file, for processes that run elsewhere."""
    return str(Path(path).expanduser().absolute())


def written(name: str, text: str) -> str:
    """The path of a file with this text, kept beside the log of the launch."""
    path = Path(launch_config.log_dir, name)
    path.write_text(text)
    return str(path)


def _own_parameters(plan: SensorPlan) -> str:
    """The path of a file with the parameters of each node; JSON is YAML in which numbers and texts are not confused."""
    space = f'/{plan.namespace.strip("/")}'.rstrip('/')
    page = {f'{space}/{name}': {'ros__parameters': own} for name, own in plan.nodes.items() if own}
    return written(f'{plan.frame}_parameters.yaml', json.dumps(page, indent=2, ensure_ascii=False))


def sensor_description(sensor_type: str) -> LaunchDescription:
    """Make the launch description of a sensor type, which the launch file `TYPE.launch.py` of its package returns.

    Parameters
    ----------
    sensor_type : str
        Name of the type, as its entry point names it.

    Returns
    -------
    LaunchDescription
        Arguments, nodes and processes of the sensor.
    """
    return description(sensor_arguments(sensor_type), lambda values: sensor_actions(values, sensor_type))


def sensor_arguments(sensor_type: str) -> Texts:
    """The arguments of a sensor type's launch file."""
    kind = SENSOR_TYPES[sensor_type]
    return {
        'namespace': (sensor_type, "of the sensor's nodes and topics; the sensor frame is named after it"),
        'source': ('sim', 'where data comes from: ' + ', '.join(kind.sources)),
        'device': ('', 'device: index, /dev path, name under /dev/v4l/by-id, or part of a serial number'),
        'path': ('', 'file, bag: the video, folder of images or rosbag2 folder'),
        'topic': ('', f'bag: the topic with the raw data; empty: {kind.raw["topic"]} of this sensor' + (
            "; topics: the images of another camera's driver, raw or .../compressed" if 'topics' in kind.sources else '')),
        'params': ('', f'parameter file of all nodes; empty: params/{kind.params or f"{sensor_type}.yaml"}, simulated '
                       f'params/{sensor_type}_sim.yaml'),
        'calibration': ('', 'calibration file, as calibrate writes it; empty: what the parameter file says'),
        'rviz': ('false', 'show it in RViz: true or false'),
        **VIEW,
        'record': ('', 'bag (MCAP) to write; empty: none'),
        'rate': ('', "Hz; file, bag: 0 for as fast as it is consumed; empty: the source's own"),
        'loop': ('', 'file, bag: start again at the end, true or false; empty: what the parameter file says'),
        'stay': ('false', 'file, bag: true keeps the nodes when the recording is over; false: the launch ends with it'),
        'scene': ('', 'sim: the scene; empty: what the parameter file says'),
        'autostart': ('', 'false: the driver waits, unconfigured, for its lifecycle services; empty: what the parameter file says, true'),
        'composed': ('true', 'true: all nodes in one process, in which images go from one to the next by a call; false: one process for '
                             'each node, for debugging'),
        **{name: ('', text) for name, text in kind.arguments.items()},
    }


def sensor_actions(values: Mapping[str, str], sensor_type: str, drawn: Mapping[str, object] | None = None, apart: bool = False) -> list:
    """The actions for the values of the arguments. drawn: parameters of the node that draws; apart: a simulated sensor has a process of its
    own, since it computes as much as all other nodes. Raises BadArgument."""
    kind, plan = SENSOR_TYPES[sensor_type], sensor_plan(values, sensor_type)
    plan.nodes[kind.view].update(drawn or {})
    own = kind.driver if apart and values['source'] == 'sim' else ''
    return [*processes(plan, _BOOLEANS[values['composed']], Playing(1), own), *([LogInfo(msg=plan.note)] if plan.note else []),
            *_rviz(values, sensor_type, plan.frame), *rerun_view(values, values['namespace'])]


def sensor_plan(values: Mapping[str, str], sensor_type: str) -> SensorPlan:
    """The nodes of a sensor for the values of its arguments. Raises BadArgument."""
    kind = SENSOR_TYPES[sensor_type]
    check(values, kind.sources)
    values = completed(values, sensor_type)
    frame = sensor_frame(values['namespace']) or sensor_type
    calibrated = {'calibration': values['calibration']} if values['calibration'] else {}
    _check_file(values['params'], sensor_type)
    calibration = values['calibration'] or parameter_of(values['params'], kind.perception, 'calibration')
    fitted = _has_contact_model(calibration) or kind.known_by and parameter_of(values['params'], kind.perception, kind.known_by, 0.0) > 0
    note = '' if fitted or not kind.uncalibrated else \
        f'not calibrated (calibration:=FILE): {kind.uncalibrated} and run `ros2 run tactile_perception calibrate`'
    ends = values['source'] in ('file', 'bag') and 'true' not in (values['loop'], values['stay'])
    driver = driver_parameters(values, sensor_type) | {'frame_id': frame} | ({'stay': False} if ends else {})
    if kind.stitched and calibration:
        driver['stitching_path'] = calibration
    nodes = {kind.driver: driver,
             kind.perception: calibrated,
             kind.view: {'frame_id': frame} | (calibrated if kind.stitched else {})}
    return SensorPlan(frame, values['namespace'], values['params'], nodes, values['record'], ends, note)


def check(values: Mapping[str, str], sources: Sequence[str]) -> None:
    """Check the values before any file is read. Raises BadArgument."""
    optional = ('', *_BOOLEANS)
    check_choices(values, {**dict.fromkeys(('rviz', *VIEW), _BOOLEANS), 'source': sources, 'loop': optional, 'stay': optional,
                           'autostart': optional, 'composed': _BOOLEANS})
    if values['source'] in ('file', 'bag'):
        if not values['path']:
            raise BadArgument(f'source:={values["source"]} needs the recording: path:=...')
        if not Path(values['path']).expanduser().exists():
            raise BadArgument(f'path:={values["path"]} does not exist')
    for name in ('params', 'calibration'):
        if values[name] and not Path(values[name]).is_file():
            raise BadArgument(f'{name}:={values[name]} is not a file')
    if values['record'] and Path(values['record']).exists():
        raise BadArgument(f'record:={values["record"]} exists already: choose another name or remove it')


def check_choices(values: Mapping[str, str], choices: Mapping[str, Sequence[str]]) -> None:
    """Raise BadArgument for a value that is not among the choices of its argument."""
    for name, known in choices.items():
        if values[name] not in known:
            raise BadArgument(f'{name}:={values[name]} is not one of {", ".join(filter(None, known))}')


def completed(values: Mapping[str, str], sensor_type: str) -> dict[str, str]:
    """values with the topics of a recording, and with the parameter and calibration files of this package where the user names none.

    The simulated specimen has files of its own. Raises TactileError.
    """
    simulated, topics = values['source'] == 'sim', {}
    if values['source'] == 'bag':
        from .recorded import recorded_topics  # takes half a second; only this source needs it
        given = {name: values[name] for name in SENSOR_TYPES[sensor_type].raw}
        topics, simulated = recorded_topics(values['path'], sensor_type, values['namespace'], given)
    own = simulated_calibration(sensor_type)
    return {**values, **topics, 'params': values['params'] or parameter_file(sensor_type, simulated),
            'calibration': values['calibration'] or (own if simulated and Path(own).is_file() else '')}


def driver_parameters(values: Mapping[str, str], sensor_type: str) -> dict:
    """The driver parameters that the arguments set. Raises BadArgument for a rate that is no number."""
    names = ('source', 'device', 'path', 'topic', 'scene', *SENSOR_TYPES[sensor_type].arguments)
    given = {name: values[name] for name in names if values.get(name)}  # the demo has the arguments of a touchpad alone
    given.update({name: _BOOLEANS[values[name]] for name in ('loop', 'autostart') if values[name]})
    return given | ({'rate': number(values, 'rate')} if values['rate'] else {})


def number(values: Mapping[str, str], name: str) -> float:
    """The number that an argument gives, 0 or more. Raises BadArgument."""
    try:
        value = float(values[name])
    except ValueError:
        raise BadArgument(f'{name}:={values[name]} is not a number') from None
    if not 0.0 <= value < math.inf:
        raise BadArgument(f'{name}:={values[name]} must be 0 or more')
    return value


def _check_file(params: str, sensor_type: str) -> None:
    """Refuse a parameter file of another sensor type, and one for nodes that no longer exist. Raises BadArgument."""
    stated = parameter_of(params, '', 'sensor_type', sensor_type)
    if stated != sensor_type and stated in SENSOR_TYPES:
        raise BadArgument(f'params:={params} is of a {stated}: launch {stated}.launch.py')
    check_sections(params, SENSOR_TYPES[sensor_type].perception)


def _has_contact_model(calibration: str) -> bool:
    """Whether a calibration file has more than a stitching; True for a damaged one too, whose error the node reports."""
    if not calibration:
        return False
    try:
        fitted = yaml.load(Path(calibration).read_text(encoding='utf-8'), getattr(yaml, 'CSafeLoader', yaml.SafeLoader))['fitted']
        return not ('stitching' in fitted and 'methods' not in fitted)
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError):
        return True


def parameter_of(params: str, node: str, name: str, default: str | float = '') -> str | float:
    """The value that a parameter file sets for a node. Raises BadArgument."""
    try:  # importing the whole parameter tables takes a second
        return read_parameters(params, node, (Parameter(name, type(default), default, '', ''),))[name]
    except TactileError as error:
        raise BadArgument(' '.join(str(error).split())) from error  # a parser's message has many lines


def _rviz(values: Mapping[str, str], sensor_type: str, frame: str) -> list:
    """RViz when the argument rviz is true; in another namespace with a copy of the configuration for that namespace."""
    if not _BOOLEANS[values['rviz']]:
        return []
    (file, drawn), namespace = rviz_file(sensor_type), values['namespace'].strip('/')
    if namespace != drawn:
        from ..hand.configurations import moved_file  # imports SciPy, which launch needs for nothing else
        file = written(f'{frame}.rviz', moved_file(sensor_type, namespace, frame))
    return optional('rviz2', 'rviz2', name='rviz2', namespace=values['namespace'], arguments=['-d', file])


def rerun_view(values: Mapping[str, str], namespace: str = '') -> list:
    """Rerun when the argument view or web is true, for the sensor of a namespace, '' for all; without Rerun a note."""
    if not any(_BOOLEANS[values[name]] for name in VIEW):
        return []
    if MISSING:
        return [LogInfo(msg=f'{MISSING}; everything else is started')]
    own = ['--namespace', namespace] if namespace else []
    return [Node(package='tactile_bringup', executable='view', exec_name='view', output='screen',
                 arguments=[*own, *(['--web'] if _BOOLEANS[values['web']] else [])])]


def optional(package: str, executable: str, **how) -> list:
    """A node of an optional package; without the package a note."""
    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        return [LogInfo(msg=f'package {package} is not installed: {executable} is left out, everything else is started')]
    return [Node(package=package, executable=executable, output='screen', **how)]
