# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Words that do not return to a room whose text is rewritten: in code, comments, messages and pages, each with what to write instead."""
import re

from test_sources import ROOT, sources

WORDS = {
    r'(?<!\bin )(?<!\bin_)(?<!\.)\bplaces?\b': 'position; label or offset',
    r'\bways?\b': 'displacement, path, manner',
    r'\b(tells?|told|telling)\b': 'indicates, reports, is identified by',
    r'\bbegin(s|ning)? again\b|\brenew(s|ed|al)?\b|\banew\b': 'reset, restart, again',
    r'\b(goes|go|going|went) on\b': 'continues',
    r'\blasting\b': 'persistent',
    r'\bamiss\b': 'residual',
    r'\bchosen\b': 'say what the constant bounds',
    r'\bhundredths?\b': '1 %',
    r'\bflesh and blood\b': 'a person',
    r'\b_?(FEWEST|MOST|LEAST|REACH|STILL|SQUARES|AROUND|WRONG)\b': 'a name that says what the constant bounds, and of what',
}
#: Files and folders whose text is finished. The list grows until it is the whole repository.
FINISHED = (
    'tactile_msgs', 'tactile_driver/doc', 'tactile_driver/CHANGELOG.rst', 'conf.py', 'tactile_perception/tactile_perception/published',
    'tactile_bringup/hands', 'tactile_bringup/test', 'tactile_driver/test',
    *(f'test/{name}' for name in ('benchmark', 'borders', 'docs', 'environment', 'faults', 'hardware', 'launch', 'stability')),
    *(f'tactile_driver/tactile_driver/{name}' for name in (
        'camera', 'nodes', 'parameters', 'recordings', 'serial', 'simulation', 'sources', 'stitching/methods.py', '__init__.py',
        'emulators.py', 'errors.py', 'frame.py', 'frame_names.py', 'lens.py', 'plugins.py', 'stamp_gaps.py')),
    *(f'tactile_perception/tactile_perception/{name}' for name in (
        'core', 'common', 'dots', 'bags', 'tools', 'evaluation', 'finger', 'force_taxels', 'gel', 'layer', 'photometric', 'taxel',
        'touchpad', 'api.py')),
    *(f'tactile_perception/test/{name}' for name in (
        'bags', 'common', 'core', 'evaluation', 'finger', 'force_taxels', 'gel', 'helpers', 'photometric', 'taxel', 'tools', 'touchpad',
        'conftest.py', 'test_work_log.py')),
    *(f'tactile_perception/tactile_perception/press/{name}' for name in (
        'dome', 'sheet/calibration.py', 'sheet/model.py', 'calibration.py', 'estimate.py', 'estimator.py', 'field.py', 'methods.py',
        'parameters.py', 'positions.py', 'presses.py', 'sensor_types.py', 'stage.py', 'stitching.py', 'tools.py')),
    *(f'tactile_perception/test/dots/{name}' for name in (
        'conftest.py', 'test_auto.py', 'test_detect.py', 'test_links.py', 'test_number.py', 'test_published.py', 'test_reference.py',
        'test_tracker.py')),
    *(f'tactile_perception/test/press/{name}' for name in (
        'dome', 'sheet', 'conftest.py', 'test_field.py', 'test_presses.py', 'test_published.py', 'test_region.py', 'test_sensitivity.py',
        'test_stage.py', 'test_stitching.py', 'test_tools.py')),
    *(f'tactile_perception/src/{name}' for name in ('bindings', 'common', 'dots', 'finger', 'force_taxels', 'press', 'taxel', 'touchpad')),
    'tactile_bringup/tactile_bringup', 'environment', 'Makefile', 'CONTRIBUTING.md', 'README.md', 'docs', '.github',
)


def test_words_do_not_return():
    names = [name for name in sources('.py', '.cpp', '.hpp', '.msg', '.md', '.rst', '.yaml', '.xml', '.bash', 'Makefile')
             if any(name == room or name.startswith(f'{room}/') for room in FINISHED)]
    assert {room for room in FINISHED if not any(name == room or name.startswith(f'{room}/') for name in names)} == set()
    lines = [(f'{name}:{number}', line) for name in names for number, line in enumerate((ROOT / name).read_text().splitlines(), 1)]
    assert [f'{where}: {match[0]!r}: write {better}' for where, line in lines for word, better in WORDS.items()
            if (match := re.search(word, line))] == []


def test_the_list_finds_a_word():
    assert re.search(next(iter(WORDS)), 'the place of a dot') and not re.search(next(iter(WORDS)), 'in place of it')
