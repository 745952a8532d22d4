#!/usr/bin/env python3
"""Mitsuba 3 on the reference scenes: CPU-seconds and error, to stand beside `halflight bench path`.

    python3 -m venv /tmp/peers && /tmp/peers/bin/pip install mitsuba numpy      # and the system's libllvm
    /tmp/peers/bin/python tools/peers/mitsuba_reference.py ../shared [scene ...] [--spp 64] [--halflight target/release/halflight]

For each scene it prints relMSE against the reference picture and the CPU time of a render whose kernels are compiled
already (the first, slower one is printed too). With --halflight it runs that program on the same scenes at several
sample counts and prints the ratio of CPU times at equal error, both measured in this one run.
"""
import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np

SCENES = {"bunny_diffuse": ("direct", 2), "hf25_coneman": ("direct", 2), "dof_row": ("direct", 2),
          "bunny_diffuse_path8": ("path8", 8)}


def relmse(image, reference):
    return float(np.mean((image - reference) ** 2 / (reference ** 2 + 0.01)))


def environment(light):
    """The light's formula at the texel centres of Mitsuba's corner-aligned layout."""
    width, height = light["width"], light["height"]
    phi = 2 * np.pi * (np.arange(width) + 0.5) / width
    theta = np.pi * np.arange(height) / (height - 1)
    phi, theta = np.meshgrid(phi, theta)
    d = np.stack([np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)], -1)
    if light["name"] == "sky":
        s = np.array([0.5, 0.7, 0.5]) / np.sqrt(0.99)
        t = np.sqrt(np.clip(d[..., 1:2], 0, 1))
        up = np.array([0.80, 0.86, 0.92]) * (1 - t) + np.array([0.22, 0.40, 0.80]) * t
        sky = np.where(d[..., 1:2] >= 0, up, np.array([0.22, 0.20, 0.18]))
        sun = 60 * np.array([1, 0.90, 0.75]) * np.exp((d @ s - 1) / 0.004)[..., None]
        return (sky + sun).astype(np.float32)
    terms = [([0.449438552, 0.799001871, 0.399500936], [3.2, 2.9, 2.4]),
             ([-0.866448578, 0.379071253, 0.324918217], [0.35, 0.5, 0.9]),
             ([0.099875234, 0.299625702, -0.948814722], [0.8, 0.45, 0.3])]
    return sum(((1 + d @ np.array(s)) / 2)[..., None] ** 5 * np.array(c) for s, c in terms).astype(np.float32)


def in_our_layout(texels, height=2048):
    """The same map, as its renderer interpolates it, at the texel centres of halflight's layout.

    The columns are the same. The reference's rows are corner-aligned and fewer than those of `sky_latlong.exr`, so its
    horizon is less sharp; on that file a converged picture differs from the reference by 4e-4 along the horizon alone.
    Interpolation in our rows rounds off the kinks at its rows: at 1024 rows that leaves 1e-4 or so along the horizon, at
    2048 an eighth of it."""
    h, w = texels.shape[:2]
    width = w
    x = ((np.arange(width) + 0.5) / width + 0.5) % 1.0 * w - 0.5
    y = (np.arange(height) + 0.5) / height * (h - 1)
    x0, y0 = np.floor(x).astype(int), np.minimum(y.astype(int), h - 2)
    fx, fy = (x - x0)[None, :, None], (y - y0)[:, None, None]
    row = lambda j: texels[j][:, x0 % w] * (1 - fx) + texels[j][:, (x0 + 1) % w] * fx
    return (row(y0) * (1 - fy) + row(y0 + 1) * fy).astype(np.float32)


def build(mi, description, shared, max_depth):
    tr = mi.ScalarTransform4f
    cam, image, light = description["camera"], description["image"], description["light"]
    sensor = {
        "type": "thinlens" if "lens_radius" in cam else "perspective",
        "fov": cam["fov_x_deg"], "fov_axis": "x",
        "to_world": tr().look_at(origin=cam["origin"], target=cam["target"], up=cam["up"]),
        "film": {"type": "hdrfilm", "width": image["width"], "height": image["height"], "rfilter": {"type": "box"},
                 "pixel_format": "rgb", "component_format": "float32"},
        "sampler": {"type": "multijitter"},
    }
    if "lens_radius" in cam:
        sensor |= {"aperture_radius": cam["lens_radius"], "focus_distance": cam["focus_distance"]}
    scene = {"type": "scene", "sensor": sensor,
             "integrator": {"type": "direct"} if max_depth == 2 else
                           {"type": "path", "max_depth": max_depth, "rr_depth": 1000},
             "light": {"type": "envmap", "bitmap": mi.Bitmap(environment(light))}}
    bsdfs = {name: {"type": "twosided", "b": {"type": "diffuse", "reflectance": {"type": "rgb", "value": m["reflectance"]}}}
             for name, m in description["materials"].items()}
    for i, shape in enumerate(description["shapes"]):
        bsdf = bsdfs[shape["material"]]
        if shape["type"] == "plane":
            h = shape["half_extent"]
            made = {"type": "rectangle", "to_world": tr().translate([0, shape["y"], 0]) @ tr().rotate([1, 0, 0], -90)
                    @ tr().scale([h, h, 1])}
        elif shape["type"] == "sphere":
            made = {"type": "sphere", "center": shape["center"], "radius": shape["radius"]}
        elif shape["type"] == "mesh":
            made = {"type": "ply", "filename": str(shared / "data/meshes" / shape["file"]), "face_normals": True,
                    "to_world": tr(np.array(shape["transform"]))}
        else:
            made = {"type": "ply", "filename": height_field(shape), "face_normals": True}
        scene[f"shape{i}"] = made | {"bsdf": bsdf}
    return mi.load_dict(scene)


