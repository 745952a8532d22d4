"""What is refused, and in which words: the argument is named, arrays and unseen files are not quoted."""

from __future__ import annotations

import argparse
import os
import pathlib
import sys
from typing import Any

import halflight as hl
import numpy as np
import pytest
from halflight import frequency, sh

BALL: dict[str, Any] = {"shapes": [{"type": "sphere"}], "environment": "studio"}


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("size", (10,)),
        ("size", "x"),
        ("size", (10.5, 3)),
        ("size", (0, 4)),
        ("size", 5),
        ("samples", "a"),
        ("samples", 1.5),
        ("samples", 0),
        ("seconds", "a"),
        ("seconds", -1),
        ("tile", 5),
        ("tile", (3, 2)),
        ("tile", (0, 2)),
        ("tile", (1, 2, 3)),
        ("layers", [1]),
        ("layers", 3),
        ("progress", 3),
        ("seed", 1.5),
        ("threads", 0),
        ("fps", "a"),
        ("time", [1]),
    ],
)
def test_an_argument_that_makes_no_sense_is_named(name: str, wrong: Any) -> None:
    options: dict[str, Any] = {"size": (8, 8), "samples": 1, name: wrong}
    with pytest.raises((hl.UsageError, TypeError), match=f"^{name}: expected"):
        hl.render(hl.Scene(**BALL), **options)


def test_messages_quote_no_arrays_and_no_unseen_files() -> None:
    with pytest.raises(hl.Error) as caught:
        hl.Scene(shapes=[{"type": "sphere", "radius": -1.0}], camera={"origin": [0, 0, 0], "target": [0, 0, 0]})
    assert "halflight-" not in str(caught.value) and "radius" in str(caught.value)
    with pytest.raises(TypeError) as ragged:
        sh.log([[1.0, 2.0], [3.0]])
    assert len(str(ragged.value)) < 250


def test_harmonics_refuse_what_has_no_answer() -> None:
    with pytest.raises(ValueError, match="overflows"):
        sh.exp([5000.0, 0.0, 0.0, 0.0])
    assert np.isfinite(sh.exp([50.0, 0.0, 0.0, 0.0])).all()
    for wrong in ([-0.1], [3.5], [0.5, 10.0]):
        with pytest.raises(ValueError, match="half_angles"):
            sh.cap(wrong, 3)
        with pytest.raises(ValueError, match="half_angles"):
            sh.log_cap(wrong, 3)
    for wrong_direction in ([0.0, 0.0, 0.0], [0.0, 0.0, 2.0]):
        with pytest.raises(ValueError, match="directions: expected directions of length 1"):
            sh.basis([wrong_direction], 3)
    with pytest.raises(TypeError, match="order"):
        sh.basis([[0.0, 0.0, 1.0]], "a")  # type: ignore[arg-type]


def test_lobes_refuse_negative_exponents() -> None:
    with pytest.raises(ValueError, match="exponents"):
        frequency.phong_bandwidth([10.0, -1.0])


@pytest.mark.parametrize("ending", ["png", "exr", "hdr"])
def test_a_picture_that_is_not_finite_is_not_written(tmp_path: pathlib.Path, ending: str) -> None:
    values = np.ones((4, 6, 3), dtype=np.float32)
    values[2, 3, 1] = np.nan
    with pytest.raises(hl.Error, match="1 pixel is not finite, first in row 2, column 3"):
        hl.Picture.from_array(values).save(tmp_path / f"x.{ending}")
    assert not list(tmp_path.iterdir())


def test_the_command_line_of_the_cluster_says_what_is_wrong() -> None:
    pytest.importorskip("ray")
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "examples/cluster"))
    import cluster

    assert list(cluster.frames_of("5")) == [5]
    assert list(cluster.frames_of("-1..2")) == [-1, 0, 1, 2]
    for wrong, words in (("3..1", "write 1..3"), ("a", "1..24"), ("1..", "1..24")):
        with pytest.raises(argparse.ArgumentTypeError, match=words):
            cluster.frames_of(wrong)
    assert cluster.size_of("640x360") == (640, 360)
    with pytest.raises(argparse.ArgumentTypeError, match="640x360"):
        cluster.size_of("640")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (["frames", "nope.toml", "-o", "x.exr"], "nope.toml"),
        (["frames", "demo:cornell-box", "-o", "x.exr", "--size", "2x2", "--tiles", "9"], "9"),
        (["field", "nope.ply", "-o", "x.ddf"], "nope.ply"),
    ],
)
def test_the_cluster_is_not_asked_for_before_the_input_is_known_to_be_sound(
    line: list[str], words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ray = pytest.importorskip("ray")
    sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "examples/cluster"))
    import cluster

    def never(*_: object, **__: object) -> None:
        raise AssertionError("the cluster was asked for")

    monkeypatch.setattr(ray, "init", never)
    monkeypatch.setattr(sys, "argv", [os.fspath("cluster.py"), *line])
    with pytest.raises(SystemExit) as ended:
        cluster.main()
    said = capsys.readouterr().err
    assert ended.value.code == 1 and words in said and said.startswith("error: ")
