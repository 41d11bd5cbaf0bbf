# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""The pages of the documentation, run from top to bottom as a reader would: a command that does not end runs until the end of its block,
the others are waited for."""
import pytest
from pages import PAGES, ROOT, blocks, files
from session import Session

#: Pages whose commands need an optional extra (environment/extras.txt).
EXTRAS = {'grasp': 'mujoco'}
pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]


@pytest.mark.parametrize('page', [page for page in PAGES if blocks(page)], ids=lambda page: page.stem)
def test_every_command_of_the_page_works(page, tmp_path):
    if page.stem in EXTRAS:
        pytest.importorskip(EXTRAS[page.stem], reason=f'{EXTRAS[page.stem]} is an optional extra, which is not installed')
    (tmp_path / 'docs').symlink_to(ROOT / 'docs')
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
