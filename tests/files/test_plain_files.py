"""Plain files: nothing else is opened, and nothing is written through a link."""

import os
import tempfile

import pytest

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import (
    read_bytes,
    read_text,
    write_atomically,
    written_by,
)

posix = pytest.mark.skipif(os.name != "posix", reason="pipes and devices of POSIX")


@posix
def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe: is not a plain file"):
        read_bytes(tmp_path / "pipe")


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path):
    (tmp_path / "notes.toml").write_bytes(b"\xef\xbb\xbfname = 1\r\n")
    assert read_text(tmp_path / "notes.toml") == "name = 1\n"


@posix
def test_a_device_behind_a_link_is_refused(tmp_path):
    (tmp_path / "zeros").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="zeros: is not a plain file"):
        read_text(tmp_path / "zeros")


def test_a_file_above_the_bound_is_refused(tmp_path):
    path = tmp_path / "large"
    path.write_bytes(bytes(3_000_000))
    assert len(read_bytes(path, 3_000_000)) == 3_000_000
    with pytest.raises(InputError, match=r"large: is larger than 2\.5 MB"):
        read_bytes(path, 2_500_000)


def test_a_file_takes_the_place_of_a_link_and_leaves_alone_what_that_points_to(tmp_path):
    target = tmp_path / "precious"
    target.write_bytes(b"kept")
    link = tmp_path / "page.html"
    link.symlink_to(target)
    write_atomically(link, b"new")
    assert link.read_bytes() == b"new"
    assert not link.is_symlink()
    link.unlink()
    link.symlink_to(target)
    with written_by(link) as place:
        place.write_bytes(b"newer")
    assert link.read_bytes() == b"newer"
    assert not link.is_symlink()
    assert target.read_bytes() == b"kept"
    assert {path.name for path in tmp_path.iterdir()} == {"precious", "page.html"}


def test_a_file_made_by_another_program_appears_whole_or_not_at_all(tmp_path):
    def break_off(path):
        with written_by(path) as place:
            place.write_bytes(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        break_off(tmp_path / "film.mp4")
    assert list(tmp_path.iterdir()) == []


@posix
def test_a_file_has_the_rights_that_the_user_gives_to_new_files(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomically(tmp_path / "file", b"")
    finally:
        os.umask(before)
    assert (tmp_path / "file").stat().st_mode & 0o777 == 0o640


def test_a_name_that_cannot_be_guessed_is_used_beside_the_file(tmp_path, monkeypatch):
    names = []
    mkstemp = tempfile.mkstemp

    def note(*given):
        made = mkstemp(*given)
        names.append(made[1])
        return made

    monkeypatch.setattr(tempfile, "mkstemp", note)
    write_atomically(tmp_path / "file", b"1")
    write_atomically(tmp_path / "file", b"2")
    assert len(set(names)) == 2
