# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Look whether the built pages' search finds what `conf.py:SEARCHED` promises: python3 docs/check_search.py out/docs.

Sphinx's search gives a main index entry of which the query is at least a half up to 100 points, a title at most 16, a word at most 15.
"""
import json
import sys
from pathlib import Path
from runpy import run_path

SEARCHED = run_path(str(Path(__file__).parents[1] / 'conf.py'))['SEARCHED']


def found(index: dict, query: str) -> str:
    """The page of the best index entry; '' if there is none. Sphinx compares small letters."""
    query = query.lower()
    entries = [(len(query) / len(entry), index['docnames'][page]) for entry, targets in index['indexentries'].items()
               if query in entry and 2 * len(query) >= len(entry) for page, _, is_main in targets if is_main]
    return max(entries, default=(0, ''))[1]


def main(folder: str) -> int:
    """Print each query that leads elsewhere; return the number of them."""
    text = (Path(folder) / 'searchindex.js').read_text()
    index = json.loads(text[text.index('{'):text.rindex('}') + 1])
    wrong = [(query, page, there) for page, queries in SEARCHED.items() for query in queries if (there := found(index, query)) != page]
    for query, page, there in wrong:
        print(f'search for "{query}" leads to {there or "no page"}, not to {page}; see SEARCHED in conf.py', file=sys.stderr)
    return len(wrong)


if __name__ == '__main__':
    sys.exit(min(main(sys.argv[1]), 1))