def height_field(shape):
    """The height field's two triangles a cell, as a PLY file."""
    n, half = shape["posts"], shape["half_extent"]
    axis = -half + 2 * half * np.arange(n) / (n - 1)
    x, z = np.meshgrid(axis, axis)
    y = sum(a * np.sin(kx * x + kz * z + p) for a, kx, kz, p in shape["terms_a_kx_kz_phase"])
    vertices = np.stack([x, y, z], -1).reshape(-1, 3).astype("<f4")
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + n + 1, a + 1], -1), np.stack([a, a + n, a + n + 1], -1)]).astype("<i4")
    record = np.zeros(len(faces), dtype=[("n", "u1"), ("v", "<i4", 3)])
    record["n"], record["v"] = 3, faces
    path = tempfile.NamedTemporaryFile(suffix=".ply", delete=False)
    path.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {n * n}\nproperty float x\nproperty float y\n"
                f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n").encode())
    path.write(vertices.tobytes() + record.tobytes())
    path.close()
    return path.name


def halflight_curve(mi, program, name, max_depth, light, reference, root):
    """(samples, CPU-seconds, relMSE) of halflight at several sample counts, under the reference's own map."""
    scene = root / "tests/reference" / f"{name.removesuffix('_path8')}.toml"
    points = []
    with tempfile.TemporaryDirectory() as folder:
        out, stats, sky = f"{folder}/out.exr", f"{folder}/stats.json", f"{folder}/map.exr"
        mi.Bitmap(in_our_layout(environment(light))).write(sky)
        for spp in (16, 32, 64, 128):
            subprocess.run([program, "render", scene, "-o", out, "--spp", str(spp), "--max-depth", str(max_depth - 1),
                            "--stats", stats, "--quiet", "--set", "path.roulette_depth=1000", "--layers", "none",
                            "--environment", sky], check=True)
            image = np.array(mi.Bitmap(out).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
            points.append((spp, json.load(open(stats))["frames"][0]["cpu_seconds"], relmse(image, reference)))
    return points


def cpu_at_error(points, error):
    """CPU-seconds at which a curve reaches an error, on straight lines between its points in log-log."""
    logs = np.log([[p[2], p[1]] for p in points])[::-1]
    return float(np.exp(np.interp(np.log(error), logs[:, 0], logs[:, 1])))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("shared", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*", default=["bunny_diffuse", "hf25_coneman"])
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--halflight")
    args = parser.parse_args()
    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    root = pathlib.Path(__file__).resolve().parents[2]
    for name in args.scenes:
        kind, max_depth = SCENES[name]
        stem = f"{name.removesuffix('_path8')}.{kind}"
        description = json.load(open(args.shared / "reference" / f"{stem}.json"))
        reference = np.array(mi.Bitmap(str(args.shared / "reference" / f"{stem}.exr")).convert(
            mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
        scene = build(mi, description, args.shared, max_depth)
        runs = []
        for seed in range(4):
            start = time.process_time()
            image = np.array(mi.render(scene, spp=args.spp, seed=seed))
            runs.append((time.process_time() - start, relmse(image, reference)))
        noise = description["reference"]["noise_relMSE"]
        warm = sorted(runs[1:])[1]
        error = float(np.mean([r[1] for r in runs]))
        print(f"{name}: Mitsuba {mi.__version__} llvm_ad_rgb multijitter {args.spp} spp: {warm[0]:.2f} CPU s "
              f"(first {runs[0][0]:.2f}), relMSE {error:.3e} (reference's own noise {noise:.1e})", flush=True)
        if args.halflight:
            points = halflight_curve(mi, args.halflight, name, max_depth, description["light"], reference, root)
            for spp, cpu, e in points:
                print(f"    halflight {spp:4d} spp: {cpu:.2f} CPU s, relMSE {e:.3e}")
            ours = cpu_at_error(points, error)
            print(f"    halflight reaches relMSE {error:.3e} in {ours:.2f} CPU s: {ours / warm[0]:.2f} x Mitsuba's")
    print(f"peak memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB", file=sys.stderr)


if __name__ == "__main__":
    main()
