"""A subject from labelled takes of one hand that moves every joint."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from handclean.api import names
from handclean.api.given import identity
from handclean.api.settings import sorted_settings
from handclean.errors import TakeNumber, UsageError
from handclean.hand.marker_set import load_marker_set
from handclean.hand.subject import Subject
from handclean.recording import Recording
from handclean.remarks import Remark
from handclean.runner import provenance
from handclean.subject.calibrate import calibrate
from handclean.subject.report import CalibrationReport
from handclean.subject.scan.locate import Located, locate_markers
from handclean.subject.settings import CalibrateConfig


@dataclass(frozen=True, kw_only=True)
class Calibrated:
    """A subject and how it was found.

    Attributes
    ----------
    subject : the hand.
    report : of the range of motion; None if the takes of a scanned hand show none.
    located : of a scanned hand: where its markers are; else None.
    remarks : what its owner should know.
    """

    subject: Subject
    report: CalibrationReport | None
    located: Located | None
    remarks: tuple[Remark, ...]


def calibrate_takes(
    takes: Sequence[Recording],
    marker_set: str,
    settings: CalibrateConfig,
    *,
    side: str = "",
    name: str = "",
    scanned: Subject | None = None,
    called: Sequence[str] = (),
) -> Calibrated:
    """Find a hand and its markers; parameters as `calibrate_hand`.

    Parameters
    ----------
    called : what remarks call the takes; "take 1", "take 2" when not given.

    Raises
    ------
    HandcleanError
        As `calibrate_hand`.
    """
    markers = load_marker_set(marker_set)
    read = [names.matched(take, markers.labels) for take in takes]
    takes = [take for take, _ in read]
    same = tuple(dict.fromkeys(one for _, told in read for one in told))
    has = [names.labels_of(take) for take in takes]
    for number, labels in enumerate(has):
        names.expect_set(TakeNumber(number), labels, marker_set)
    located = None
    of_hand: tuple[Remark, ...] = ()
    if scanned is not None:
        located = locate_markers(
            scanned, takes, markers, settings, name=name, names=called
        )
        subject, report = located.subject, located.report
        of_hand = located.placed.remarks
    else:
        subject, report = calibrate(
            takes, markers, settings, side=side, name=name, names=called
        )
    if report is not None:
        larger = names.larger_set(set.intersection(*map(set, has)), marker_set)
        of_hand = (*of_hand, *report.remarks, *larger)
    return Calibrated(
        subject=subject, report=report, located=located, remarks=(*of_hand, *same)
    )


def calibrate_hand(
    takes: Sequence[Recording],
    marker_set: Path | str,
    *,
    side: str = "",
    name: str = "",
    scanned: Subject | None = None,
    **settings: Any,
) -> Subject:
    """Find bone lengths, joints and marker places of a hand.

    As ``handclean calibrate-hand markers``.

    Parameters
    ----------
    takes : sequence of Recording
        Labelled takes of one hand, in which every joint goes through its range.
    marker_set : str or path
        Shipped name or TOML file of the set that the markers are named after.
    side : {"", "left", "right"}
        The marker set's own by default.
    name : str
        Whose hand it is.
    scanned : Subject, optional
        The same hand from a scan: the markers are placed on its skin.
    **settings
        Fields of `handclean.subject.settings.CalibrateConfig`.

    Returns
    -------
    Subject
        ``model.tree`` has the bones [m], ``errors`` the residuals [m] and other
        figures by name, ``marker_sigma`` (M,) [m] the RMS residual of each marker;
        ``remarks`` tell what is odd.

    Raises
    ------
    HandcleanError
        If a take lacks a marker of the set, too few frames hold enough markers, or
        what they show is not of a hand's size.
    UsageError
        If there is no take, the side is not that of the hand measured, or a setting is
        wrong.

    Examples
    --------
    >>> import handclean as hc
    >>> rom = hc.simulate("rom", marker_set="maycock26", rate_hz=20.0, ghosts_per_s=0.0)
    >>> take, truth = rom[0].labelled, rom[0].subject
    >>> subject = hc.calibrate_hand([take], "maycock26", name="S01", frames=60)
    >>> hc.compare(truth, subject).figures()["length_mean_mm"] < 2.0
    True
    """
    chosen = sorted_settings("calibrate_hand", {"": CalibrateConfig}, settings)[""]
    takes = list(takes)
    if not takes:
        raise UsageError("there are none; give one at least", where="takes")
    if scanned is not None and side not in ("", scanned.model.tree.side):
        wrong = f"'{side}': the scan is of a {scanned.model.tree.side} hand"
        raise UsageError(wrong, where="side")
    done = calibrate_takes(
        takes, str(marker_set), chosen, side=side, name=name, scanned=scanned
    )
    inputs: list[dict[str, Any]] = [
        {"role": "input", "marker_set": str(marker_set), "frames": take.frames}
        for take in takes
    ]
    if scanned is not None:
        whose = {"name": scanned.name, "sha256": identity(scanned)}
        inputs.append({"role": "subject", **whose})
    given = {**asdict(chosen), "side": side, "name": name}
    begun = provenance.begin("calibrate-hand markers", given, inputs)
    entry = provenance.finished(begun, done.subject.errors, done.remarks)
    return replace(done.subject, provenance=(entry,), remarks=done.remarks)
