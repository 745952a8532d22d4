"""Python objects as the text of a scene file."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_ASSETS = [".ply", ".obj", ".gltf", ".glb", ".hdr", ".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff"]
_ASSETS += [".binary", ".ddf", ".spheres", ".xz", ".safetensors", ".vol"]

Keeper = Callable[[object], "str | None"]
"""Turns an object that is not text into the name of a file, or into nothing."""


def key(name: str) -> str:
    """A key, in quotes where it has to be."""
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def string(text: str) -> str:
    """A basic string."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


def value(item: object, folder: str, keep: Keeper, place: str) -> str:
    """A value on one line. Relative names of assets start from ``folder``."""
    kept = keep(item)
    if kept is not None:
        return string(kept)
    if isinstance(item, (bool, np.bool_)):
        return "true" if item else "false"
    if isinstance(item, (int, np.integer)):
        return str(int(item))
    if isinstance(item, (float, np.floating)):
        number = float(item)
        if math.isfinite(number):
            return repr(number)
        return "nan" if math.isnan(number) else ("inf" if number > 0 else "-inf")
    if isinstance(item, os.PathLike):
        return string(os.path.abspath(os.path.join(folder, os.fspath(item))))
    if isinstance(item, str):
        is_asset = item.lower().endswith(tuple(_ASSETS)) and "\n" not in item
        return string(os.path.abspath(os.path.join(folder, item)) if is_asset else item)
    if isinstance(item, np.ndarray):
        return value(item.tolist(), folder, keep, place)
    if isinstance(item, Mapping):
        entries = (
            f"{key(str(name))} = {value(inner, folder, keep, f'{place}.{name}')}"
            for name, inner in item.items()
            if inner is not None
        )
        return "{ " + ", ".join(entries) + " }"
    if isinstance(item, Sequence) and not isinstance(item, (bytes, bytearray)):
        return "[" + ", ".join(value(x, folder, keep, f"{place}[{i}]") for i, x in enumerate(item)) + "]"
    raise TypeError(f"{place}: {type(item).__name__} cannot be part of a scene")


def document(table: Mapping[str, Any], folder: str, keep: Keeper) -> str:
    """A scene file: plain values first, then tables, then arrays of tables."""
    plain, tables = [], []
    for name, item in table.items():
        if item is None:
            continue
        many = isinstance(item, Sequence) and not isinstance(item, (str, bytes)) and item
        if isinstance(item, Mapping):
            tables.append(_table(f"[{key(name)}]", item, folder, keep, name))
        elif many and all(isinstance(entry, Mapping) for entry in item):
            for i, entry in enumerate(item):
                tables.append(_table(f"[[{key(name)}]]", entry, folder, keep, f"{name}[{i}]"))
        else:
            plain.append(f"{key(name)} = {value(item, folder, keep, name)}")
    return "\n".join(plain + tables) + "\n"


def _table(head: str, table: Mapping[str, Any], folder: str, keep: Keeper, place: str) -> str:
    lines = [
        f"{key(str(name))} = {value(item, folder, keep, f'{place}.{name}')}" for name, item in table.items() if item is not None
    ]
    return "\n".join(["", head, *lines])
