"""The example scripts run, and find what they are to show."""

from __future__ import annotations

import pathlib
import subprocess
import sys

import halflight as hl

EXAMPLES = pathlib.Path(__file__).resolve().parents[1] / "examples"


def run(name: str, folder: pathlib.Path, *arguments: str) -> str:
    said = subprocess.run(
        [sys.executable, str(EXAMPLES / name), "--output", str(folder), *arguments],
        capture_output=True,
        text=True,
    )
    assert said.returncode == 0, said.stdout + said.stderr
    return said.stdout


def test_a_scene_is_relit_and_the_error_falls_with_the_order(tmp_path: pathlib.Path) -> None:
    said = run("relight.py", tmp_path, "--size", "96x54", "--samples", "8")
    rows = [line.split() for line in said.splitlines() if line[:1].isdigit()]
    errors = {int(row[0]): float(row[1]) for row in rows}
    assert list(errors) == [1, 2, 3, 4, 5, 6]
    assert errors[6] < errors[3] < errors[1]
    plot = hl.load_picture(tmp_path / "error-by-order.png")
    assert plot.width >= 320 and plot.rgb.std() > 0.05
    assert hl.load_picture(tmp_path / "relit-3.png").rgb.max() > 0.1


def test_a_field_is_trained_and_its_error_falls(tmp_path: pathlib.Path) -> None:
    said = run("train_field.py", tmp_path, "--steps", "60", "--resolution", "24", "--every", "20")
    rows = [line.split() for line in said.splitlines() if line[:1].isdigit()]
    assert [int(row[0]) for row in rows] == [20, 40, 60]
    assert float(rows[-1][1]) < float(rows[0][1])
    assert (tmp_path / "field.ddf").exists()
    assert hl.load_picture(tmp_path / "error-by-step.png").rgb.std() > 0.05
