"""How far apart two pictures are."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Floats, floats
from ._mesh import PathLike
from ._picture import Picture, load_picture


@dataclass(frozen=True)
class Comparison:
    """Figures, smaller is nearer but for ``psnr``, and maps of rows × columns."""

    relmse: float
    mse: float
    psnr: float
    flip: float
    hdr_flip: float
    max_error: float
    max_error_at: tuple[int, int]
    mean: list[float]
    reference_mean: list[float]
    left_out: int
    maps: dict[str, Floats] = field(repr=False)


PictureLike = Union[Picture, npt.ArrayLike, PathLike]


def _rgb(name: str, value: PictureLike) -> Floats:
    if isinstance(value, (str, os.PathLike)):
        value = load_picture(value)
    if isinstance(value, Picture):
        value = np.ascontiguousarray(value.rgb)
    return floats(name, value, (None, None, 3), finite=False)


def compare(picture: PictureLike, reference: PictureLike, *, exposure: float = 0.0) -> Comparison:
    """Measure a picture against a reference: pictures, arrays of rows × columns × 3, or files.

    ``exposure`` in stops counts for ``psnr`` and ``flip``, which judge what a screen shows.
    """
    figures, maps = _native.compare(_rgb("picture", picture), _rgb("reference", reference), exposure)
    return Comparison(maps=maps, **figures)
