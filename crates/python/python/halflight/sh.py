"""Real spherical harmonics: orthonormal, no Condon–Shortley phase, coefficient l² + l + m; order n has n² coefficients.

Functions of (..., n²) coefficients work on the last side, in double precision, many at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Union

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Doubles, coefficients, doubles, floats, rows, unit

__all__ = [
    "basis",
    "cap",
    "convert",
    "convolve",
    "evaluate",
    "exp",
    "irradiance",
    "kept_energy",
    "log",
    "log_cap",
    "product",
    "project",
    "quadrature",
    "rotate",
]


def _order(order: int) -> int:
    if isinstance(order, bool) or not isinstance(order, (int, np.integer)):
        raise TypeError(f"order: expected a whole number, found {type(order).__name__}")
    if not 1 <= order <= 8:
        raise ValueError(f"order: expected 1 to 8, found {order}")
    return int(order)


def _angles(half_angles: npt.ArrayLike) -> list[float]:
    angles = doubles("half_angles", half_angles, (None,))
    if angles.size and not (0 <= angles.min() and angles.max() <= np.pi):
        raise ValueError(f"half_angles: expected 0 to π radians, found {angles.min():.6g} to {angles.max():.6g}")
    return list(angles.tolist())


def basis(directions: npt.ArrayLike, order: int) -> Doubles:
    """Values of all harmonics along (..., 3) unit directions: (..., order²)."""
    table, shape = rows("directions", directions, 3)
    unit("directions", table)
    return _native.sh_basis(table, _order(order)).reshape(*shape, order * order)


def quadrature(nodes: int) -> tuple[Doubles, Doubles]:
    """Directions (n, 3) and weights (n,) whose sum is exact for functions of bands below 2 · nodes."""
    if not 1 <= nodes <= 512:
        raise ValueError(f"nodes: expected 1 to 512, found {nodes}")
    return _native.sh_quadrature(nodes)


def project(what: Union[npt.ArrayLike, Callable[[Doubles], npt.ArrayLike]], order: int, *, nodes: int = 32) -> Doubles:
    """Coefficients of a latitude–longitude picture (rows × columns × 3), (3, order²), or of a function, (order²,).

    The function is given (n, 3) directions and gives back n values; it is summed over ``quadrature(nodes)``.
    """
    if callable(what):
        directions, weights = quadrature(nodes)
        values = doubles("values of the function", what(directions), (len(weights),))
        return np.asarray(basis(directions, order).T @ (weights * values))
    return _native.sh_project_map(floats("picture", what, (None, None, 3)), _order(order))[0]


def kept_energy(picture: npt.ArrayLike, order: int) -> float:
    """The share of a latitude–longitude picture's energy that so many bands keep."""
    return _native.sh_project_map(floats("picture", picture, (None, None, 3)), _order(order))[1]


def evaluate(functions: npt.ArrayLike, directions: npt.ArrayLike) -> Doubles:
    """Values of (..., n²) functions along (k, 3) directions: (..., k)."""
    table, shape, order = coefficients("functions", functions)
    along = basis(doubles("directions", directions, (None, 3)), order)
    return np.asarray((table @ along.T).reshape(*shape, len(along)))


def product(a: npt.ArrayLike, b: npt.ArrayLike) -> Doubles:
    """Products of functions, cut to their order; (..., n²) each, broadcast."""
    left, right = np.broadcast_arrays(np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64))
    one, shape, order = coefficients("a", left)
    two, _, _ = coefficients("b", right)
    return _native.sh_product(one, two).reshape(*shape, order * order)


def rotate(functions: npt.ArrayLike, matrix: npt.ArrayLike) -> Doubles:
    """Functions turned by a rotation matrix (3, 3): what lay along d lies along matrix @ d."""
    table, shape, order = coefficients("functions", functions)
    turn = doubles("matrix", matrix, (3, 3))
    if not np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) or np.linalg.det(turn) < 0:
        raise ValueError("matrix: expected a rotation (rows of unit length at right angles, no mirror)")
    return _native.sh_rotate(table, turn).reshape(*shape, order * order)


def log(functions: npt.ArrayLike, floor: float = 1e-3) -> Doubles:
    """Logarithms by eigenvalues of the product matrix, raised to ``floor``."""
    if not floor > 0:
        raise ValueError(f"floor: expected a number greater than 0, found {floor}")
    table, shape, order = coefficients("functions", functions)
    return _native.sh_log(table, floor).reshape(*shape, order * order)


def exp(functions: npt.ArrayLike) -> Doubles:
    """Exponentials by eigenvalues of the product matrix; refuses functions whose exponential no number can hold."""
    table, shape, order = coefficients("functions", functions)
    with np.errstate(all="ignore"):
        out = _native.sh_exp(table)
    if not np.isfinite(out).all():
        found = np.abs(table).max()
        raise ValueError(f"functions: the exponential overflows (the largest coefficient is {found:.3g})")
    return out.reshape(*shape, order * order)


def convolve(functions: npt.ArrayLike, zonal: npt.ArrayLike) -> Doubles:
    """Functions convolved with a zonal function about +z, one number a band."""
    table, shape, order = coefficients("functions", functions)
    return _native.sh_convolve(table, doubles("zonal", zonal, (order,))).reshape(*shape, order * order)


def irradiance(functions: npt.ArrayLike) -> Doubles:
    """Irradiance as a function of the normal, of radiance."""
    table, shape, order = coefficients("functions", functions)
    return _native.sh_irradiance(table).reshape(*shape, order * order)


def convert(functions: npt.ArrayLike, to: str, *, source: str = "halflight") -> Doubles:
    """Coefficients in the form of another library: directxmath, threejs, e3nn, filament …"""
    table, shape, order = coefficients("functions", functions)
    return _native.sh_convert(table, source, to).reshape(*shape, order * order)


def cap(half_angles: npt.ArrayLike, order: int) -> Doubles:
    """Zonal coefficients of caps about +z, 1 within the half angle (radians) and 0 beyond: (n, order)."""
    return _native.sh_cap(_angles(half_angles), _order(order))


def log_cap(half_angles: npt.ArrayLike, order: int, floor: float = 1e-3) -> Doubles:
    """Zonal logarithms of the visibility beside spheres of those half angles: (n, order)."""
    if not (floor > 0 and np.isfinite(floor)):
        raise ValueError(f"floor: expected a number greater than 0, found {floor}")
    return _native.sh_log_cap(_angles(half_angles), floor, _order(order))
