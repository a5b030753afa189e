"""The notebook runs from top to bottom, its own assertions among it."""

from __future__ import annotations

from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[1] / "notebooks/reversal.ipynb"


def test_the_notebook_runs() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    done = NotebookClient(notebook, timeout=600, kernel_name="python3").execute()
    shown = [output for cell in done.cells for output in cell.get("outputs", [])]
    pages = [output["data"]["text/html"] for output in shown if "text/html" in output.get("data", {})]
    assert sum("data:image/svg+xml" in page for page in pages) == 3
    assert sum("image/png" in output.get("data", {}) for output in shown) == 2
    told = "".join(output.get("text", "") for output in shown if output["output_type"] == "stream")
    assert "zero-jump" in told and not [o for o in shown if o.get("name") == "stderr"]
