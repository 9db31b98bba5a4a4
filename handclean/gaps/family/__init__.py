"""Fillers others use or publish, on one contract (`gaps.tracks`), to be compared with.

One module holds one idea; `table` lists them by name. None knows a hand: markers and
frames are all they look at. What they share: `ends` leads a path onto the measured
samples beside a gap, `donors` finds the markers and the frames to learn from, `body`
takes out how the body moved as a whole.
"""
