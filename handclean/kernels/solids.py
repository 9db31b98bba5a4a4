"""Distances between capsules, segments and the solids that hands grasp.

A capsule is all points within a radius of a segment. A solid sits at its own frame's
origin and is one of three kinds, given by four numbers (a, b, c, e) in metres:

====  =========  ==========================================================
0     box        half sizes a, b, c, its edges rounded by e (added outside);
                 a sphere is a box of half sizes zero
1     cylinder   radius a, half height c along z, rounded by e
2     ellipsoid  half axes a, b, c
====  =========  ==========================================================

The distance of kinds 0 and 1 is exact, hence convex along any line, so that a search by
golden section finds its smallest value on a segment. For the ellipsoid it is exact to
first order near the surface: k (k - 1) / g with k = |p / axes| and g = |p / axes^2|.
"""

import math
from typing import NamedTuple

import numpy as np

from handclean.arrays import Bools, Floats, Ints
from handclean.kernels import jit

BOX, CYLINDER, ELLIPSOID = 0, 1, 2
"""Kinds of solids."""

_GOLDEN_SECTION = 0.6180339887498949
"""(sqrt(5) - 1) / 2, of the search by golden section."""


class Capsules(NamedTuple):
    """L capsules in T frames."""

    start: Floats
    """(T, L, 3) [m] one end of each segment."""
    stop: Floats
    """(T, L, 3) [m] the other end."""
    radius: Floats
    """(L,) [m]"""


class Solids(NamedTuple):
    """O solids in T frames."""

    frames: Floats
    """(T, O, 3, 4) where they are, as in `into_frame`."""
    kinds: Ints
    """(O,) 0, 1 or 2."""
    sizes: Floats
    """(O, 4) [m] as above."""
    reach: Floats
    """(O,) [m] radius of a ball around each."""


@jit
def solid_distance(x: float, y: float, z: float, kind: int, size: Floats) -> float:
    """[m] Signed distance of a point from a solid, negative inside.

    Parameters
    ----------
    x, y, z : [m] the point in the solid's frame.
    kind : 0, 1 or 2.
    size : (4,) [m] as above.
    """
    if kind == ELLIPSOID:
        a, b, c = x / size[0], y / size[1], z / size[2]
        k = math.sqrt(a * a + b * b + c * c)
        if k < 1e-9:
            return -float(min(size[0], min(size[1], size[2])))
        a, b, c = a / size[0], b / size[1], c / size[2]
        return k * (k - 1.0) / math.sqrt(a * a + b * b + c * c)
    if kind == CYLINDER:
        u = math.sqrt(x * x + y * y) - size[0]
        v = abs(z) - size[2]
        w = -1e9
    else:
        u, v, w = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
    inside = min(max(u, max(v, w)), 0.0)
    u, v, w = max(u, 0.0), max(v, 0.0), max(w, 0.0)
    return float(inside + math.sqrt(u * u + v * v + w * w) - size[3])


@jit
def segment_solid_distance(p: Floats, q: Floats, kind: int, size: Floats) -> float:
    """[m] Smallest signed distance from a solid over the segment from p to q.

    Parameters
    ----------
    p, q : (3,) [m] ends, in the solid's frame.
    """
    dx, dy, dz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    low, high = 0.0, 1.0
    s, t = 1.0 - _GOLDEN_SECTION, _GOLDEN_SECTION
    at_s = solid_distance(p[0] + s * dx, p[1] + s * dy, p[2] + s * dz, kind, size)
    at_t = solid_distance(p[0] + t * dx, p[1] + t * dy, p[2] + t * dz, kind, size)
    span = math.sqrt(dx * dx + dy * dy + dz * dz)
    best = min(
        solid_distance(p[0], p[1], p[2], kind, size),
        solid_distance(q[0], q[1], q[2], kind, size),
    )
    while (high - low) * span > 1e-5:
        if at_s < at_t:
            high, t, at_t = t, s, at_s
            s = high - _GOLDEN_SECTION * (high - low)
            at_s = solid_distance(
                p[0] + s * dx, p[1] + s * dy, p[2] + s * dz, kind, size
            )
        else:
            low, s, at_s = s, t, at_t
            t = low + _GOLDEN_SECTION * (high - low)
            at_t = solid_distance(
                p[0] + t * dx, p[1] + t * dy, p[2] + t * dz, kind, size
            )
    return float(min(best, min(at_s, at_t)))


