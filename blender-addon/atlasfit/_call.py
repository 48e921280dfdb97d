"""Calls into the native library: status to exception, progress, cancel, Ctrl-C, and handles that free
themselves.
"""

from __future__ import annotations

import ctypes
import logging
import signal
import threading
from ctypes import byref
from dataclasses import fields
from typing import TYPE_CHECKING, Any, Callable, TypedDict

import numpy as np

from . import _abi
from ._abi import lib
from ._progress import Bar, Progress, shown

if TYPE_CHECKING:
    from types import FrameType

    from numpy.typing import NDArray

# Levels of the library's log, as the module logging has them.
_LEVELS = {_abi.LOG_ERROR: logging.ERROR, _abi.LOG_WARNING: logging.WARNING, _abi.LOG_INFO: logging.INFO}


class Error(RuntimeError):
    """A call failed. The text says what was wrong, where, and what to do.

    status: the number that atlasfit.h gives it; status_name: its short name ("invalid argument").
    """

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status
        self.status_name: str = lib().atlasfit_status_name(status).decode()

    def __reduce__(self) -> tuple[Any, ...]:
        # Pools of processes pickle what their workers raise.
        return type(self), (self.status, str(self))


class Cancelled(Error):
    """The run was cancelled: by its progress callback or a Cancel token. There is no result."""


class TimedOut(Error):
    """The time limit passed. There is no result."""


class RunOptions(TypedDict, total=False):
    """How long work is run; every long function takes these as keywords.

    seed          of everything random; same input, options, seed and version give the same bytes on machines
                  of one type. Default 0.
    threads       worker threads, 0 = all cores; the result does not depend on it. Default 0.
    time_limit    seconds after which TimedOut is raised; 0 = no limit. Default 0.
    memory_limit  bytes that the run's own estimate may not exceed; 0 = no limit. Default 0.
    progress      True shows a bar with the time that is left, in a terminal or a notebook (by tqdm where
    that is
                  installed); a tqdm bar is filled. A function is called with the name of the running stage
                  and
                  the share of the whole call that is done, in [0, 1], which never falls (a stage may come
                  again); on the calling thread, at most 50 times a second. It returns False to cancel. What
                  it
                  raises ends the run and is raised by the function.
    cancel        a token that cancels the run from another thread.
    log           a function of level and line, on the calling thread, which is told stages, warnings and
                  why a call fails; levels are those of the module logging:
                  logging.getLogger("atlasfit").log fits. What it raises is raised by the function.
    """

    seed: int
    threads: int
    time_limit: float
    memory_limit: int
    progress: Progress | Bar | bool | None
    cancel: Cancel | None
    log: Callable[[int, str], object] | None


class Handle:
    """A native object, freed with the last reference to it. The library fills `pointer`."""

    def __init__(self, kind: str) -> None:
        self.pointer = ctypes.c_void_p()
        self._kind = kind
        # Held here: at interpreter exit the module's own names may be gone already.
        self._free = getattr(lib(), f"atlasfit_{kind}_free")

    def copy(self, name: str, shape: tuple[int, ...], kind: Any, *which: int) -> NDArray[Any]:
        """An array of the object's, by the name that its function ends in."""
        array = np.empty(shape, kind)
        check(
            getattr(lib(), f"atlasfit_{self._kind}_{name}")(
                self.pointer, *which, array.ctypes.data, array.size
            )
        )
        return array

    def warnings(self) -> tuple[str, ...]:
        """What the user should hear of the object."""
        return self.lines("warnings")

    def lines(self, name: str) -> tuple[str, ...]:
        """Lines of text, by the name that their function ends in."""
        get = getattr(lib(), f"atlasfit_{self._kind}_{name}")
        length = ctypes.c_size_t()
        check(get(self.pointer, None, 0, byref(length)))
        text = ctypes.create_string_buffer(length.value + 1)
        check(get(self.pointer, text, len(text), byref(length)))
        return tuple(text.value.decode().splitlines())

    def __del__(self) -> None:
        if getattr(self, "pointer", None):
            self._free(self.pointer)


class Cancel:
    """A token that cancels runs from any thread. Once asked, it stays asked."""

    def __init__(self) -> None:
        self._handle = Handle("cancel")
        check(lib().atlasfit_cancel_new(byref(self._handle.pointer)))

    def request(self) -> None:
        """Asks every run that holds this token to stop: within 100 ms it raises Cancelled."""
        check(lib().atlasfit_cancel_request(self._handle.pointer))


