"""Scenes: of files, and of Python objects."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _native, _toml
from ._arrays import floats
from ._mesh import Mesh, PathLike
from .ddf import Field
from .spheres import SphereSet

Table = Mapping[str, Any]
_PLURALS = {"shapes": "shape", "lights": "light", "materials": "material", "media": "medium", "techniques": "technique"}


class Scene:
    """What there is, as functions of time.

    The keywords are the tables of a scene file (``docs/scene-format.md``), with lists for tables that come more than once:

    >>> scene = Scene(
    ...     camera={"origin": [0, 1, 5], "target": [0, 0.5, 0]},
    ...     environment="sky",
    ...     shapes=[{"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5}, {"type": "plane"}],
    ... )

    Where a file is expected, a :class:`Mesh`, a :class:`halflight.ddf.Field`, a :class:`halflight.spheres.SphereSet` or an
    array of rows × columns × 3 may stand instead. Names of files start from ``folder``.
    """

    def __init__(
        self,
        *,
        folder: PathLike = ".",
        set: Optional[Mapping[str, Any]] = None,
        simd: Optional[str] = None,
        **tables: Any,
    ) -> None:
        table = {_PLURALS.get(name, name): item for name, item in tables.items()}
        self._folder = home = tempfile.TemporaryDirectory(prefix="halflight-")
        kept: dict[int, str] = {}

        def keep(item: object) -> Optional[str]:
            if not isinstance(item, (Mesh, Field, SphereSet, np.ndarray)):
                return None
            if isinstance(item, np.ndarray) and item.ndim != 3:
                return None
            if id(item) not in kept:
                kept[id(item)] = _write(home.name, len(kept), item)
            return kept[id(item)]

        self.text: Optional[str] = _toml.document(table, os.path.abspath(os.fspath(folder)), keep)
        path = os.path.join(home.name, "scene.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.text)
        try:
            self._open(path, simd=simd, set=_settings(set))
        except _native.Error as error:
            raise type(error)(_without(home.name, str(error))) from None

    @classmethod
    def load(
        cls,
        path: PathLike,
        *,
        environment: Union[PathLike, npt.NDArray[Any], None] = None,
        material: Optional[str] = None,
        shapes: Optional[Mapping[str, PathLike]] = None,
        set: Optional[Mapping[str, Any]] = None,
        up: str = "y",
        size: Optional[tuple[int, int]] = None,
        simd: Optional[str] = None,
    ) -> Scene:
        """Load a scene file, a bare asset or ``demo:NAME``, with the changes that the command's options make.

        ``environment`` may be a latitude–longitude array, ``set`` has keys such as ``"camera.aperture_radius"``, ``shapes``
        puts fields (``.ddf``) or meshes in the place of shapes by their names, ``simd`` pins the instruction set.
        """
        if up not in ("y", "z"):
            raise _native.UsageError(f"up: there are y and z, not {up!r}")
        scene = cls.__new__(cls)
        scene.text = None
        scene._folder = None
        if isinstance(environment, np.ndarray):
            scene._folder = tempfile.TemporaryDirectory(prefix="halflight-")
            environment = os.path.join(scene._folder.name, _write(scene._folder.name, 0, environment))
        scene._open(
            os.fspath(path),
            up_z=up == "z",
            environment=None if environment is None else os.fspath(environment),
            material=material,
            shapes=[(name, os.fspath(file)) for name, file in (shapes or {}).items()],
            set=_settings(set),
            size=size,
            simd=simd,
        )
        return scene

    _folder: Optional[tempfile.TemporaryDirectory[str]]

    def _open(self, path: str, **options: Any) -> None:
        self._options = (path, options)
        self._native = _native.Stage(path, **options)

    def __reduce__(self) -> tuple[Any, ...]:
        """Scenes travel to other processes as what they were made from."""
        if self._folder is None:
            return _reopened, self._options
        files = {}
        for name in sorted(os.listdir(self._folder.name)):
            with open(os.path.join(self._folder.name, name), "rb") as file:
                files[name] = file.read()
        path, options = self._options
        return _unpacked, (self._folder.name, files, path, options, self.text)

    @property
    def name(self) -> str:
        """The file or the demo, as it was asked for."""
        return self._native.name

    @property
    def hash(self) -> str:
        """Of everything that the scene was made from."""
        return self._native.hash

    @property
    def simd(self) -> str:
        """The instruction set of its rays: baseline, avx2 or avx512."""
        return self._native.simd

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows that the scene asks for."""
        return self._native.size

    @property
    def warnings(self) -> list[str]:
        """What the loader did that the user should know."""
        return self._native.warnings

    @property
    def files(self) -> list[str]:
        """Every file that was read beside the scene file."""
        return [os.fspath(path) for path in self._native.files]

    @property
    def duration(self) -> Optional[float]:
        """Seconds until all keyframes and animations have ended; None if there are none."""
        return self._native.duration

    @property
    def is_animated(self) -> bool:
        """Whether anything depends on time."""
        return self._native.is_animated

    def describe(self) -> str:
        """What the scene holds, in lines."""
        return self._native.describe()

    def __repr__(self) -> str:
        return f"Scene({self.name!r}, hash {self.hash})"


def _without(folder: str, message: str) -> str:
    """A message without the place where the text of a scene of Python objects lies for the renderer, which nobody sees."""
    for place in (os.path.realpath(folder), folder):
        scene = os.path.join(place, "scene.toml")
        message = message.replace(scene, "the scene of these tables").replace(place + os.sep, "")
    return message


def _reopened(path: str, options: dict[str, Any]) -> Scene:
    scene = Scene.__new__(Scene)
    scene.text = None
    scene._folder = None
    scene._open(path, **options)
    return scene


def _unpacked(home: str, files: Mapping[str, bytes], path: str, options: dict[str, Any], text: Optional[str]) -> Scene:
    scene = Scene.__new__(Scene)
    scene.text = text
    scene._folder = tempfile.TemporaryDirectory(prefix="halflight-")

    def moved(name: Any) -> Any:
        is_inside = isinstance(name, str) and os.path.dirname(name) == home
        return os.path.join(scene._folder.name, os.path.basename(name)) if is_inside and scene._folder else name

    for name, data in files.items():
        with open(os.path.join(scene._folder.name, name), "wb") as file:
            file.write(data)
    scene._open(moved(path), **{key: moved(item) for key, item in options.items()})
    return scene


def _write(folder: str, number: int, item: Any) -> str:
    """Puts an object into a folder, and says under which name."""
    if isinstance(item, Mesh):
        name = f"mesh{number}.ply"
        item.save(os.path.join(folder, name))
    elif isinstance(item, Field):
        name = f"field{number}.ddf"
        item.save(os.path.join(folder, name))
    elif isinstance(item, SphereSet):
        name = f"spheres{number}.spheres"
        item.save(os.path.join(folder, name))
    else:
        name = f"picture{number}.exr"
        _native.save_image(os.path.join(folder, name), floats("a picture", item, (None, None, 3)))
    return name


def _settings(settings: Optional[Mapping[str, Any]]) -> list[str]:
    """``key=value`` as the command's ``--set`` takes it."""
    return [f"{name}={setting(name, item)}" for name, item in (settings or {}).items()]


def setting(name: str, item: Any) -> str:
    """A value as ``--set`` takes it: text as it stands, anything else as in a scene file."""
    return item if isinstance(item, str) else _toml.value(item, os.getcwd(), lambda _: None, name)


SceneLike = Union[Scene, PathLike]


def load(path: PathLike, **changes: Any) -> Scene:
    """Load a scene file, a bare asset or ``demo:NAME``; see :meth:`Scene.load` for the changes that can be made."""
    return Scene.load(path, **changes)


def as_scene(value: SceneLike) -> Scene:
    """A scene, or that of a file."""
    return value if isinstance(value, Scene) else Scene.load(value)
