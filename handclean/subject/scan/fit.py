"""``calibrate-hand scan``: from a point cloud with landmarks to a hand with a skin.

1. What is not the hand is left out (`prepare`).
2. The template is aligned: place, size and posture, by landmarks, then also by closest
   points (`alignment`).
3. Its skin is drawn onto the scan (`nonrigid`).
4. Joints follow, and both are brought to the zero posture (`rebuild`).

Schroeder et al. 2017, "Hand model generation".
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from handclean.arrays import Floats
from handclean.errors import HandcleanError, UsageError
from handclean.hand.model import Model
from handclean.hand.subject import Subject
from handclean.hand.surface import Surface
from handclean.hand.template import FINGERS, HAND_LENGTH_M, template
from handclean.hand.template_surface import landmarks as template_landmarks
from handclean.hand.template_surface import template_surface
from handclean.remarks import remark
from handclean.subject.scan.alignment import Aligned, Template, to_cloud, to_landmarks
from handclean.subject.scan.cloud import Cloud, Pairs, Scan
from handclean.subject.scan.landmarks import checked, doubtful, expect_alike, expect_on
from handclean.subject.scan.nonrigid import Registered, Registration, falling
from handclean.subject.scan.prepare import nearby, oriented, prepared
from handclean.subject.scan.rebuild import Rebuilt, rebuilt
from handclean.subject.scan.report import ScanReport, report_on
from handclean.subject.scan.settings import ScanConfig
from handclean.tree import JointTree

Progress = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Start:
    """The hand that is fitted, and its landmarks.

    Attributes
    ----------
    tree, surface : of the template; landmarks : vertices by name.
    """

    tree: JointTree
    surface: Surface
    landmarks: Mapping[str, int]


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """All stages of a fit.

    Attributes
    ----------
    subject : the outcome; report : figures and remarks.
    cloud : the points that were fitted to.
    aligned : the template before its shape was fitted.
    registered : the skin in the scan's posture; rebuilt : the hand behind it.
    """

    subject: Subject
    report: ScanReport
    cloud: Cloud
    aligned: Aligned
    registered: Registered
    rebuilt: Rebuilt


def shipped_start(side: str) -> Start:
    """Return the built-in hand."""
    tree = template(side)
    return Start(
        tree=tree,
        surface=template_surface(tree),
        landmarks=template_landmarks(tree),
    )


def fit_scan(
    scan: Scan,
    marks: Mapping[str, Floats],
    settings: ScanConfig,
    *,
    side: str = "right",
    name: str = "",
    start: Start | None = None,
    progress: Progress = lambda _: None,
) -> Fitted:
    """Fit the template to a scan.

    Parameters
    ----------
    marks : (3,) [m] landmarks on the scan by name.
    side : "left" or "right".
    name : whose hand it is.
    start : what is fitted; the built-in hand when not given.
    progress : called with what is being done.

    Raises
    ------
    UnknownNameError
        If a landmark is none of the template's.
    UsageError
        If the side is neither, or clearly not that of the hand scanned.
    HandcleanError
        If landmarks or points do not make a hand.
    """
    if side not in ("left", "right"):
        raise UsageError(f"--side: should be left or right for a scan, not '{side}'")
    start = start or shipped_start(side)
    names, places, missing = checked(marks, start.landmarks, settings.least_landmarks)
    progress("points of the hand")
    expect_on(names, places, scan.points[np.isfinite(scan.points).all(axis=1)])
    ready = prepared(scan, places, settings)
    progress("landmarks")
    rows = np.array([start.landmarks[landmark] for landmark in names], dtype=np.int64)
    model = Template(tree=start.tree, surface=start.surface, landmarks=rows)
    aligned = to_landmarks(model, places)
    expect_alike(names, places, aligned.vertices()[rows])
    cloud, remarks = oriented(ready.scan, aligned.vertices(), start.surface)
    places = cloud.snapped(places)
    aligned = to_cloud(
        aligned,
        places,
        cloud,
        settings.rounds,
        settings.reach_m,
        settings.normal_rad,
        lambda n: progress(f"posture, round {n + 1} of {settings.rounds}"),
    )
    cloud = nearby(cloud, aligned, settings.far_m)
    if len(cloud.points) < settings.points // 1000 + 100:
        raise HandcleanError(
            "scan: hardly a point lies near the aligned template; are the landmarks "
            "named right?"
        )
    registered = drawn(aligned, places, cloud, settings, progress)
    progress("joints")
    found = rebuilt(aligned, registered.vertices)
    if missing:
        text = f"landmarks that are missing: {', '.join(missing)}"
        remarks = (*remarks, remark("unseen", text, landmarks=list(missing)))
    there = aligned.vertices()[rows]
    gaps = np.linalg.norm(there - places, axis=1)
    away = dict(zip(names, gaps.tolist(), strict=True))
    remarks = (*remarks, *doubtful(names, places, there, aligned.template.tree.scale))
    report = report_on(aligned, registered, found, ready, cloud, remarks, away)
    tree = replace(found.tree, subject=name, scale=report.size)
    found = replace(found, tree=tree)
    return Fitted(
        subject=_subject(found, report, name),
        report=report,
        cloud=cloud,
        aligned=aligned,
        registered=registered,
        rebuilt=found,
    )


def drawn(
    aligned: Aligned,
    places: Floats,
    cloud: Cloud,
    settings: ScanConfig,
    progress: Progress = lambda _: None,
) -> Registered:
    """Draw the aligned template's skin onto the scan, by the schedule.

    Parameters
    ----------
    places : (N, 3) [m] of the landmarks.
    """
    template = aligned.template
    work = Registration(
        aligned.vertices(),
        template.surface.faces,
        Pairs(rows=template.landmarks, places=places),
        template.tree.scale * HAND_LENGTH_M,
    )
    for stiffness in falling(settings.stiff, settings.middle, settings.steps):
        progress(f"skin by landmarks, stiffness {stiffness:.0e}")
        work.relax(float(stiffness), 1.0, None)

    def find(vertices: Floats, normals: Floats) -> Pairs:
        return cloud.pairs(vertices, normals, settings.reach_m, settings.normal_rad)

    for stiffness in falling(settings.middle, settings.soft, 2 * settings.steps):
        progress(f"skin by points, stiffness {stiffness:.1e}")
        work.relax(float(stiffness), settings.landmark_weight, find)
    return work.registered()


def _subject(found: Rebuilt, report: ScanReport, name: str) -> Subject:
    """Make the subject, without markers as yet."""
    errors = {
        "scan_fit_mean_m": report.fit_mean_m,
        "scan_fit_p95_m": report.fit_p95_m,
        "scan_fit_max_m": report.fit_max_m,
        "scan_landmark_m": report.landmark_m,
        "scan_aligned_fit_m": report.aligned_fit_m,
        "scan_covered": report.covered,
        "scan_points": float(report.points_used),
    }
    for finger in FINGERS:
        errors[f"{finger}_distal_length_m"] = found.tips[finger]
    none = np.zeros(0, dtype=np.int64)
    return Subject(
        name=name,
        model=Model(tree=found.tree, labels=(), bone=none, at=np.zeros((0, 3))),
        marker_set="",
        marker_sigma=np.zeros(0),
        errors=errors,
        surface=found.surface,
    )
