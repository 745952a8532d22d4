"""Triangle meshes."""

from __future__ import annotations

import os
from typing import Optional, Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Floats, floats, whole_numbers

PathLike = Union[str, "os.PathLike[str]"]


class Mesh:
    """A mesh of triangles, from arrays or from a file.

    ``vertices`` are (n, 3), ``faces`` (m, 3) indices, counter-clockwise seen from the front; ``normals`` and ``colors`` (n, 3)
    and ``uvs`` (n, 2) are optional.
    """

    def __init__(
        self,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        normals: Optional[npt.ArrayLike] = None,
        uvs: Optional[npt.ArrayLike] = None,
        colors: Optional[npt.ArrayLike] = None,
    ) -> None:
        points = floats("vertices", vertices, (None, 3))
        count = len(points)
        self._native = _native.Mesh(
            points,
            whole_numbers("faces", faces, (None, 3)),
            None if normals is None else floats("normals", normals, (count, 3)),
            None if uvs is None else floats("uvs", uvs, (count, 2)),
            None if colors is None else floats("colors", colors, (count, 3)),
        )

    @classmethod
    def load(cls, path: PathLike) -> Mesh:
        """Read a .ply, .obj, .gltf or .glb: all parts where they stand, repaired as far as they can be."""
        mesh = cls.__new__(cls)
        mesh._native = _native.Mesh.load(os.fspath(path))
        return mesh

    @property
    def vertices(self) -> Floats:
        """Positions, (n, 3)."""
        return self._native.vertices

    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """Indices, (m, 3)."""
        return self._native.faces

    @property
    def warnings(self) -> list[str]:
        """What the loader mended."""
        return self._native.warnings

    def save(self, path: PathLike) -> None:
        """Write a binary PLY."""
        self._native.save(os.fspath(path))

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces)"


MeshLike = Union[Mesh, PathLike]


def as_mesh(value: MeshLike) -> Mesh:
    """A mesh, or that of a file."""
    return value if isinstance(value, Mesh) else Mesh.load(value)
