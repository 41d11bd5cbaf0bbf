# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
import itertools

import numpy as np
import pytest
from tactile_driver.errors import BadRecording
from tactile_driver.serial.table import read_table

FRAMES = np.arange(5 * 3 * 4).reshape(5, 3, 4) + 0.5
TIMES = np.array([0.0, 0.02, 0.04, 0.07, 0.08])


@pytest.mark.parametrize(('separator', 'head', 'time', 'lines'), itertools.product(
    [',', ';', '\t', ', '], [False, True], ['', 's', 'ms'], [1, 3]))
def test_tables_of_all_kinds(tmp_path, separator, head, time, lines):
    scale = 1000 if time == 'ms' and head else 1  # without a header a time is in s
    rows = FRAMES.reshape(5 * lines, -1)
    if time:
        rows = np.column_stack([np.repeat(scale * TIMES, lines), rows])
    text = [separator.join(f'{x:g}' for x in row) for row in rows]
    if separator == ';':
        text = [line.replace('.', ',') for line in text]
    if head:
        names = ([f'time ({time})'] if time else []) + [f'c{k}' for k in range(12 // lines)]
        text.insert(0, separator.join(names))
    (tmp_path / 'a.csv').write_text('\ufeff' * head + '\r\n'.join(text) + '\n\n', encoding='utf-8')
    frames, times = read_table(tmp_path / 'a.csv', (3, 4))
    np.testing.assert_allclose(frames, FRAMES)
    if time:
        np.testing.assert_allclose(times, TIMES)
    else:
        assert times is None


@pytest.mark.parametrize(('text', 'said'), [
    ('1,2,3\n4,5,6\n', '2 lines of 3 numbers; expected for 3 x 4 taxels: 12 a line'), ('', 'no line of numbers'),
    ('a,b\nc,d\n1,2\n', 'line 2 is not of numbers'),
    ('1,2,3,4\n1,2,3\n', 'line 2 has 3 numbers, those before it 4'),
    ('1,2,3,4\n' * 4, '4 lines of 4 numbers'), ('1,1,2,3,4\n' * 6, 'do not increase at frame 1'),
    ('1,2,x,4\n1,2,3,4\n1,2,y,4\n', 'line 3')])
def test_what_was_seen_and_what_is_expected_are_reported(tmp_path, text, said):
    (tmp_path / 'a.csv').write_text(text)
    with pytest.raises(BadRecording, match=said):
        read_table(tmp_path / 'a.csv', (3, 4))
