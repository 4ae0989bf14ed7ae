"""Outputs appear whole or not at all."""

import errno
import gzip
import os

import pytest

from jaxident.errors import InputError, WorkError
from jaxident.files.atomic import check_target, make_folder, write_bytes, write_text, writing_bytes, writing_text


def test_text_and_bytes_are_written_as_they_are(tmp_path):
    write_text(tmp_path / "a.txt", "è\r\nb\n")
    write_bytes(tmp_path / "b.bin", b"\x00\xff\r\n")
    assert (tmp_path / "a.txt").read_bytes() == "è\r\nb\n".encode()
    assert (tmp_path / "b.bin").read_bytes() == b"\x00\xff\r\n"


def test_gzip_is_told_by_the_name_and_equal_content_gives_equal_files(tmp_path):
    for name in ("a.txt.gz", "b.txt.gz"):
        write_text(tmp_path / name, "content")
    first = (tmp_path / "a.txt.gz").read_bytes()
    assert gzip.decompress(first) == b"content"
    assert first == (tmp_path / "b.txt.gz").read_bytes()


@pytest.mark.parametrize("name", ["a.txt", "a.txt.gz"])
def test_a_block_that_raises_leaves_the_old_file_and_nothing_else(tmp_path, name):
    write_text(tmp_path / name, "old")
    before = (tmp_path / name).read_bytes()

    def fail():
        with writing_text(tmp_path / name) as stream:
            stream.write("new" * 100_000)
            raise KeyError("in the block")

    with pytest.raises(KeyError, match="in the block"):
        fail()
    assert (tmp_path / name).read_bytes() == before
    assert os.listdir(tmp_path) == [name]


def test_the_file_is_not_there_before_the_block_ends(tmp_path):
    with writing_bytes(tmp_path / "a") as stream:
        stream.write(b"1")
        assert not (tmp_path / "a").exists()
    assert os.listdir(tmp_path) == ["a"]


def test_a_link_keeps_leading_to_the_content(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "target")
    write_text(tmp_path / "link", "content")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_text() == "content"


def test_new_files_follow_the_umask(tmp_path):
    old = os.umask(0o027)
    try:
        write_text(tmp_path / "a", "")
    finally:
        os.umask(old)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


def test_a_pipe_is_written_as_it_stands(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    end = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_text(tmp_path / "pipe", "through")
        assert os.read(end, 100) == b"through"
    finally:
        os.close(end)
    assert os.listdir(tmp_path) == ["pipe"]


@pytest.mark.parametrize(
    ("target", "reason"),
    [
        ("missing/a", "missing does not exist; make it first"),
        ("folder", "is a folder; give the name of a file"),
        ("file/a", "Not a directory"),
        ("n" * 300, "File name too long"),
    ],
)
def test_a_bad_target_is_bad_input(tmp_path, target, reason):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    for write in (check_target, lambda path: write_text(path, "")):
        with pytest.raises(InputError, match=reason) as caught:
            write(tmp_path / target)
        assert target in str(caught.value)
        assert "\n" not in str(caught.value)


def test_no_permission_is_bad_input(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(InputError, match="no permission to write in its folder"):
        write_text(tmp_path / "a", "")
    (tmp_path / "a").touch()
    with pytest.raises(InputError, match="no permission to write this file"):
        check_target(tmp_path / "a")


def test_a_full_disk_is_failed_work_and_leaves_nothing(tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(WorkError, match=r"a\.csv: cannot be written: No space left on device; nothing was left behind"):
        write_text(tmp_path / "a.csv", "content")
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="the system has no /dev/full")
def test_a_full_device_is_failed_work():
    with pytest.raises(WorkError, match="No space left"):
        write_text("/dev/full", "content")


def test_folders_are_made_where_they_are_missing(tmp_path):
    for _ in range(2):
        make_folder(tmp_path / "a" / "b")
        assert (tmp_path / "a" / "b").is_dir()
    (tmp_path / "file").touch()
    for name in ("file", "file/a"):
        with pytest.raises(InputError, match=r"file.*: .*file is a file; give the name of a folder"):
            make_folder(tmp_path / name)
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(InputError, match=r"link: cannot be written: "):
        make_folder(tmp_path / "link")
    with pytest.raises(InputError, match="empty"):
        make_folder("")
