"""Sizes of the template hand's flesh [mm], means of men and women.

Finger breadths and depths at the joints: Garrett, The adult human hand: some
anthropometric and biomechanical considerations, Human Factors 13 (1971) 117-131
(index: 19 mm wide at the middle joint, 17 at the outer one; thumb 22 at its outer
joint). Wrist 60 x 42 mm, its circumference as Greiner's (1991, see
`handclean.hand.template`); hand 28 mm thick at the metacarpals. Webs reach 40 to
45 % of the first phalanx beyond the knuckle.
What these do not say is chosen by eye, on pictures of the hand.
"""

# A row per knot: which segment and the share of it, then width to a side, height of
# the back and depth of the pad over the axis [mm]. Segment -1 is before the first.
_Row = tuple[int, float, float, float, float]

FINGER: tuple[_Row, ...] = (  # of the index finger
    (-1, 14.0, 9.0, 9.0, 10.0),
    (0, 0.00, 10.0, 10.4, 11.0),
    (0, 0.30, 9.2, 9.0, 11.0),
    (0, 0.60, 8.7, 8.0, 10.4),
    (0, 0.85, 9.0, 8.1, 8.8),
    (1, 0.00, 9.5, 8.7, 7.5),
    (1, 0.20, 9.1, 7.9, 8.4),
    (1, 0.55, 8.3, 6.9, 8.5),
    (1, 0.85, 8.3, 6.7, 7.3),
    (2, 0.00, 8.5, 6.9, 6.7),
    (2, 0.25, 8.2, 6.2, 7.2),
    (2, 0.55, 7.8, 5.4, 7.2),
    (2, 1.00, 6.6, 4.2, 5.8),
)

THUMB: tuple[_Row, ...] = (
    (-1, 8.0, 10.0, 9.0, 10.0),
    (0, 0.00, 11.0, 11.0, 13.0),
    (0, 0.45, 11.5, 10.0, 15.0),
    (0, 0.80, 11.5, 10.5, 14.0),
    (1, 0.00, 11.3, 11.0, 12.3),
    (1, 0.30, 10.3, 9.6, 11.6),
    (1, 0.60, 9.8, 8.8, 10.6),
    (2, 0.00, 11.0, 9.0, 9.0),
    (2, 0.25, 10.9, 7.7, 9.9),
    (2, 0.55, 10.3, 6.4, 9.7),
    (2, 1.00, 8.0, 4.6, 7.2),
)

GIRTH_SHARE = {"thumb": 1.0, "index": 1.0, "middle": 1.01, "ring": 0.92, "little": 0.80}
"""[-] girth of each finger against the index finger's, of the thumb against its own
(Garrett; what it does not say is chosen)."""

TIP_CAP_SHARE = {
    "thumb": 0.52,
    "index": 0.55,
    "middle": 0.52,
    "ring": 0.52,
    "little": 0.55,
}
"""[-] length of a tip's round end against its segment (chosen)."""

# Metacarpals: start (3), then half width, height, depth at the start and the knuckle.
METACARPALS = {
    "index": ((13.0, 4.0, -1.0), (12.5, 11.0, 16.0), (11.6, 11.4, 16.0)),
    "middle": ((3.0, 3.0, 0.0), (12.5, 11.5, 16.0), (12.2, 11.8, 17.4)),
    "ring": ((-7.0, 3.0, -1.0), (12.5, 11.0, 16.0), (11.8, 11.4, 16.2)),
    "little": ((-16.0, 4.0, -2.5), (12.5, 10.0, 15.0), (10.8, 10.2, 14.0)),
}

# Eminences: start, stop, half width, height, depth [mm] at the middle.
THENAR = ((13.0, 6.0, -13.0), (45.0, 50.0, -13.0), 15.0, 11.0, 16.0)
HYPOTHENAR = ((-21.0, 2.0, -10.0), (-34.0, 64.0, -10.0), 13.5, 11.0, 14.5)
PADS = ((30.0, 82.0, -6.5), (-39.0, 70.0, -8.5), 18.0, 6.0, 11.5)
HEEL = ((-14.0, 12.0, -12.0), (14.0, 12.0, -12.0), 13.0, 10.0, 11.0)

STUB_MM = 25.0
"""[mm] of wrist below the crease (chosen)."""

WRIST = (  # y, half width, height, depth [mm]
    (-29.0, 27.5, 18.5, 19.5),
    (-10.0, 28.0, 17.5, 19.5),
    (0.0, 29.0, 15.5, 19.0),
    (10.0, 29.0, 14.0, 18.0),
    (26.0, 28.0, 12.0, 15.0),
)
