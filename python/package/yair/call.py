"""Calling the command: its failures as exceptions, its warnings as warnings, its progress where it is seen."""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from . import _yair

Progress = Callable[[str, int, int], object]
"""Is told what is counted, how many are done, and how many there will be."""


class Error(Exception):
    """A failure of the command, with its message: file, line, what is wrong and what to do.

    `exit_code` is the command's; `document` is the JSON that it prints beside the failure, where there is one.
    """

    def __init__(self, message: str, exit_code: int = 1, document: dict[str, Any] | None = None) -> None:
        super().__init__(message)
        self.exit_code = exit_code
        self.document = document


class YairWarning(UserWarning):
    """What the command warns of; its number stands all the same."""


INTERRUPTED = 130
"""Exit code of a command that was stopped."""


def call(
    arguments: Sequence[str | os.PathLike[str]],
    progress: Progress | None = None,
    accepted: tuple[int, ...] = (0,),
) -> tuple[str | None, list[str]]:
    """The document and the remarks of the command; a failure, or an exit code not `accepted`, raises `Error`."""
    shown = None if progress else _in_a_notebook()
    try:
        code, document, remarks, failure = _yair.call(
            ["yair", *(os.fspath(argument) for argument in arguments)], progress or (shown.show if shown else None)
        )
    finally:
        if shown:
            shown.clear()
    for remark in remarks:
        kind, _, text = remark.partition(": ")
        if kind in ("warning", "error"):
            warnings.warn(text, YairWarning, stacklevel=_depth_of_the_caller())
    if failure or code not in accepted:
        if code == INTERRUPTED:
            raise KeyboardInterrupt(remarks[-1] if remarks else "stopped")
        message = failure or (remarks[-1] if remarks else f"yair ended with exit code {code}")
        raise Error(_without_usage(message), code, json.loads(document) if document else None)
    return document, remarks


def _without_usage(message: str) -> str:
    """The reason alone of what the command line's grammar refuses."""
    return message.split("\n\n")[0].removeprefix("error: ").strip()


def _depth_of_the_caller() -> int:
    """Frames up to the first that is not of this package, so that a warning names the user's line."""
    depth, frame, here = 1, sys._getframe(1), os.path.dirname(__file__)
    while frame.f_back and os.path.dirname(frame.f_code.co_filename) == here:
        depth, frame = depth + 1, frame.f_back
    return depth


class _NotebookLine:
    """A line under the cell that counts, and goes when the work is done."""

    def __init__(self, display: Any) -> None:
        self._display, self._handle = display, None

    def show(self, what: str, done: int, total: int) -> None:
        line = {"text/plain": f"{what}: {done} of {total}"}
        if self._handle is None:
            self._handle = self._display(line, raw=True, display_id=True)
        else:
            self._handle.update(line, raw=True)

    def clear(self) -> None:
        if self._handle is not None:
            self._handle.update({"text/plain": ""}, raw=True)


def _in_a_notebook() -> _NotebookLine | None:
    """Where progress is shown, if this is the kernel of a notebook. Nothing is imported to find out."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython and hasattr(ipython, "get_ipython") else None
    if shell is None or not hasattr(shell, "kernel"):
        return None
    from IPython.display import display

    return _NotebookLine(display)
