#!/usr/bin/env python3
"""Rays per second of halflight and of Embree, on the same rays in one run, and their ratios.

    python3 -m venv VENV && VENV/bin/pip install numpy embreex      # Embree 4, one ray at a time
    apt-get install libembree-dev gcc                               # Embree 3 from C, with packets (optional)
    VENV/bin/python tools/peers/embree.py MESH...

`ray_rate` measures halflight and dumps the meshes and rays; `embree.c` beside this file and the package `embreex` are
timed on those. Rates are million rays per second of processor time on one thread. A peer that is not there is left out.
"""

import argparse
import pathlib
import re
import shutil
import subprocess
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent


def halflight(meshes, folder):
    command = ["cargo", "run", "--release", "-q", "-p", "halflight-trace", "--example", "ray_rate", "--"]
    text = subprocess.run(
        command + ["--dump", str(folder), *meshes], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    print(text)
    rates, builds = {}, {}
    for line in text.splitlines():
        words = line.split()
        built = re.match(r"(\S+) +\d+ triangles: build ([\d.]+) ms \(([\d.]+) cpu\)", line)
        if built:
            builds[built[1]] = (float(built[2]), float(built[3]))
        elif len(words) == 8 and words[1] in ("primary", "random", "bounce"):
            rates[words[0], words[1], words[2]] = float(words[3])
    return rates, builds


def embree3(names, folder):
    """Rates of rtcIntersect1/8/16 and rtcOccluded1/8/16, from the C program."""
    rates, builds = {}, {}
    if not shutil.which("gcc"):
        return rates, builds
    program = folder / "embree"
    compiled = subprocess.run(
        ["gcc", "-O2", "-march=native", str(HERE / "embree.c"), "-lembree3", "-lpthread", "-lm", "-o", str(program)],
        capture_output=True,
    )
    if compiled.returncode:
        print("libembree-dev is not installed: Embree 3 is left out")
        return rates, builds
    text = subprocess.run([str(program), str(folder), *names], check=True, capture_output=True, text=True).stdout
    for line in text.splitlines():
        words = line.split()
        if words[1] == "build":
            builds[words[0]] = (float(words[2]), float(words[5]))
        else:
            rates[words[0], words[1], words[2], int(words[3])] = float(words[4])
    return rates, builds


def embree4(names, folder):
    """Rates of Embree 4's single-ray calls, from the package embreex."""
    rates = {}
    try:
        import numpy
        from embreex import mesh_construction, rtcore_scene
    except ImportError:
        print("embreex is not installed: Embree 4 is left out")
        return rates
    for name in names:
        positions = numpy.fromfile(folder / f"{name}.positions", numpy.float32).reshape(-1, 3)
        triangles = numpy.fromfile(folder / f"{name}.triangles", numpy.int32).reshape(-1, 3)
        scene = rtcore_scene.EmbreeScene()
        mesh = mesh_construction.TriangleMesh(scene, positions, triangles)
        for kind in ("primary", "random", "bounce"):
            rays = numpy.fromfile(folder / f"{name}.{kind}", numpy.float32).reshape(-1, 6)
            origins, directions = rays[:, :3].copy(), rays[:, 3:].copy()
            for question, query in (("closest", "INTERSECT"), ("any", "OCCLUDED")):
                scene.run(origins[:1000], directions[:1000], query=query)
                times = []
                for _ in range(5):
                    begun = time.process_time()
                    scene.run(origins, directions, query=query)
                    times.append(time.process_time() - begun)
                rates[name, kind, question] = len(rays) * 1e-6 / sorted(times)[2]
        del mesh
    return rates


def ratio(ours, theirs):
    return f"{ours / theirs:6.2f}" if ours and theirs else "     -"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the rays (kept)")
    arguments = parser.parse_args()
    folder = arguments.keep or pathlib.Path(tempfile.mkdtemp(prefix="halflight-rays-"))
    meshes = [str(pathlib.Path(mesh).resolve()) for mesh in arguments.meshes]
    names = [pathlib.Path(mesh).name.split(".")[0] for mesh in meshes]
    ours, our_builds = halflight(meshes, folder)
    three, three_builds = embree3(names, folder)
    four = embree4(names, folder)

    print(f"{'mesh':<22}{'rays':<9}{'question':<9}{'ours':>8}{'packets':>9}{'E4 one':>8}{'E3 one':>8}{'E3 16':>8}"
          f"{'one/E4':>8}{'one/E3':>8}{'packets/E3 16':>15}")
    for name in names:
        for kind in ("primary", "random", "bounce"):
            for question in ("closest", "any"):
                one = ours.get((name, kind, question))
                packets = ours.get((name, kind, question + "-together"))
                e4, e1, e16 = four.get((name, kind, question)), *(three.get((name, kind, question, n)) for n in (1, 16))
                cells = [f"{rate:8.1f}" if rate else "       -" for rate in (one, packets, e4, e1, e16)]
                print(f"{name:<22}{kind:<9}{question:<9}{cells[0]} {cells[1]}{cells[2]}{cells[3]}{cells[4]}"
                      f"  {ratio(one, e4)}  {ratio(one, e1)}         {ratio(packets, e16)}")
    for name in names:
        for label, builds in (("halflight", our_builds), ("Embree 3, medium", three_builds)):
            if name in builds:
                print(f"{name}: build by {label}: {builds[name][0]:.1f} ms wall on two threads, {builds[name][1]:.1f} ms cpu")
    if not arguments.keep:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
