"""Relight a scene through harmonics of rising order, and plot how far that is from the light itself.

A picture is linear in its light: rendered once under each harmonic (both signs apart, for light is never negative), it is
relit by any map with a handful of sums. What is lost is the light above the order.
"""

from __future__ import annotations

import argparse
import pathlib

import halflight as hl
import numpy as np
from halflight import sh
from plotting import plot

ORDERS = range(1, 7)
ROWS = 32


def directions() -> np.ndarray:
    """Directions of the texels of a latitude–longitude map."""
    theta = np.pi * (np.arange(ROWS) + 0.5) / ROWS
    phi = 2 * np.pi * ((np.arange(2 * ROWS) + 0.5) / (2 * ROWS) - 0.5)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    return np.stack([np.sin(p) * np.sin(t), np.cos(t), -np.cos(p) * np.sin(t)], axis=-1)


def evening() -> np.ndarray:
    """Light from one side, with a wide warm lamp low in the sky."""
    d = directions()
    lamp = np.exp(8.0 * (d @ np.array([0.8, 0.45, 0.4]) / 1.0 - 1.0))
    sky = 0.25 + 0.25 * d[..., 1]
    return np.asarray(lamp[..., None] * [3.0, 2.0, 1.0] + sky[..., None] * [0.4, 0.6, 1.0], np.float32)


def scene(light: np.ndarray, size: tuple[int, int]) -> hl.Scene:
    """Balls on a plane under a map."""
    return hl.Scene(
        image={"size": size},
        camera={"origin": [0, 1.6, 5], "target": [0, 0.5, 0], "vertical_fov_degrees": 35},
        environment={"type": "image", "file": light},
        shapes=[
            {"type": "sphere", "center": [x, 0.5, 0], "radius": 0.5, "material": {"type": "diffuse", "albedo": c}}
            for x, c in ((-1.1, [0.7, 0.3, 0.2]), (0.0, [0.5, 0.5, 0.5]), (1.1, [0.2, 0.4, 0.7]))
        ]
        + [{"type": "plane", "material": {"type": "diffuse", "albedo": 0.5}}],
    )


def main() -> None:
    """Print and plot the error of each order."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=pathlib.Path, default=pathlib.Path("."))
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--samples", type=int, default=32)
    arguments = parser.parse_args()
    columns, rows = (int(side) for side in arguments.size.split("x"))
    arguments.output.mkdir(parents=True, exist_ok=True)

    light = evening()
    coefficients = sh.project(light, max(ORDERS))
    basis = sh.basis(directions(), max(ORDERS))

    def rendered(of: np.ndarray) -> np.ndarray:
        grey = np.repeat(of[..., None], 3, axis=-1).astype(np.float32)
        picture = hl.render(scene(grey, (columns, rows)), samples=arguments.samples, settings={"max_depth": 2})
        return picture.rgb.astype(np.float64)

    def channel(c: int) -> np.ndarray:
        return rendered(light[..., c])[..., c]

    truth = np.stack([channel(c) for c in range(3)], axis=-1)
    transfer = [rendered(np.maximum(basis[..., i], 0)) - rendered(np.maximum(-basis[..., i], 0)) for i in range(max(ORDERS) ** 2)]
    print("order  relmse")
    errors = []
    for order in ORDERS:
        relit = sum(transfer[i] * coefficients[:, i] for i in range(order * order))
        picture = np.maximum(relit, 0).astype(np.float32)
        errors.append(hl.compare(picture, truth.astype(np.float32)).relmse)
        print(f"{order:<6} {errors[-1]:.5f}")
        hl.Picture.from_array(picture).save(arguments.output / f"relit-{order}.png")
    plot(
        arguments.output / "error-by-order.png",
        list(ORDERS),
        {"relit by harmonics": errors},
        across="order",
        up="relative squared error",
    )


if __name__ == "__main__":
    main()