@jit
def segment_meets_solid(p: Floats, q: Floats, kind: int, size: Floats) -> bool:
    """Whether the segment from p to q passes through a solid (in whose frame it is)."""
    if kind == ELLIPSOID:
        a = b = c = 0.0
        for n in range(3):
            start, along = p[n] / size[n], (q[n] - p[n]) / size[n]
            a += along * along
            b += start * along
            c += start * start
        s = min(max(-b / a, 0.0), 1.0) if a > 0.0 else 0.0
        return bool(c + 2.0 * s * b + s * s * a < 1.0)
    return bool(segment_solid_distance(p, q, kind, size) < 0.0)


@jit
def segments_distance(p: Floats, q: Floats, a: Floats, b: Floats) -> float:
    """[m] Distance between the segments from p to q and from a to b.

    Closest points of two segments after Ericson, Real-time collision detection (2005),
    5.1.9: the lines' closest points, clamped one after the other.

    Parameters
    ----------
    p, q, a, b : (3,) [m]
    """
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    wx, wy, wz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    uu = ux * ux + uy * uy + uz * uz
    vv = vx * vx + vy * vy + vz * vz
    uv = ux * vx + uy * vy + uz * vz
    uw = ux * wx + uy * wy + uz * wz
    vw = vx * wx + vy * wy + vz * wz
    area = uu * vv - uv * uv
    s = min(max((uv * vw - vv * uw) / area, 0.0), 1.0) if area > 1e-18 else 0.0
    t = (uv * s + vw) / vv if vv > 0.0 else -1.0
    if t < 0.0:
        t = 0.0
        s = min(max(-uw / uu, 0.0), 1.0) if uu > 0.0 else 0.0
    elif t > 1.0:
        t = 1.0
        s = min(max((uv - uw) / uu, 0.0), 1.0) if uu > 0.0 else 0.0
    dx = wx + s * ux - t * vx
    dy = wy + s * uy - t * vy
    dz = wz + s * uz - t * vz
    return math.sqrt(dx * dx + dy * dy + dz * dz)


@jit
def into_frame(point: Floats, frame: Floats, out: Floats) -> None:
    """Write a laboratory point in the coordinates of a frame.

    Parameters
    ----------
    point : (3,) [m]
    frame : (3, 4) rotation to laboratory orientation and origin [m].
    out : (3,) [m], overwritten in full.
    """
    x, y, z = point[0] - frame[0, 3], point[1] - frame[1, 3], point[2] - frame[2, 3]
    for n in range(3):
        out[n] = frame[0, n] * x + frame[1, n] * y + frame[2, n] * z


