from collections.abc import Sequence
from enum import IntEnum
from os import PathLike
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Contacts",
    "FrameResult",
    "Heights",
    "OverflyError",
    "Ray",
    "Readiness",
    "Replay",
    "Status",
    "Terrain",
    "View",
    "ecef_from_geodetic",
    "geodetic_from_ecef",
    "measure",
    "replay",
    "still",
]

_Floats: TypeAlias = NDArray[np.float64]
_Path: TypeAlias = str | PathLike[str]
_Show: TypeAlias = Literal["shaded", "wireframe", "level", "error", "residency", "normals", "range"]

class OverflyError(RuntimeError): ...

class Status(IntEnum):
    OK = 0
    COARSER = 1
    NOT_READY = 2
    REFUSED = 3

@final
class View:
    def __new__(
        cls,
        lat_deg: float,
        lon_deg: float,
        height_m: float,
        *,
        look_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
        field_of_view_deg: float = 60.0,
        size_px: tuple[int, int] = (1280, 720),
        near_m: float = 0.1,
    ) -> View: ...
    @property
    def lat_deg(self) -> float: ...
    @property
    def lon_deg(self) -> float: ...
    @property
    def height_m(self) -> float: ...
    @property
    def look_deg(self) -> tuple[float, float, float]: ...
    @property
    def field_of_view_deg(self) -> float: ...
    @property
    def size_px(self) -> tuple[int, int]: ...
    @property
    def near_m(self) -> float: ...

@final
class Heights:
    @property
    def height_m(self) -> _Floats: ...
    @property
    def bound_m(self) -> _Floats: ...
    @property
    def sea_level_m(self) -> _Floats: ...
    @property
    def level(self) -> NDArray[np.uint8]: ...
    @property
    def status(self) -> NDArray[np.uint8]: ...
    @property
    def water(self) -> NDArray[np.bool_]: ...

@final
class Contacts:
    @property
    def agl_m(self) -> _Floats: ...
    @property
    def contact_m(self) -> _Floats: ...
    @property
    def normal(self) -> _Floats: ...
    @property
    def bound_m(self) -> _Floats: ...
    @property
    def status(self) -> NDArray[np.uint8]: ...

@final
class Ray:
    @property
    def status(self) -> int: ...
    @property
    def distance_m(self) -> float | None: ...
    @property
    def point_m(self) -> tuple[float, float, float] | None: ...
    @property
    def normal(self) -> tuple[float, float, float] | None: ...
    @property
    def level(self) -> int | None: ...

@final
class Readiness:
    @property
    def fraction(self) -> float: ...
    @property
    def worst_level(self) -> int | None: ...
    @property
    def missing(self) -> int: ...

@final
class FrameResult:
    @property
    def frame(self) -> int: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def bound_px(self) -> float: ...
    @property
    def digest(self) -> str: ...

@final
class Terrain:
    def __new__(
        cls,
        scene: _Path = "earth",
        *,
        workers: int = 0,
        pages: Literal["waited", "as_ready"] = "waited",
    ) -> Terrain: ...
    @property
    def body(self) -> tuple[float, float]: ...
    @property
    def scene_text(self) -> str: ...
    def frame(
        self, time_s: float, views: Sequence[View], *, hold_lod: bool = False
    ) -> FrameResult: ...
    def heights(self, lat_deg: ArrayLike, lon_deg: ArrayLike, query: str = "best") -> Heights: ...
    def exact_heights(
        self, lat_deg: ArrayLike, lon_deg: ArrayLike, query: str = "best"
    ) -> Heights: ...
    def agl(self, ecef_m: ArrayLike, query: str = "best") -> Contacts: ...
    def ray(
        self,
        origin_m: ArrayLike,
        direction: ArrayLike,
        max_m: float = ...,
        query: str = "best",
    ) -> Ray: ...
    def request(self, lat_deg: float, lon_deg: float, radius_m: float, level: int) -> int: ...
    def release(self, ticket: int) -> None: ...
    def readiness(
        self, lat_deg: float, lon_deg: float, radius_m: float, level: int
    ) -> Readiness: ...
    def wait_ready(
        self,
        lat_deg: float,
        lon_deg: float,
        radius_m: float,
        level: int,
        timeout_s: float = 60.0,
    ) -> None: ...
    def record(self, path: _Path, *, name: str = "python", rate_hz: float = 60.0) -> None: ...
    def finish_recording(self) -> int: ...
    def close(self) -> None: ...
    def __enter__(self) -> Terrain: ...
    def __exit__(self, *raised: object) -> None: ...

@final
class Replay:
    @property
    def name(self) -> str: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def first_frame(self) -> int: ...
    @property
    def time_s(self) -> _Floats: ...
    @property
    def frame_ms(self) -> _Floats: ...
    @property
    def waited_ms(self) -> _Floats: ...
    @property
    def stages_ms(self) -> dict[str, _Floats]: ...
    @property
    def counts(self) -> dict[str, NDArray[Any]]: ...
    @property
    def digests(self) -> NDArray[np.uint64]: ...
    @property
    def digest(self) -> str: ...
    @property
    def same(self) -> bool | None: ...
    @property
    def diverged(self) -> tuple[int, str] | None: ...
    @property
    def damage(self) -> str | None: ...

def replay(
    flight: _Path,
    *,
    frames: tuple[int, int] | None = None,
    scene: _Path | None = None,
    workers: int | None = None,
    size_px: tuple[int, int] = (1280, 720),
    from_start: bool = False,
) -> Replay: ...
def measure(
    flight: _Path,
    *,
    frames: tuple[int, int] | None = None,
    scene: _Path | None = None,
    every: int | None = None,
    rays: int = 100_000,
    size_px: tuple[int, int] = (1280, 720),
    workers: int | None = None,
    cell_px: float = 1.0,
) -> dict[str, Any]: ...
def still(
    view: View,
    *,
    scene: _Path = "earth",
    agl: bool = False,
    show: _Show = "shaded",
    time_s: float = 0.0,
) -> NDArray[np.uint8]: ...
def ecef_from_geodetic(
    lat_deg: ArrayLike,
    lon_deg: ArrayLike,
    height_m: ArrayLike,
    *,
    body: tuple[float, float] | None = None,
) -> _Floats: ...
def geodetic_from_ecef(
    ecef_m: ArrayLike, *, body: tuple[float, float] | None = None
) -> tuple[_Floats, _Floats, _Floats]: ...
