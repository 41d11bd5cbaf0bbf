# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Tables to which installed packages add entries of their own, by Python's entry points."""
from __future__ import annotations

from collections import UserDict
from collections.abc import Iterator, Mapping
from pkgutil import resolve_name
from typing import TYPE_CHECKING

from .errors import BadArgument

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


class PluginTable(UserDict):
    """Name -> object: the entries of this project, and those of other packages.

    An entry of another package is an entry point of the table's group in that package's ``setup.py`` or ``setup.cfg``. Entry points are
    read only when a name is unknown here, or when the names are listed, because reading those of all installed packages delays the start
    of a process.

    Parameters
    ----------
    group : str
        Group of the entry points, such as ``tactile_perception.sensor_types``.
    own : Mapping
        The entries of this project. A text ``module:name`` stands for the object of that name, which is imported when it is first used.

    Raises
    ------
    BadArgument
        When an entry is used that cannot be imported, or that two packages define differently.
    """

    def __init__(self, group: str, own: Mapping[str, object]):
        super().__init__(own)
        self.group, self.own = group, tuple(own)
        self._plugins: dict[str, EntryPoint] | None = None

    def __getitem__(self, name: str) -> object:
        value = self.data[name] if name in self.data else self._found()[name]
        if isinstance(value, str) or name not in self.data:
            value = self.data[name] = self._imported(name, value)
        return value

    def __contains__(self, name: object) -> bool:
        return name in self.data or name in self._found()

    def __iter__(self) -> Iterator[str]:
        return iter({**self.data, **self._found()})

    def __len__(self) -> int:
        return len({**self.data, **self._found()})

    def __bool__(self) -> bool:
        return bool(self.data) or bool(self._found())

    def package(self, name: str) -> str:
        """Name of the package that defines an entry.

        Parameters
        ----------
        name : str
            Name of the entry.

        Returns
        -------
        str
            Name of the Python package.

        Raises
        ------
        KeyError
            If there is no entry of that name.
        """
        value = self.data[name] if name in self.data else self._found()[name].value
        return (value if isinstance(value, str) else value.__module__).partition('.')[0].partition(':')[0]

    def extended(self, more: Mapping[str, object]) -> PluginTable:
        """Make a table of the same group with more entries of this project.

        Parameters
        ----------
        more : Mapping
            Name to object, as `own`.

        Returns
        -------
        PluginTable
            The table.
        """
        return PluginTable(self.group, {**{name: self.data[name] for name in self.own}, **more})

    def _found(self) -> dict[str, EntryPoint]:
        """Entry points of other packages, by name."""
        if self._plugins is None:
            from importlib.metadata import entry_points  # takes 0.1 s to import
            self._plugins = {}
            for entry in entry_points(group=self.group):
                other = self._plugins.setdefault(entry.name, entry)
                if other.value != entry.value or entry.name in self.own:
                    raise BadArgument(f'{self.group}: {entry.name!r} is defined twice, as {entry.value} and as '
                                      f'{self.data.get(entry.name, other.value)}: uninstall one of the packages, or rename its entry')
        return self._plugins

    def _imported(self, name: str, value: str | EntryPoint) -> object:
        try:
            return resolve_name(value) if isinstance(value, str) else value.load()
        except (ImportError, AttributeError) as error:
            text = value if isinstance(value, str) else value.value
            raise BadArgument(f'{self.group}: {name!r}, which is {text}, cannot be imported: {error}') from error
