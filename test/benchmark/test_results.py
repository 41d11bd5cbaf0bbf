# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import math
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import results  # noqa: E402
from parts import Row  # noqa: E402


def entry(ms=(2.0, 2.0), normal=(0.2, 0.2), false=(0.0, 0.0), method='map', yardstick=4.0):
    return results.Entry('finger', 'psd_finger', method, '', list(ms), [t / yardstick for t in ms],
                         {'normal': list(normal), 'false samples': list(false)})


def test_rounds_are_collected_by_method():
    rounds = [(y, [Row('finger', 'psd_finger', 'map', '', ms, {'normal': off})]) for y, ms, off in ((4.0, 2.0, 0.2), (8.0, 3.0, 0.3))]
    found, = results.collect(rounds)
    assert (found.ms, found.relative, found.errors) == ([2.0, 3.0], [0.5, 0.375], {'normal': [0.2, 0.3]})


def test_what_is_kept_comes_back():
    kept = results.to_plain([entry(normal=(math.nan, math.inf))])
    assert kept[0]['errors']['normal'] == [None, None]
    back = results.from_plain(kept)[0]
    assert back.name == 'finger, psd_finger, map' and math.isnan(back.errors['normal'][0]) and back.ms == [2.0, 2.0]


def test_tables_have_medians_and_noise():
    page = results.tables([entry(ms=(1.0, 2.0, 4.0), normal=(0.1, math.nan, math.nan))])
    assert '| psd_finger | map | - | 2 | 75 % | - | 0 |' in page and '| normal, degrees | false samples, % |' in page


@pytest.mark.parametrize('after, said', [
    (entry(ms=(2.15, 2.15)), None), (entry(ms=(2.3, 2.3)), 'slower by 15 % (2 to 2.3 ms)'), (entry(ms=(2.0, 3.4)), None),
    (entry(normal=(0.21, 0.21)), None), (entry(normal=(0.22, 0.22)), 'normal 0.2 to 0.22 degrees'), (entry(normal=(0.2, 0.26)), None),
    (entry(normal=(math.nan, 0.2)), 'normal is not told any more'), (entry(false=(0.05, 0.05)), None),
    (entry(false=(0.2, 0.2)), 'false samples 0 to 0.2 %'), (entry(method='other'), 'not measured any more'),
    (entry(ms=(1.0, 1.0), normal=(0.1, 0.1)), None)])
def test_what_became_worse_by_more_than_the_noise_is_named(after, said):
    assert results.compare([entry()], [after]) == ([f'finger, psd_finger, map: {said}'] if said else [])


def test_a_slower_machine_makes_nothing_slower():
    assert results.compare([entry()], [entry(ms=(6.0, 6.0), yardstick=12.0)]) == []


def test_what_was_not_told_before_cannot_be_worse():
    assert results.compare([entry(normal=(math.nan, math.nan))], [entry(normal=(9.0, 9.0))]) == []
