# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The soak test of a hand: what it starts, how it finds processes, and its evaluation."""
import math
import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest

pytest.importorskip('launch_ros', reason='ROS is not sourced')
pytest.importorskip('tactile_msgs', reason='tactile_msgs is not built')

sys.path.insert(0, str(Path(__file__).parent))
import hand_soak  # noqa: E402
from soak_faults import Heard  # noqa: E402
from soak_system import environment, look, name_of, pages  # noqa: E402
from soak_trend import Sample, flat, settled, slope, trend  # noqa: E402

HOUR = 3600.0


def taken(per_hour, noise=0.0, lives=((1, 100.0, 0), (2, 130.0, 400)), seconds=300):
    """Samples of lives (pid, MB at its begin, s) that grow alike."""
    rng = np.random.default_rng(3)
    return [Sample(begin + k, pid, base + per_hour * k / HOUR + noise * rng.standard_normal(), 20, 9)
            for pid, base, begin in lives for k in range(seconds)]


def test_two_hands_with_all_five_sensors(tmp_path):
    found = pages(tmp_path, 4.0)
    assert [sensor['name'] for page in found.values() for sensor in page['sensors']] == ['thumb', 'index', 'palm', 'tip', 'array']
    assert [sensor['rate'] for sensor in found['cameras']['sensors']] == [240.0, 240.0, 120.0]
    assert [sensor['device'] for sensor in found['ports']['sensors']] == [f'{tmp_path}/tip', f'{tmp_path}/array']


def test_cameras_play_films(tmp_path):
    np.save(tmp_path / 'demo_240.npy', np.stack([np.full((480, 640, 3), value, np.uint8) for value in (10, 20, 30)]))
    told = "from tactile_driver.simulation.sensors.scenes import open_scene; print(open_scene('demo', 240.0).render(1 / 240).image.max())"
    done = subprocess.run([sys.executable, '-c', told], env=environment(tmp_path), cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == '20\n'


def test_a_process_is_called_after_its_sensor():
    sensors = ['thumb', 'left/tip']
    assert name_of(['/usr/bin/python3', '/x/sensor_nodes', 'psd_node', '--ros-args', '-r', '__ns:=/left/tip'], sensors) == 'left/tip'
    assert name_of(['/usr/bin/python3', '/x/hand_frames_node', '--ros-args'], sensors) == 'hand_frames_node'


def test_what_this_process_takes():
    sample = look(psutil.Process(), 1.5)
    assert sample.pid == psutil.Process().pid and sample.seconds == 1.5
    assert 10 < sample.memory < psutil.Process().memory_info().rss / 2**20 and sample.fds > 2 and sample.threads >= 1


def test_one_slope_over_lives_of_which_the_first_seconds_do_not_count():
    assert slope(taken(36.0), 'memory') == pytest.approx((36.0, 0.0), abs=1e-6)
    kept = settled(taken(0.0), 30.0)
    assert len(kept) == 540 and min(s.seconds for s in kept if s.pid == 2) == 430
    assert all(math.isnan(value) for value in slope(taken(1.0, seconds=1), 'memory'))


def test_the_standard_error_is_that_of_the_noise():
    found, error = slope(taken(12.0, noise=0.5), 'memory')
    spread = 2 * sum((k - 149.5)**2 for k in range(300))
    assert error == pytest.approx(0.5 / math.sqrt(spread) * HOUR, rel=0.1) and abs(found - 12.0) < 3 * error


def test_flat_is_what_noise_explains_or_a_megabyte_does_not_reach():
    assert flat((9.0, 5.0), 'memory', 1200.0) and flat((2.9, 0.1), 'memory', 1200.0)
    assert not flat((9.0, 1.0), 'memory', 1200.0) and flat((-9.0, 1.0), 'memory', 1200.0)
    assert not flat((math.nan, math.nan), 'memory', 1200.0), 'unknown is not flat'


def test_growth_of_descriptors_is_found():
    leaking = [sample._replace(fds=20 + int(sample.seconds // 60)) for sample in taken(0.0)]
    found = trend(leaking, 1200.0, 30.0)
    assert found['lives'] == 2 and found['threads'] == 9 and found['memory']['flat'] and not found['fds']['flat']
    assert found['fds']['an hour'] == pytest.approx(60.0, rel=0.1)


def message(seconds):
    whole = int(seconds)
    return struct.pack('<4xiI', whole, round(1e9 * (seconds - whole))) + bytes(8)


def test_a_killed_sensor_is_back_with_a_stamp_after_the_kill(monkeypatch):
    heard = Heard()
    heard.kills.append([100 * 10**9, None])
    monkeypatch.setattr('soak_faults.time', SimpleNamespace(time_ns=lambda: 103 * 10**9))
    heard.take(message(99.9))
    assert heard.kills[0][1] is None, 'it was sent before'
    heard.take(message(102.5))
    heard.take(message(102.6))
    assert heard.kills == [[100 * 10**9, 3.0]] and heard.count == 3


def test_the_table(tmp_path):
    heard = Heard()
    heard.count, heard.kills = 600, [[0, 2.25], [0, None]]
    result = {'duration': 60.0, 'share': 4.0, 'busy %': 99.0, '/dev/shm MB': [10.0, 12.0],
              'sensors': {'thumb': hand_soak.sensor_summary('thumb', heard, 4.0, 60.0)},
              'processes': {'thumb': trend(taken(36.0), 1200.0, 30.0)},
              'faults': [{'fault': 'process killed', 'target': 'thumb', 'answer': ''}] * 2,
              'launches': {'cameras': {'exit code': 1, 'tracebacks': 0, 'log': 'x.log'}}}
    page = hand_soak.text(result)
    assert '| thumb | 2 | 100.3 | 133.0 | 36.0 ± 0.0 | no | 20 | 20 | 0.0 ± 0.0 | yes | 9 |' in page
    assert '| thumb | 240 | 10.0 | 2 | 2.2, never |' in page and '| process killed |  | 2 |' in page
    assert 'cameras: exit code 1, 0 tracebacks in x.log' in page
