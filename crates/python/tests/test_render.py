"""Pictures from Python: the command's bits, arrays without copies, interrupts, tiles."""

from __future__ import annotations

import pathlib
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time

import halflight as hl
import numpy as np
import pytest


def same_bits(a: hl.Picture, b: hl.Picture) -> bool:
    one, two = a.channels, b.channels
    return one.keys() == two.keys() and all(
        np.ascontiguousarray(one[name]).tobytes() == np.ascontiguousarray(two[name]).tobytes() for name in one
    )


@pytest.mark.parametrize("technique", ["path", "prt", "shadow-fields", "shexp", "bandwidth", "covariance"])
def test_a_rendering_equals_the_picture_of_the_command_bit_for_bit(
    technique: str, command: str, scene_file: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    out = tmp_path / "command.exr"
    line = f"render {scene_file} -t {technique} --spp 3 --seed 5 --frame 12 -o {out} -q"
    subprocess.run([command, *line.split()], check=True)
    picture = hl.render(hl.load(scene_file), technique, samples=3, seed=5, frame=12, layers="all")
    theirs = hl.load_picture(out)
    assert same_bits(picture, theirs)
    picture.save(tmp_path / "python.exr")
    saved = hl.load_picture(tmp_path / "python.exr")
    assert same_bits(saved, theirs)
    told = {"command", "seconds"}
    assert {k: v for k, v in saved.metadata.items() if k not in told} == {
        k: v for k, v in theirs.metadata.items() if k not in told
    }


def test_a_png_has_the_bytes_of_the_commands(command: str, scene_file: pathlib.Path, tmp_path: pathlib.Path) -> None:
    subprocess.run([command, "render", scene_file, "--spp", "2", "-o", tmp_path / "command.png", "-q"], check=True)
    picture = hl.render(scene_file, samples=2)
    picture.save(tmp_path / "python.png")
    assert (tmp_path / "python.png").read_bytes() == (tmp_path / "command.png").read_bytes()
    assert picture._repr_png_() == (tmp_path / "python.png").read_bytes()


def test_threads_do_not_change_a_bit_and_settings_do(scene: hl.Scene) -> None:
    one = hl.render(scene, samples=3, threads=1)
    assert same_bits(one, hl.render(scene, samples=3, threads=3))
    assert not same_bits(one, hl.render(scene, samples=3, settings={"max_depth": 1}))
    assert same_bits(hl.render(scene, "path:max_depth=1", samples=3), hl.render(scene, samples=3, settings={"max_depth": 1}))


def test_a_technique_that_was_prepared_once_gives_the_same_bits_again(scene: hl.Scene) -> None:
    first = hl.render(scene, "shexp", samples=1, frame=3)
    hl.render(scene, "shexp", samples=1, frame=40)
    assert same_bits(first, hl.render(scene, "shexp", samples=1, frame=3))


def test_arrays_are_views_of_the_renderers_memory(scene: hl.Scene) -> None:
    picture = hl.render(scene, samples=2, layers=["depth", "normal", "alpha"])
    assert picture.rgb.shape == (27, 48, 3) and picture.rgb.dtype == np.float32
    assert picture.rgb is picture.rgb
    assert np.shares_memory(picture["normal.X"], picture["normal"])
    assert np.shares_memory(picture.channels["G"], picture.rgb)
    assert picture["depth"].shape == (27, 48) and "depth.Z" in picture
    assert picture.layers == ("rgb", "A", "depth", "normal")
    assert np.shares_memory(np.asarray(picture), picture.rgb)
    with pytest.raises(KeyError, match="there is no layer 'albedo'"):
        picture["albedo"]


def test_tiles_merge_to_the_bits_of_the_whole(scene: hl.Scene, tmp_path: pathlib.Path) -> None:
    whole = hl.render(scene, samples=2, layers="all")
    names = []
    for i in range(1, 4):
        tile = hl.render(scene, samples=2, layers="all", tile=(i, 4))
        x, y, width, height = hl.tile_size((i, 4), scene.size)
        assert tile.rgb.tobytes() == whole.rgb[y : y + height, x : x + width].tobytes()
        names.append(tmp_path / f"{i}.exr")
        tile.save(names[-1])
    with pytest.raises(hl.Error, match="1 of 4 tiles is missing: 4/4"):
        hl.merge(names, tmp_path / "merged.exr")
    assert not (tmp_path / "merged.exr").exists()
    names.append(tmp_path / "4.exr")
    other = hl.render(scene, samples=2, layers="all", tile=(4, 4), seed=9)
    other.save(names[-1])
    with pytest.raises(hl.Error, match="do not belong together: the seed of"):
        hl.merge(names, tmp_path / "merged.exr")
    hl.render(scene, samples=2, layers="all", tile=(4, 4)).save(names[-1])
    hl.merge(names, tmp_path / "merged.exr")
    assert same_bits(hl.load_picture(tmp_path / "merged.exr"), whole)


def test_tiles_of_the_command_and_of_python_belong_together(
    command: str, scene_file: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    line = f"render {scene_file} --spp 2 --tile 1/2 -o {tmp_path}/t.exr -q"
    subprocess.run([command, *line.split()], check=True)
    scene = hl.load(scene_file)
    hl.render(scene, samples=2, layers="all", tile=(2, 2)).save(tmp_path / "mine.exr")
    hl.merge([tmp_path / "t.tile1of2.exr", tmp_path / "mine.exr"], tmp_path / "merged.exr")
    assert same_bits(hl.load_picture(tmp_path / "merged.exr"), hl.render(scene, samples=2, layers="all"))


def test_other_threads_of_python_go_on_while_a_picture_is_made(scene: hl.Scene) -> None:
    counted, over = [0], threading.Event()

    def count() -> None:
        while not over.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    hl.render(scene, samples=1 << 20, seconds=0.5, size=(320, 180), threads=1)
    after = counted[0]
    over.set()
    thread.join()
    assert after - before > 50


def test_progress_is_told_and_false_keeps_the_picture_so_far(scene: hl.Scene) -> None:
    told: list[tuple[str, int, int]] = []

    def progress(what: str, done: int, total: int) -> bool:
        told.append((what, done, total))
        return len(told) < 3

    picture = hl.render(scene, samples=1 << 20, size=(320, 180), progress=progress)
    assert len(told) == 3 and told[0][0] == "samples" and 0 < told[-1][1] < told[-1][2]
    assert picture.interrupted and 0 < picture.samples < 1 << 20 and picture.rgb.max() > 0

    def wrong(what: str, done: int, total: int) -> None:
        raise ZeroDivisionError("progress")

    with pytest.raises(ZeroDivisionError):
        hl.render(scene, samples=1 << 20, size=(320, 180), progress=wrong)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_ctrl_c_stops_and_keeps_the_partial_picture(scene_file: pathlib.Path, tmp_path: pathlib.Path) -> None:
    program = textwrap.dedent(f"""
        import halflight as hl
        scene = hl.load({str(scene_file)!r})
        try:
            hl.render(scene, samples=1 << 20, size=(320, 180), progress=lambda *_: print("begun", flush=True))
        except KeyboardInterrupt as stopped:
            picture = stopped.result
            assert picture.interrupted and picture.samples > 0 and picture.rgb.max() > 0
            picture.save({str(tmp_path / "partial.exr")!r})
            print(type(stopped).__name__)
    """)
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    begun = time.monotonic()
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[0]
    assert said.endswith("Interrupted\n") and process.returncode == 0
    assert time.monotonic() - begun < 30
    assert hl.load_picture(tmp_path / "partial.exr").interrupted


@pytest.mark.parametrize(
    ("line", "call"),
    [
        ("nowhere.toml", lambda s: hl.load("nowhere.toml")),
        ("scene.toml -t pth", lambda s: hl.render(s, "pth")),
        ("scene.toml -t path:max_dept=3", lambda s: hl.render(s, "path:max_dept=3")),
        ("scene.toml --layers depht -o x.exr", lambda s: hl.render(s, layers="depht")),
        ("scene.toml --set camera.aperture=1", lambda s: hl.load("scene.toml", set={"camera.aperture": 1})),
        ("scene.toml --tile 9/9 -o x.exr", lambda s: hl.render(s, tile=(9, 9))),
        ("scene.toml --tile 1/2 --time-limit 1 -o x.exr", lambda s: hl.render(s, tile=(1, 2), seconds=1)),
    ],
)
def test_errors_have_the_text_of_the_commands(
    line: str, call: object, command: str, scene_file: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(scene_file.parent)
    said = subprocess.run([command, "render", *line.split()], capture_output=True, text=True)
    assert said.returncode != 0
    scene = hl.load("scene.toml")
    with pytest.raises(hl.Error) as caught:
        call(scene)  # type: ignore[operator]
    assert str(caught.value) in said.stderr


def test_wrong_arguments_are_refused(scene: hl.Scene) -> None:
    with pytest.raises(hl.UsageError, match="samples: expected 1 to 16777216, found 0"):
        hl.render(scene, samples=0)
    with pytest.raises(hl.UsageError, match="size: expected columns and rows"):
        hl.render(scene, size=(0, 5))
    with pytest.raises(hl.UsageError, match="time: expected a number, found nan"):
        hl.render(scene, time=float("nan"))
    with pytest.raises(hl.UsageError, match="seed: expected 0"):
        hl.render(scene, seed=-1)
    with pytest.raises(hl.UsageError, match="threads: expected 1 to 1024"):
        hl.render(scene, samples=1, threads=5000)
    with pytest.raises(hl.UsageError, match="frame or time"):
        hl.render(scene, frame=1, time=1)
    with pytest.raises(hl.Error):
        hl.load("demo:cornell-box", simd="sse9")
    with pytest.raises(TypeError):
        hl.render(scene, samples="many")  # type: ignore[arg-type]


def test_a_scene_travels_to_other_processes(scene: hl.Scene, octahedron: hl.Mesh) -> None:
    again = pickle.loads(pickle.dumps(scene))
    assert again.hash == scene.hash
    built = hl.Scene(shapes=[{"type": "mesh", "file": octahedron}], environment="sky", image={"size": [16, 16]})
    text = pickle.dumps(built)
    picture = hl.render(built, samples=1)
    del built
    again = pickle.loads(text)
    assert same_bits(hl.render(again, samples=1), picture)


def test_frames_are_rendered_one_after_another(scene: hl.Scene) -> None:
    pictures = dict(hl.frames(scene, 2, 4, samples=1))
    assert list(pictures) == [2, 3, 4]
    assert same_bits(pictures[3], hl.render(scene, frame=3, samples=1))
    assert same_bits(pictures[3], hl.render(scene, time=3 / 24, samples=1))


def test_pictures_are_compared(scene: hl.Scene) -> None:
    few, many = hl.render(scene, samples=1), hl.render(scene, samples=16, seed=1)
    found = hl.compare(few, many)
    assert 0 < found.relmse < 10 and found.psnr > 5 and 0 < found.flip < 1
    assert found.maps["flip"].shape == (27, 48)
    assert hl.compare(many.rgb, many).relmse == 0
    with pytest.raises(hl.Error, match="48"):
        hl.compare(few, np.zeros((5, 5, 3)))
    with pytest.raises(ValueError, match=r"picture: expected an array of shape \(n, m, 3\), found \(5, 5\)"):
        hl.compare(np.zeros((5, 5)), few)
