"""A plot of a few lines: by matplotlib where it is installed, else drawn here."""

from __future__ import annotations

import pathlib
from collections.abc import Mapping, Sequence

import halflight as hl
import numpy as np

SIZE = (480, 640)
MARGIN = 50


def plot(path: pathlib.Path, x: Sequence[float], lines: Mapping[str, Sequence[float]], *, across: str, up: str) -> None:
    """Write a plot with a logarithmic axis upwards."""
    try:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot
    except ImportError:
        hl.Picture.from_array(drawn(x, lines)).save(path)
        return
    figure, axes = pyplot.subplots(figsize=(6.4, 4.8))
    for name, values in lines.items():
        axes.semilogy(x, values, marker="o", label=name)
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=100)
    pyplot.close(figure)


def drawn(x: Sequence[float], lines: Mapping[str, Sequence[float]]) -> np.ndarray:
    """Lines on white with axes, as a picture."""
    rows, columns = SIZE
    page = np.ones((rows, columns, 3), np.float32)
    page[rows - MARGIN, MARGIN:-20] = page[20 : rows - MARGIN, MARGIN] = 0.0
    logs = {name: np.log10(np.maximum(values, 1e-12)) for name, values in lines.items()}
    every = np.concatenate(list(logs.values()))
    low, high = every.min() - 0.1, every.max() + 0.1
    left, right = min(x), max(x)
    for color, values in zip(np.array([[0.8, 0.1, 0.0], [0.0, 0.2, 0.7], [0.0, 0.5, 0.1]]), logs.values()):
        across = MARGIN + (np.asarray(x) - left) / max(right - left, 1e-9) * (columns - MARGIN - 40)
        down = 20 + (high - values) / (high - low) * (rows - MARGIN - 40)
        t = np.linspace(0, len(x) - 1, 4 * columns)
        line_x, line_y = np.interp(t, np.arange(len(x)), across), np.interp(t, np.arange(len(x)), down)
        for dy in range(2):
            page[np.round(line_y).astype(int) + dy, np.round(line_x).astype(int)] = color
        for px, py in zip(np.round(across).astype(int), np.round(down).astype(int)):
            page[py - 3 : py + 4, px - 3 : px + 4] = color
    return page
