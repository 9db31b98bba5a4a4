"""Nothing is learnt from frames that are not trusted."""

import numpy as np
import pytest
from takes import take_source
from told import texts

from handclean.commands.shared import motions
from handclean.commands.shared.choices import LearnConfig
from handclean.commands.table import COMMANDS
from handclean.errors import HandcleanError
from handclean.hand.template import template
from handclean.io import files
from handclean.io.hdf5.prior import read_prior
from handclean.recording import Recording, motion_from_poses
from handclean.runner.batch import Task
from handclean.runner.command import Work
from handclean.runner.execute import execute

FRAMES = 400


@pytest.fixture
def write(tmp_path):
    """Write a take of which some frames are trusted; return its path."""
    tree = template("right")
    rng = np.random.default_rng(3)
    ways = rng.normal(size=(3, len(tree.hinges)))

    def go(name, trusted, spoilt=0.0):
        poses = np.zeros((FRAMES, 7 + len(tree.hinges)))
        poses[:, 3] = 1.0
        poses[:, 7:] = 0.1 * rng.normal(size=(FRAMES, 3)) @ ways
        if trusted is not None:
            poses[~trusted, 7:] += spoilt * rng.normal(size=poses[~trusted, 7:].shape)
        motion = motion_from_poses(tree.hinges, poses, trusted=trusted)
        take = Recording(
            rate=100.0,
            frames=FRAMES,
            skeletons={"right": tree},
            motions={"right": motion},
        )
        files.write(tmp_path / name, take)
        return tmp_path / name

    return go


def some(count):
    trusted = np.zeros(FRAMES, bool)
    trusted[:count] = True
    return trusted


def learn(*paths, held_out=(), share=0.99):
    sources = [take_source(path=path) for path in paths]
    given = {f"held_out {n}": path for n, path in enumerate(held_out)}
    sources[0] = take_source(path=paths[0], files=given)
    output = paths[0].with_suffix(".prior.h5")
    task = Task(sources=tuple(sources), outputs=(output,), token="t", reduces=True)
    work = Work(command=COMMANDS["learn subspace"], settings=LearnConfig(share=share))
    return execute(work, task), output


def test_a_prior_is_that_of_the_trusted_frames(write):
    report, output = learn(write("a.h5", some(300), spoilt=1.0))
    assert report.status == "done", report.error
    assert report.figures["directions"] == 3  # the rest is spoilt in all directions
    assert (report.figures["frames"], report.figures["left_out"]) == (300, 100)
    (warning,) = texts(report.remarks)
    assert "100 of 400 frames are not trusted: they are left out" in warning
    assert len(read_prior(output).deviations) == 3


def test_nothing_is_left_out_of_motion_that_does_not_say_what_is_trusted(write):
    report, _ = learn(write("a.h5", None))
    assert report.figures["frames"] == FRAMES
    assert texts(report.remarks) == ()


@pytest.mark.parametrize("count", [0, 3, 20])
def test_too_few_trusted_frames_teach_no_prior(write, count):
    report, output = learn(write("a.h5", some(count)))
    assert report.status == "failed"
    assert "a prior of 20 angles needs 21 at least" in report.error
    assert not output.exists()


def test_a_prior_of_few_frames_is_warned_of(write):
    report, _ = learn(write("a.h5", some(30)))
    assert any("learnt from 30 frames only" in text for text in texts(report.remarks))


def test_a_take_without_a_trusted_frame_is_named_beside_others(write):
    report, _ = learn(write("a.h5", some(300)), write("b.h5", some(0)))
    assert report.figures["takes"] == 1
    assert any(
        "no frame is trusted of" in text and "b.h5" in text
        for text in texts(report.remarks)
    )


def test_held_out_frames_that_are_not_trusted_do_not_count(write):
    held = write("b.h5", some(200), spoilt=1.0)
    report, _ = learn(write("a.h5", some(400)), held_out=[held])
    assert report.figures["held_out_covered"] > 0.99
    assert any("--held-out: 200 of 400" in text for text in texts(report.remarks))
    report, _ = learn(write("a.h5", some(400)), held_out=[write("c.h5", some(0))])
    assert "--held-out: fewer than 2 frames" in report.error


def test_layouts_are_made_for_and_judged_on_trusted_frames(write):
    (motion,) = motions.read(take_source(path=write("a.h5", some(30))), [])
    takes = [motions.angles(motion, motion.names)]
    assert motions.known(takes) == 30
    assert len(motions.on_tree(motion, template("right"))) == 30
    motions.expect_enough(takes, 30, "a layout")
    with pytest.raises(HandcleanError, match="have 30 frames"):
        motions.expect_enough(takes, 31, "a layout")
