# SPDX-License-Identifier: Apache-2.0
"""What scripts/docs adds to Griffe, which reads the docstrings for docs/reference/python.md."""

from typing import Any

import griffe

from tools.docstring_text import separate_entries


class DocstringSections(griffe.Extension):
    """Applies `separate_entries` to every docstring before Griffe parses it."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        """Change the docstring of an object that Griffe has found."""
        if obj.docstring:
            obj.docstring.value = separate_entries(obj.docstring.value)
