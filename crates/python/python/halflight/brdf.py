"""Materials, analytic and measured, asked many directions at a time.

Directions are (n, 3), unit, in the local frame (+z is the normal), and point away from the surface.
"""

from __future__ import annotations

import os
from typing import Optional

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Floats, floats
from ._mesh import PathLike

__all__ = ["Material", "describe", "synthesize"]


class Material:
    """A material by its words (``"phong exponent=40"``, ``"copper"``) or a measured .binary file."""

    def __init__(self, spec: str) -> None:
        self.spec = spec
        self._native = _native.Material(spec)

    @property
    def albedo(self) -> tuple[float, float, float]:
        """The colour that it returns straight on."""
        red, green, blue = self._native.albedo
        return red, green, blue

    def _pair(self, wo: npt.ArrayLike, wi: npt.ArrayLike) -> tuple[Floats, Floats]:
        towards, light = floats("wo", wo, (None, 3)), floats("wi", wi, (None, 3))
        if len(towards) == 1 and len(light) > 1:
            towards = np.repeat(towards, len(light), axis=0)
        if len(towards) != len(light):
            raise ValueError(f"wi: expected an array of shape ({len(towards)}, 3), found ({len(light)}, 3)")
        return towards, light

    def eval(self, wo: npt.ArrayLike, wi: npt.ArrayLike) -> Floats:
        """The scattering function times the cosine of ``wi``: (n, 3)."""
        return self._native.eval_pdf(*self._pair(wo, wi))[0]

    def pdf(self, wo: npt.ArrayLike, wi: npt.ArrayLike) -> Floats:
        """The density with which :meth:`sample` chooses ``wi``, per solid angle: (n,)."""
        return self._native.eval_pdf(*self._pair(wo, wi))[1]

    def sample(self, wo: npt.ArrayLike, u: Optional[npt.ArrayLike] = None, *, seed: int = 0) -> tuple[Floats, Floats, Floats]:
        """Directions to light (n, 3), their weights (n, 3) and densities (n,), for (n, 3) numbers in [0, 1)."""
        towards = floats("wo", wo, (None, 3))
        if u is None:
            u = np.random.default_rng(seed).random((len(towards), 3), dtype=np.float32)
        numbers = floats("u", u, (len(towards), 3))
        if numbers.size and not (numbers.min() >= 0 and numbers.max() < 1):
            raise ValueError("u: expected numbers from 0 to below 1")
        return self._native.sample(towards, numbers)

    def __repr__(self) -> str:
        return f"Material({self.spec!r})"


def synthesize(spec: str, path: PathLike) -> None:
    """Write a material as a file of the MERL database's format."""
    Material(spec)._native.save(os.fspath(path))


def describe(path: PathLike) -> str:
    """What a measured material is like, in words."""
    return _native.describe_measured(os.fspath(path))
