# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The API reference: it names what is there, each page is in it, the examples of docstrings run, and it builds without a warning."""
import doctest
import importlib
import re
import shutil
import subprocess
import sys
from pathlib import Path
from pkgutil import resolve_name
from runpy import run_path

import pytest
import yaml
from pages import PAGES, ROOT

import tactile_perception

SEARCHED = run_path(str(ROOT / 'conf.py'))['SEARCHED']
DIRECTIVE = re.compile(r'^\.\. (auto\w+|currentmodule|headers):: (\S+)$', re.MULTILINE)
#: Where `make docs` installs Sphinx.
SPHINX = ROOT / '.env' / 'docs' / 'bin'


def documented():
    """(directive, full name) of what the pages of docs/api document."""
    for page in (ROOT / 'docs' / 'api').glob('*.rst'):
        module = ''
        for directive, name in DIRECTIVE.findall(page.read_text()):
            if directive == 'currentmodule':
                module = name + '.'
            elif directive != 'headers':
                yield directive, name if name.startswith('tactile_') else module + name


def object_of(name):
    module = name
    while True:
        module = module.rpartition('.')[0]
        try:
            importlib.import_module(module)
        except ImportError:
            continue
        return resolve_name(f'{module}:{name[len(module) + 1:]}')


def test_the_reference_documents_what_is_there():
    for directive, name in documented():
        found = importlib.import_module(name) if directive == 'automodule' else object_of(name)
        assert found.__doc__, name


def test_the_reference_has_every_public_name():
    names = {name for _, name in documented()}
    # PsdFinger is a class of the compiled module, which is documented by its header.
    assert {f'tactile_perception.{name}' for name in tactile_perception.__all__} - names == {'tactile_perception.PsdFinger'}


def test_every_page_is_in_the_table_of_contents():
    lines = (ROOT / 'docs/index.md').read_text().splitlines()
    pages = {(ROOT / 'docs' / f'{line.rstrip(">").split("<")[-1]}.md').resolve() for line in lines}
    assert [page.name for page in PAGES if page.name != 'index.md' and page not in pages] == []
    assert [page for page in SEARCHED if not (ROOT / f'{page}.md').is_file()] == []


def test_the_configuration_finds_what_is_beside_it(tmp_path, monkeypatch):
    """rosdoc2 executes it in a copy of the repository."""
    monkeypatch.setattr(sys, 'path', sys.path[:])
    run_path(shutil.copy(ROOT / 'conf.py', tmp_path))
    assert {'docs/extension', 'tactile_driver', 'tactile_perception'} <= {str(Path(path).relative_to(tmp_path)) for path in sys.path[:4]}
    _, config = yaml.safe_load_all((ROOT / 'tactile_bringup/rosdoc2.yaml').read_text())
    assert (ROOT / 'tactile_bringup' / config['builders'][0]['sphinx']['sphinx_sourcedir']).samefile(ROOT)


def test_examples_of_docstrings_run():
    modules = {object_of(name).__module__ for directive, name in documented() if directive != 'automodule'}
    modules |= {name for directive, name in documented() if directive == 'automodule'}
    results = {name: doctest.testmod(sys.modules[name], optionflags=doctest.NORMALIZE_WHITESPACE) for name in sorted(modules)}
    assert {name: result.failed for name, result in results.items() if result.failed} == {}
    assert sum(result.attempted for result in results.values()) >= 10


@pytest.mark.skipif(not (SPHINX / 'sphinx-build').exists(), reason='make docs has not installed Sphinx')
def test_the_pages_build_without_a_warning_and_the_search_finds_them(tmp_path):
    built = subprocess.run([SPHINX / 'sphinx-build', '--quiet', '--fail-on-warning', '.', tmp_path], cwd=ROOT, text=True,
                           capture_output=True)
    assert built.returncode == 0, built.stderr
    searched = subprocess.run([SPHINX / 'python', 'docs/check_search.py', tmp_path], cwd=ROOT, text=True, capture_output=True)
    assert searched.returncode == 0, searched.stderr
    assert 'tactile_perception.detect_dots' in Path(tmp_path, 'docs/api/algorithms.html').read_text()
