"""Short texts of results for a console: what they are and how many, never their numbers."""

from __future__ import annotations


def counted(n: int, one: str, many: str = "") -> str:
    """ "12,000 points"."""
    return f"{n:,} {one if n == 1 else many or one + 's'}"


def brief(of: object, *parts: object) -> str:
    """The type's name with those parts that say something."""
    return f"{type(of).__name__}({', '.join(str(part) for part in parts if part)})"
