# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Parameter files in the form that ROS reads, read without ROS: what a node would get from the file, a tool gets too."""
from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import yaml

from tactile_driver.parameters.table import Parameter, defaults

from .errors import BadArgument

_MERGED = 'dot_tracker_node', 'contact_region_node', 'contact_point_node'


class _Loader(yaml.SafeLoader):
    """Reads 8e-05 as a number, as ROS does; YAML 1.1 would have a point in it."""


_Loader.add_implicit_resolver('tag:yaml.org,2002:float', re.compile(r'[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$'), list('-+.0123456789'))


def read_parameters(path: str | Path, node: str, table: Sequence[Parameter]) -> dict[str, object]:
    """Name -> value of a node's parameters: defaults, then those that the file has for it. Raises BadArgument: file, name, what is
    allowed.
    """
    known = {p.name: p for p in table}
    values = defaults(table)
    for name, value in _sections(path, node):
        if name in known:
            try:
                values[name] = known[name].checked(value)
            except BadArgument as error:
                raise BadArgument(f'{path}: {error}') from error
    return values


def check_sections(path: str | Path, node: str) -> None:
    """Raise BadArgument for a file with a section of a node of earlier versions; node: the one that computes all results of the sensor."""
    for old in _MERGED:
        if old != node and re.search(rf'^[^#\n]*\b{old}:', Path(path).read_text(errors='replace'), re.MULTILINE):
            raise BadArgument(f'{path}: section {old} is not used: one node computes all results of this sensor; name the section {node}')


def all_values(path: str | Path) -> Iterator[tuple[str, object]]:
    """(name, value) of the parameters of all nodes of a file. Raises BadArgument for a file that cannot be read."""
    yield from _sections(path, '')


def write_parameters(path: Path, changes: Mapping[str, object], old: Path | None = None) -> Path:
    """Write a parameter file: the old one, where there is one, with changes, name -> value, for all nodes. Its path."""
    page = yaml.load(old.read_text(), _Loader) if old else {}
    for section in page.values():
        section['ros__parameters'] |= {name: value for name, value in changes.items() if name in section['ros__parameters']}
    page.setdefault('/**', {'ros__parameters': {}})['ros__parameters'] |= changes
    path.write_text(yaml.safe_dump(page, sort_keys=False))
    return path


def _sections(path: str | Path, node: str) -> Iterator[tuple[str, object]]:
    """(name, value) of every section that names the node, '' for any, wild cards first as ROS applies them."""
    try:
        content = yaml.load(Path(path).read_text(), _Loader)
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise BadArgument(f'parameter file {path}: cannot be read: {error}') from error
    if not isinstance(content, dict):
        raise BadArgument(f'parameter file {path}: no section "/**:" or "{node}:" with "ros__parameters:" in it')
    for key in sorted(content, key=lambda k: k.split('/')[-1] != '**'):
        section = content[key]
        if (not node or key.split('/')[-1] in ('**', node)) and isinstance(section, dict):
            yield from _flat(section.get('ros__parameters') or {})


def _flat(section: dict, prefix: str = ''):
    for name, value in section.items():
        if isinstance(value, dict):
            yield from _flat(value, f'{prefix}{name}.')
        else:
            yield f'{prefix}{name}', value
