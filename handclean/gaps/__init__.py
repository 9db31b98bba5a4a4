"""Gaps in marker trajectories, filled from the take itself, with the error to expect.

From a take to a filled take
----------------------------
`fill` is the entry: it takes the labelled markers of a take (`tracks`), bridges the
posture of the subjects it is given (`hand`), has the gaps filled (`fill_tracks`) and
puts what was filled into the take (`samples`). `measured` cleans measured samples
before, on request.

`sources` says what fills gaps, by method: the take's own regression (`regression`), the
posture of a hand (`follow_posture`), and a family of simpler ones (`family`). All keep
the contract of `tracks`. `pseudo` hides stretches of the take that are like its gaps,
and `doubt` learns from them how far off a source is in this take.

A posture bridged through gaps
------------------------------
Maycock et al. 2015 (section III-C) and Schroeder et al. 2017 (eq. 6) interpolate the
joint angles a missing marker leaves undecided, and let the marker follow the posture.
What they leave open is decided here:

- Which joints are undecided is not a matter of names but of what the markers in sight
  tell: a joint is *affected* if the markers explain less than `decided.DECIDED` of its
  variance while those that are missing would explain more. A marker further out drives
  the chain, joints that only follow the subspace count, any marker set works.
- A path also follows what the other joints did beside paths of their own, as far as the
  take shows that they go together (`coupling`).
- Interpolated joints are then refined with the markers that are there, each weighed by
  what it knows, so that a joint which is half decided is not thrown away.
- The end velocities come from a fit. Which fit (how many frames, straight or bent) the
  take itself chooses, by what would have restored its measured stretches best; the
  same trial says how far off an interpolation of that length is, hence ``sigma``.
- A model never fits exactly, so losing a marker would pull the posture elsewhere by a
  step. What is left over between model and markers is therefore carried through each
  gap (`offsets`): on a hand calibrated 6 mm wrong this took the error of 0.1 s gaps
  from 8 to 1.2 mm, and the steps at their ends away.
- A chain may have an elbow up and an elbow down for one place of its marker. In a gap
  the posture is looked for from what joins both ends, and joints that jump nonetheless
  are interpolated.

Tried and left: the single-frame end slopes of the printed equation (marker noise grows
with the gap's length); one fixed window (25 ms is right for a quiet 0.02 mm system and
far too short for 3 mm of noise).
"""
