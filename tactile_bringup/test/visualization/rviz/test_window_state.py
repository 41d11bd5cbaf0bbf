# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
from tactile_bringup.visualization.rviz.window_state import window_state

# QMainWindow(1600 x 960).saveState().toHex() of Qt 5.15, with two of the right docks in tabs, for docks whose least height is 0x17;
# columns: what each part is
QT = ('000000ff00000000fd00000003'
      '000000000000011800000368fc0200000001fb000000100044006900730070006c006100790073010000000000000368{least}00ffffff'
      '000000010000023000000368fc0200000003'
      'fc00000000000001b4{least}00fffffffa000000000200000002fb00000002004101{tab}{least}00fffffffb00000002004201{tab}{least}00ffffff'
      'fb00000002004301000001b4000001b4{least}00ffffff'
      'fb0000000a0056006900650077007300{tab}{least}00ffffff'
      '000000030000000000000000fc0100000001fb0000000800540069006d006500{tab}{least}00ffffff'
      '000002f80000036800000004000000040000000800000008'
      'fc0000000100000002000000010000000a0054006f006f006c00730100000000ffffffff0000000000000000')


def test_the_bytes_are_in_the_order_in_which_qt_writes_them():
    made = window_state((1600, 872), ('Displays', 280), [['A', 'B'], ['C']], 560, ('Views', 'Time'))
    assert made == QT.format(least='0000003c', tab='00000000ffffffff')


def test_without_pictures_the_right_is_empty():
    made = window_state((1600, 872), ('Displays', 280), [], 560, ('Views', 'Time'))
    assert '000000010000000000000368fc0200000001fb0000000a00560069006500770073' in made
