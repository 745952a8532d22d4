"""Harmonics, spheres, materials, fields and frequencies, many at a time."""

from __future__ import annotations

import pathlib
import subprocess

import halflight as hl
import numpy as np
import pytest
from halflight import brdf, ddf, frequency, sh, spheres


def directions(count: int) -> np.ndarray:
    found = np.random.default_rng(1).normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def test_harmonics_are_orthonormal() -> None:
    along, weights = sh.quadrature(8)
    basis = sh.basis(along, 6)
    np.testing.assert_allclose(basis.T @ (weights[:, None] * basis), np.eye(36), atol=1e-12)
    f = sh.project(lambda d: 1 + d[:, 2], 3)
    np.testing.assert_allclose(sh.evaluate(f, directions(50)), 1 + directions(50)[:, 2], atol=1e-12)
    assert sh.basis(directions(6).reshape(2, 3, 3), 4).shape == (2, 3, 16)


def test_products_rotations_logarithms_and_exponentials_hold_for_batches() -> None:
    random = np.random.default_rng(2)
    f = random.normal(size=(5, 7, 9)) * 0.1
    f[..., 0] += 3
    g = sh.product(f, f)
    assert g.shape == f.shape
    np.testing.assert_allclose(g[2, 3], sh.product(f[2, 3], f[2, 3]))
    constant = np.zeros((3, 9))
    constant[:, 0] = [1, 2, 3]
    np.testing.assert_allclose(sh.exp(sh.log(constant)), constant, atol=1e-12)
    # Small variations are only cut to the order once more.
    np.testing.assert_allclose(sh.exp(sh.log(f)), f, atol=0.1)
    angle = 0.7
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    d = directions(20)
    np.testing.assert_allclose(sh.evaluate(sh.rotate(f, turn), d @ turn.T), sh.evaluate(f, d), atol=1e-12)
    two = sh.project(lambda d: d[:, 0] + 2, 2)
    np.testing.assert_allclose(sh.convolve(two, [1, 1]).shape, (4,))
    np.testing.assert_allclose(sh.irradiance(two)[0], np.pi * two[0])


def test_projection_is_that_of_the_command(command: str, tmp_path: pathlib.Path) -> None:
    picture = np.random.default_rng(3).random((8, 16, 3), dtype=np.float32)
    hl.Picture.from_array(picture).save(tmp_path / "map.exr")
    line = f"sh project {tmp_path}/map.exr --order 3 -o {tmp_path}/light.json -q"
    subprocess.run([command, *line.split()], check=True)
    import json

    theirs = np.array(json.loads((tmp_path / "light.json").read_text())["coefficients"]).T
    np.testing.assert_allclose(sh.project(picture, 3), theirs, rtol=1e-6)
    assert 0 < sh.kept_energy(picture, 3) <= 1


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: sh.basis([1, 2], 3), r"directions: expected an array of shape \(\.\.\., 3\)"),
        (lambda: sh.basis([0, 0, 1], 9), "order: expected 1 to 8, found 9"),
        (lambda: sh.product(np.zeros(5), np.zeros(5)), "a: expected 1, 4, 9"),
        (lambda: sh.product(np.zeros(9), np.zeros(4)), "broadcast"),
        (lambda: sh.rotate(np.zeros(9), 2 * np.eye(3)), "expected a rotation"),
        (lambda: sh.rotate(np.zeros(9), np.eye(4)), r"matrix: expected an array of shape \(3, 3\)"),
        (lambda: sh.log(np.zeros(9), floor=0), "floor"),
        (lambda: sh.project(np.zeros((4, 8)), 3), r"picture: expected an array of shape \(n, m, 3\)"),
        (lambda: spheres.SphereSet([[0, 0, 0]]), r"spheres: expected an array of shape \(n, 4\)"),
        (lambda: spheres.SphereSet([[0, 0, 0, -1]]), "radii greater than 0"),
        (lambda: frequency.bandwidth("fly", [[1, 2]]), "there is no operator 'fly'"),
        (lambda: frequency.bandwidth("travel", [[1, 2]]), "travel: expected 1 numbers, found 0"),
        (lambda: frequency.covariance("travel", np.zeros((1, 6, 6)), 1), "2 to 5 dimensions"),
        (lambda: brdf.Material("phnog"), "phnog"),
        (lambda: brdf.Material("diffuse").eval([[0, 0]], [[0, 0, 1]]), r"wo: expected an array of shape"),
        (lambda: sh.exp(np.full(9, np.inf)), "functions: a number is not finite"),
        (lambda: frequency.bandwidth("travel", [[1, 2]], np.nan), "travel: a number is not finite"),
        (lambda: brdf.Material("diffuse").sample([[0, 0, 1]], [[2, 0, 0]]), "u: expected numbers from 0"),
        (lambda: spheres.log_visibility(spheres.SphereSet([[0, 0, 2, 1]]), [[np.nan, 0, 0]]), "points: a number"),
        (lambda: ddf.train(hl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), seconds=np.nan), "seconds: expected"),
        (lambda: sh.convert(np.zeros(9), "nobody"), "there is no convention"),
    ],
)
def test_wrong_shapes_and_values_are_refused(call: object, text: str) -> None:
    with pytest.raises((ValueError, hl.Error), match=text):
        call()  # type: ignore[operator]


@pytest.mark.parametrize("wrong", [np.zeros(9, complex), np.array(["x"] * 9), [None] * 9, np.zeros(9, object)])
def test_wrong_types_are_refused(wrong: object) -> None:
    with pytest.raises(TypeError, match="functions: expected an array of numbers"):
        sh.exp(wrong)  # type: ignore[arg-type]


