"""Pseudo-gaps are like a take's own gaps, and nothing of them is seen."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handclean.gaps import pseudo
from handclean.gaps.pseudo import Kind, PseudoGap
from handclean.gaps.runs import Gap
from handclean.gaps.tracks import Path, Refused, Tracks

RATE = 100.0


def tracks(frames=1000, markers=5, gaps=()):
    rng = np.random.default_rng(1)
    places = np.cumsum(rng.normal(scale=1e-3, size=(frames, markers, 3)), axis=0)
    for column, start, stop in gaps:
        places[start:stop, column] = np.nan
    return Tracks(positions=places, rate=RATE, bones=np.full(markers, -1))


@pytest.mark.parametrize(
    ("start", "stop", "kind"),
    [
        (100, 110, Kind(0.1, 2)),
        (100, 106, Kind(0.05, 2)),
        (0, 95, Kind(1.0, 1)),
        (970, 1000, Kind(0.2, 1)),
        (100, 900, Kind(4.0, 2)),
    ],
)
def test_kinds(start, stop, kind):
    take = tracks(gaps=[(1, start, stop)])
    assert pseudo.kind_of(take, Gap(column=1, start=start, stop=stop)) == kind


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 970)), min_size=1))
def test_they_lie_where_their_marker_is_measured(places):
    cuts = [(column, start, start + 12 + start % 17) for column, start in places]
    take = tracks(gaps=cuts)
    own = [Gap(column=c, start=a, stop=b) for c, a, b in cuts]
    for kind, drawn in pseudo.draw(take, own, 10).items():
        assert len(drawn) <= 10
        for one in drawn:
            gap = one.gap
            assert take.seen[[gap.start - 1, gap.stop], gap.column].all()
            within = np.count_nonzero(take.seen[gap.start : gap.stop, gap.column])
            assert within >= min(5, gap.frames)
            assert one.hidden[gap.column]
            assert any(gap.frames == g.frames and gap.column == g.column for g in own)
            assert pseudo.kind_of(take, gap).length_s == kind.length_s
        again = pseudo.draw(take, own, 10)[kind]
        assert [p.gap for p in again] == [p.gap for p in drawn]


def test_other_markers_are_hidden_as_they_are_in_the_gap():
    take = tracks(gaps=[(1, 100, 150), (2, 90, 160), (3, 100, 110)])
    (drawn,) = pseudo.draw(take, [Gap(column=1, start=100, stop=150)], 8).values()
    for one in drawn:
        np.testing.assert_array_equal(one.hidden, [False, True, True, False, False])
        holes = pseudo.punched(take, [one])
        rows = slice(one.gap.start, one.gap.stop)
        assert not holes.seen[rows, 1:3].any()
        kept = take.seen & holes.seen
        np.testing.assert_array_equal(
            take.positions[kept].view(np.uint64), holes.positions[kept].view(np.uint64)
        )


def test_a_gap_with_one_end_is_tried_with_one_end():
    take = tracks(gaps=[(1, 0, 50)])
    (drawn,) = pseudo.draw(take, [Gap(column=1, start=0, stop=50)], 8).values()
    for one in drawn:
        assert one.stop == one.gap.stop
        assert one.start == max(one.gap.start - 50, 0)


def test_a_marker_seen_in_parts_is_tried_in_parts():
    parts = [(1, start, start + 30) for start in range(0, 1000, 50)]
    take = tracks(gaps=[*parts, (1, 400, 500)])
    (drawn,) = pseudo.draw(take, [Gap(column=1, start=400, stop=500)], 8).values()
    assert drawn
    for one in drawn:
        assert one.gap.frames == 100
        path = Path(np.zeros((100, 3)), np.ones(100))
        measured = np.isfinite(pseudo.errors(take, one, path)[:, 0])
        assert 30 <= measured.sum() < 100


def test_a_take_without_room_has_none():
    take = tracks(frames=100, gaps=[(1, 20, 80)])
    (drawn,) = pseudo.draw(take, [Gap(column=1, start=20, stop=80)], 8).values()
    assert drawn == []


def test_rounds_leave_each_other_alone():
    take = tracks()
    own = [Gap(column=c, start=10, stop=40) for c in range(5)]
    drawn = [p for part in pseudo.draw(take, own, 24).values() for p in part]
    parts = pseudo.rounds(drawn, RATE)
    assert sorted(i for part in parts for i in part) == list(range(len(drawn)))
    for part in parts:
        spans = [(drawn[i].start, drawn[i].stop) for i in part]
        for (_, stop), (start, _) in pairwise(spans):
            assert start - stop >= 30


def test_a_filler_is_prepared_without_what_it_should_find():
    take = tracks(gaps=[(1, 100, 130)])
    (drawn,) = pseudo.draw(take, [Gap(column=1, start=100, stop=130)], 6).values()

    def prepare(given):
        def fill(gap):
            if gap.start > 700:
                raise Refused("too late")
            assert not given.seen[gap.start : gap.stop, gap.column].any()
            return Path(np.zeros((gap.frames, 3)), np.ones(gap.frames))

        return fill

    paths = pseudo.filled(prepare, take, drawn)
    for one, path in zip(drawn, paths, strict=True):
        assert (path is None) == (one.gap.start > 700)


def test_errors_are_what_was_found_less_what_was_measured():
    take = tracks()
    gap = Gap(column=2, start=50, stop=60)
    one = PseudoGap(gap=gap, hidden=np.arange(5) == 2, start=50, stop=60)
    path = Path(take.positions[50:60, 2] + 0.001, np.ones(10))
    np.testing.assert_allclose(pseudo.errors(take, one, path), 0.001)
