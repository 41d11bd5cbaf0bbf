# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""What is left out is counted by reason, told by its first case, and never takes more than so much memory."""
from tactile_driver.recordings.left_out import LeftOut


def test_reasons_that_differ_in_their_numbers_count_as_one():
    found = LeftOut()
    found.add('image_raw', 'image is 64 x 48 px', 1_500_000_000)
    found.add('image_raw', 'image is 32 x 24 px', 2_500_000_000)
    found.add('bag.mcap', 'the file is cut off at byte 7', count=3)
    assert found.total == 5
    assert found.lines() == ['3 of bag.mcap: the file is cut off at byte 7',
                             '2 of image_raw: image is 64 x 48 px (first at 1.500 s)']


def test_so_many_reasons_are_told_apart_and_no_more():
    found = LeftOut()
    for k in range(26):
        for other in 'abcd':
            found.add('topic', f'reason {chr(97 + k)}{other}')
    assert found.total == 104 and len(found.lines()) == 51 and found.lines()[0] == '54 of elsewhere: other reasons'
