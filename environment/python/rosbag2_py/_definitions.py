# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Definitions of message types, as they are stored in a bag."""
from __future__ import annotations

import re
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from ._storage import MessageDefinition, NeedsRosbag2

_NESTED = re.compile(r'^\s*(?:(\w+)/(?:msg/)?)?([A-Z]\w*)(?:\[.*?\])?\s+\w+', re.MULTILINE)
_TYPE = re.compile(r'(\w+)/(?:(\w+)/)?(\w+)')


class LocalMessageDefinitionSource:
    """Finds the definitions of the message types that are installed."""

    def get_full_text(self, root_type: str) -> MessageDefinition:
        """The definition of a type, std_msgs/msg/String or std_msgs/String, followed by those of all types in it.

        A name of another form has the encoding 'unknown' and no text. Raises IndexError where the package or the type is not installed,
        and NeedsRosbag2 for services and actions.
        """
        match = _TYPE.fullmatch(root_type)
        if match is None:
            return MessageDefinition(root_type, 'unknown', '', '')
        package, kind, name = match.groups()
        if kind not in (None, 'msg'):
            raise NeedsRosbag2(f'the definition of the type {root_type}')
        texts, waiting = {}, [(package, name)]
        while waiting:
            package, name = waiting.pop(0)
            if (package, name) not in texts:
                texts[package, name] = text = _text(package, name)
                waiting += [(other or package, nested) for other, nested in _NESTED.findall(text)]
        (_, first), *others = texts.items()
        rest = ''.join(f'\n{"=" * 80}\nMSG: {package}/{name}\n{text}' for (package, name), text in others)
        return MessageDefinition(root_type, 'ros2msg', first + rest, '')


def _text(package: str, name: str) -> str:
    try:
        return Path(get_package_share_directory(package), 'msg', f'{name}.msg').read_text()
    except (OSError, PackageNotFoundError) as error:
        raise IndexError(f"message type '{package}/msg/{name}' not found: {error}") from error