def check(status: int) -> None:
    """Raises the exception for a failure of the call that this thread has just made."""
    if status == _abi.OK:
        return
    length = lib().atlasfit_last_error(None, 0)
    text = ctypes.create_string_buffer(length + 1)
    lib().atlasfit_last_error(text, length + 1)
    kind = {_abi.CANCELLED: Cancelled, _abi.TIMED_OUT: TimedOut}.get(status, Error)
    raise kind(status, text.value.decode())


class _Held:
    """The first exception that was raised inside a callback: it cannot pass through native code, so it is
    raised after it.
    """

    def __init__(self) -> None:
        self.exception: BaseException | None = None

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except BaseException as exception:
            self.exception = self.exception or exception


def run(call: Callable[[Any], int], options: RunOptions) -> None:
    """Makes one long call, handing it the run's struct, with the GIL released. Ctrl-C cancels it."""
    unknown = set(options) - set(RunOptions.__annotations__)
    if unknown:
        raise TypeError(f"unknown option {', '.join(sorted(unknown))}")
    with shown(options.get("progress")) as progress:
        _run(call, options, progress)


def _run(call: Callable[[Any], int], options: RunOptions, progress: Progress | None) -> None:
    held = _Held()
    overall = ctypes.c_double()
    cancel = options.get("cancel")

    @_abi.progress_fn  # type: ignore[untyped-decorator]
    def tick(_user: object, stage: int, _fraction: float) -> int:
        # Being here at all lets Python run its signal handlers: see `interrupted`.
        if progress is not None and held.exception is None:
            if held.call(progress, lib().atlasfit_stage_name(stage).decode(), overall.value) is False:
                return 0
        return held.exception is None

    log = options.get("log")

    @_abi.log_fn  # type: ignore[untyped-decorator]
    def told(_user: object, level: int, line: bytes) -> None:
        if log is not None and held.exception is None:
            held.call(log, _LEVELS.get(level, logging.DEBUG), line.decode())

    settings = _abi.atlasfit_run()
    check(lib().atlasfit_run_init(byref(settings), settings.struct_size))
    settings.overall = ctypes.addressof(overall)
    for name, ours in (
        ("seed", "seed"),
        ("threads", "threads"),
        ("time_limit_s", "time_limit"),
        ("memory_limit_bytes", "memory_limit"),
    ):
        if ours in options:
            setattr(settings, name, plain(options[ours]))  # type: ignore[literal-required]
    if log is not None:
        settings.log = told
    if cancel is not None:
        settings.cancel = cancel._handle.pointer

    # The handler that is set for Ctrl-C runs as ever, but what it raises (KeyboardInterrupt) is held until
    # the library has returned.
    handler = (
        signal.getsignal(signal.SIGINT) if threading.current_thread() is threading.main_thread() else None
    )
    deferred = callable(handler)

    def interrupted(number: int, frame: FrameType | None) -> None:
        held.call(handler, number, frame)  # type: ignore[arg-type]

    # What the log raises ends the run through it, too.
    if deferred or progress is not None or log is not None:
        settings.progress = tick
    if deferred:
        signal.signal(signal.SIGINT, interrupted)
    try:
        status = call(byref(settings))
    finally:
        if deferred:
            signal.signal(signal.SIGINT, handler)
    if held.exception is not None:
        raise held.exception
    check(status)


def options_with(options: _abi.Sized, **values: Any) -> _abi.Sized:
    """An option struct with the library's defaults but for the values that are not None."""
    name = type(options).__name__
    check(getattr(lib(), f"{name}_init")(byref(options), options.struct_size))
    for key, value in values.items():
        if value is not None:
            setattr(options, key, plain(value))
    return options


def plain(value: Any) -> Any:
    """NumPy's numbers as Python's: ctypes takes no others."""
    return value.item() if isinstance(value, np.generic) else value


def values(kind: Any, struct: Any) -> dict[str, Any]:
    """The dataclass's fields that the struct has, booleans as such."""
    of = {f.name: getattr(struct, f.name) for f in fields(kind) if hasattr(struct, f.name)}
    return of | {f.name: bool(of[f.name]) for f in fields(kind) if f.type == "bool"}


def choice(value: str | None, names: dict[str, int], what: str) -> int | None:
    """The number of a named choice; None stays None."""
    if value is not None and value not in names:
        raise ValueError(f"{what} is {value!r}. Give one of {', '.join(names)}")
    return None if value is None else names[value]


def size_of_page(size: int | tuple[int, int] | None) -> tuple[int | None, int | None]:
    """Width and height, of one side or both."""
    if size is None or isinstance(size, (int, np.integer)):
        return size, size
    width, height = size
    return width, height
