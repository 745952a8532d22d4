"""Pictures with layers."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Floats
from ._mesh import PathLike

Groups = list[tuple[str, list[str], npt.NDArray[np.float32]]]


class Picture:
    """Radiance and layers, as arrays that share the memory of the renderer; row 0 is on top.

    ``picture.rgb`` is rows × columns × 3; ``picture["normal"]`` a layer, ``picture["normal.X"]`` a view of one of its channels.
    An unfinished picture says so with ``picture.interrupted``.
    """

    def __init__(
        self,
        groups: Groups,
        metadata: Mapping[str, str],
        facts: Optional[Mapping[str, Any]] = None,
        *,
        exposure: Optional[float] = 0.0,
        tone: str = "srgb",
        tile: Optional[tuple[tuple[int, int], tuple[int, int], Optional[int]]] = None,
    ) -> None:
        self._groups = {layer: (tuple(names), array) for layer, names, array in groups}
        self.metadata: dict[str, str] = dict(metadata)
        self.facts: dict[str, Any] = dict(facts or {})
        self.exposure = exposure
        self.tone = tone
        self._tile = tile

    @classmethod
    def from_array(cls, rgb: npt.ArrayLike) -> Picture:
        """A picture of an array of rows × columns × 3."""
        from ._arrays import floats

        return cls([("rgb", ["R", "G", "B"], floats("rgb", rgb, (None, None, 3), finite=False))], {})

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of the layers; ``rgb`` is the radiance."""
        return tuple(self._groups)

    @property
    def channels(self) -> dict[str, Floats]:
        """All channels by the name they have in an EXR, as views."""
        return {
            name: array if array.ndim == 2 else array[..., i]
            for names, array in self._groups.values()
            for i, name in enumerate(names)
        }

    @property
    def rgb(self) -> Floats:
        """Linear Rec. 709 radiance, rows × columns × 3."""
        return self["rgb"]

    @property
    def width(self) -> int:
        """Columns."""
        return int(next(iter(self._groups.values()))[1].shape[1])

    @property
    def height(self) -> int:
        """Rows."""
        return int(next(iter(self._groups.values()))[1].shape[0])

    @property
    def interrupted(self) -> bool:
        """Whether it was stopped before it was done."""
        return bool(self.facts.get("interrupted", "interrupted" in self.metadata))

    @property
    def samples(self) -> float:
        """Samples a pixel, on the average; 0 where nobody knows."""
        return float(self.facts.get("samples", self.metadata.get("samples", 0.0)))

    @property
    def notes(self) -> list[str]:
        """Approximations in force."""
        return list(self.facts.get("notes", []))

    def __getitem__(self, name: str) -> Floats:
        if name in self._groups:
            return self._groups[name][1]
        channels = self.channels
        if name in channels:
            return channels[name]
        raise KeyError(f"there is no layer {name!r} (there are {', '.join(self._groups)})")

    def __contains__(self, name: object) -> bool:
        return name in self._groups or name in self.channels

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> npt.NDArray[Any]:
        array = self.rgb if dtype is None else self.rgb.astype(dtype, copy=False)
        return array.copy() if copy else array

    def save(
        self,
        path: PathLike,
        *,
        exposure: Optional[float] = None,
        tone: Optional[str] = None,
        half: bool = False,
    ) -> None:
        """Write .exr (all layers), .hdr or .png, whole or not at all; a tile as an .exr that knows its place.

        Radiance that is not finite is refused.
        """
        wrong = ~np.isfinite(self.rgb).all(axis=-1) if "rgb" in self else np.zeros((1, 1), dtype=bool)
        if wrong.any():
            row, column = (int(i) for i in np.argwhere(wrong)[0])
            count = int(wrong.sum())
            raise _native.Error(
                f"cannot write {os.fspath(path)}: the radiance of {count} pixel{'' if count == 1 else 's'} is not finite, "
                f"first in row {row}, column {column}"
            )
        chosen = self.exposure if exposure is None else exposure
        channels = [(name, np.ascontiguousarray(array)) for name, array in self.channels.items()]
        metadata = {"command": "halflight.render", **self.metadata}
        if self._tile is None:
            _native.save_picture(os.fspath(path), channels, metadata, chosen, tone or self.tone, half)
            return
        if not os.fspath(path).lower().endswith(".exr"):
            raise _native.UsageError(f"cannot write a tile to {os.fspath(path)}: tiles are .exr")
        share, whole, samples = self._tile
        _native.save_tile(os.fspath(path), channels, metadata, share, whole, samples, chosen, tone or self.tone, half)

    def to_png(self, *, exposure: Optional[float] = None, tone: Optional[str] = None) -> bytes:
        """What a screen shows, as the bytes of a PNG."""
        chosen = self.exposure if exposure is None else exposure
        rgb = np.ascontiguousarray(self.rgb)
        if chosen is None:
            chosen = _native.exposure_of(rgb)
        return _native.png(rgb, chosen, tone or self.tone)

    def _repr_png_(self) -> bytes:
        return self.to_png()

    def __repr__(self) -> str:
        state = ", interrupted" if self.interrupted else ""
        return f"Picture({self.width}×{self.height}, {', '.join(self.layers)}{state})"


def load_picture(path: PathLike) -> Picture:
    """Read an .exr with its layers, or the colour of any other picture."""
    name = os.fspath(path)
    if name.lower().endswith((".exr", ".exr.xz")):
        return Picture(*_native.load_picture(name))
    return Picture([("rgb", ["R", "G", "B"], _native.load_image(name))], {})


def merge(
    tiles: Iterable[PathLike],
    output: PathLike,
    *,
    exposure: Optional[float] = None,
    tone: Optional[str] = None,
) -> None:
    """Join the tiles of one picture, bit for bit, and write it; refuses tiles that do not belong together."""
    _native.merge([os.fspath(tile) for tile in tiles], os.fspath(output), exposure, tone)
