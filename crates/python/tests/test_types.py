"""The stubs say what is there, and the package is typed."""

from __future__ import annotations

import importlib.util
import pathlib
import subprocess
import sys

import halflight
import pytest

PACKAGE = pathlib.Path(halflight.__file__).parent
CONFIG = pathlib.Path(__file__).resolve().parents[1] / "pyproject.toml"

needs_mypy = pytest.mark.skipif(importlib.util.find_spec("mypy") is None, reason="mypy is not installed")


def run(*arguments: str, cwd: pathlib.Path) -> None:
    said = subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, cwd=cwd)
    assert said.returncode == 0, said.stdout + said.stderr


@needs_mypy
def test_the_package_and_the_examples_are_typed_strictly(tmp_path: pathlib.Path) -> None:
    assert (PACKAGE / "py.typed").exists()
    examples = sorted(str(path) for path in (CONFIG.parent / "examples").glob("*.py"))
    run("mypy", "--strict", "--config-file", str(CONFIG), "-p", "halflight", cwd=tmp_path)
    run("mypy", "--strict", "--config-file", str(CONFIG), *examples, cwd=tmp_path)


@needs_mypy
def test_the_stub_of_the_native_half_is_true(tmp_path: pathlib.Path) -> None:
    run("mypy.stubtest", "halflight._native", "--mypy-config-file", str(CONFIG), cwd=tmp_path)