@jit
def passes_near(p: Floats, q: Floats, centre: Floats, reach: float) -> bool:
    """Whether the segment from p to q comes within ``reach`` of a point."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    wx, wy, wz = centre[0] - p[0], centre[1] - p[1], centre[2] - p[2]
    uu = ux * ux + uy * uy + uz * uz
    s = (ux * wx + uy * wy + uz * wz) / uu if uu > 0.0 else 0.0
    s = min(max(s, 0.0), 1.0)
    x, y, z = wx - s * ux, wy - s * uy, wz - s * uz
    return bool(x * x + y * y + z * z < reach * reach)


@jit
def is_blocked(
    marker: Floats,
    camera: Floats,
    t: int,
    capsules: Capsules,
    solids: Solids,
    room: Floats,
) -> bool:
    """Whether a capsule or solid stands between a marker and a camera.

    Parameters
    ----------
    marker, camera : (3,) [m]
    t : in which frame.
    capsules, solids : what may be in the way.
    room : (3, 3) work space.
    """
    start, stop, radius = capsules.start[t], capsules.stop[t], capsules.radius
    frames, kinds = solids.frames[t], solids.kinds
    for k in range(radius.shape[0]):
        if segments_distance(marker, camera, start[k], stop[k]) < radius[k]:
            return True
    for o in range(kinds.shape[0]):
        for n in range(3):
            room[0, n] = frames[o, n, 3]
        if passes_near(marker, camera, room[0], solids.reach[o]):
            into_frame(marker, frames[o], room[1])
            into_frame(camera, frames[o], room[2])
            if segment_meets_solid(room[1], room[2], kinds[o], solids.sizes[o]):
                return True
    return False


@jit
def sightlines(
    markers: Floats, cameras: Floats, capsules: Capsules, solids: Solids, out: Bools
) -> None:
    """Write which cameras see which markers past capsules and solids.

    A camera sees a marker if the segment between them meets nothing. A marker inside
    a capsule or solid is seen by none.

    Parameters
    ----------
    markers : (T, M, 3) [m]
    cameras : (C, 3) [m]
    capsules, solids : what may be in the way.
    out : (T, M, C), overwritten in full.
    """
    room = np.zeros((3, 3))
    for t in range(markers.shape[0]):
        for m in range(markers.shape[1]):
            for c in range(cameras.shape[0]):
                out[t, m, c] = not is_blocked(
                    markers[t, m], cameras[c], t, capsules, solids, room
                )


@jit
def capsule_gaps(
    start: Floats,
    stop: Floats,
    radius: Floats,
    frames: Floats,
    kind: int,
    size: Floats,
    out: Floats,
) -> None:
    """Write how far capsules are from a solid, negative where they reach into it.

    Parameters
    ----------
    start, stop : (T, L, 3) [m] ends of L capsules.
    radius : (L,) [m]
    frames : (T, 3, 4) the solid's frames, as in `into_frame`.
    kind : of the solid; size : (4,) [m]
    out : (T, L) [m], overwritten in full.
    """
    p, q = start[0, 0] * 0.0, start[0, 0] * 0.0
    for t in range(start.shape[0]):
        for k in range(radius.shape[0]):
            into_frame(start[t, k], frames[t], p)
            into_frame(stop[t, k], frames[t], q)
            out[t, k] = segment_solid_distance(p, q, kind, size) - radius[k]


@jit
def hide_behind_markers(
    markers: Floats, cameras: Floats, apart: float, out: Bools
) -> None:
    """Take out of a camera's sight the markers that stand behind another marker.

    Parameters
    ----------
    markers : (T, M, 3) [m]
    cameras : (C, 3) [m]
    apart : [m] two images touch when their lines of sight come closer than this.
    out : (T, M, C) what is seen so far; the farther marker of such a pair is taken out.
    """
    for t in range(markers.shape[0]):
        for c in range(cameras.shape[0]):
            for m in range(markers.shape[1]):
                if not out[t, m, c]:
                    continue
                x = markers[t, m, 0] - cameras[c, 0]
                y = markers[t, m, 1] - cameras[c, 1]
                z = markers[t, m, 2] - cameras[c, 2]
                far = math.sqrt(x * x + y * y + z * z)
                x, y, z = x / far, y / far, z / far
                for n in range(markers.shape[1]):
                    u = markers[t, n, 0] - cameras[c, 0]
                    v = markers[t, n, 1] - cameras[c, 1]
                    w = markers[t, n, 2] - cameras[c, 2]
                    along = u * x + v * y + w * z
                    aside = u * u + v * v + w * w - along * along
                    if along < far - 1e-9 and aside < apart * apart:
                        out[t, m, c] = False
                        break
