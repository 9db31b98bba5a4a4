"""Seconds by step: each counts for itself, and nothing is counted where nobody asks."""

import time

import pytest

from handclean.runner import steps


def test_a_step_within_another_counts_for_itself():
    with steps.collected() as taken:
        with steps.step("label"):
            time.sleep(0.02)
            with steps.step("read"):
                time.sleep(0.05)
        with steps.step("label"):
            time.sleep(0.02)
    assert list(taken) == ["label", "read"]
    assert 0.04 <= taken["label"] < 0.05 + 0.04
    assert taken["read"] >= 0.05
    assert steps.in_words({"read": 0.01, "label": 2.0}) == "read 0.010, label 2.000"


def test_a_step_that_fails_is_counted():
    with steps.collected() as taken, pytest.raises(KeyError), steps.step("read"):
        raise KeyError
    assert taken["read"] > 0.0


def test_outside_nothing_is_counted():
    with steps.step("read"):
        pass
    with steps.collected() as taken:
        pass
    assert taken == {}
