# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Words that do not return: in code, comments, messages and pages, each with what to write instead."""
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
#: Files and folders that keep some: a history of names, files written by earlier versions, a public method, and the list itself.
EXCEPT = ('test/style/test_words.py', 'tactile_perception/CHANGELOG.rst', 'tactile_bringup/calibration',
          'tactile_driver/tactile_driver/stitching/calibration.py')


def found_in(name):
    """Lines of a file with such a word, and what to write instead."""
    return [f'{name}:{number}: {match[0]!r}: write {better}' for number, line in enumerate((ROOT / name).read_text().splitlines(), 1)
            for word, better in WORDS.items() if (match := re.search(word, line))]


def test_words_do_not_return():
    kept, found = set(), []
    for name in sources('.py', '.cpp', '.hpp', '.msg', '.md', '.rst', '.yaml', '.xml', '.bash', 'Makefile'):
        room = next((room for room in EXCEPT if name == room or name.startswith(f'{room}/')), None)
        lines = found_in(name)
        if room is None:
            found += lines
        elif lines:
            kept.add(room)
    assert found == []
    assert kept == set(EXCEPT), 'an exception that is needed no more goes'


def test_the_list_finds_a_word():
    assert re.search(next(iter(WORDS)), 'the place of a dot') and not re.search(next(iter(WORDS)), 'in place of it')
