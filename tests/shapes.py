"""Small hands of any shape, and their Jacobian by the shape, for several tests."""

import numpy as np
from oracles import random_tree

from handclean.hand.model import Model
from handclean.kernels import bundle
from handclean.kernels.chain import place_links, place_points
from handclean.kernels.shape import shape_jacobian
from handclean.subject.shape import body_of, sections


def random_model(rng, bones=6, markers=7):
    tree = random_tree(rng, bones)
    return Model(
        tree=tree,
        labels=tuple(f"m{m}" for m in range(markers)),
        bone=rng.integers(0, bones, markers),
        at=rng.normal(scale=0.02, size=(markers, 3)),
    )


def body_for(model, hold=0.0, bound=0.0):
    hinges = len(model.tree.hinges)
    limits = model.tree.limits
    return body_of(model, np.zeros(hinges), np.full(hinges, hold), limits, bound)


def dense_shape_jacobian(model, pose):
    """(M, 3, N) by the kernel, spread over the shape's numbers."""
    body = body_for(model)
    room = bundle.make_room(body)
    links = body.links
    place_links(
        pose, links.parent, links.offset, links.axis, room.turn, room.origin, room.hinge
    )
    place_points(room.turn, room.origin, body.link, body.at, room.point)
    room.by_shape[:] = np.nan
    shape_jacobian(
        room.turn,
        room.origin,
        room.point,
        links.parent,
        body.link,
        body.packing,
        room.by_shape,
    )
    assert np.isfinite(room.by_shape).all()
    out = np.zeros((len(model.labels), 3, sum(sections(model))))
    for m, columns in enumerate(body.packing.column):
        for c, at in enumerate(columns):
            if at >= 0:
                out[m, :, at] += room.by_shape[m, :, c]
    return out
