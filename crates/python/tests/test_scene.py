"""Scenes of Python objects."""

from __future__ import annotations

import pathlib

import halflight as hl
import numpy as np
import pytest


def test_a_scene_of_objects_is_the_scene_of_its_file(tmp_path: pathlib.Path) -> None:
    scene = hl.Scene(
        image={"size": (40, 30)},
        camera={"origin": np.array([0, 1, 5]), "target": [0, 0.5, 0], "vertical_fov_degrees": 40},
        environment="sky",
        shapes=[
            {"type": "sphere", "center": (0, 0.5, 0), "radius": np.float32(0.5)},
            {"type": "plane", "material": {"type": "diffuse", "albedo": [0.5, 0.4, 0.3]}},
        ],
        technique={"path": {"max_depth": 2}},
    )
    assert scene.text is not None
    path = tmp_path / "same.toml"
    path.write_text(scene.text)
    one, two = hl.render(scene, samples=2), hl.render(hl.load(path), samples=2)
    assert one.rgb.tobytes() == two.rgb.tobytes() and one.rgb.max() > 0
    assert scene.hash == hl.load(path).hash


def test_meshes_and_maps_come_from_arrays(octahedron: hl.Mesh, tmp_path: pathlib.Path) -> None:
    sky = np.ones((8, 16, 3), np.float32) * [0.2, 0.5, 1.0]
    shape = {"type": "mesh", "file": octahedron, "material": {"type": "diffuse", "albedo": 0.8}}
    scene = hl.Scene(
        image={"size": [32, 32]},
        camera={"origin": [0, 0, 4], "target": [0, 0, 0]},
        environment={"type": "image", "file": sky},
        shapes=[shape],
    )
    picture = hl.render(scene, samples=4, layers=["alpha"])
    assert 0.02 < picture["A"].mean() < 0.6
    np.testing.assert_allclose(picture.rgb[0, 0], [0.2, 0.5, 1.0], rtol=1e-4)
    octahedron.save(tmp_path / "mesh.ply")
    again = hl.Mesh.load(tmp_path / "mesh.ply")
    assert (again.vertices == octahedron.vertices).all() and (again.faces == octahedron.faces).all()
    same = hl.Scene(
        folder=tmp_path,
        image={"size": [32, 32]},
        camera={"origin": [0, 0, 4], "target": [0, 0, 0]},
        environment={"type": "image", "file": sky},
        shapes=[{**shape, "file": "mesh.ply"}],
    )
    assert hl.render(same, samples=4).rgb.tobytes() == picture.rgb.tobytes()


def test_a_scene_may_take_another_light(octahedron: hl.Mesh, tmp_path: pathlib.Path) -> None:
    octahedron.save(tmp_path / "mesh.ply")
    red = np.zeros((8, 16, 3), np.float32)
    red[..., 0] = 1
    picture = hl.render(hl.load(tmp_path / "mesh.ply", environment=red, size=(16, 16)), samples=1, size=(16, 16))
    assert picture.rgb[..., 0].max() > 0.5 and picture.rgb[..., 1].max() < 1e-3


def test_what_is_wrong_with_a_scene_is_said_with_its_place() -> None:
    with pytest.raises(hl.Error, match="radus"):
        hl.Scene(shapes=[{"type": "sphere", "radus": 1}])
    with pytest.raises(TypeError, match=r"shape\[0\].center: object cannot be part of a scene"):
        hl.Scene(shapes=[{"type": "sphere", "center": object()}])
    with pytest.raises(hl.Error):
        hl.Scene(shapes=[{"type": "sphere", "radius": float("nan")}])


def test_wrong_meshes_are_refused() -> None:
    points = np.zeros((3, 3))
    with pytest.raises(ValueError, match=r"vertices: expected an array of shape \(n, 3\), found \(3, 2\)"):
        hl.Mesh(np.zeros((3, 2)), [[0, 1, 2]])
    with pytest.raises(TypeError, match="faces: expected whole numbers, found float64"):
        hl.Mesh(points, [[0.5, 1, 2]])
    with pytest.raises(ValueError, match="faces: a number is not between 0"):
        hl.Mesh(points, [[-1, 1, 2]])
    with pytest.raises(hl.Error, match="7"):
        hl.Mesh(points, [[0, 1, 7]])
    with pytest.raises(ValueError, match="vertices: a number is not finite"):
        hl.Mesh(np.full((3, 3), np.nan), [[0, 1, 2]])
    with pytest.raises(TypeError, match="vertices: expected an array of numbers, found <U1"):
        hl.Mesh([["a", "b", "c"]], [[0, 1, 2]])
    with pytest.raises(TypeError, match="vertices"):
        hl.Mesh([[1, 2], [3]], [[0, 1, 2]])
    with pytest.raises(ValueError, match=r"uvs: expected an array of shape \(3, 2\)"):
        hl.Mesh(points, [[0, 1, 2]], uvs=np.zeros((4, 2)))
