"""Progress as users want it: a bar in a terminal or a notebook, a bar of tqdm, or a function."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Callable, Iterator, Optional, Protocol

if TYPE_CHECKING:
    from typing_extensions import Self

Progress = Callable[[str, float], Optional[bool]]


class Bar(Protocol):
    """What is used of a tqdm bar."""

    n: float
    total: Any

    def update(self, n: float) -> Any: ...


@contextmanager
def shown(progress: Progress | Bar | bool | None) -> Iterator[Progress | None]:
    """The function that tells `progress`, as long as a call runs: True is a bar of its own."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        with _bar() as bar, shown(bar) as tell:
            yield tell
    elif hasattr(progress, "update"):
        tell = _filling(progress)
        yield tell
        tell("done", 1.0)
    else:
        yield progress


def _bar() -> Any:
    """A bar for this terminal or notebook."""
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped]
    except ImportError:
        return _Line()
    form = "{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
    return tqdm(total=100, bar_format=form, desc="preparing")


def _filling(bar: Any) -> Progress:
    """A function that fills a bar up to its total, from where it is."""
    begin = bar.n
    total = bar.total or 100

    def tell(stage: str, share: float) -> None:
        if hasattr(bar, "set_description_str"):
            bar.set_description_str(stage, refresh=False)
        bar.update(begin + (total - begin) * share - bar.n)

    return tell


class _Line:
    """A bar on one line of a terminal, where there is no tqdm: nothing where output is no terminal."""

    n = 0.0
    total = 100
    _stage = "preparing"

    def __enter__(self) -> Self:
        self._began = time.monotonic()
        return self

    def set_description_str(self, stage: str, refresh: bool) -> None:
        self._stage = stage

    def update(self, n: float) -> None:
        self.n += n
        passed = time.monotonic() - self._began
        left = f"{passed * (self.total - self.n) / self.n:.0f} s left" if self.n > 1 else ""
        self._say(f"{self._stage}: {self.n:3.0f} % {left}")

    def __exit__(self, *_: object) -> None:
        self._say("")

    @staticmethod
    def _say(text: str) -> None:
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{text:<60}\r")
            sys.stderr.flush()
