# Copyright 2026 The tactile authors
# SPDX-License-Identifier: Apache-2.0
"""Sphinx directive `headers`: the C++ headers of a folder, with the comment before each class, structure and function."""
import re
from pathlib import Path

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

DECLARED = re.compile(r'(?:class|struct|enum) (?P<type>\w+)[^;]*[{:]|[\w:<>,&*\[\] ]*?[\w>&*\]] (?P<function>\w+)\(')
COMMENT = re.compile(r'\s*//+ ?(.*)')


def described(text: str) -> list[tuple[str, str]]:
    """Each class, structure and function of a header that has a comment before it, with the comment; first '' with the file's own."""
    found, comment = [], []
    for line in text.split('\n')[2:]:  # after the licence
        if match := COMMENT.fullmatch(line):
            comment.append(match[1])
            continue
        declaration = DECLARED.match(line.strip())
        if comment and (not found or declaration):
            found.append(((declaration['type'] or f'{declaration["function"]}()') if found else '', ' '.join(comment)))
        comment = []
    return found


class Headers(SphinxDirective):
    """`headers` with the folder as its argument, from the top of the repository."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """A section for each header."""
        made = []
        for path in sorted((Path(self.env.srcdir) / self.arguments[0]).glob('*.hpp')):
            self.env.note_dependency(str(path))
            (_, about), *parts = described(path.read_text())
            name = f'{path.parent.name}/{path.name}'
            section = nodes.section('', nodes.title(text=name), nodes.paragraph(text=about), ids=[nodes.make_id(name)])
            items = [nodes.definition_list_item('', nodes.term('', '', nodes.literal(text=part)),
                                                nodes.definition('', nodes.paragraph(text=text))) for part, text in parts]
            if items:
                section += nodes.definition_list('', *items)
            made.append(section)
        return made


def setup(app) -> dict:
    """Add the directive."""
    app.add_directive('headers', Headers)
    return {'parallel_read_safe': True}
