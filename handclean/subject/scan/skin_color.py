"""Which colors are those of skin.

Kovac, Peer and Solina, Human skin color clustering for face detection, EUROCON 2003,
the rule for RGB at uniform daylight illumination, red, green and blue being 0 to 255:

    R > 95 and G > 40 and B > 20 and max(R, G, B) - min(R, G, B) > 15
    and |R - G| > 15 and R > G and R > B

The rule was made for fair to medium skin under daylight; dark skin or a tinted light
may lie outside of it (see ``prepare``, which says when most of a scan does).
"""

import numpy as np

from handclean.arrays import Bools, Bytes, expect_shape


def is_skin(colors: Bytes) -> Bools:
    """(P,) whether (P, 3) colors, red, green, blue, are those of skin."""
    expect_shape("colors", colors, "P", 3)
    red, green, blue = colors.astype(np.int64).T
    bright = (red > 95) & (green > 40) & (blue > 20)
    colored = np.ptp(colors.astype(np.int64), axis=1) > 15
    reddish = (np.abs(red - green) > 15) & (red > green) & (red > blue)
    return np.asarray(bright & colored & reddish)
