"""Arrays as the native half takes them, or an error that says what was expected and what was found."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]


def _said(shape: tuple[int | None, ...]) -> str:
    names = iter("nmk")
    sides = [str(side) if side is not None else next(names) for side in shape]
    return f"({', '.join(sides)}{',' if len(sides) == 1 else ''})"


def _numbers(name: str, value: npt.ArrayLike, kind: Any) -> npt.NDArray[Any]:
    try:
        array = np.asarray(value)
    except (ValueError, TypeError) as error:
        # NumPy may quote the whole of what it was given.
        reason = str(error).splitlines()[0][:120]
        raise TypeError(f"{name}: expected an array of numbers ({reason})") from None
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name}: expected an array of numbers, found {array.dtype}")
    if np.issubdtype(kind, np.integer):
        if array.dtype.kind == "f":
            raise TypeError(f"{name}: expected whole numbers, found {array.dtype}")
        limits = np.iinfo(kind)
        if array.size and (int(array.min()) < limits.min or int(array.max()) > limits.max):
            raise ValueError(f"{name}: a number is not between {limits.min} and {limits.max}")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, dtype=kind)


def _shaped(name: str, array: npt.NDArray[Any], shape: tuple[int | None, ...]) -> None:
    fits = array.ndim == len(shape) and all(want is None or want == have for want, have in zip(shape, array.shape))
    if not fits:
        raise ValueError(f"{name}: expected an array of shape {_said(shape)}, found {_said(array.shape)}")


def _finite(name: str, array: npt.NDArray[Any]) -> None:
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: a number is not finite")


def floats(name: str, value: npt.ArrayLike, shape: tuple[int | None, ...], *, finite: bool = True) -> Floats:
    """A contiguous array of that shape in single precision; ``None`` stands for any length."""
    array = _numbers(name, value, np.float32)
    _shaped(name, array, shape)
    if finite:
        _finite(name, array)
    return array


def doubles(name: str, value: npt.ArrayLike, shape: tuple[int | None, ...]) -> Doubles:
    """A contiguous array of that shape in double precision."""
    array = _numbers(name, value, np.float64)
    _shaped(name, array, shape)
    _finite(name, array)
    return array


def unit(name: str, table: npt.NDArray[Any]) -> None:
    """Refuses rows of three numbers whose length is not 1."""
    lengths = np.linalg.norm(table, axis=-1)
    off = np.abs(lengths - 1.0) > 1e-4
    if off.any():
        row = int(np.argmax(off))
        raise ValueError(f"{name}: expected directions of length 1, found {lengths[row]:.6g} in row {row}")


def whole_numbers(name: str, value: npt.ArrayLike, shape: tuple[int | None, ...]) -> npt.NDArray[np.uint32]:
    """A contiguous array of that shape of whole numbers from 0."""
    array = _numbers(name, value, np.uint32)
    _shaped(name, array, shape)
    return array


def rows(name: str, value: npt.ArrayLike, width: int | None = None) -> tuple[Doubles, tuple[int, ...]]:
    """Any number of rows, (..., width), as a table, with the shape before the last side."""
    array = _numbers(name, value, np.float64)
    if array.ndim == 0 or (width is not None and array.shape[-1] != width):
        raise ValueError(f"{name}: expected an array of shape (..., {width or 'n'}), found {_said(array.shape)}")
    _finite(name, array)
    count = int(np.prod(array.shape[:-1]))
    return array.reshape(count, array.shape[-1]), array.shape[:-1]


def coefficients(name: str, value: npt.ArrayLike) -> tuple[Doubles, tuple[int, ...], int]:
    """Rows of order² coefficients, with the shape before them and the order."""
    table, shape = rows(name, value)
    order = round(table.shape[1] ** 0.5)
    if not 1 <= order <= 8 or order * order != table.shape[1]:
        raise ValueError(f"{name}: expected 1, 4, 9, 16, 25, 36, 49 or 64 coefficients in the last side, found {table.shape[1]}")
    return table, shape, order
