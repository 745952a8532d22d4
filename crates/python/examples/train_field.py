"""Train a field of directed distances on a mesh, and plot its error against the steps."""

from __future__ import annotations

import argparse
import pathlib

import halflight as hl
import numpy as np
from halflight import ddf
from plotting import plot


def torus(around: int = 48, across: int = 24) -> hl.Mesh:
    """A ring of triangles."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * u / around, 2 * np.pi * v / across
    ring = 1.0 + 0.4 * np.cos(b)
    points = np.stack([ring * np.cos(a), 0.4 * np.sin(b), ring * np.sin(a)], axis=-1).reshape(-1, 3)

    def index(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        return np.asarray((i % around) * across + j % across)

    corners = [index(u, v), index(u, v + 1), index(u + 1, v + 1), index(u + 1, v)]
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    return hl.Mesh(points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def main() -> None:
    """Train in pieces, each going on from the last, and measure after each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", type=pathlib.Path, help="a .ply, .obj or .glb instead of the ring")
    parser.add_argument("--output", type=pathlib.Path, default=pathlib.Path("."))
    parser.add_argument("--steps", type=int, default=600)
    parser.add_argument("--every", type=int, default=100)
    parser.add_argument("--resolution", type=int, default=48)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    mesh = hl.Mesh.load(arguments.mesh) if arguments.mesh else torus()

    checkpoint = arguments.output / "training.checkpoint"
    checkpoint.unlink(missing_ok=True)
    steps = range(arguments.every, arguments.steps + 1, arguments.every)
    chamfer, wrong = [], []
    print("step   chamfer×10³  wrong")
    for step in steps:
        trained = ddf.train(mesh, steps=step, resolution=arguments.resolution, checkpoint=checkpoint, resume=step > steps[0])
        found = trained.field.evaluate(mesh, 10_000)
        chamfer.append(found["chamfer_e3"])
        wrong.append(1.0 - found["from_outside"]["visibility"])
        print(f"{step:<6} {chamfer[-1]:<12.4f} {wrong[-1]:.4f}")
        trained.field.save(arguments.output / "field.ddf")
    plot(
        arguments.output / "error-by-step.png",
        list(steps),
        {"Chamfer distance × 10³": chamfer, "share of rays wrong": wrong},
        across="steps",
        up="error",
    )


if __name__ == "__main__":
    main()
