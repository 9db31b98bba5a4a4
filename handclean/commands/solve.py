"""Joint angles of labelled takes."""

from collections.abc import Mapping
from typing import Any

from handclean.api.solve import solve_hands
from handclean.commands.shared import hands, sessions
from handclean.commands.shared.choices import Solving
from handclean.runner.batch import Source
from handclean.runner.outcome import Outcome
from handclean.runner.steps import step

FIGURES = {
    "frames": "frames of the take",
    "hands": "hands solved",
    "kept": "those of them whose motion fill-gaps or clean found at the same settings",
    "trusted": "share of frames whose posture is decided and fits, of the worse hand",
    "residual_mm": "RMS distance of measured markers, all frames and hands",
    "residual_p95_mm": "95th percentile over frames of a frame's RMS distance",
}


def solve(source: Source, settings: Solving) -> Outcome:
    """Add the joint angles of every hand, or keep those that filling found."""
    recording = sessions.read(source)
    sought = hands.of_source(source, with_prior=not settings.standard)
    with step("solve"):
        done = solve_hands(recording, sought, settings.solve)
    return sessions.outcome(
        done.take,
        in_words(done.figures),
        done.figures,
        done.remarks,
        sessions.surfaces(sought.subjects),
    )


def in_words(figures: Mapping[str, Any]) -> str:
    """Say the figures in a few words."""
    hands = f"{figures['hands']} hands" if figures["hands"] != 1 else "a hand"
    kept = ", as its gaps were filled" if figures.get("kept") else ""
    return (
        f"solved {hands} in {figures['frames']} frames, "
        f"RMS {figures['residual_mm']:.2f} mm, "
        f"{100 * figures['trusted']:.0f} % trusted{kept}"
    )