def test_spheres_are_fitted_kept_and_asked(octahedron: hl.Mesh, tmp_path: pathlib.Path) -> None:
    fitted = spheres.fit(octahedron, 6)
    assert len(fitted) == 6 and fitted.measure(octahedron)["uncovered"] < 0.01
    fitted.save(tmp_path / "o.spheres")
    again = spheres.load(tmp_path / "o.spheres")
    assert (again.centers == fitted.centers).all() and (again.radii == fitted.radii).all()
    ball = spheres.SphereSet([[0, 0, 5, 1]])
    logs = spheres.log_visibility(ball, [[0, 0, 0], [0, 0, 3]], 4)
    assert logs.shape == (2, 16)
    expected = sh.log_cap([np.arcsin(1 / 5)], 4)[0]
    np.testing.assert_allclose(logs[0][[0, 2, 6, 12]], expected, rtol=0.05)
    # The nearer, the less is left.
    left = sh.exp(logs)[:, 0]
    assert left[1] < left[0] < np.sqrt(4 * np.pi)


def test_materials_answer_many_directions() -> None:
    clay = brdf.Material("diffuse albedo=0.5")
    up = np.array([[0, 0, 1.0]])
    d = np.abs(directions(200))
    np.testing.assert_allclose(clay.eval(up, d), 0.5 / np.pi * d[:, 2:].repeat(3, axis=1), rtol=1e-4)
    np.testing.assert_allclose(clay.pdf(up, d), d[:, 2] / np.pi, rtol=1e-4)
    shiny = brdf.Material("phong exponent=40")
    wo = np.repeat(up, 1000, axis=0)
    wi, weights, densities = shiny.sample(wo, seed=4)
    np.testing.assert_allclose(weights * densities[:, None], shiny.eval(wo, wi), rtol=1e-3, atol=1e-6)


def test_a_material_is_measured_by_calculation(tmp_path: pathlib.Path) -> None:
    brdf.synthesize("conductor roughness=0.4", tmp_path / "metal.binary")
    assert "albedo" in brdf.describe(tmp_path / "metal.binary")
    with pytest.raises(hl.Error, match="nowhere"):
        brdf.describe(tmp_path / "nowhere.binary")


def test_a_field_is_trained_resumed_and_asked(octahedron: hl.Mesh, tmp_path: pathlib.Path) -> None:
    told: list[int] = []
    field, history = ddf.train(octahedron, steps=30, resolution=16, progress=lambda what, done, total: told.append(done))
    assert [step.step for step in history] == list(range(1, 31)) and history[-1].wrong < history[0].wrong
    origins = np.array([[0, 0, 3], [0, 3, 3], [3, 3, 3]], np.float32)
    distances, normals = field.query(origins, [[0, 0, -1], [0, 0, -1], [0, 1, 0]])
    assert abs(distances[0] - 2) < 0.3 and np.isinf(distances[1:]).all() and normals.shape == (3, 3)
    field.save(tmp_path / "o.ddf")
    again = ddf.load(tmp_path / "o.ddf")
    assert (again.query(origins, [[0, 0, -1]] * 3)[0] == distances).all()
    assert again.evaluate(octahedron, 1000)["from_outside"]["visibility"] > 0.6
    # Interrupted after twenty steps and gone on with, it ends with the same bytes.
    checkpoint = tmp_path / "training"
    half = ddf.train(octahedron, steps=30, resolution=16, checkpoint=checkpoint, progress=lambda what, done, total: False)
    assert half.field.steps < 30
    ddf.train(octahedron, steps=30, resolution=16, checkpoint=checkpoint, resume=True).field.save(tmp_path / "r.ddf")
    assert (tmp_path / "r.ddf").read_bytes() == (tmp_path / "o.ddf").read_bytes()
    with pytest.raises(hl.UsageError, match="steps or seconds"):
        ddf.train(octahedron)
    with pytest.raises(ValueError, match=r"directions: expected an array of shape \(3, 3\)"):
        field.query(origins, [[0, 0, 1]])


def test_operators_act_on_batches() -> None:
    nu = np.array([[1, 2], [3, 4]], np.float32)
    np.testing.assert_allclose(frequency.bandwidth("travel", nu, [10, 1]), [[1, -8], [3, 1]])
    np.testing.assert_allclose(frequency.bandwidth("curvature", nu, 2), [[5, 2], [11, 4]])
    window = frequency.covariance_of_window([[0.1, 0.2, 0.3, 0.4]] * 3)
    back = frequency.covariance("travel", frequency.covariance("travel", window, 2.0), -2.0)
    np.testing.assert_allclose(back, window, atol=1e-12)
    blurred = frequency.covariance("reflect", window, *frequency.lobe("phong", 50))
    assert (frequency.eigenvalues(blurred) <= frequency.eigenvalues(window) + 1e-12).all()
    assert frequency.phong_bandwidth([10, 1000]).tolist() == sorted(frequency.phong_bandwidth([10, 1000]))
    assert frequency.pixel_bandwidth([100], 0.001)[0] == pytest.approx(0.1, rel=0.5)


def test_fine_stripes_have_a_higher_bandwidth_than_coarse_ones() -> None:
    x = np.arange(64)
    coarse, fine = (np.tile(1 + np.sin(2 * np.pi * x / period), (64, 1)) for period in (32, 4))
    assert 0 < frequency.picture_bandwidth(coarse) < frequency.picture_bandwidth(fine) <= 0.5
    local = frequency.local_bandwidth(np.concatenate([coarse, fine], axis=1))
    assert local.shape == (64, 128) and local[:, 100].mean() > 2 * local[:, 30].mean()
