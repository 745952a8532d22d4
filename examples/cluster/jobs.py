"""Pieces of work that any machine can do, and that come out the same on each: tiles of frames, transfer, fields.

A job is plain data. What it makes is the bytes of a file, which the machine that asked writes, whole or not at all: so no shared
disk is needed, a job that was lost can be done again anywhere, and a run that was cut short goes on with what is missing.
"""

from __future__ import annotations

import os
import pathlib
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Optional

import halflight as hl
from halflight import ddf


@dataclass(frozen=True)
class TileJob:
    """One tile of one frame; tile 1 of 1 is a whole picture."""

    output: str
    scene: hl.Scene
    technique: str
    frame: int
    tile: tuple[int, int]
    options: Mapping[str, Any] = field(default_factory=dict)
    half: bool = False
    transfer: Optional[bytes] = None

    def key(self) -> str:
        """What the file must have been made with to be of this run."""
        options = dict(self.options)
        return repr((self.technique, self.half, sorted(options.items(), key=lambda item: item[0])))

    def run(self) -> bytes:
        """The bytes of the tile's .exr."""
        with tempfile.TemporaryDirectory() as folder:
            options = dict(self.options)
            if self.transfer is not None:
                cache = pathlib.Path(folder, "transfer.safetensors")
                cache.write_bytes(self.transfer)
                options["settings"] = {**options.get("settings", {}), "cache": str(cache)}
            tile = self.tile if self.tile[1] > 1 else None
            picture = hl.render(self.scene, self.technique, frame=self.frame, tile=tile, threads=1, **options)
            if self.transfer is not None:
                # Where this machine kept it is of no interest to the others.
                picture.metadata["technique"] = picture.metadata["technique"].replace(str(cache), "transfer")
            picture.metadata["cluster_job"] = self.key()
            path = pathlib.Path(folder, "tile.exr")
            picture.save(path, half=self.half)
            return path.read_bytes()


@dataclass(frozen=True)
class TransferJob:
    """What `prt` prepares for a scene that stands still, for all its frames and lights."""

    output: str
    scene: hl.Scene
    settings: Mapping[str, Any] = field(default_factory=dict)

    def run(self) -> bytes:
        """The bytes of the transfer's file."""
        with tempfile.TemporaryDirectory() as folder:
            cache = pathlib.Path(folder, "transfer.safetensors")
            settings = {**self.settings, "cache": str(cache)}
            hl.render(self.scene, "prt", settings=settings, samples=1, size=(16, 16), threads=1)
            return cache.read_bytes()


@dataclass(frozen=True)
class TrainingJob:
    """A piece of the training of a field: goes on from a checkpoint for so many seconds, or to the end."""

    output: str
    mesh: bytes
    steps: int
    resolution: int
    seed: int
    seconds: float
    checkpoint: Optional[bytes] = None

    def run(self) -> bytes:
        """The bytes of the field if its training is over, else of a checkpoint; the first byte tells which."""
        until = time.monotonic() + self.seconds
        with tempfile.TemporaryDirectory() as folder:
            mesh, kept = pathlib.Path(folder, "mesh.ply"), pathlib.Path(folder, "training")
            mesh.write_bytes(self.mesh)
            if self.checkpoint is not None:
                kept.write_bytes(self.checkpoint)
            trained = ddf.train(
                mesh,
                steps=self.steps,
                resolution=self.resolution,
                seed=self.seed,
                checkpoint=kept,
                resume=True,
                threads=1,
                progress=lambda what, done, total: time.monotonic() < until,
            )
            if trained.field.steps < self.steps:
                return b"c" + kept.read_bytes()
            trained.field.save(pathlib.Path(folder, "field.ddf"))
            return b"f" + pathlib.Path(folder, "field.ddf").read_bytes()


def write_whole(path: str, data: bytes) -> None:
    """Write a file beside its name and rename it, so that it is whole or absent."""
    os.makedirs(os.path.dirname(os.path.abspath(path)), exist_ok=True)
    beside = f"{path}.{os.getpid()}.partial"
    with open(beside, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


def belongs(job: TileJob) -> bool:
    """Whether the file of a job is there and was made from the same scene with the same options."""
    if not os.path.exists(job.output):
        return False
    try:
        found = hl.load_picture(job.output).metadata
    except hl.Error:
        return False
    wanted = {
        "version": f"halflight {hl.__version__}",
        "scene_hash": job.scene.hash,
        "simd": job.scene.simd,
        "frame": str(job.frame),
        "cluster_job": job.key(),
    }
    if job.tile[1] > 1:
        wanted["tile"] = f"{job.tile[0]}/{job.tile[1]}"
    return all(found.get(key) == value for key, value in wanted.items())
