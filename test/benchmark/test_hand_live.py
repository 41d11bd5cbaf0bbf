# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark of a hand: what it starts, and its evaluation of the received messages."""
import importlib.util
import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('launch_ros', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')


def loaded(name):
    spec = importlib.util.spec_from_file_location(f'{name}_benchmark', Path(__file__).with_name(f'{name}.py'))
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


hand_live, rendered = loaded('hand_live'), loaded('rendered')
S = 10**9


def test_the_nodes_of_each_sensor():
    plans = hand_live.plan(['thumb', 'tip'], 0.5)
    assert list(plans['tip'].nodes) == ['psd_node', 'psd_contact_node', 'finger_markers_node']
    assert plans['tip'].nodes['psd_node']['rate'] == 500.0 and plans['thumb'].nodes['camera_node']['rate'] == 30.0
    assert list(plans['thumb'].nodes) == ['camera_node', 'dot_tracker_node', 'contact_region_node', 'markers_node']


TAKER = """
print('begun', flush=True)
input()
more = b'1' * (30 * 2**20)
print('taken', flush=True)
input()
"""


def test_memory_of_no_file_that_a_process_has_is_seen():
    with subprocess.Popen([sys.executable, '-c', TAKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1) as process:
        seen = []
        for word in ('begun', 'taken'):
            assert process.stdout.readline() == f'{word}\n'
            seen.append(hand_live.anonymous(process.pid))
            process.stdin.write('\n')
    assert seen[1] - seen[0] == pytest.approx(30, abs=1) and process.returncode == 0


def heard_of(rate, late_s, lost=0):
    heard = hand_live.Heard()
    for k in range(lost, round(11 * rate)):
        heard.stamps.append(100 * S + round(k * S / rate))
        heard.latencies.append(late_s)
    return heard


def test_losses_latency_and_cpu_of_the_time_that_counts():
    usage = [(0.0, {'a': (0.0, 1.0), 'b': (0.0, 1.0)}), (10.0, {'a': (4.0, 1.0), 'b': (2.0, 1.0)})]
    heard = {'thumb': heard_of(60, 0.012, lost=90), 'tip': heard_of(200, 0.008)}
    result = hand_live.summary(heard, SimpleNamespace(usage=usage), 1.0, 101 * S, 10.0)
    assert result['CPU %'] == pytest.approx(60.0)
    assert result['sensors']['thumb']['lost %'] == pytest.approx(5.0) and result['sensors']['tip']['lost %'] == 0
    assert result['sensors']['tip']['latency ms'] == pytest.approx([8.0] * 4)


def test_results_that_are_due():
    assert [hand_live.rate_of(name, 0.5) for name in ('thumb', 'array')] == [30, 100]
    assert hand_live.rate_of('tip', 1.0) == 200 and hand_live.rate_of('tip', 0.33) == 165


def test_medians_of_runs_and_their_table():
    runs = [{'CPU %': c, 'memory MB': m, 'growth MB': m - 100, 'sensors': {'thumb': {'lost %': x, 'latency ms': [c, c, c, c]}}}
            for c, m, x in ((10, 100, 0.0), (30, 120, 1.0), (20, 110, 0.5))]
    middle = hand_live.medians(runs)
    assert (middle['CPU %'], middle['memory MB'], middle['sensors']['thumb']) == (20, 110, {'lost %': 0.5, 'latency ms': [20] * 4})
    assert '| 1 | composed:=true | 20 | 110, +10.0 | thumb 20.0 / 20.0, 0.5 % |' in hand_live.text({(1, 'true'): middle})


def test_a_result_is_read_from_its_bytes():
    heard = hand_live.Heard()
    heard.take(b'\0\1\0\0' + struct.pack('<iI', 12, 34) + b'pad')
    assert heard.stamps == [12 * S + 34]


def scene_of(rate):
    return SimpleNamespace(rate=rate, render=lambda t: (np.full((4, 4), round(t * rate), np.uint8), 'truth'), sensor='taxels')


def test_frames_are_rendered_once_and_played_to_and_fro(tmp_path):
    np.save(rendered.file_of(tmp_path, 'demo', 10.0), rendered.frames_of(scene_of(10.0), 0.5))
    opened = rendered.playing(tmp_path, lambda name, rate, seed=0: scene_of(rate))
    scene = opened('demo', 10.0, 3)
    shown = [(int(values[0, 0]), truth) for values, truth in (scene.render(k / 10) for k in range(11))]
    assert [number for number, _ in shown] == [0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2] and {truth for _, truth in shown} == {None}
    assert scene.sensor == 'taxels' and not isinstance(opened('other', 10.0), rendered.Rendered)


def test_samples_are_played_again_and_again():
    scene = SimpleNamespace(rate=100.0, play=lambda first, count: (np.arange(4 * count, dtype=np.uint16).reshape(-1, 4), 'truth'))
    counts, truth = rendered.Rendered(scene, rendered.frames_of(scene, 0.1)).play(8, 4)
    assert truth is None and counts[:, 0].tolist() == [32, 36, 0, 4]


def test_pictures_of_one_and_of_two_cameras(tmp_path):
    view = np.zeros((6, 8, 3), np.uint8)
    one = SimpleNamespace(rate=10.0, render=lambda t: SimpleNamespace(image=view, truth=1))
    two = SimpleNamespace(rate=10.0, render=lambda t: (view, view + 1, 1))
    left, right, truth = rendered.Rendered(two, rendered.frames_of(two, 0.3)).render(0.1)
    assert (left.max(), right.max(), truth) == (0, 1, None)
    assert rendered.Rendered(one, rendered.frames_of(one, 0.3)).render(0.1).truth is None
