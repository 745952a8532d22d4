"""Scenes and the command that the tests share."""

from __future__ import annotations

import os
import pathlib
import shutil

import halflight as hl
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[3]

SCENE = """
[image]
size = [48, 27]
[camera]
origin = [0, 1.2, 5]
target = [0, 0.5, 0]
vertical_fov_degrees = 35
[environment]
type = "sky"
[[shape]]
type = "sphere"
radius = 0.5
material = { type = "diffuse", albedo = [0.7, 0.3, 0.2] }
keyframes = [{ time = 0, translate = [-1, 0.5, 0] }, { time = 4, translate = [1, 0.5, 0] }]
[[shape]]
type = "plane"
material = { type = "diffuse", albedo = 0.5 }
"""


@pytest.fixture
def scene_file(tmp_path: pathlib.Path) -> pathlib.Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def scene(scene_file: pathlib.Path) -> hl.Scene:
    return hl.load(scene_file)


@pytest.fixture
def command() -> str:
    """The command of the same version, or the test is skipped."""
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    built = os.environ.get("HALFLIGHT_COMMAND") or target / "debug" / "halflight"
    found = shutil.which(str(built))
    if found is None:
        pytest.skip(f"there is no command {built} (cargo build, or set HALFLIGHT_COMMAND)")
    return found


@pytest.fixture
def octahedron() -> hl.Mesh:
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float32)
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return hl.Mesh(vertices, faces)
