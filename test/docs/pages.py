# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pages of the documentation: their commands, and the files that they show."""
from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = sorted([*(ROOT / 'docs').glob('*.md'), *(ROOT / 'docs/papers').glob('*.md')])
ALL_PAGES = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *PAGES]
_FENCED = re.compile(r'^```(\w+)\n(.*?)^```$', re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """What one fenced block holds. kind: sh, python ...; lines: without empty ones in sh."""

    kind: str
    lines: tuple[str, ...]

    @property
    def file_name(self) -> str:
        """Of a block that shows a file: its first line is a comment with the name."""
        return self.lines[0].removeprefix('# ')


def blocks(page: Path) -> list[Block]:
    """All fenced blocks of a page, in order."""
    return [Block(kind, tuple(line for line in text.splitlines() if kind != 'sh' or line.strip()))
            for kind, text in _FENCED.findall(page.read_text())]


def commands(page: Path) -> list[str]:
    """All commands of a page that are run: the lines of its sh blocks."""
    return [line for block in blocks(page) if block.kind == 'sh' for line in block.lines]


def indented_commands(page: Path) -> list[str]:
    """The commands of a page that are only checked, each once: indented by four, without their remarks."""
    lines = (line[4:].split(' #')[0].strip() for line in prose(page).splitlines() if line.startswith('    '))
    return list(dict.fromkeys(line for line in lines if line.split(' ')[0] in ('ros2', 'make', 'python3')))


#: First words of commands. In back quotes, one of these alone is a name, not a command.
PROGRAMS = ('CASES="unbound', 'colcon', 'cp', 'ffmpeg', 'ls', 'make', 'mcap', 'pre-commit', 'python3', 'ros2', 'rosdep', 'sed', 'source',
            'sudo', 'v4l2-ctl')


def listed_commands(page: Path) -> list[str]:
    """The commands of a page that are not in its sh blocks, each once, without their remarks: indented by four, in other blocks of text,
    and those of `make` and `python3` in back quotes."""
    text = re.sub(r'^```(?!text|\n)\w+\n.*?^```$', '', page.read_text(), flags=re.MULTILINE | re.DOTALL)
    blocks = [line for block in re.findall(r'^```(?:text)?\n(.*?)^```$', text, re.MULTILINE | re.DOTALL) for line in block.splitlines()]
    indented = [line for line in text.splitlines() if line.startswith('    ')]
    quoted = [word for word in re.findall(r'`([^`\n]+)`', prose(page)) if re.match(r'(make|python3|CASES=\S*) \S', word)]
    lines = (line.split(' #')[0].strip() for line in [*indented, *blocks, *quoted])
    return list(dict.fromkeys(line for line in lines if line.split(' ')[0] in PROGRAMS))


def helped_commands() -> list[str]:
    """The commands that the Makefile's help shows."""
    shown = re.findall(r"@echo '([^']*)'", (ROOT / 'Makefile').read_text())
    return [re.split(r' {2,}', line.strip())[0] for line in shown]


def prose(page: Path) -> str:
    """The text of a page without its fenced blocks."""
    return re.sub(r'^```.*?^```$', '', page.read_text(), flags=re.MULTILINE | re.DOTALL)


def files(page: Path) -> dict[str, str]:
    """Name -> text of the files that a page shows in full."""
    return {block.file_name: '\n'.join(block.lines) + '\n' for block in blocks(page) if block.kind in ('python', 'yaml')}
