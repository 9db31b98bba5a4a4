"""The gaps simulated takes come with: occlusions and dropouts of simulated cameras."""

import numpy as np

from handclean.gaps.fill import fill_take
from handclean.gaps.settings import METHODS, POSTURE_METHODS, FillConfig
from handclean.recording import Origin


def rows(trials, prior):
    """Rows: errors of each method at all that it fills, against the truth.

    Parameters
    ----------
    trials : simulated takes with subject and truth.
    """
    return [_row(method, trials, prior) for method in METHODS]


def _row(method, trials, prior):
    errors, shares, missing = [], [], 0
    for trial in trials:
        followed = method in ("auto", *POSTURE_METHODS)
        subjects = {"hand": trial.subject} if followed else {}
        settings = FillConfig(method=method)
        found, _ = fill_take(trial.labelled, subjects, prior=prior, settings=settings)
        markers, truth = found.markers, trial.truth.markers
        columns = [truth.labels.index(label) for label in markers.labels]
        filled = markers.origin == Origin.FILLED
        away = (markers.positions - truth.positions[:, columns])[filled]
        errors.append(np.linalg.norm(away, axis=1))
        shares.append((np.abs(away) / markers.sigma[filled][:, None]).ravel())
        missing += int(np.count_nonzero(~trial.labelled.markers.measured))
    errors, shares = 1e3 * np.concatenate(errors), np.concatenate(shares)
    row = {"method": method, "samples": missing}
    row["open"] = f"{1.0 - len(errors) / max(missing, 1):.0%}"
    if len(errors):
        row["mean"] = round(float(errors.mean()), 2)
        row["median"] = round(float(np.median(errors)), 2)
        row["95 %"] = round(float(np.percentile(errors, 95)), 2)
        row["within sigma"] = f"{np.mean(shares <= 1.0):.2f}"
    return row
