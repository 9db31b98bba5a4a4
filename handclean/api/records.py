"""The record of a step that was done without files.

It names the same as a command's: command, version, settings, subjects, prior. So a
later step, of either kind, knows what was done to the take.
"""

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from handclean.api.hands import Hands
from handclean.api.results import VERDICTS, StepResult
from handclean.recording import Recording
from handclean.runner import provenance


def recorded(
    command: str, before: Recording, done: StepResult, hands: Hands, settings: Any
) -> Recording:
    """Return the take of a step with its remarks and one more entry of provenance.

    Parameters
    ----------
    command : whose step it is, "fill-gaps".
    before : the take that was given.
    settings : by name, settings objects or plain values; of one class, the object.
    """
    inputs: list[dict[str, str]] = []
    for name, subject in hands.subjects.items():
        known = hands.identities[name]
        if hands.is_template:
            inputs.append({"role": "input", "marker_set": known})
        else:
            inputs.append({"role": "subject", "name": subject.name, "sha256": known})
    if hands.prior_sha256 is not None:
        inputs.append({"role": "prior", "sha256": hands.prior_sha256})
    begun = provenance.begin(command, _plain(settings), inputs)
    entry = provenance.finished(begun, done.figures, done.remarks)
    earlier = [one for one in done.take.remarks if one.kind not in VERDICTS]
    return replace(
        done.take,
        provenance=(*before.provenance, entry),
        remarks=(*earlier, *done.remarks),
    )


def _plain(settings: Any) -> dict[str, Any]:
    if not isinstance(settings, Mapping):
        return asdict(settings)
    return {
        name: asdict(part) if hasattr(part, "__dataclass_fields__") else part
        for name, part in settings.items()
    }
