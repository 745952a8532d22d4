"""Geometry as learned fields of directed distances."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, NamedTuple, Optional

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Floats, floats
from ._mesh import MeshLike, PathLike, as_mesh

__all__ = ["Field", "Step", "Training", "load", "train"]


class Step(NamedTuple):
    """How a step of a training went."""

    step: int
    visibility_loss: float
    wrong: float
    distance_loss: float
    seconds: float


class Field:
    """A learned field: how far a ray goes before it meets the surface."""

    def __init__(self, native: _native.Field) -> None:
        self._native = native

    @property
    def parameters(self) -> int:
        """How many numbers were learned."""
        return self._native.parameters

    @property
    def memory_bytes(self) -> int:
        """Memory that it takes."""
        return self._native.memory_bytes

    @property
    def steps(self) -> int:
        """Steps of its training."""
        return self._native.steps

    @property
    def bounds(self) -> tuple[list[float], list[float]]:
        """Corners of its box."""
        low, high = self._native.bounds
        return list(low), list(high)

    def query(self, origins: npt.ArrayLike, directions: npt.ArrayLike) -> tuple[Floats, Floats]:
        """Distances (n,) along rays, infinite where nothing is met, and unit normals (n, 3), zero there."""
        starts = floats("origins", origins, (None, 3))
        towards = floats("directions", directions, (len(starts), 3))
        nowhere = ~towards.any(axis=1)
        if nowhere.any():
            raise ValueError(f"directions: row {int(np.argmax(nowhere))} has no direction, it is zero")
        return self._native.query(starts, towards)

    def is_visible(self, origins: npt.ArrayLike, directions: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether rays meet the surface: (n,)."""
        return np.isfinite(self.query(origins, directions)[0])

    def evaluate(self, mesh: MeshLike, points: int = 30_000) -> dict[str, Any]:
        """How far it is from its mesh: Chamfer distance × 10³ (``floor_e3`` is that of two clouds of the mesh), rays."""
        if points < 100:
            raise ValueError(f"points: expected 100 or more, found {points}")
        return self._native.evaluate(as_mesh(mesh)._native, points)

    def save(self, path: PathLike) -> None:
        """Write a .ddf file."""
        self._native.save(os.fspath(path))

    def __repr__(self) -> str:
        return f"Field({self.parameters} parameters, {self.steps} steps)"


class Training(NamedTuple):
    """A trained field, and how it got there."""

    field: Field
    history: list[Step]


def load(path: PathLike) -> Field:
    """Read a .ddf file."""
    return Field(_native.Field.load(os.fspath(path)))


def train(
    mesh: MeshLike,
    *,
    steps: Optional[int] = None,
    seconds: Optional[float] = None,
    resolution: Optional[int] = None,
    seed: int = 1,
    checkpoint: Optional[PathLike] = None,
    resume: bool = False,
    threads: Optional[int] = None,
    progress: Optional[Callable[[str, int, int], Optional[bool]]] = None,
) -> Training:
    """Learn a mesh, for so many steps or seconds.

    With ``steps`` the field depends on nothing but mesh, resolution and seed. ``checkpoint`` names a file that the training is
    kept in; with ``resume`` it goes on from there. Ctrl-C raises :class:`halflight.Interrupted`, whose ``result`` is the training
    so far.
    """
    for name, limit in (("steps", steps), ("seconds", seconds), ("threads", threads)):
        if limit is not None and not limit > 0:
            raise _native.UsageError(f"{name}: expected a number greater than 0, found {limit}")
    try:
        field, history = _native.ddf_train(
            as_mesh(mesh)._native,
            steps=steps,
            seconds=seconds,
            resolution=resolution,
            seed=seed,
            checkpoint=None if checkpoint is None else os.fspath(checkpoint),
            resume=resume,
            threads=threads,
            progress=progress,
        )
    except _native.Interrupted as stopped:
        if stopped.result is not None:
            field, history = stopped.result
            stopped.result = Training(Field(field), [Step(*step) for step in history])
        raise
    return Training(Field(field), [Step(*step) for step in history])
