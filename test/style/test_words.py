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
    'tactile_msgs', 'tactile_driver/doc', 'tactile_driver/CHANGELOG.rst', 'docs/index.md', 'docs/conf.py', 'docs/check_search.py',
    'docs/extension', 'docs/api', 'docs/papers', 'tactile_perception/tactile_perception/published',
    'tactile_bringup/tactile_bringup/papers', *(f'tactile_driver/tactile_driver/{name}' for name in (
        'camera', 'nodes', 'parameters', 'recordings', 'serial', 'sources', 'stitching/methods.py', '__init__.py', 'emulators.py',
        'errors.py', 'frame.py', 'frame_names.py', 'lens.py', 'plugins.py', 'stamp_gaps.py')),
    *(f'tactile_perception/tactile_perception/{name}' for name in (
        'common', 'calibration/files', 'bags', 'parameters', 'nodes', 'tools', 'evaluation/plots.py', 'evaluation/scores.py', 'api.py',
        'camera_stage.py', 'clock.py', 'errors.py', 'node.py', 'sensor_type.py', 'stage.py', 'work_log.py')),
    'environment', 'Makefile', 'CONTRIBUTING.md', 'README.md', *(f'docs/{name}.md' for name in (
        'README', 'accuracy', 'calibration', 'controllers', 'devices', 'extending', 'install', 'points', 'python', 'recordings', 'security',
        'troubleshooting')),
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
