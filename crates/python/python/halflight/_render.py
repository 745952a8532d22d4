"""Rendering."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Optional, Union

import numpy as np

from . import _native
from ._picture import Picture
from ._scene import SceneLike, as_scene, setting

Progress = Callable[[str, int, int], Optional[bool]]


def techniques() -> dict[str, dict[str, str]]:
    """The techniques, each with its settings and what they do."""
    return {name: dict(settings) for name, settings in _native.techniques()}


def render(
    scene: SceneLike,
    technique: str = "path",
    *,
    settings: Optional[Mapping[str, Any]] = None,
    size: Optional[tuple[int, int]] = None,
    samples: Optional[int] = None,
    seconds: Optional[float] = None,
    error: Optional[float] = None,
    seed: int = 0,
    layers: Union[str, Iterable[str]] = (),
    frame: Optional[float] = None,
    time: Optional[float] = None,
    fps: float = 24.0,
    tile: Optional[tuple[int, int]] = None,
    threads: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> Picture:
    """Render one instant of a scene: the bits of ``halflight render`` with the same options.

    ``size`` is columns and rows. The work ends at the first of ``samples`` a pixel, ``seconds`` and estimated relative ``error``.
    ``layers`` are names (``depth``, ``normal`` …) or ``"all"``. The instant is a ``frame`` (at ``fps``) or a ``time`` in seconds.
    ``tile=(2, 8)`` renders the second of eight parts. ``progress(what, done, total)`` is called now and then; when it gives
    back ``False``, the picture so far is returned. Ctrl-C raises :class:`Interrupted`, whose ``result`` is the picture so far.
    """
    if frame is not None and time is not None:
        raise _native.UsageError("a picture has one instant: say frame or time, not both")
    for name, given in (("frame", frame), ("time", time), ("fps", fps)):
        if given is not None and not math.isfinite(_number(name, given)):
            raise _native.UsageError(f"{name}: expected a number, found {given}")
    if not fps > 0:
        raise _native.UsageError(f"fps: expected a number greater than 0, found {fps}")
    for name, limit in (("seconds", seconds), ("error", error)):
        if limit is not None and not _number(name, limit) > 0:
            raise _native.UsageError(f"{name}: expected a number greater than 0, found {limit}")
    for name, count, most in (("samples", samples, 1 << 24), ("threads", threads, 1024)):
        if count is not None and not 1 <= _whole(name, count) <= most:
            raise _native.UsageError(f"{name}: expected 1 to {most}, found {count}")
    if not 0 <= _whole("seed", seed) < 1 << 64:
        raise _native.UsageError(f"seed: expected 0 to {(1 << 64) - 1}, found {seed}")
    if size is not None:
        size = pair("size", size, "columns and rows, as in (640, 360)")
    if tile is not None:
        tile = pair("tile", tile, "a number and how many there are, as in (2, 8)")
        if not 1 <= tile[0] <= tile[1]:
            raise _native.UsageError(f"tile: expected (1, {tile[1]}) to ({tile[1]}, {tile[1]}), found {tile}")
    if progress is not None and not callable(progress):
        raise TypeError(f"progress: expected a function of (what, done, total), found {type(progress).__name__}")
    number = frame if frame is not None else (time * fps if time is not None else 0.0)
    instant = time if time is not None else number / fps
    stage = as_scene(scene)
    names = _names(layers)
    try:
        shown = _native.render(
            stage._native,
            technique,
            [f"{name}={setting(name, item)}" for name, item in (settings or {}).items()],
            size=size,
            samples=samples,
            seconds=seconds,
            error=error,
            seed=seed,
            layers=names or "none",
            frame=float(number),
            time=float(instant),
            tile=tile,
            threads=threads,
            progress=progress,
        )
    except _native.Interrupted as stopped:
        if stopped.result is not None:
            stopped.result = _picture(stopped.result, stage, size, tile, samples)
        raise
    return _picture(shown, stage, size, tile, samples)


def _number(name: str, value: Any) -> float:
    """A number, or an error that names the argument."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise TypeError(f"{name}: expected a number, found {type(value).__name__}")
    return float(value)


def _whole(name: str, value: Any) -> int:
    """A whole number, or an error that names the argument."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name}: expected a whole number, found {type(value).__name__}")
    return int(value)


def pair(name: str, value: Any, what: str) -> tuple[int, int]:
    """Two whole numbers from 1 on, or an error that names the argument."""
    if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
        raise TypeError(f"{name}: expected {what}, found {type(value).__name__}")
    sides = [_whole(name, side) for side in value]
    if len(sides) != 2:
        raise _native.UsageError(f"{name}: expected {what}, found {len(sides)} number{'' if len(sides) == 1 else 's'}")
    if not all(1 <= side < 1 << 32 for side in sides):
        raise _native.UsageError(f"{name}: expected {what}, found ({sides[0]}, {sides[1]})")
    return sides[0], sides[1]


def _names(layers: Any) -> str:
    """Names of layers as the native half takes them."""
    if isinstance(layers, str):
        return layers
    if not isinstance(layers, Iterable):
        raise TypeError(f"layers: expected names, found {type(layers).__name__}")
    names = list(layers)
    for name in names:
        if not isinstance(name, str):
            raise TypeError(f"layers: expected names, found {type(name).__name__}")
    return ",".join(names)


def _picture(
    shown: Any,
    scene: Any,
    size: Optional[tuple[int, int]],
    tile: Optional[tuple[int, int]],
    samples: Optional[int],
) -> Picture:
    groups, metadata, facts = shown
    exposure, tone = scene._native.showing
    place = None if tile is None else (tuple(tile), tuple(size or scene.size), samples)
    return Picture(groups, metadata, facts, exposure=exposure, tone=tone, tile=place)  # type: ignore[arg-type]


def frames(scene: SceneLike, first: int, last: int, technique: str = "path", **options: Any) -> Iterator[tuple[int, Picture]]:
    """Render all frames from ``first`` to ``last``; what the technique prepares is shared."""
    stage = as_scene(scene)
    for number in range(first, last + 1):
        yield number, render(stage, technique, frame=number, **options)


def tile_size(tile: tuple[int, int], size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Left column, top row, columns and rows of a tile of a picture of that size."""
    part = pair("tile", tile, "a number and how many there are, as in (2, 8)")
    return _native.tile_region(part, pair("size", size, "columns and rows, as in (640, 360)"))
