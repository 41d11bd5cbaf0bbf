# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Message definitions as a bag holds them."""
from __future__ import annotations

import re
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

_SEPARATOR = f'\n{"=" * 80}\nMSG: '
_NESTED = re.compile(r'^\s*(?:(\w+)/(?:msg/)?)?([A-Z]\w*)(?:\[.*?\])?\s+\w+', re.MULTILINE)


def full_text(type_name: str) -> str:
    """The definition of a message type (std_msgs/msg/String), followed by those of all types in it; '' if it is not installed."""
    texts, waiting = {}, [tuple(type_name.split('/')[::2])]
    while waiting:
        package, kind = waiting.pop(0)
        if (package, kind) in texts:
            continue
        try:
            text = Path(get_package_share_directory(package), 'msg', f'{kind}.msg').read_text()
        except (OSError, PackageNotFoundError):
            return ''
        texts[package, kind] = text
        waiting += [(other or package, name) for other, name in _NESTED.findall(text)]
    (_, first), *others = texts.items()
    return first + ''.join(f'{_SEPARATOR}{package}/{kind}\n{text}' for (package, kind), text in others)
