"""Rendering."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Optional, Union

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
    if not fps > 0:
        raise _native.UsageError(f"fps: expected a number greater than 0, found {fps}")
    for name, limit in (("samples", samples), ("seconds", seconds), ("error", error), ("threads", threads)):
        if limit is not None and not limit > 0:
            raise _native.UsageError(f"{name}: expected a number greater than 0, found {limit}")
    if samples is not None and samples > 1 << 24:
        raise _native.UsageError(f"samples: expected at most {1 << 24}, found {samples}")
    if not 0 <= seed < 1 << 64:
        raise _native.UsageError(f"seed: expected 0 to {(1 << 64) - 1}, found {seed}")
    for name, instant_given in (("frame", frame), ("time", time), ("fps", fps)):
        if instant_given is not None and not math.isfinite(instant_given):
            raise _native.UsageError(f"{name}: expected a number, found {instant_given}")
    number = frame if frame is not None else (time * fps if time is not None else 0.0)
    instant = time if time is not None else number / fps
    stage = as_scene(scene)
    names = layers if isinstance(layers, str) else ",".join(layers)
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
    return _native.tile_region(tile, size)
