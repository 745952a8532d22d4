"""Local frequency analysis: bandwidth vectors and covariance matrices, many at a time, and the bandwidth of pictures.

Frequencies are in cycles per metre, per radian, per texel or per pixel.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import _native
from ._arrays import Doubles, Floats, doubles, floats

__all__ = [
    "bandwidth",
    "covariance",
    "covariance_of_window",
    "eigenvalues",
    "lobe",
    "local_bandwidth",
    "phong_bandwidth",
    "picture_bandwidth",
    "pixel_bandwidth",
]

_BANDWIDTH = {"travel": 1, "incidence": 1, "exit": 1, "curvature": 1, "band_limit": 1, "reflect": 2, "magnitude": 0}
_COVARIANCE = {
    "travel": 1,
    "rotate": 1,
    "arrive": 1,
    "leave": 1,
    "curve": 4,
    "occlude": 1,
    "cosine": 1,
    "texture": 3,
    "reflect": 3,
    "thin_lens": 1,
    "into_motion": 4,
    "out_of_motion": 4,
}


def _parameters(operator: str, known: dict[str, int], values: tuple[npt.ArrayLike, ...], count: int) -> npt.NDArray[np.float64]:
    if operator not in known:
        raise ValueError(f"there is no operator {operator!r} (there are {', '.join(known)})")
    if len(values) != known[operator]:
        raise ValueError(f"{operator}: expected {known[operator]} numbers, found {len(values)}")
    columns = [np.broadcast_to(np.asarray(value, dtype=np.float64), (count,)) for value in values]
    if not all(np.isfinite(column).all() for column in columns):
        raise ValueError(f"{operator}: a number is not finite")
    return np.ascontiguousarray(np.stack(columns, axis=1)) if columns else np.zeros((count, 0))


def bandwidth(operator: str, vectors: npt.ArrayLike, *parameters: npt.ArrayLike) -> Floats:
    """Apply an operator to bandwidth vectors (n, 2), (ν_s, ν_a); its numbers are scalars or (n,).

    travel(distance), incidence(cos), exit(cos), curvature(1/m), band_limit(lobe), reflect(texture, lobe), magnitude().
    """
    table = floats("vectors", vectors, (None, 2))
    numbers = _parameters(operator, _BANDWIDTH, parameters, len(table)).astype(np.float32)
    return _native.frequency_bandwidth(operator, table, numbers)


def covariance(operator: str, matrices: npt.ArrayLike, *parameters: npt.ArrayLike) -> Doubles:
    """Apply an operator to covariance matrices (n, k, k) over (x, u), (x, u, t), (x, y, u, v) or (x, y, u, v, t).

    travel(distance), rotate(angle), arrive(cos), leave(cos), curve(xx, xy, yy, cos), occlude(radius), cosine(cos),
    texture(xx, xy, yy), reflect(uu, uv, vv), thin_lens(focal_length), into_motion and out_of_motion(vx, vy, wx, wy).
    """
    table = doubles("matrices", matrices, (None, None, None))
    if table.shape[1] != table.shape[2]:
        raise ValueError(f"matrices: expected an array of shape (n, k, k), found {table.shape}")
    return _native.frequency_covariance(operator, table, _parameters(operator, _COVARIANCE, parameters, len(table)))


def covariance_of_window(deviations: npt.ArrayLike) -> Doubles:
    """The covariance of the spectrum of Gaussian windows, (n, k) standard deviations: (n, k, k)."""
    table = doubles("deviations", deviations, (None, None))
    out = np.zeros((*table.shape, table.shape[1]))
    for axis in range(table.shape[1]):
        out[:, axis, axis] = 1.0 / (4.0 * np.pi**2 * table[:, axis] ** 2)
    return out


def eigenvalues(matrices: npt.ArrayLike) -> Doubles:
    """Eigenvalues of covariance matrices (n, k, k): (n, k)."""
    return _native.frequency_eigenvalues(doubles("matrices", matrices, (None, None, None)))


def phong_bandwidth(exponents: npt.ArrayLike) -> Floats:
    """Angular bandwidth of Phong lobes, cycles per radian: (n,)."""
    table = floats("exponents", exponents, (None,))
    if table.size and table.min() < 0:
        raise ValueError(f"exponents: expected numbers from 0 on, found {table.min():.6g}")
    return _native.frequency_phong(table.tolist())


def lobe(kind: str, value: float, cos: float = 1.0) -> tuple[float, float, float]:
    """The covariance (uu, uv, vv) in radians² of a lobe: ``"phong"`` by exponent, ``"microfacet"`` by α and the cosine."""
    uu, uv, vv = _native.frequency_lobe(kind, value, cos)
    return uu, uv, vv


def pixel_bandwidth(angular: npt.ArrayLike, pixel_angle: float) -> Floats:
    """Cycles per pixel of angular bandwidths (n,), for pixels of so many radians."""
    return _native.frequency_pixel(floats("angular", angular, (None,)).tolist(), pixel_angle)


def picture_bandwidth(values: npt.ArrayLike) -> float:
    """The bandwidth of a picture of one value a texel, cycles per texel: 95 % of its power lies below."""
    return _native.frequency_picture(floats("values", values, (None, None)))


def local_bandwidth(values: npt.ArrayLike) -> Floats:
    """The bandwidth around each texel, cycles per texel, from wavelets."""
    return _native.frequency_local(floats("values", values, (None, None)))
