"""Frames, tiles, transfer and training on a Ray cluster of several nodes, one of which is lost in the middle."""

from __future__ import annotations

import pathlib
import sys
from collections.abc import Iterator
from typing import Any

import halflight as hl
import numpy as np
import pytest
from halflight import ddf

ray = pytest.importorskip("ray", reason="Ray is not installed")
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "examples" / "cluster"))

import cluster as halflight_cluster  # noqa: E402


@pytest.fixture(scope="module")
def nodes() -> Iterator[Any]:
    from ray.cluster_utils import Cluster

    # The head has no room for work: whatever is done is done on a node that can be lost.
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
    workers = [cluster.add_node(num_cpus=1) for _ in range(2)]
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster, workers
    ray.shutdown()
    cluster.shutdown()


def test_a_run_that_loses_a_node_gives_the_bits_of_one_machine(nodes: Any, scene: hl.Scene, tmp_path: pathlib.Path) -> None:
    cluster, workers = nodes
    options = {"samples": 24, "size": (160, 96)}
    told: list[tuple[int, int, str]] = []

    def progress(done: int, total: int, what: str) -> None:
        told.append((done, total, what))
        if done == 2:
            cluster.remove_node(workers.pop(), allow_graceful=False)
            cluster.add_node(num_cpus=1)

    names = halflight_cluster.render_frames(
        scene, range(1, 4), str(tmp_path / "out.####.exr"), tiles=4, progress=progress, **options
    )
    assert [done for done, _, _ in told] == list(range(1, 13)) and told[0][1] == 12
    for frame, name in zip(range(1, 4), names):
        alone, joined = hl.render(scene, frame=frame, layers="all", **options), hl.load_picture(name)
        assert alone.channels.keys() == joined.channels.keys()
        for channel, values in alone.channels.items():
            assert np.ascontiguousarray(values).tobytes() == np.ascontiguousarray(joined[channel]).tobytes()
    assert sorted(path.name for path in tmp_path.glob("out*")) == [f"out.000{i}.exr" for i in range(1, 4)]

    # Started again, it makes what is missing and nothing else.
    (tmp_path / "out.0002.exr").unlink()
    before = (tmp_path / "out.0001.exr").stat().st_mtime_ns
    again: list[str] = []
    halflight_cluster.render_frames(
        scene,
        range(1, 4),
        str(tmp_path / "out.####.exr"),
        tiles=4,
        progress=lambda done, total, what: again.append(what),
        **options,
    )
    assert len(again) == 4 and all("out.0002.tile" in name for name in again)
    assert (tmp_path / "out.0001.exr").stat().st_mtime_ns == before


def test_transfer_is_made_once_and_used_everywhere(nodes: Any, tmp_path: pathlib.Path) -> None:
    scene = hl.Scene(
        image={"size": [48, 32]},
        camera={"origin": [0, 1.2, 5], "target": [0, 0.5, 0]},
        environment="sky",
        shapes=[{"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5}, {"type": "plane"}],
    )
    transfer = halflight_cluster.transfer_of(scene, str(tmp_path / "scene.safetensors"))
    [name] = halflight_cluster.render_frames(
        scene, [0], str(tmp_path / "p.##.exr"), technique="prt", tiles=2, transfer=transfer, samples=2
    )
    alone = hl.render(scene, "prt", samples=2)
    assert hl.load_picture(name).rgb.tobytes() == alone.rgb.tobytes()


def test_a_field_is_trained_in_pieces_on_any_machine(nodes: Any, octahedron: hl.Mesh, tmp_path: pathlib.Path) -> None:
    octahedron.save(tmp_path / "mesh.ply")
    pieces: list[str] = []
    halflight_cluster.train_fields(
        {str(tmp_path / "mesh.ddf"): (tmp_path / "mesh.ply").read_bytes()},
        steps=40,
        resolution=16,
        piece_seconds=0.3,
        progress=lambda done, total, what: pieces.append(what),
    )
    ddf.train(tmp_path / "mesh.ply", steps=40, resolution=16).field.save(tmp_path / "alone.ddf")
    assert (tmp_path / "mesh.ddf").read_bytes() == (tmp_path / "alone.ddf").read_bytes()
    assert len(pieces) >= 1 and not (tmp_path / "mesh.ddf.checkpoint").exists()


def test_an_error_of_a_job_ends_the_run_with_its_text(nodes: Any, scene: hl.Scene, tmp_path: pathlib.Path) -> None:
    with pytest.raises(Exception, match="did you mean path"):
        halflight_cluster.render_frames(scene, [0], str(tmp_path / "x.exr"), technique="pth", samples=1)
    assert not list(tmp_path.glob("x*"))
