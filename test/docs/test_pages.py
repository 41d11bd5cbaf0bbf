# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pages' links, headings, figures and paths."""
import json
import os
import re
import signal
import subprocess
import time
from pathlib import Path

from pages import ALL_PAGES, PAGES, ROOT, blocks, files, prose
import pytest
import run
from tactile_perception.sensors import SENSOR_TYPES

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


@pytest.mark.parametrize('page', [page for page in PAGES if blocks(page)], ids=lambda page: page.stem)
def test_every_command_of_the_page_works(page, tmp_path):
    for name, text in files(page).items():
        (tmp_path / name).write_text(text)
    session = Session(tmp_path)
    for block in blocks(page):
        if block.kind == 'sh':
            try:
                for command in block.lines:
                    session.run(command)
            finally:
                session.end_block()


_READY_S, _PATIENCE_S, _TOOL_S = 8.0, 60.0, 900.0
_LASTING = ('ros2 launch', 'python3 ')


class Session:
    """A reader's terminals, all in one folder."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._environment = {**os.environ, 'PYTHONUNBUFFERED': '1'}
        self._running: list[tuple[str, subprocess.Popen, Path]] = []
        self._count = 0

    def run(self, command: str) -> None:
        """One line. Raises AssertionError, with what was printed, where it fails."""
        if command.startswith(_LASTING) or ' run ' in command and ('_emulator' in command or '_node ' in command):
            self._begin(command)
        elif command.startswith('ros2 topic hz'):
            self._measure(command)
        elif command.startswith('ros2') and ' run ' not in command:
            self._ask(command)
        else:
            found = self._called(command, _TOOL_S)
            assert found.returncode == 0, f'{command}\n{found.stdout[-2000:]}\n{found.stderr[-2000:]}{self._said()}'

    def _called(self, command: str, limit: float) -> subprocess.CompletedProcess:
        return subprocess.run(['bash', '-c', command], cwd=self._folder, env=self._environment, capture_output=True, text=True,
                              timeout=limit)

    def _ask(self, command: str) -> None:
        """Again until the nodes are there: a busy machine takes long to start them."""
        end = time.monotonic() + _PATIENCE_S
        while (found := self._called(command, _PATIENCE_S)).returncode != 0 and time.monotonic() < end:
            time.sleep(1.0)
        assert found.returncode == 0, f'{command}\n{found.stdout[-2000:]}\n{found.stderr[-2000:]}{self._said()}'

    def _start(self, command: str) -> tuple[subprocess.Popen, Path]:
        self._count += 1
        log = self._folder / f'{self._count}.log'
        with log.open('w') as out:
            process = subprocess.Popen(['bash', '-c', f'exec {command}'], cwd=self._folder, env=self._environment, stdin=subprocess.PIPE,
                                       stdout=out, stderr=subprocess.STDOUT, start_new_session=True)
        return process, log

    def _begin(self, command: str) -> None:
        process, log = self._start(command)
        self._running.append((command, process, log))
        time.sleep(2.0 if '_emulator' in command else _READY_S)
        assert process.poll() is None, f'{command} has ended by itself\n{log.read_text()[-3000:]}'

    def _measure(self, command: str) -> None:
        process, log = self._start(command)
        end = time.monotonic() + _PATIENCE_S
        while 'average rate' not in log.read_text() and time.monotonic() < end:
            time.sleep(0.2)
        os.killpg(process.pid, signal.SIGINT)
        process.wait(20)
        assert 'average rate' in log.read_text(), f'{command} measured nothing{self._said()}'

    def end_block(self) -> None:
        """Ctrl-C for what still runs, the last first; it has to end cleanly, without a traceback."""
        ended, self._running = self._running[::-1], []
        failed = []
        for command, process, log in ended:
            os.killpg(process.pid, signal.SIGINT)
            try:
                code = process.wait(40)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                code = 'none'
            if code != 0 or 'Traceback' in log.read_text():
                failed.append(f'{command}: exit code {code}\n{log.read_text()[-3000:]}')
        assert not failed, '\n'.join(failed)

    def _said(self) -> str:
        return ''.join(f'\n--- {command}\n{log.read_text()[-2000:]}' for command, _, log in self._running)


PACKAGES = ('tactile_driver', 'tactile_perception', 'tactile_bringup')
#: Where a path may begin besides the page's folder: at the top, in a package, in its Python folder, among the tests, in the example.
FOLDERS = (*PACKAGES, 'docs', 'environment', 'test')
STARTS = (ROOT, *(ROOT / package for package in PACKAGES), *(ROOT / package / package for package in PACKAGES), ROOT / 'test',
          ROOT / 'docs' / 'examples' / 'slip_watch')
ENDINGS = r'\.(?:py|md|yaml|xml|rviz|bash|txt|in|cpp|hpp|msg|png|webp)'
PATH = re.compile(rf'((?:[\w.*-]+/)+[\w.*-]*|[\w*-]+\.py|(?:[\w.*-]+/)*[\w.*-]+{ENDINGS})(?::(\w+))?')
#: What commands write, what recordings hold, and what users call their own.
ELSEWHERE = re.compile(r'(out|folder|frames|sdh_slip|dsa_slip|simulated|ground_truth|left|right|share|image_raw)/.*|'
                       r'(my_|NAME_|rows_and_columns|BAG|PARAMS|CALIBRATION|sensor\.json).*')


def code_words(page):
    """Return each text in back quotes of a page."""
    return re.findall(r'`([^`\n]+)`', prose(page))


def code_paths(page):
    """Return (path, name or '') of each text in back quotes that is a path, but for those of things that are not in the repository."""
    found = [match.groups('') for word in code_words(page) if (match := PATH.fullmatch(word))]
    return [(path, name) for path, name in dict.fromkeys(found) if not ELSEWHERE.fullmatch(path)]


def targets(page, path):
    """Return the files that a path may mean; words in capitals in it, as TYPE, stand for anything."""
    pattern = re.sub(r'\b[A-Z]{3,}\b', '*', path) if path != 'README.md' else path
    found = [file for start in (page.parent, *STARTS) for file in start.glob(pattern.rstrip('/'))]
    return found or ([] if '/' in path else [file for folder in FOLDERS for file in (ROOT / folder).rglob(pattern)])


@pytest.mark.parametrize('page', ALL_PAGES, ids=lambda page: page.stem)
def test_links_lead_to_files(page):
    for target in re.findall(r'\]\(([^)#]+)[^)]*\)', prose(page)):
        assert target.startswith('http') or (page.parent / target).exists(), f'{page.name} links to {target}, which is not there'


@pytest.mark.parametrize('page', ALL_PAGES, ids=lambda page: page.stem)
def test_links_lead_to_headings(page):
    for target, heading in re.findall(r'\]\(([^)#:]*)#([^)]+)\)', prose(page)):
        file = page.parent / target if target else page
        headings = [re.sub(r'[^\w -]', '', line.lstrip('# ').lower()).replace(' ', '-') for line in file.read_text().splitlines()
                    if line.startswith('#')]
        assert heading in headings, f'{page.name} links to {target}#{heading}, which is not there'


@pytest.mark.parametrize('page', ALL_PAGES, ids=lambda page: page.stem)
def test_paths_and_names_exist(page):
    own = files(page)
    for path, name in code_paths(page):
        if path in own:
            continue
        found = targets(page, path)
        assert found, f'{page.name} names {path}, which is not there'
        # a class or function of Python, a name that a module assigns, a function of C++
        defined = re.compile(rf'^ *(?:class|def) {name}\b|^{name} = |^[\w:<>,&* ]+\b{name}\(', re.MULTILINE)
        assert not name or any(defined.search(file.read_text()) for file in found), \
            f'{page.name} names {name} in {path}, which does not define it'


def test_the_readme_is_short():
    assert len((ROOT / 'README.md').read_text().split()) <= 1500


def test_the_readmes_table_is_of_the_benchmark_that_is_stored_and_shows_every_sensor():
    entries = json.loads((ROOT / 'test/benchmark/doc/benchmark.json').read_text())['entries']
    assert set(SENSOR_TYPES) <= {entry['source'] for entry in entries}
    assert run.summary(entries) in (ROOT / 'README.md').read_text(), 'run.py --out test/benchmark/doc measures again'
