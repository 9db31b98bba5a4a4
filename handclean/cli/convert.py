"""``handclean convert``."""

from pathlib import Path

import click

from handclean.cli import completion, options
from handclean.commands.shared.choices import Converting
from handclean.commands.table import work_of
from handclean.runner import many
from handclean.runner.batch import Batch


@click.command("convert")
@click.option(
    "--joint-map",
    metavar="NAME|FILE",
    shell_complete=completion.joint_maps,
    help="Whose joints a skinned hand (.glb) has.  [default: the shipped that fits]",
)
@click.option(
    "--unnamed",
    is_flag=True,
    help="Into a TRC, write points without a name, too.",
)
@click.option(
    "--bvh-up",
    type=click.Choice(("+y", "+z")),
    default="+y",
    help="Axis that points up in a BVH; the take is turned if another does.",
    show_default=True,
)
@options.batch(
    options.SOURCES,
    options.OUTPUT,
    options.SUBJECTS,
    options.MANY,
    options.TELLING,
)
def command(batch: Batch, joint_map: str | None, unnamed: bool, bvh_up: str) -> int:
    """Convert takes from any format into any other.

    A take with joint angles becomes an animation of the hand's skin (.glb), its own if
    a --subject has one. A subject becomes a .glb or a mesh (.ply .obj .stl), a skinned
    hand of another program (.glb) a subject, a mesh another mesh.

    \b
    Example:
        handclean convert take_07.c3d -o take_07.h5
        handclean convert take_07.angles.h5 -o take_07.glb --subject S01.h5
        handclean convert take_07.angles.h5 -o take_07.bvh --bvh-up +z
        handclean convert hand.glb -o hand.subject.h5 --joint-map webxr
    """
    chosen = None
    if joint_map or unnamed or bvh_up != Converting.bvh_up:
        chosen = Converting(joint_map=joint_map or "", unnamed=unnamed, bvh_up=bvh_up)
    if joint_map and joint_map.endswith(".toml"):
        batch = options.with_files(batch, joint_map=Path(joint_map))
    return many.run(work_of("convert", batch, chosen), batch)
