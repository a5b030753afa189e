"""The types say what the package is."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import errsep
from errsep import _errsep


def test_the_stub_of_the_compiled_module_is_true() -> None:
    """mypy's stubtest compares names, signatures and properties of the stub with the module."""
    words = [sys.executable, "-m", "mypy.stubtest", "errsep._errsep"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_is_typed_throughout() -> None:
    package = Path(errsep.__file__).parent
    assert (package / "py.typed").exists()
    config = Path(__file__).parent / "mypy.ini"
    words = [sys.executable, "-m", "mypy", "--config-file", str(config), "-p", "errsep"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_public_name_has_words() -> None:
    for name in errsep.__all__:
        thing = getattr(errsep, name)
        assert name == "__version__" or inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for key, member in vars(thing).items():
                if not key.startswith("_") and (callable(member) or isinstance(member, property)):
                    assert inspect.getdoc(member), f"{name}.{key}"
    public = {name for name in vars(_errsep) if not name.startswith("_")}
    assert public == {"Answered", "Shared", "call", "least_squares", "main", "table_as_csv", "work"}
