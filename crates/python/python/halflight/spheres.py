"""Sets of spheres that stand for meshes where soft shadows are computed."""

from __future__ import annotations

import os

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Doubles, Floats, floats
from ._mesh import MeshLike, PathLike, as_mesh

__all__ = ["SphereSet", "fit", "load", "log_visibility"]


class SphereSet:
    """Spheres: (n, 4) rows of centre and radius, or what :func:`fit` and :func:`load` give."""

    def __init__(self, spheres: npt.ArrayLike) -> None:
        self._native = _native.Spheres(floats("spheres", spheres, (None, 4)))

    @classmethod
    def _of(cls, native: _native.Spheres) -> SphereSet:
        spheres = cls.__new__(cls)
        spheres._native = native
        return spheres

    @property
    def centers(self) -> Floats:
        """Centres, (n, 3)."""
        return self._native.centers

    @property
    def radii(self) -> Floats:
        """Radii, (n,)."""
        return self._native.radii

    @property
    def warnings(self) -> list[str]:
        """What the fit has to say."""
        return self._native.warnings

    def measure(self, mesh: MeshLike) -> dict[str, float]:
        """Volume outside of a mesh, surface left uncovered, agreement of silhouettes."""
        return self._native.measure(as_mesh(mesh)._native)

    def save(self, path: PathLike) -> None:
        """Write a .spheres file."""
        self._native.save(os.fspath(path))

    def __len__(self) -> int:
        return len(self.radii)

    def __repr__(self) -> str:
        return f"SphereSet({len(self)} spheres)"


def fit(mesh: MeshLike, count: int = 25, *, balanced: bool = False) -> SphereSet:
    """Fit so many spheres to a mesh, an object or a file; ``balanced`` ones have its shadow on the average."""
    if count < 1:
        raise ValueError(f"count: expected a number greater than 0, found {count}")
    return SphereSet._of(_native.Spheres.fit(as_mesh(mesh)._native, count, balanced))


def load(path: PathLike) -> SphereSet:
    """Read a .spheres file."""
    return SphereSet._of(_native.Spheres.load(os.fspath(path)))


def log_visibility(spheres: SphereSet, points: npt.ArrayLike, order: int = 4) -> Doubles:
    """The logarithm of what spheres leave of the sky at (..., 3) points: (..., order²); ``sh.exp`` makes visibility of it."""
    if not 1 <= order <= 8:
        raise ValueError(f"order: expected 1 to 8, found {order}")
    places = np.asarray(points)
    shape = places.shape[:-1] if places.ndim > 1 else ()
    table = floats("points", places.reshape(-1, places.shape[-1]) if places.ndim else places, (None, 3))
    return _native.spheres_log_visibility(spheres._native, table, order).reshape(*shape, order * order)
