import numpy as np
import pytest

from handclean.errors import FileError
from handclean.io.landmarks import read_landmarks, write_landmarks


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def test_landmarks_are_in_the_scans_unit_unless_they_say_another(tmp_path):
    path = written(tmp_path / "a.toml", "thumb_tip = [100, 20.5, -3]\n")
    found = read_landmarks(path, "mm")
    np.testing.assert_allclose(found["thumb_tip"], [0.1, 0.0205, -0.003])
    path = written(tmp_path / "b.toml", 'unit = "cm"\nthumb_tip = [10, 2.05, -0.3]\n')
    found = read_landmarks(path, "mm")
    np.testing.assert_allclose(found["thumb_tip"], [0.1, 0.0205, -0.003])


def test_what_is_written_is_read_again(tmp_path, rng):
    marks = {"thumb_tip": rng.normal(size=3), "wrist": rng.normal(size=3)}
    write_landmarks(tmp_path / "a.toml", marks)
    found = read_landmarks(tmp_path / "a.toml", "mm")
    assert list(found) == list(marks)
    for name, place in marks.items():
        np.testing.assert_allclose(found[name], place, atol=1e-7)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("thumb_tip = [1, 2]", "three numbers"),
        ("thumb_tip = ['a', 1, 2]", "three numbers"),
        ("thumb_tip = [true, 1, 2]", "three numbers"),
        ("thumb_tip = [1, 2, nan]", "three numbers"),
        ("thumb_tip = 3", "three numbers"),
        ("unit = 'inch'\nthumb_tip = [1, 2, 3]", "inch"),
        ("", "no landmarks"),
        ("thumb_tip = [", "not landmarks"),
    ],
)
def test_what_are_no_landmarks_is_told_in_one_line(tmp_path, text, why):
    path = written(tmp_path / "a.toml", text)
    with pytest.raises(FileError, match=why) as error:
        read_landmarks(path, "mm")
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


def test_a_file_that_is_not_there_is_told(tmp_path):
    with pytest.raises(FileError, match="no such file"):
        read_landmarks(tmp_path / "none.toml", "mm")
