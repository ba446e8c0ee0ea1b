"""The notebooks run, each in a map of its own, and are checked in without outputs."""

from __future__ import annotations

import html.parser
import pathlib

import pytest
from conftest import PATIENCE_S, PYTHON, Daemon, needed

FOLDER = PYTHON / "notebooks"


@pytest.mark.parametrize("name", sorted(path.name for path in FOLDER.glob("*.ipynb")))
def test_a_notebook_runs(name: str, own_daemon: Daemon, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    needed("ipykernel")
    nbclient = needed("nbclient")
    nbformat = needed("nbformat")
    notebook = nbformat.read(FOLDER / name, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code), "clear the outputs"
    monkeypatch.setenv("RELMAP_SERVER", own_daemon.server)
    monkeypatch.setenv("REPORT", str(tmp_path / "report.html"))
    nbclient.NotebookClient(
        notebook, timeout=int(PATIENCE_S), kernel_name="python3", resources={"metadata": {"path": str(FOLDER)}}
    ).execute()
    shown = [output.get("data", {}) for cell in code for output in cell.outputs]
    if name != "judge_closures.ipynb":
        assert any("image/svg+xml" in data for data in shown)
    else:
        assert any("inliers" in str(data.get("text/html")) for data in shown)
    if name == "report_of_a_day.ipynb":
        text = (tmp_path / "report.html").read_text()
        html.parser.HTMLParser().feed(text)
        assert "morning" in text and "evening" in text and "<svg" in text
