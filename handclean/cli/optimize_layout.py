"""``handclean optimize-layout``."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from handclean.cli import completion, options
from handclean.commands.shared.choices import JudgingLayouts, LayingOut
from handclean.commands.table import JUDGE_LAYOUTS, work_of
from handclean.errors import UnknownSettingError, UsageError
from handclean.ik.settings import SolveConfig
from handclean.layouts.evaluate_settings import EvaluateConfig
from handclean.layouts.settings import LayoutConfig
from handclean.runner import many, progress
from handclean.runner.batch import Batch
from handclean.runner.command import Work

SHEETS = (".pdf", ".svg", ".png")


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What the options ask for that are no settings.

    Attributes
    ----------
    from_set : marker set to choose from, "" for all of the skin.
    prior : file of the posture subspace.
    painted : file of the skin with forbidden places painted.
    by_error : whether to try several numbers of directions.
    marker_mm : diameter of the markers.
    name : of the marker set, "" for the file's.
    sheets : placement sheets to write.
    glb : file of the hand with its markers.
    evaluate : whether the inputs are layouts to judge.
    on : motion to judge them on.
    """

    from_set: str
    prior: Path | None
    painted: Path | None
    by_error: bool
    marker_mm: float
    name: str
    sheets: tuple[Path, ...]
    glb: Path | None
    evaluate: bool
    on: tuple[Path, ...]

    @property
    def beside(self) -> list[Path]:
        """Files to write beside the marker set."""
        return [*self.sheets, *([self.glb] if self.glb is not None else [])]


class SeveralOn(click.Command):
    """A command whose option ``--on`` takes all that follows it."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Repeat the option for each of its values."""
        given: list[str] = []
        on = False
        for word in args:
            on = word == "--on" or (on and not word.startswith("-"))
            if on and word != "--on" and given[-1] != "--on":
                given.append("--on")
            given.append(word)
        return super().parse_args(ctx, given)


@click.command("optimize-layout", cls=SeveralOn)
@options.settings("optimize-layout", LayoutConfig)
@click.option(
    "--from-set",
    default="",
    metavar="NAME|FILE",
    shell_complete=completion.marker_sets,
    help="Choose from the markers of this set, instead of from all of the skin.",
)
@click.option(
    "--prior",
    type=options.PATH,
    metavar="FILE",
    help="Posture subspace.  [default: that of MOTION; to evaluate, the one that "
    "ships]",
)
@click.option(
    "--painted",
    type=options.PATH,
    metavar="FILE.ply",
    help="The hand's skin with the places painted red that should have no marker.",
)
@click.option(
    "--by-error",
    is_flag=True,
    help="Try 3 to 12 directions; keep the layout that, simulated on MOTION, tells the "
    "skin best.",
)
@click.option(
    "--marker-mm",
    default=6.0,
    show_default=True,
    help="Diameter of the markers, which sit on the skin.",
)
@click.option("--name", default="", help="Of the marker set.  [default: the file's]")
@click.option(
    "--sheet",
    "sheets",
    multiple=True,
    type=options.PATH,
    metavar="FILE",
    help="A placement sheet at true scale to print (.pdf .svg .png); once per file.",
)
@click.option(
    "--glb", type=options.PATH, metavar="FILE", help="The hand with its markers."
)
@click.option("--evaluate", is_flag=True, help="Judge layouts, the inputs.")
@click.option(
    "--on",
    multiple=True,
    type=options.PATH,
    metavar="MOTION...",
    help="What layouts are judged on: not what they were made for.",
)
@options.settings("evaluate-layout", EvaluateConfig, prefix="judge", into="judged")
@options.batch(
    [*options.SOURCES, options.subject, options.side],
    options.ONE_DRAWN_OUTPUT,
    options.TELLING,
)
def command(
    batch: Batch, settings: LayoutConfig, judged: EvaluateConfig, **given: Any
) -> int:
    """Find the few markers that tell a motion best, or judge such layouts.

    MOTION are sessions with joint angles or BVH files; the layout is a marker set as
    'label' and 'solve' take it. With --evaluate the inputs are layouts, marker sets
    that ship or files: their markers are simulated on --on MOTION... and solved, and
    the skin is compared.

    \b
    Example:
        handclean optimize-layout takes/*.h5 -o six.toml --sheet six.pdf
        handclean optimize-layout --evaluate six.toml hoyet6 --on others/*.h5
    """
    asked = Asked(**given)
    if asked.by_error and (settings.full or settings.dimensions):
        raise UsageError("--by-error: finds the dimensions; leave out --dimensions")
    if asked.evaluate:
        return _evaluate(batch, settings, judged, asked)
    if asked.on:
        raise UsageError("--on: is for --evaluate; motion to optimize for is an input")
    for sheet in asked.sheets:
        if sheet.suffix.lower() not in SHEETS:
            raise UnknownSettingError(sheet, "format for sheets", sheet.suffix, SHEETS)
    if asked.glb is not None and asked.glb.suffix.lower() != ".glb":
        raise UsageError(f"--glb {asked.glb}: should end in .glb")
    try:
        chosen = LayingOut(
            layout=settings,
            name=asked.name,
            from_set=asked.from_set,
            marker_mm=asked.marker_mm,
            by_error=asked.by_error,
            beside=tuple(path.suffix.lower() for path in asked.beside),
        )
    except ValueError as error:
        raise UsageError(str(error)) from None
    layout = Path(asked.from_set) if asked.from_set.endswith(".toml") else None
    batch = options.with_files(
        batch, from_set=layout, prior=asked.prior, painted=asked.painted
    )
    with progress.shown(batch.quiet):
        work = work_of("optimize-layout", batch, chosen)
        return many.reduce(work, batch, asked.beside)


def _evaluate(
    batch: Batch, settings: LayoutConfig, judged: EvaluateConfig, asked: Asked
) -> int:
    if not asked.on:
        raise UsageError("--on: is missing; it should name motion to judge layouts on")
    if batch.output is not None or asked.beside or asked.painted is not None:
        raise UsageError("--evaluate: writes nothing; leave out -o and other files")
    chosen = JudgingLayouts(
        evaluate=judged, anchor=settings.anchor, solve=SolveConfig()
    )
    numbered = {f"on {n}": path for n, path in enumerate(asked.on, start=1)}
    batch = options.with_files(batch, prior=asked.prior, **numbered)
    with progress.shown(batch.quiet):
        return many.reduce(Work.of(JUDGE_LAYOUTS, batch, chosen), batch)
