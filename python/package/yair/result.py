"""Results: the command's JSON document, by attribute or by key."""

from __future__ import annotations

import html
import json
import os
import shutil
import weakref
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas

Rows = Callable[["Record"], "list[dict[str, Any]] | pandas.DataFrame"]
"""Makes the rows of a document."""


def _wrapped(value: Any) -> Any:
    if isinstance(value, dict):
        return Record(value)
    return [_wrapped(item) for item in value] if isinstance(value, list) else value


class Record(Mapping[str, Any]):
    """An object of the document: `found.methods[0].parameters["wheel_separation_m"].value`."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = values

    def __getitem__(self, key: str) -> Any:
        return _wrapped(self._values[key])

    def __getattr__(self, name: str) -> Any:
        values = self.__dict__.get("_values", {})
        if name in values:
            return _wrapped(values[name])
        raise AttributeError(f"{name}: there are {', '.join(values)}")

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._values]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({json.dumps(self._values, indent=1, ensure_ascii=False)})"

    def to_dict(self) -> dict[str, Any]:
        """The object as dictionaries and lists."""
        return dict(self._values)


PAGE_HEIGHT_PX = 720
"""Height of a report in a notebook: its first screen."""


class Result(Record):
    """A whole document, with the files that were written beside it."""

    def __init__(
        self,
        text: str,
        remarks: list[str],
        rows: Rows,
        folder: Path | None = None,
        file: Path | None = None,
        temporary: bool = False,
    ) -> None:
        super().__init__(json.loads(text))
        self._rows = rows
        if temporary and folder is not None:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self.json = text
        """The document, byte by byte as the command prints it."""
        self.remarks = remarks
        """What the command says besides, warnings included."""
        self.folder = folder
        """Where its files are; a temporary folder, gone with this result, where no other was given."""
        self.file = file
        """The calibration file or extended model, which `calibration=` takes."""

    def to_pandas(self) -> pandas.DataFrame:
        """The rows of the document as a table."""
        import pandas

        return pandas.DataFrame(self._rows(self))

    @property
    def report(self) -> Path | None:
        """The report page, where there is one."""
        page = self.folder / "report.html" if self.folder else None
        return page if page and page.is_file() else None

    def _repr_html_(self) -> str:
        page = self.report
        if page is None:
            try:
                return str(self.to_pandas().to_html(notebook=True))
            except ImportError:
                return f"<pre>{html.escape(repr(self))}</pre>"
        # Its own document, so that neither its style nor the notebook's reaches the other.
        text = html.escape(page.read_text(encoding="utf-8"), quote=True)
        return (
            f'<iframe title="yair" sandbox="allow-scripts" srcdoc="{text}" '
            f'style="width: 100%; height: {PAGE_HEIGHT_PX}px; border: 0"></iframe>'
        )


def calibration_file(given: str | os.PathLike[str] | Result) -> Path:
    """The file that a calibration stands in."""
    if not isinstance(given, Result):
        return Path(given)
    if given.file is None:
        why = given.get("extended_model_why_null") or "it was neither calibrated nor diagnosed"
        raise ValueError(f"this result holds no calibration: {why}")
    return given.file
