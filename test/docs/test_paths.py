# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Links, paths and names in the code that the documentation gives lead to what is there."""
import json
import re

import pytest
import run
from pages import ALL_PAGES, ROOT, files, prose

from tactile_perception.common.marker_sensor import MARKER_SENSORS

PACKAGES = ('tactile_driver', 'tactile_perception', 'tactile_bringup')
#: Where a path may begin besides the page's folder: at the top, in a package, in its Python folder, among the tests, in the example.
FOLDERS = (*PACKAGES, 'docs', 'environment', 'test')
STARTS = (ROOT, *(ROOT / package for package in PACKAGES), *(ROOT / package / package for package in PACKAGES), ROOT / 'test',
          ROOT / 'docs/examples/slip_watch', ROOT / 'docs/examples/tactile_plate')
ENDINGS = r'\.(?:py|md|yaml|xml|rviz|bash|txt|in|cpp|hpp|msg|png|webp)'
PATH = re.compile(rf'((?:[\w.*-]+/)+[\w.*-]*|[\w*-]+\.py|(?:[\w.*-]+/)*[\w.*-]+{ENDINGS})(?::(\w+))?')
#: What commands write, what recordings hold, and what users call their own.
ELSEWHERE = re.compile(r'(out|folder|frames|simulated|ground_truth|left|right|share|recordings|estimates|image_raw|\w+_(bag|slip))/.*|'
                       r'(my_|NAME_|BAG|PARAMS|CALIBRATION|sensor\.json).*')


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
        # a class or function of Python, a name that a module assigns, a class or function of C++
        defined = re.compile(rf'^ *(?:class|struct|def) {name}\b|^{name}(?:: .+)? = |^[\w:<>,&* ]+\b{name}\(', re.MULTILINE)
        assert not name or any(defined.search(file.read_text()) for file in found), \
            f'{page.name} names {name} in {path}, which does not define it'


def test_the_readme_is_short():
    assert len((ROOT / 'README.md').read_text().split()) <= 1500


def test_the_readmes_table_is_of_the_benchmark_that_is_stored_and_shows_every_sensor_of_the_papers():
    entries = json.loads((ROOT / 'test/benchmark/doc/benchmark.json').read_text())['entries']
    assert {'touchpad', *MARKER_SENSORS, 'psd_finger', 'taxel_array'} <= {entry['source'] for entry in entries}
    page = (ROOT / 'test/benchmark/doc/benchmark.md').read_text()
    shown = f'{run.TITLE}\n\n{run.tables(entries)}'
    assert page.startswith(shown), 'run.py --out test/benchmark/doc measures again, --stored makes the page again'
    assert run.summary(entries) in (ROOT / 'README.md').read_text(), 'copy the first table that run.py --stored prints'
