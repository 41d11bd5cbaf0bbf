# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Of a sqlite3 file that is cut off or damaged all messages before that are read, and that there were more is told."""
import pytest
from small_bags import SQLITE, TYPE, message, numbers, write_bag
from tactile_driver.recordings.left_out import LeftOut
from tactile_driver.recordings.salvage_sqlite import SalvagedSqlite


def test_a_whole_file_is_read_whole(tmp_path):
    left_out = LeftOut()
    bag = SalvagedSqlite(write_bag(tmp_path / 'bag', 5, SQLITE), left_out)
    assert bag.topics == {'/a': TYPE} and bag.counts == {'/a': 5}
    assert list(bag.messages({'/a'})) == [('/a', TYPE, 10 * (k + 1), message(k)) for k in range(5)]
    assert list(bag.messages({'/b'})) == [] and left_out.total == 0


@pytest.mark.parametrize('kept, least', [(0.5, 3), (0.9, 7)])
def test_a_file_that_is_cut_off_is_read_to_there(tmp_path, kept, least):
    file = write_bag(tmp_path / 'bag', 9, SQLITE)
    data = file.read_bytes()
    file.write_bytes(data[:int(kept * len(data))])
    left_out = LeftOut()
    found = list(SalvagedSqlite(file, left_out).messages({'/a'}))
    assert least <= len(found) < 9 and numbers(m[3] for m in found) == list(range(len(found)))
    assert [m[3] for m in found] == [message(k) for k in range(len(found))]
    assert left_out.total == 1 and 'cut off or damaged' in left_out.lines()[0]


def test_what_is_no_database_has_nothing(tmp_path):
    (tmp_path / 'x.db3').write_bytes(b'nothing of the kind' * 100)
    left_out = LeftOut()
    assert list(SalvagedSqlite(tmp_path / 'x.db3', left_out).messages({'/a'})) == [] and left_out.total == 1
