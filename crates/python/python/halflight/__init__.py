"""halflight: a renderer for scenes that move, lit from everywhere, made of measured materials.

>>> import halflight as hl
>>> scene = hl.load("demo:cornell-box")
>>> picture = hl.render(scene, samples=2, size=(32, 32))
>>> picture.rgb.shape
(32, 32, 3)

Arrays come and go without copies where their type and layout fit. Long work leaves the interpreter's lock alone; Ctrl-C ends
it with :class:`Interrupted`, which carries what there was.
"""

from __future__ import annotations

from . import brdf, ddf, frequency, sh, spheres
from ._compare import Comparison, compare
from ._mesh import Mesh
from ._native import Error, Interrupted, UsageError, __version__, demos, detect_simd
from ._picture import Picture, load_picture, merge
from ._render import frames, render, techniques, tile_size
from ._scene import Scene, load

__all__ = [
    "Comparison",
    "Error",
    "Interrupted",
    "Mesh",
    "Picture",
    "Scene",
    "UsageError",
    "__version__",
    "brdf",
    "compare",
    "ddf",
    "demos",
    "detect_simd",
    "frames",
    "frequency",
    "load",
    "load_picture",
    "merge",
    "render",
    "sh",
    "spheres",
    "techniques",
    "tile_size",
]
