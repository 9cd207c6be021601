"""Terrain backend of a flight simulator: exact ground heights, replays, measured errors, stills.

Heights are metres above the ellipsoid, angles degrees, points body-fixed (ECEF) metres; names say
so. `docs/python.md` of the repository has examples.

>>> import overfly
>>> terrain = overfly.Terrain("earth")
>>> summit = terrain.exact_heights(46.8523, -121.7603)
>>> int(summit.status) == overfly.Status.OK
True
"""

from enum import IntEnum

from ._native import (
    Contacts,
    FrameResult,
    Heights,
    OverflyError,
    Ray,
    Readiness,
    Replay,
    Terrain,
    View,
    ecef_from_geodetic,
    geodetic_from_ecef,
    measure,
    replay,
    still,
)


class Status(IntEnum):
    """How a question about the ground was answered."""

    OK = 0
    """As asked."""
    COARSER = 1
    """From the finest level that is there; the bound says how sure that is."""
    NOT_READY = 2
    """No page of that place is there: there is no number."""
    REFUSED = 3
    """The question has no answer anywhere."""


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
