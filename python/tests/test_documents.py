"""The documents in Python: docs/python.md prints what it shows, and the notebooks run."""

import doctest
import re

import nbclient
import nbformat
import pytest
from conftest import ROOT

EXAMPLES = ROOT / "python" / "examples"


def test_the_document_prints_what_it_shows(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    document = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    # A fence is no output, but its end.
    text = re.sub(r"^```.*$", "", document, flags=re.MULTILINE)
    test = doctest.DocTestParser().get_doctest(text, {}, "docs/python.md", "docs/python.md", 0)
    told = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    outcome = runner.run(test, out=told.append)
    assert outcome.failed == 0, "".join(told)
    assert outcome.attempted >= 12


def test_notebooks_are_there():
    assert sorted(path.name for path in EXAMPLES.glob("*.ipynb")) == ["diagnose_a_robot.ipynb"]


@pytest.mark.filterwarnings("default")  # of the kernel's own packages
@pytest.mark.parametrize("notebook", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda path: path.name)
def test_notebooks_run(notebook):
    book = nbformat.read(notebook, as_version=4)
    nbformat.validate(book)
    kept = [cell for cell in book.cells if cell.cell_type == "code" and (cell.outputs or cell.execution_count)]
    assert not kept, "clear the outputs before you commit"
    client = nbclient.NotebookClient(book, timeout=120, resources={"metadata": {"path": str(notebook.parent)}})
    client.execute()
    shown = [output for cell in book.cells if cell.cell_type == "code" for output in cell.outputs]
    pages = [output.data["text/html"] for output in shown if "text/html" in output.get("data", {})]
    assert any("<iframe" in page and "yair diagnose" in page for page in pages)
