# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Docks of an RViz window in the format of Qt's QMainWindow::saveState (Qt 5 and 6, version 0), from which RViz restores its panels."""
from __future__ import annotations

import struct
from collections.abc import Sequence

# First byte of each part, from Qt's qmainwindowlayout.cpp, qdockarealayout.cpp and qtoolbararealayout.cpp.
_VERSION, _DOCKS, _TOOLBARS, _LIST, _TABS, _WIDGET = 0xff, 0xfd, 0xfc, 0xfc, 0xfa, 0xfb
_LEFT, _RIGHT, _BOTTOM, _TOP_EDGE = 0, 1, 3, 2
_HORIZONTAL, _VERTICAL = 1, 2
_UNKNOWN, _LEAST, _MOST = 0xffffffff, 60, 0xffffff  # px: smallest and largest height of a panel


def window_state(size: tuple[int, int], left: tuple[str, int], right: Sequence[Sequence[str]], right_width: int,
                 hidden: tuple[str, str]) -> str:
    """Hexadecimal text of a window with docks.

    size: of docks and centre together, px; left: name and width, px, of the left panel; right: groups of panels, top to bottom; panels of
    a group share a dock as tabs, the first one in front; hidden: panels at the right and at the bottom that exist but are not shown.
    """
    width, height = size
    share = height // max(len(right), 1)
    shown = [_group(names, k * share, share) for k, names in enumerate(right)]
    areas = [(_LEFT, left[1], height, _VERTICAL, [_widget(left[0], True, 0, height)]),
             (_RIGHT, right_width if right else 0, height, _VERTICAL, [*shown, _widget(hidden[0], False)]),
             (_BOTTOM, 0, 0, _HORIZONTAL, [_widget(hidden[1], False)])]
    docks = b''.join(struct.pack('>iii', area, across, down) + _items(_LIST, orientation, items)
                     for area, across, down, orientation, items in areas)
    centre = struct.pack('>ii', width - left[1] - (right_width if right else 0), height)
    corners = struct.pack('>IIII', 4, 4, 8, 8)  # Qt's default: the side docks end where the bottom dock begins
    toolbar = struct.pack('>Biii', _TOOLBARS, 1, _TOP_EDGE, 1) + _text('Tools') + struct.pack('>BIIII', 1, 0, _UNKNOWN, 0, 0)
    return (struct.pack('>iiBi', _VERSION, 0, _DOCKS, len(areas)) + docks + centre + corners + toolbar).hex()


def _text(text: str) -> bytes:
    data = text.encode('utf-16-be')
    return struct.pack('>i', len(data)) + data


def _items(kind: int, orientation: int, items: Sequence[bytes]) -> bytes:
    return struct.pack('>BBi', kind, orientation, len(items)) + b''.join(items)


def _widget(name: str, shown: bool, start: int = 0, size: int = _UNKNOWN) -> bytes:
    return struct.pack('>B', _WIDGET) + _text(name) + struct.pack('>BIIII', shown, start, size, _LEAST, _MOST)


def _group(names: Sequence[str], start: int, size: int) -> bytes:
    """One panel, or several as tabs."""
    if len(names) == 1:
        return _widget(names[0], True, start, size)
    tabs = struct.pack('>Bi', _TABS, 0) + struct.pack('>Bi', _VERTICAL, len(names)) + b''.join(_widget(name, True) for name in names)
    return struct.pack('>BIIII', _LIST, start, size, _LEAST, _MOST) + tabs
