#!/usr/bin/env python3
"""FLIP as its authors' package computes it, for the pairs of crates/image/tests/metrics_flip.rs.

    python3 -m venv /tmp/flip && /tmp/flip/bin/pip install flip-evaluator==1.7 numpy
    /tmp/flip/bin/python tools/peers/flip.py [SHARED]

prints one line per pair: name, mean LDR-FLIP, mean HDR-FLIP, and the exposures the package chose for the latter.
SHARED is the folder of shared data (default: ../shared beside the repository); without it only the pairs that are
made of nothing are printed. Pictures are multiplied by 2^EV, clamped and encoded as sRGB for LDR-FLIP.
"""

import pathlib
import sys

import flip_evaluator
import numpy as np


def hashed(height, width, channels=3):
    """A value in [0, 1) for each pixel and channel, from 32-bit integer arithmetic only."""
    h = np.arange(height * width * channels, dtype=np.uint32).reshape(height, width, channels)
    h = h * np.uint32(747796405) + np.uint32(2891336453)
    h = (h ^ (h >> np.uint32(16))) * np.uint32(2246822519)
    h = (h ^ (h >> np.uint32(13))) * np.uint32(3266489917)
    return (h ^ (h >> np.uint32(16))).astype(np.float64) / 2.0**32


def noisy(picture):
    """Each value times something between a half and one and a half."""
    return (picture * (0.5 + hashed(*picture.shape))).astype(np.float32)


def rings(height, width):
    """Coloured rings from black to forty times white."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    r = np.hypot(x - 0.4 * width, y - 0.6 * height)
    bands = np.stack([0.5 + 0.5 * np.sin(r * f) for f in (0.21, 0.34, 0.55)], axis=-1)
    return (bands**3 * (40.0 * np.exp(-r / 12.0) + 0.3)[..., None]).astype(np.float32)


def bars(height, width):
    """Grey bars, eight pixels wide, that get brighter to the right."""
    x = np.arange(width)
    row = np.where(x // 8 % 2 == 0, 0.1, 0.2 + x / width)
    return np.broadcast_to(row[None, :, None], (height, width, 3)).astype(np.float32)


def pairs(shared):
    """Name, exposure, picture under test, reference."""
    reference = rings(61, 97)
    yield "rings_noisy", -1.0, noisy(reference), reference
    reference = bars(40, 120)
    yield "bars_shifted", 0.0, np.roll(reference, 1, axis=1), reference
    if not shared.is_dir():
        return

    def load(path):
        return np.ascontiguousarray(flip_evaluator.load(str(shared / path))[..., :3])

    cornell = "data/scenes/cornell-box/"
    yield "cornell", 0.0, load(cornell + "TungstenRender.exr"), load(cornell + "mitsuba/scene_v3.exr")
    bunny = load("reference/bunny_diffuse.direct.exr")
    yield "bunny_depth", 0.0, load("reference/bunny_diffuse.path8.exr"), bunny
    yield "bunny_material", 1.0, load("reference/bunny_merlfile.direct.exr"), bunny
    crop = load("reference/hf25_coneman.direct.exr")[170:370, 330:630].copy()
    yield "coneman_crop_noisy", 0.5, noisy(crop), crop
    row = load("reference/dof_row.direct.exr")
    yield "dof_shifted", 0.0, np.roll(row, 1, axis=1), row
    bidir = load("data/scenes/veach-bidir/TungstenRender.exr")
    yield "bidir_darker", 2.0, (bidir * np.float32(0.9)), bidir


def srgb(linear, exposure):
    v = np.clip(linear.astype(np.float64) * 2.0**exposure, 0.0, 1.0)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055).astype(np.float32)


def main():
    here = pathlib.Path(__file__).resolve()
    shared = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else here.parents[2].parent / "shared"
    for name, exposure, test, reference in pairs(shared):
        _, ldr, _ = flip_evaluator.evaluate(srgb(reference, exposure), srgb(test, exposure), "LDR", True, False)
        _, hdr, p = flip_evaluator.evaluate(reference, test, "HDR", False, False)
        start, stop, count = p["startExposure"], p["stopExposure"], p["numExposures"]
        print(f"{name:20} EV {exposure:4.1f}  LDR {ldr:.6f}  HDR {hdr:.6f}  {start:.4f} .. {stop:.4f} in {count}")


if __name__ == "__main__":
    main()
