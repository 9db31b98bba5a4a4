"""The hand that layouts are made for."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from handclean.commands.shared.take_options import options_of
from handclean.errors import Place, UsageError
from handclean.hand.surface import Surface
from handclean.hand.template import template
from handclean.hand.template_surface import template_surface
from handclean.io.hdf5.subject import read_subject
from handclean.runner.batch import Source
from handclean.tree import JointTree


@dataclass(frozen=True, kw_only=True)
class LayoutHand:
    """A hand with its skin, and whose it is."""

    name: str
    tree: JointTree
    surface: Surface


def hand_of_layout(
    source: Source, sides: Sequence[str] = (), *, forearm: bool = False
) -> LayoutHand:
    """Return the subject's hand, or the template's of the side that moves most often.

    Parameters
    ----------
    sides : of the motions; "" where that is not known.
    forearm : whether the template's should have one.

    Raises
    ------
    UsageError
        If there are several subjects, or the one is not of the side asked for.
    """
    options = options_of(source)
    side = "" if options.side == "both" else options.side
    if len(options.subjects) > 1:
        raise UsageError("--subject: is given twice; a layout is for one hand")
    if not options.subjects:
        known = Counter(s for s in sides if s)
        side = side or (max(known, key=known.__getitem__) if known else "right")
        tree = template(side, forearm=forearm)
        surface = template_surface(tree)
        return LayoutHand(name="template hand", tree=tree, surface=surface)
    (path,) = options.subjects
    subject = read_subject(path)
    tree = subject.model.tree
    if tree.kind != "hand":
        raise UsageError("is no hand", where=Place(path, option="--subject"))
    if side and tree.side != side:
        raise UsageError(f"--side {side}: the subject is a {tree.side} hand")
    skin = subject.surface if subject.surface is not None else template_surface(tree)
    return LayoutHand(name=subject.name or path.stem, tree=tree, surface=skin)
