"""How markers move when the hand that carries them changes.

In the letters of ``kernels.chain``: marker m sits at place q on link i, at
p = o_i + T_i q relative to the root's origin. Then

- by its place: dp/dq = T_i;
- by the offset of a joint between it and the root: dp = T_up d(offset), with T_up the
  rotation of the link the joint belongs to;
- by the axis of a hinge d between it and the root: tilting axis a to exp(w) a turns
  the hinge's rotation R(a, angle) into exp(w) R exp(-w), hence

      dp = ((T_up - T_d) w) x (p - o_d),

  which vanishes at angle zero and for w along a; w runs over two tangents of a.

A marker depends on few of these numbers: those of the joints between it and the root.
Its columns are kept packed, with the number each belongs to beside them.
"""

from typing import NamedTuple

from handclean.arrays import Floats, Ints
from handclean.kernels import jit


class Packing(NamedTuple):
    """Which numbers of a hand's shape each of M markers depends on."""

    tangents: Floats
    """(D + 1, 3, 2) two unit vectors across each link's axis, in the axis' frame."""
    joint_up: Ints
    """(M, A) for each joint between marker and root the link it belongs to; -1 past
    the end."""
    hinges: Ints
    """(M, H) links of the hinges between marker and root; -1 past the end."""
    column: Ints
    """(M, 3 + 3 A + 2 H) the number of the shape behind each packed column of the
    marker; -1 past the end."""


@jit
def shape_jacobian(
    turn: Floats,
    origin: Floats,
    points: Floats,
    parent: Ints,
    link: Ints,
    packing: Packing,
    out: Floats,
) -> None:
    """Write the derivative of markers by joint offsets, hinge axes and their places.

    Parameters
    ----------
    turn, origin : as written by `chain.place_links`.
    points : (M, 3) [m] markers relative to the root's origin.
    parent : (D + 1,) parent of each link.
    link : (M,) link each marker sits on.
    packing : what each marker depends on.
    out : (M, 3, 3 + 3 A + 2 H) [1, m/rad]
        By the place, by each joint's offset, by each hinge's two tilts; zero past the
        end. Overwritten in full.
    """
    tangents, joint_up, hinges = packing.tangents, packing.joint_up, packing.hinges
    joints, turns = joint_up.shape[1], hinges.shape[1]
    for m in range(points.shape[0]):
        out[m] = 0.0
        out[m, :, 0:3] = turn[link[m]]
        for j in range(joints):
            if joint_up[m, j] >= 0:
                out[m, :, 3 + 3 * j : 6 + 3 * j] = turn[joint_up[m, j]]
        for h in range(turns):
            i = hinges[m, h]
            if i < 0:
                continue
            up = turn[parent[i]]
            x = points[m, 0] - origin[i, 0]
            y = points[m, 1] - origin[i, 1]
            z = points[m, 2] - origin[i, 2]
            for k in range(2):
                e, f, g = tangents[i, 0, k], tangents[i, 1, k], tangents[i, 2, k]
                ux = (up[0, 0] - turn[i, 0, 0]) * e + (up[0, 1] - turn[i, 0, 1]) * f
                uy = (up[1, 0] - turn[i, 1, 0]) * e + (up[1, 1] - turn[i, 1, 1]) * f
                uz = (up[2, 0] - turn[i, 2, 0]) * e + (up[2, 1] - turn[i, 2, 1]) * f
                ux += (up[0, 2] - turn[i, 0, 2]) * g
                uy += (up[1, 2] - turn[i, 1, 2]) * g
                uz += (up[2, 2] - turn[i, 2, 2]) * g
                c = 3 + 3 * joints + 2 * h + k
                out[m, 0, c] = uy * z - uz * y
                out[m, 1, c] = uz * x - ux * z
                out[m, 2, c] = ux * y - uy * x
