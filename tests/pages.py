"""The code of a page of docs/, as its readers copy it."""

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1] / "docs"


def code(name):
    """The page's Python blocks, in order, as one program."""
    return "\n".join(re.findall(r"```python\n(.*?)```", (DOCS / name).read_text(encoding="utf-8"), re.S))


def bold(name):
    """What the page says to press."""
    return set(re.findall(r"\*\*(.+?)\*\*", (DOCS / name).read_text(encoding="utf-8")))
