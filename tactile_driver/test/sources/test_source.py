# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Time in sources: stamps, paces, and scenes in real time; every source is made from its node's parameters."""

import time
from types import SimpleNamespace

import numpy as np
import pytest
from tactile_driver.camera.file import TwoFilesSource
from tactile_driver.camera.pairs import PairedSource
from tactile_driver.camera.simulated import DualSimulatedSource
from tactile_driver.errors import BadArgument
from tactile_driver.parameters.drivers import CAMERA_PARAMETERS, DUAL_CAMERA_PARAMETERS, PSD_DRIVER_PARAMETERS, TAXEL_DRIVER_PARAMETERS
from tactile_driver.parameters.table import defaults
from tactile_driver.sources import source as pacing
from tactile_driver.sources.registry import CAMERA_SOURCES, DUAL_CAMERA_SOURCES, PSD_SOURCES, TAXEL_SOURCES, make_source
from tactile_driver.sources.source import NS, EndOfSource, EvenPace, PlayedSource, SceneSource, stamp_of


@pytest.fixture
def now(monkeypatch):
    """The monotonic clock, in a list of one entry, ns."""
    clock = [1_000_000_000_000]

    def sleep(seconds):
        clock[0] += round(seconds * NS)
    monkeypatch.setattr(pacing, 'time', SimpleNamespace(monotonic_ns=lambda: clock[0], sleep=sleep))
    return clock


def test_a_stamp_is_carried_over_to_the_other_clock(now):
    assert stamp_of(now[0] - 3_000_000, lambda: 77 * NS) == 77 * NS - 3_000_000
    assert stamp_of(now[0] - 3_000_000, lambda: 0) == 0


def test_deadlines_do_not_drift(now):
    pace = EvenPace(60.0)
    start = now[0]
    for k in range(600):
        due = pace.next()
        assert due == pytest.approx(start + k * NS / 60, abs=2)
        now[0] = due + 900_000  # whoever is a little late stays only a little late
    assert pace.skipped == 0


def test_a_camera_goes_on_while_its_reader_is_late(now):
    pace = EvenPace(10.0)
    first = pace.next()
    now[0] = first + int(0.35 * NS)
    assert pace.next() == first + int(0.3 * NS)
    assert pace.skipped == 2


class Played(PlayedSource):
    """Frames that are when they were recorded, s, and when they were due."""

    def __init__(self, recorded, rate=-1.0):
        super().__init__({'path': 'film', 'rate': rate, 'loop': False}, lambda: 0)
        self.recorded = recorded
        self.open()

    def _items(self):
        return iter(self.recorded)

    def _recorded(self, item):
        return round(item * NS), item

    def _frame(self, content, due_ns):
        return content, due_ns


def test_a_recording_waits_for_its_reader(now):
    film = Played([0.0] * 4, rate=10.0)
    first = film.read()[1]
    now[0] = first + int(5.02 * NS)
    second = film.read()[1]
    assert 0 <= now[0] - second < NS // 10
    assert film.read()[1] == second + NS // 10


@pytest.mark.parametrize('stamp', [90, 200])
def test_stamps_that_jump_do_not_stop_the_recording(now, stamp):
    film = Played([100, stamp])
    assert film.read() == (100, now[0]) and film.read() == (stamp, now[0])


def test_a_paused_recording_does_not_rush(now):
    film = Played([100, 100.04, 100.08])
    film.read()
    now[0] += 30 * NS
    assert film.read()[1] == now[0] and film.read()[1] == pytest.approx(now[0], abs=NS // 1000)
    with pytest.raises(EndOfSource, match='film'):
        film.read()


class Counting(SceneSource):
    """Hands over the number of the first step and when that was due."""

    usual_rate = 200.0

    def _open_scene(self, name, rate, seed):
        return name

    def _make(self, number):
        return number

    def _handed_over(self, made, due_ns):
        return made, due_ns


def opened(rate=-1.0, count=1):
    source = Counting({'scene': 'any', 'rate': rate, 'seed': 0}, time.time_ns)
    source.count = count
    source.open()
    return source


def test_steps_come_in_order_at_their_pace(now):
    source = opened(count=4)
    numbers, due = zip(*(source.read() for _ in range(5)))
    assert numbers == (0, 4, 8, 12, 16)
    assert np.diff(due).tolist() == [NS // 50] * 4
    assert source.rate == 200.0 and source.describe()['scene'] == 'any' and source.calibrations() == (None, None)


def test_a_scene_stands_still_while_nobody_wants_it_and_begins_anew_when_opened_again(now):
    source = opened()
    assert source.read()[0] == 0
    assert [source.read(wanted=False) for _ in range(5)] == [None] * 5
    assert source.read()[0] == 1
    source.close()
    source.open()
    assert source.read()[0] == 0


def test_after_a_stall_only_a_few_steps_are_leapt_over_and_all_are_counted(now):
    source = opened()
    source.read()
    now[0] += NS // 10
    assert source.read()[0] == 1 + source.longest_leap and source.skipped == 19


def test_no_rate_is_refused():
    with pytest.raises(BadArgument, match='real time.*200 Hz'):
        Counting({'rate': 0.0}, time.time_ns)


KINDS = [(CAMERA_SOURCES, CAMERA_PARAMETERS), (PSD_SOURCES, PSD_DRIVER_PARAMETERS), (TAXEL_SOURCES, TAXEL_DRIVER_PARAMETERS)]
TWO = {**defaults(DUAL_CAMERA_PARAMETERS), 'path': 'a', 'right_path': 'b', 'device': 'A1', 'right_device': 'B2'}


@pytest.mark.parametrize(('sources', 'table', 'name'), [(*kind, name) for kind in KINDS for name in kind[0]])
def test_every_source_is_made_from_the_nodes_parameters(sources, table, name):
    source = make_source(sources, {**defaults(table), 'source': name, 'path': 'somewhere', 'device': '/dev/x'}, time.time_ns)
    assert source.live == (name in ('sim', 'device')) and not source.on_demand
    source.close()


@pytest.mark.parametrize('sources', [kind[0] for kind in KINDS])
def test_an_unknown_source_is_answered_with_the_known_ones(sources):
    with pytest.raises(BadArgument, match=', '.join(sources)):
        make_source(sources, {'source': 'nix'}, time.time_ns)


def made(**values):
    return make_source(DUAL_CAMERA_SOURCES, {**TWO, **values}, time.time_ns)


@pytest.mark.parametrize(('name', 'kind', 'live'), [('sim', DualSimulatedSource, True), ('device', PairedSource, True),
                                                    ('file', TwoFilesSource, False), ('bag', PairedSource, False)])
def test_each_kind_of_two_cameras(name, kind, live):
    source = made(source=name)
    assert isinstance(source, kind) and source.live == live
    source.close()


def test_left_and_right_are_what_was_asked_for():
    assert made(source='device').describe()['path'] == 'A1 + B2'
    about = made(source='bag', right_path='').describe()
    assert (about['left']['path'], about['right']['path']) == ('a', 'a')
    assert made(source='file').describe()['path'] == 'a + b'
