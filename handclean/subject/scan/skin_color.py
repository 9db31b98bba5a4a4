"""Which colors are those of skin.

Kovac, Peer and Solina, Human skin color clustering for face detection, EUROCON 2003,
the rule for RGB at uniform daylight illumination, red, green and blue being 0 to 255:

    R > 95 and G > 40 and B > 20 and max(R, G, B) - min(R, G, B) > 15
    and |R - G| > 15 and R > G and R > B

The rule was made for fair to medium skin under daylight; dark skin or a tinted light
may lie outside of it. Then colors like those at the landmarks are skin: logarithms of
red, green and blue, whose mean and covariance these points give, within so many
standard deviations; light and shade change all three logarithms alike.
"""

import numpy as np

from handclean.arrays import Bools, Bytes, expect_shape

SKIN_COLOR_SDS = 4.0
"""[standard deviations] how far a color may be from those known to be skin (chosen)."""

LEAST_LOG_COLOR_SD = 0.05
"""Standard deviation of a logarithm that skin is granted at least (chosen)."""


def is_skin(colors: Bytes) -> Bools:
    """(P,) whether (P, 3) colors, red, green, blue, are those of skin."""
    expect_shape("colors", colors, "P", 3)
    red, green, blue = colors.astype(np.int64).T
    bright = (red > 95) & (green > 40) & (blue > 20)
    colored = np.ptp(colors.astype(np.int64), axis=1) > 15
    reddish = (np.abs(red - green) > 15) & (red > green) & (red > blue)
    return np.asarray(bright & colored & reddish)


def is_like(colors: Bytes, known: Bytes) -> Bools:
    """(P,) whether (P, 3) colors are like (N, 3) known ones, two or more."""
    expect_shape("colors", colors, "P", 3)
    expect_shape("known", known, "N", 3)
    logs, samples = (np.log(part.astype(np.float64) + 8.0) for part in (colors, known))
    middle = np.median(samples, axis=0)
    spread = np.cov(samples.T) + LEAST_LOG_COLOR_SD**2 * np.eye(3)
    away = logs - middle
    distance2 = np.einsum("pi,ij,pj->p", away, np.linalg.inv(spread), away)
    return np.asarray(distance2 < SKIN_COLOR_SDS**2)
