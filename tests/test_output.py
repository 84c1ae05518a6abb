"""Output appears whole or not at all."""

from __future__ import annotations

import pytest

from toolkit import UsageError
from toolkit.output import try_folder, whole_file, whole_folder


def test_a_folder_appears_whole_and_leaves_other_files_alone(tmp_path):
    out = tmp_path / "a" / "b"
    out.mkdir(parents=True)
    (out / "kept.txt").write_text("kept")
    (out / "old.txt").write_text("old")
    with whole_folder(out) as unfinished:
        (unfinished / "old.txt").write_text("new")
        (unfinished / "figures").mkdir()
        (unfinished / "figures" / "one.svg").write_text("<svg/>")
        assert (out / "old.txt").read_text() == "old"
    assert (out / "kept.txt").read_text() == "kept"
    assert (out / "old.txt").read_text() == "new"
    assert sorted(p.name for p in out.iterdir()) == ["figures", "kept.txt", "old.txt"]


@pytest.mark.parametrize("trouble", [ValueError, KeyboardInterrupt])
def test_nothing_remains_of_a_job_that_broke(tmp_path, trouble):
    out = tmp_path / "new" / "out"
    with pytest.raises(trouble), whole_folder(out) as unfinished:
        (unfinished / "half.csv").write_text("1,2")
        raise trouble
    assert list(tmp_path.iterdir()) == []


def test_a_broken_job_leaves_the_old_result(tmp_path):
    target = tmp_path / "result.csv"
    target.write_text("old")
    with pytest.raises(ValueError, match="broke"), whole_file(target) as unfinished:
        unfinished.write_text("half")
        raise ValueError("broke")
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_where_a_folder_should_be(tmp_path):
    blocking = tmp_path / "out"
    blocking.write_text("")
    with pytest.raises(UsageError, match="is a file"), whole_folder(blocking):
        pass
    with pytest.raises(UsageError, match="is a folder"), whole_file(tmp_path):
        pass


def test_a_folder_is_tried_before_long_work(tmp_path):
    try_folder(tmp_path / "new" / "out")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").write_text("taken")
    with pytest.raises(UsageError, match="is a file"):
        try_folder(tmp_path / "file")


def test_a_folder_is_not_written_over_by_a_file(tmp_path):
    (tmp_path / "taken.mp4").mkdir()
    with pytest.raises(UsageError, match="is a folder"), whole_folder(tmp_path) as unfinished:
        (unfinished / "taken.mp4").write_text("film")
