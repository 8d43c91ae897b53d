import tempfile
from pathlib import Path

import pytest

from uas_coverage_env.files.output_dir import prepare_folder, write_files
from uas_coverage_env.files.strict_toml import InputError


def test_a_folder_is_made_and_told_with_what_it_holds(tmp_path):
    folder = tmp_path / "deep" / "down"
    assert prepare_folder(folder) == set()
    assert list(folder.iterdir()) == []
    (folder / "flight.csv").touch()
    (folder / ".lock").touch()
    assert prepare_folder(folder) == {"flight.csv", ".lock"}


def test_a_file_is_no_folder_and_holds_none(tmp_path):
    (tmp_path / "taken").touch()
    with pytest.raises(InputError, match=r"taken: is a file; give a folder"):
        prepare_folder(tmp_path / "taken")
    with pytest.raises(InputError, match=r"below: cannot be written \(Not a directory\)"):
        prepare_folder(tmp_path / "taken" / "below")


def test_a_folder_that_takes_no_files_is_refused_although_it_is_there(tmp_path, monkeypatch):
    def closed(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", closed)
    with pytest.raises(InputError, match=r"cannot be written \(Permission denied\)"):
        prepare_folder(tmp_path)


def test_files_are_written_all_or_none(tmp_path, monkeypatch):
    write_files(tmp_path, {"one": b"1", "two": b"2"})
    mkstemp = tempfile.mkstemp

    def full_disk(suffix, prefix, folder):
        if "two" in prefix:
            raise OSError(28, "No space left on device")
        return mkstemp(suffix, prefix, folder)

    monkeypatch.setattr(tempfile, "mkstemp", full_disk)
    with pytest.raises(InputError, match=r"cannot be written \(No space left on device\)"):
        write_files(tmp_path, {"one": b"11", "two": b"22", "three": b"33"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {
        "one": b"1",
        "two": b"2",
    }


def test_a_kill_between_two_files_leaves_no_mixture_that_is_taken_for_whole(tmp_path, monkeypatch):
    write_files(tmp_path, {"one": b"1", "two": b"2", "seal": b"s"})
    replace = Path.replace

    def killed(path, target):
        if target.name == "two":
            raise KeyboardInterrupt
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        write_files(tmp_path, {"one": b"11", "two": b"22", "seal": b"ss"})
    assert (tmp_path / "one").read_bytes() == b"11"
    assert not (tmp_path / "seal").exists()


def test_what_a_killed_process_left_is_removed_by_the_next_and_nothing_else(tmp_path):
    (tmp_path / ".one.x1y2z3.part").touch()
    (tmp_path / ".notes.part").touch()
    write_files(tmp_path, {"one": b"1"})
    assert {path.name for path in tmp_path.iterdir()} == {"one", ".notes.part"}
