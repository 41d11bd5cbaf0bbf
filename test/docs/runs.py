# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""How each command of the pages is run in a test, and the only ones that are not, with the reason.

The first row whose expression fits the beginning of a command counts.
"""
from __future__ import annotations

import re
from dataclasses import dataclass

ENDS, LASTS, ANSWERED = 'ends', 'lasts', 'answered'


@dataclass(frozen=True)
class Run:
    """How some commands are run.

    expression : of the beginning of the commands.
    how : ENDS with exit code 0; LASTS until Ctrl-C, and ends cleanly then; ANSWERED by a node of the command beside.
    more : words that are added, so that it takes a minute at most.
    change : (old, new), for what the page leaves to the reader; @ is the folder with the files that stand for the reader's.
    writes : file that it writes.
    prints : expression in what it prints, or in the YAML file that it writes.
    asks : of a command that LASTS, asked until it prints `prints`.
    is_quick : it takes seconds, and `make test` runs it.
    beside : command that runs meanwhile.
    extra : module of an optional extra (environment/extras.txt) that it needs; it is skipped where that is not installed.
    is_in_checkout : it runs in the checkout itself, not in a folder of its own.
    """

    expression: str
    how: str = ENDS
    more: str = ''
    change: tuple[str, str] = ('', '')
    writes: str = ''
    prints: str = ''
    asks: str = ''
    is_quick: bool = False
    beside: str = ''
    extra: str = ''
    is_in_checkout: bool = False

    def command(self, shown: str) -> str:
        """What is run of what a page shows."""
        return shown.replace(*self.change) + self.more if self.change[0] else shown + self.more


LAUNCH, NODE = r'ros2 launch tactile_bringup ', r'ros2 run tactile_perception '
PALM = ('ros2 launch tactile_bringup calibrate.launch.py type:=areal_single namespace:=/palm source:=device device:=0 probe:=tool0_tip '
        'output:=my_palm.yaml mounting:="0.4 0.1 0.05 0 0 0" base:=base_link')
MAT = ('ros2 launch tactile_bringup calibrate.launch.py type:=taxel_array namespace:=/mat source:=device device:=/dev/ttyACM0 '
       'weights:="5 10 20 10 5 0" output:=my_mat.yaml')
GEL = ('ros2 launch tactile_bringup calibrate.launch.py type:=gel namespace:=/gel source:=device device:=0 weights:="2" '
       'output:=my_gel.yaml')
TOUCHPAD_SIM = 'ros2 launch tactile_bringup touchpad.launch.py'
FEW = ' TESTS=test/style/test_sources.py PYTEST="-k licence_header"'  # tests that take a second, in place of all
FINGER = 'python3 test/benchmark/run.py --quick --part finger'
PASSED = r'\d+ passed'
NODES, DIAGNOSTICS = 'ros2 node list', 'timeout 30 ros2 topic echo --once /diagnostics'
CONTACTS, ARE_CONTACTS = 'timeout 30 ros2 topic echo --once /{}/contacts', r'^contacts:'
PHOTOMETRIC = '$(ros2 pkg prefix --share tactile_bringup)/params/photometric_gel_sim.yaml'
RETRIES = 'the node retries'  # of a device that is not there
TABLE = r'^\|.*\|$'

RUNS = (
    # make: the targets themselves, on one test in place of all
    Run(r'make demo SOURCE=file PATH_TO=grasp.csv', is_in_checkout=True, change=('PATH_TO=grasp.csv OUT=out/grasp PARAMS=my_array.yaml',
                                                                             'PATH_TO=@/grasp.csv OUT=@/grasp PARAMS=@/my_array.yaml'),
        writes='@/grasp/demo.mp4'),
    Run(r'make demo SOURCE=file PATH_TO=press.avi PARAMS', is_in_checkout=True, writes='@/press/demo.mp4',
        change=('PATH_TO=press.avi PARAMS=my_video.yaml', 'PATH_TO=@/press.avi PARAMS=@/my_video.yaml OUT=@/press')),
    Run(r'make demo SOURCE=file PATH_TO=press.avi OUT', is_in_checkout=True, writes='@/press/demo.mp4',
        change=('PATH_TO=press.avi OUT=out/press', 'PATH_TO=@/press.avi OUT=@/press')),
    Run(r'make demo SOURCE=file PATH_TO=video.avi', is_in_checkout=True, writes='@/press/demo.mp4',
        change=('video.avi', '@/press.avi PARAMS=@/my_video.yaml OUT=@/press')),
    Run(r'make demo TYPE=force_taxels', is_in_checkout=True, more=' OUT=@/taxels', writes='@/taxels/demo.mp4'),
    Run(r'make demo$', is_in_checkout=True, more=' OUT=@/demo', writes='@/demo/demo.mp4'),
    Run(r'make test TESTS="?tactile_driver/test"?', is_in_checkout=True, change=('-k dots -x', '-k no_such_test_at_all --co; true'),
        prints=r'deselected'),
    Run(r'make (test|test-full)$', is_in_checkout=True, more=FEW, prints=PASSED, is_quick=True),
    Run(r'make test-full PYTEST="-m slow"', is_in_checkout=True,
        change=('-m slow', '-m slow --collect-only -q'), prints=r'tests? collected'),
    Run(r'make test-full TESTS=\S+( PYTEST="-m slow")?', is_in_checkout=True, change=(' PYTEST="-m slow"', ''),
        more=' PYTEST="--collect-only -q"', prints=r'tests? collected'),
    Run(r'make lint$', is_in_checkout=True, more=' PYTEST="-k licence_header"', prints=PASSED, is_quick=True),
    Run(r'source setup.bash$', is_in_checkout=True, more=' && ros2 pkg list', prints='tactile_bringup', is_quick=True),
    # benchmarks
    Run(r'python3 test/benchmark/run.py.*--recorded', more=' --quick', prints=TABLE),
    Run(r'python3 test/benchmark/run.py --compare', change=('python3', f'{FINGER} && {FINGER} --compare out/benchmark/benchmark.json; '
                                                            'test $? -le 1 #'),
        prints=r'worse than before|nothing is slower'),
    Run(r'python3 test/benchmark/run.py --quick$', writes='out/benchmark/benchmark.png'),
    Run(r'python3 test/benchmark/run.py', more=' --quick', prints=TABLE),
    Run(r'python3 test/benchmark/live.py', more=' --quick --duration 5', prints=r'\| (thumb|tip) \| [\d.]+ \| [\d.]+ /'),
    Run(r'python3 test/benchmark/starts.py', more=' --quick', prints=r'psd_finger, composed \| [\d.]+'),
    Run(r'python3 test/benchmark/sheets.py( --sensor \w+)?$', more=' --specimens 1 --rows press', prints=r'\| 0, press'),
    Run(r'python3 test/benchmark/sheets.py --rows', change=('two_0.2 two_1.0', 'two_0.2 --specimens 1'), prints=r'\| 0, two_0.2'),
    Run(r'python3 test/benchmark/force_taxels.py', change=('py 5', 'py 1'), prints=r'\| pillars, 0 dead \| [\d.]+'),
    Run(r'python3 test/benchmark/photometric_gel.py 3', change=('py 3', 'py 1'), prints=r'ball of 2 mm, with dots \| \d+'),
    Run(r'python3 test/benchmark/taxel_latency.py 1', more=' drag', prints=r'macro F1'),
    Run(r'python3 test/benchmark/gel_presses.py --photographs', writes='gel_presses.webp',
        change=('--photographs calibration_data --pitch 2.05', '--presses 2')),  # the photographs are others'
    Run(r'python3 test/benchmark/gel_presses.py', more=' --presses 2', prints=r'simulated, all measured'),
    Run(r'python3 test/benchmark/clips.py', change=('out/sheet press.avi', '@/sheet @/press.avi'), prints=r'found in the first image'),
    Run(r'python3 test/benchmark/gels.py', change=('gels.py 5', 'gels.py 1'), prints=r'middle mm'),
    Run(r'python3 test/benchmark/fit_contact_score.py', more=' --scenes 2', writes='out/border_network.npz'),
    Run(r'python3 test/benchmark/ratios.py', more=' touchpad --rounds 1', prints=r'touchpad: [\d.]+ ms a frame'),
    Run(r'python3 test/benchmark/constants.py', more=' sheet', prints=r'SheetConstants.tip'),
    Run(r'python3 test/benchmark/judged.py', prints=r'F1|position'),
    Run(r'python3 test/benchmark/taxel_slip.py FOLDER', change=('FOLDER', '$TACTILE_RECORDINGS'), prints=r'frames, [\d.]+% slip'),
    # the finger's of all papers; the page of each other paper has a command of its own
    Run(r'ros2 run tactile_bringup papers --report', more=' --quick --paper psd_finger', prints=r'its method'),
    Run(r'ros2 run tactile_bringup papers --details --report', more=' --quick --paper psd_finger', prints=TABLE),
    Run(r'ros2 run tactile_bringup papers .*--details', more=' --quick', prints=TABLE),
    Run(r'ros2 run tactile_bringup papers', more=' --quick', prints=r'its method'),
    # tools
    Run(r'ros2 run tactile_bringup simulate camera demo', writes='out/demo_bag/metadata.yaml', change=('--rate 5', '--rate 2')),
    Run(r'ros2 run tactile_bringup view BAG RESULTS --save', extra='rerun', change=('BAG RESULTS', '@/finger_bag'), writes='my_pad.rrd'),
    Run(r'ros2 run tactile_bringup view BAG RESULTS --web', extra='rerun', more=' || test $? -eq 124', prints='open http://localhost',
        change=('ros2 run tactile_bringup view BAG RESULTS', 'timeout -s INT 20 ros2 run tactile_bringup view @/finger_bag')),
    Run(r'ros2 run tactile_bringup view --web --tune', LASTS, extra='rerun', asks=NODES, prints='^/view$'),
    Run(r'ros2 param set /dots/dot_tracker_node', prints='successful', beside='ros2 launch tactile_bringup dots.launch.py',
        change=('ros2 param', 'sleep 10; ros2 param')),
    Run(r'ros2 run tactile_bringup export BAG --to lerobot', extra='pyarrow', writes='touches/meta/info.json',
        change=('BAG --to lerobot touches --topics /tip/contacts', '@/finger_bag --to lerobot touches')),
    Run(r'ros2 run tactile_bringup export BAG --to zarr', extra='zarr', change=('BAG', '@/finger_bag'), writes='touches.zarr/zarr.json'),
    Run(r'ros2 run tactile_perception process_bag recordings \S+ .*--jobs', change=('PARAMS.yaml', '@/FINGER.yaml'),
        writes='estimates/b/metadata.yaml', prints='2 done'),
    Run(r'ros2 run tactile_perception evaluate estimates', writes='report/b/report.json', prints='2 done', change=(
        'ros2 run', 'ros2 run tactile_perception process_bag recordings estimates --params @/FINGER.yaml && ros2 run')),
    Run(r'ros2 run tactile_bringup export recordings', writes='touches.h5', prints='2 done'),
    Run(r'ros2 run tactile_bringup export BAG', extra='h5py', change=('BAG', '@/finger_bag'), writes='touches.h5'),
    Run(r'ros2 run tactile_bringup simulate camera gel_demo', writes='out/gel/metadata.yaml'),
    Run(r'ros2 run tactile_bringup simulate camera pins_calib', writes='out/pins/metadata.yaml'),
    Run(r'ros2 run tactile_perception calibrate out/pins', writes='out/pins.yaml',
        change=('ros2 run', 'ros2 run tactile_bringup simulate camera pins_calib out/pins --rate 4 && ros2 run')),
    Run(r'ros2 run tactile_perception calibrate out/gel', writes='out/gel.yaml',
        change=('ros2 run', 'ros2 run tactile_bringup simulate camera gel_demo out/gel --rate 5 && ros2 run')),
    Run(r'ros2 run tactile_perception calibrate out/presses', writes='my_gel_calibration.yaml',
        change=('ros2 run tactile_perception calibrate out/presses --params my_gel.yaml',
                'ros2 run tactile_bringup simulate camera photometric_calib out/presses --rate 10 && ros2 run tactile_perception calibrate '
                f'out/presses --params {PHOTOMETRIC}')),
    Run(r'ros2 run tactile_perception calibrate out/press ', writes='my_taxels_calibration.yaml',
        change=('ros2 run tactile_perception calibrate out/press out/pull_x out/pull_y --params my_taxels.yaml',
                'ros2 run tactile_bringup simulate force_taxels uskin_weights out/press --rate 50 && ros2 run tactile_perception calibrate '
                'out/press --params $(ros2 pkg prefix --share tactile_bringup)/params/force_taxels_sim.yaml')),
    Run(r'ros2 run tactile_perception calibrate BAG', change=('BAG... --params PARAMS.yaml', '@/finger_bag --params @/FINGER.yaml'),
        writes='CALIBRATION.yaml'),
    Run(r'ros2 run tactile_perception convert_recording', change=('FOLDER', '$TACTILE_RECORDINGS/simulated/psd_grid25'),
        writes='BAG/metadata.yaml', is_quick=True),
    Run(r'cp \$\(ros2 pkg prefix --share tactile_bringup\)/layouts', writes='plotjuggler.xml', is_quick=True),
    Run(r'cp ', writes='my_array.yaml', is_quick=True),
    Run(r'sed .*foxglove.json', writes='thumb.json', is_quick=True,
        change=('foxglove.json', '$(ros2 pkg prefix --share tactile_bringup)/layouts/foxglove.json')),
    Run(r'sed ', writes='thumb_psd.policy.xml', is_quick=True),
    # nodes and launch files; a device that is not there is waited for
    Run(LAUNCH + r'calibrate.launch.py .*simulated_stage', LASTS, asks='timeout 30 ros2 topic echo --once --no-arr /palm/image',
        prints='^encoding:'),
    Run(LAUNCH + r'calibrate.launch.py', LASTS, asks=DIAGNOSTICS, prints=RETRIES),
    Run(r'ros2 service call /palm/calibrate_node/undo', ANSWERED, beside=PALM),
    Run(r'ros2 service call /mat/calibrate_node/next', ANSWERED, beside=MAT),
    Run(r'ros2 service call /gel/calibrate_node/next', ANSWERED, beside=GEL),
    Run(r'ros2 service call /touchpad/camera_node/change_state', ANSWERED, beside=TOUCHPAD_SIM),
    # A recording starts with its first subscriber, here the recorder, and ends the launch.
    Run(LAUNCH + r'touchpad.launch.py rviz:=true source:=bag', more=' record:=played', prints=r'name: /touchpad/contacts',
        change=('rviz:=true source:=bag path:=out/demo_bag rate:=0.5', 'source:=bag path:=@/short_bag rate:=0'),
        writes='played/metadata.yaml'),
    Run(LAUNCH + r'\w+.launch.py .*source:=(file|bag)', more=' rate:=0 record:=played', writes='played/metadata.yaml',
        prints=r'name: /\w+/(contacts|dots)$'),
    Run(LAUNCH + r'force_taxels.launch.py source:=device', LASTS, asks=CONTACTS.format('force_taxels'), prints=ARE_CONTACTS,
        change=('source:=device device:=/dev/ttyACM0 params:=my_taxels.yaml', 'source:=sim')),
    Run(LAUNCH + r'.* calibration:=my_pad.yaml', LASTS, change=(' calibration:=my_pad.yaml', ''),  # docs/touchpad.md makes one, and is run
        asks=DIAGNOSTICS, prints=RETRIES),
    Run(LAUNCH + r'photometric_gel.launch.py .* calibration:=', LASTS, asks=DIAGNOSTICS, prints=RETRIES,
        change=('my_gel.yaml calibration:=my_gel_calibration.yaml', PHOTOMETRIC)),
    Run(LAUNCH + r'photometric_gel.launch.py .* record:=', LASTS, change=('my_gel.yaml', PHOTOMETRIC), asks=DIAGNOSTICS, prints=RETRIES),
    Run(LAUNCH + r'.*source:=device', LASTS, asks=DIAGNOSTICS, prints=RETRIES),
    Run(LAUNCH + r'.*source:=topics', LASTS, asks=DIAGNOSTICS, prints='nobody subscribes'),
    Run(LAUNCH + r'\w+.launch.py (view|web):=true', LASTS, change=('view:=true', 'web:=true'), extra='rerun', asks=NODES,
        prints='/view$'),  # a window needs a screen
    *(Run(LAUNCH + rf'{name}.launch.py', LASTS, asks=CONTACTS.format(name), prints=ARE_CONTACTS)
      for name in ('touchpad', 'gel', 'photometric_gel', 'force_taxels')),
    Run(r'ros2 run tactile_bringup grip_controller', LASTS, asks=NODES, prints='^/grip_controller$'),
    Run(r'ros2 run tactile_bringup sensor_nodes', LASTS, change=('FILE', '@/FINGER.yaml'), asks=CONTACTS.format('tip'),
        prints=ARE_CONTACTS),
    Run(r'ros2 run tactile_driver camera_node', LASTS, change=('PARAMS.yaml', '@/PARAMS.yaml'), asks=NODES,
        prints='^/touchpad/camera_node$'),
    Run(NODE + r'touchpad_contact_node', LASTS, change=('PARAMS.yaml', '@/PARAMS.yaml'), asks=NODES,
        prints='^/touchpad/touchpad_contact_node$'),
)

#: Commands that no test runs, and why.
NOT_RUN = {
    r'rosdep install': 'installs Debian packages from the network, as root; test/style/test_packages.py checks each key',
    r'colcon (build|test)': 'builds a whole workspace of a user; setup.bash makes the same call of colcon, and each package is tested here',
    r'source install/setup.bash': 'belongs to the workspace of colcon build',
    r'make docs': 'installs Sphinx from the network; test/docs/test_reference.py builds the pages where it is installed',
    r'make clean': 'takes away the environment that the tests run in',
    r'(CASES=.* )?make test-hardware': 'boots a machine in QEMU; test/hardware is that test',
    r'make demo VIEW=1': 'installs an optional extra from the network; tactile_bringup/test/view tests what it starts',
    r'.*--scheduler': 'needs a cluster; tactile_perception/test/tools/test_many.py has a local one',
    r'python3 -m pip install (rerun-sdk|distributed|mujoco)': 'installs an optional extra from the network',
    r'python3 test/benchmark/network.py': 'makes network namespaces, as root, for minutes; test/launch/test_network.py tests these',
    r'.*grasp.launch.py ros2_control:=true': 'needs mujoco_ros2_control, which comes with ROS 2 from apt; test/launch/test_grasp.py has a '
                                             'simulator with the same topics',
    r'make grasp': 'installs an optional extra from the network; test/launch/test_grasp.py runs the launch file that it starts',
    r'make sanitize': 'compiles the kernels again, with checks: minutes; the continuous integration runs it',
    r'python3 -m pytest test/launch/test_rviz.py': 'is itself a test, which the continuous integration runs where RViz is found',
    r'python3 test/benchmark/pins.py FOLDER': 'needs a data set of others, which is not shipped',
    r'ros2 bag ': "ROS 2's own verb, absent where setup.bash made the environment; test/environment/test_rosbag2_py.py tests the bags",
    r'mcap ': 'a program of others',
    r'ros2 security ': "ROS 2's own verb, absent where setup.bash made the environment; test/faults/test_policies.py tests the policies",
    r'ros2 run tactile_driver psd_node .*--enclave': 'needs the keys of ros2 security',
    r'v4l2-ctl|ls -l /dev/|sudo ': 'looks at devices, or changes the machine as root',
}


def run_of(command: str) -> Run | None:
    """How a command is run."""
    return next((run for run in RUNS if re.match(run.expression, command)), None)


def reason_of(command: str) -> str:
    """Why no test runs a command; '' for one that is run."""
    return next((reason for expression, reason in NOT_RUN.items() if re.match(expression, command)), '')
