"""Send frames, tiles, transfer and training to the machines of a Ray cluster.

    python cluster.py frames scene.toml --frames 1..24 --tiles 4 --spp 64 -o frames/out.####.exr --address auto
    python cluster.py transfer scene.toml -o scene.safetensors --address auto
    python cluster.py field bunny.ply --steps 4000 -o bunny.ddf --address auto

Without --address a cluster of this machine alone is started. A worker that is lost is replaced by another, which does the lost
jobs again; a run that was cut short goes on where it was. The files hold the bits that one machine would have made, as long as
all have the instruction set that is asked for (--simd).
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Optional, Union

import ray

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import halflight as hl
import jobs
from jobs import TileJob, TrainingJob, TransferJob

# Workers need not have these files: what they need of them travels along.
ray.cloudpickle.register_pickle_by_value(jobs)

Job = Union[TileJob, TransferJob, TrainingJob]
Progress = Callable[[int, int, str], None]
RETRIES = 8
"""How often a job is begun again after its worker was lost. An error of the job itself is not tried again."""


@ray.remote(num_cpus=1, max_retries=RETRIES)
def work(job: Any) -> bytes:
    """Do a job on some machine."""
    result: bytes = job.run()
    return result


def frames_of(text: str) -> range:
    """`5`, or `1..24`: the first and the last frame."""
    found = re.fullmatch(r"\s*(-?\d+)\s*(?:\.\.\s*(-?\d+)\s*)?", text)
    if not found:
        raise argparse.ArgumentTypeError(f"expected a frame or FIRST..LAST, as in 1..24, found {text!r}")
    first = int(found[1])
    last = first if found[2] is None else int(found[2])
    if last < first:
        raise argparse.ArgumentTypeError(f"the last frame, {last}, comes before the first, {first}: write {last}..{first}")
    return range(first, last + 1)


def size_of(text: str) -> tuple[int, int]:
    """`640x360`."""
    found = re.fullmatch(r"\s*([1-9]\d{0,5})\s*x\s*([1-9]\d{0,5})\s*", text)
    if not found:
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT, as in 640x360, found {text!r}")
    return int(found[1]), int(found[2])


def count_of(text: str) -> int:
    """A whole number from 1 on."""
    if not re.fullmatch(r"\s*[1-9]\d{0,8}\s*", text):
        raise argparse.ArgumentTypeError(f"expected a whole number from 1 on, found {text!r}")
    return int(text)


def told(done: int, total: int, what: str) -> None:
    """Tell the progress on a line."""
    print(f"{done}/{total} {what}", file=sys.stderr, flush=True)


def numbered(output: str, frame: int) -> str:
    """`out.####.exr` with the number of a frame, as `halflight render --frames` names it."""
    head, name = os.path.split(output)
    if "#" not in name:
        stem, extension = os.path.splitext(name)
        name = f"{stem}.####{extension}"
    runs = list(re.finditer("#+", name))
    last = runs[-1]
    sign = "-" if frame < 0 else ""
    number = sign + str(abs(frame)).zfill(len(last.group()))
    return os.path.join(head, name[: last.start()] + number + name[last.end() :])


def tile_name(output: str, index: int, count: int) -> str:
    """The name of a tile, as `halflight render --tile` gives it."""
    stem, extension = os.path.splitext(output)
    return f"{stem}.tile{str(index).zfill(len(str(count)))}of{count}{extension}"


def render_frames(
    scene: hl.Scene,
    frames: Iterable[int],
    output: str,
    *,
    technique: str = "path",
    tiles: int = 1,
    transfer: Optional[bytes] = None,
    progress: Progress = told,
    keep_tiles: bool = False,
    **options: Any,
) -> list[str]:
    """Render frames in tiles wherever there is room, join them, and give their names."""
    options.setdefault("layers", "all")
    names = [(frame, numbered(output, frame)) for frame in frames]
    missing: list[TileJob] = []
    for frame, name in names:
        whole = TileJob(name, scene, technique, frame, (1, 1), options, transfer=transfer)
        if jobs.belongs(whole):
            continue
        shares = [(index, tiles) for index in range(1, tiles + 1)]
        parts = [
            TileJob(
                tile_name(name, *share) if tiles > 1 else name,
                scene,
                technique,
                frame,
                share,
                options,
                transfer=transfer,
            )
            for share in shares
        ]
        missing += [part for part in parts if not jobs.belongs(part)]

    write_as_they_come(missing, progress)
    for _, name in names:
        parts_of = [tile_name(name, index, tiles) for index in range(1, tiles + 1)] if tiles > 1 else []
        if parts_of and all(os.path.exists(part) for part in parts_of):
            hl.merge(parts_of, name)
            if not keep_tiles:
                for part in parts_of:
                    os.unlink(part)
    return [name for _, name in names]


def write_as_they_come(missing: Sequence[Job], progress: Progress) -> None:
    """Do jobs and write each file as soon as it is there: what is done stays done."""
    waiting = {work.remote(job): job for job in missing}
    done_count = 0
    while waiting:
        done, _ = ray.wait(list(waiting), num_returns=1, timeout=1.0)
        for reference in done:
            job = waiting.pop(reference)
            try:
                data = ray.get(reference)
            except Exception:
                for left in waiting:
                    ray.cancel(left, force=True)
                raise
            jobs.write_whole(job.output, data)
            done_count += 1
            progress(done_count, len(missing), job.output)


def transfer_of(scene: hl.Scene, output: str, progress: Progress = told, **settings: Any) -> bytes:
    """What `prt` prepares for a scene, from the file if it is there."""
    if not os.path.exists(output):
        write_as_they_come([TransferJob(output, scene, settings)], progress)
    with open(output, "rb") as file:
        return file.read()


def train_fields(
    meshes: dict[str, bytes],
    *,
    steps: int,
    resolution: int = 64,
    seed: int = 1,
    piece_seconds: float = 60.0,
    progress: Progress = told,
) -> None:
    """Train fields of meshes (bytes of .ply files by the output's name), in pieces that are kept beside the output."""
    todo = {output: mesh for output, mesh in meshes.items() if not os.path.exists(output)}

    def piece(output: str) -> TrainingJob:
        kept = f"{output}.checkpoint"
        checkpoint = None
        if os.path.exists(kept):
            with open(kept, "rb") as file:
                checkpoint = file.read()
        return TrainingJob(output, todo[output], steps, resolution, seed, piece_seconds, checkpoint)

    waiting = {work.remote(piece(output)): output for output in todo}
    finished = 0
    while waiting:
        done, _ = ray.wait(list(waiting), num_returns=1, timeout=1.0)
        for reference in done:
            output = waiting.pop(reference)
            kind, data = (answer := ray.get(reference))[:1], answer[1:]
            if kind == b"c":
                jobs.write_whole(f"{output}.checkpoint", data)
                waiting[work.remote(piece(output))] = output
                progress(finished, len(todo), f"{output}: a piece of its training")
                continue
            jobs.write_whole(output, data)
            if os.path.exists(f"{output}.checkpoint"):
                os.unlink(f"{output}.checkpoint")
            finished += 1
            progress(finished, len(todo), output)


def main() -> None:
    """Read the command line and do it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["frames", "transfer", "field"])
    parser.add_argument("input", help="a scene, an asset or demo:NAME; a mesh for `field`")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--address", help="of the cluster: auto, or ray://HOST:10001")
    parser.add_argument("-t", "--technique", default="path")
    parser.add_argument("--frames", type=frames_of, default=range(0, 1), metavar="N or FIRST..LAST")
    parser.add_argument("--tiles", type=count_of, default=1)
    parser.add_argument("--spp", type=count_of)
    parser.add_argument("--size", type=size_of, metavar="WxH")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--simd", help="baseline, avx2 or avx512: what all machines have")
    parser.add_argument("--transfer", help="what `transfer` has made, for -t prt")
    parser.add_argument("--steps", type=count_of, default=4000)
    parser.add_argument("--resolution", type=count_of, default=64)
    given = parser.parse_args()
    try:
        run(given)
    except (hl.Error, OSError) as error:
        parser.exit(1, f"error: {error}\n")


def run(given: argparse.Namespace) -> None:
    """Do what the command line asks. What can be wrong with it is found before a cluster is asked for."""
    if given.what == "field":
        with open(given.input, "rb") as file:
            mesh = file.read()
        ray.init(address=given.address, log_to_driver=False)
        train_fields({given.output: mesh}, steps=given.steps, resolution=given.resolution)
        return
    scene = hl.load(given.input, simd=given.simd)
    options: dict[str, Any] = {"seed": given.seed}
    if given.spp is not None:
        options["samples"] = given.spp
    if given.size is not None:
        options["size"] = given.size
    if given.what == "frames":
        # Refuses more tiles than there are pixels.
        hl.tile_size((1, given.tiles), given.size or scene.size)
    transfer = None
    if given.transfer is not None:
        with open(given.transfer, "rb") as file:
            transfer = file.read()
    ray.init(address=given.address, log_to_driver=False)
    if given.what == "transfer":
        transfer_of(scene, given.output)
        return
    render_frames(
        scene,
        given.frames,
        given.output,
        technique=given.technique,
        tiles=given.tiles,
        transfer=transfer,
        **options,
    )


if __name__ == "__main__":
    main()
