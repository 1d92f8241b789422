"""Whatever is given as a file: one line, at once, and no memory filled."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from ema import bundle
from ema.bus.keys import load_keys
from ema.core import config, csv_records
from ema.core.errors import ConfigError, EmaError
from ema.core.files import require_new, write_new
from ema.log import LogReader
from ema.models.actuator import Actuator


@pytest.fixture(params=["zero", "pipe", "folder", "socket"])
def no_file(request, tmp_path):
    if request.param == "zero":
        yield Path("/dev/zero"), "a device"
    elif request.param == "pipe":
        os.mkfifo(tmp_path / "pipe")  # nobody writes, so opening it would wait for ever
        yield tmp_path / "pipe", "a pipe"
    elif request.param == "folder":
        yield tmp_path, "a folder"
    else:
        with socket.socket(socket.AF_UNIX) as sock:
            sock.bind(str(tmp_path / "s"))
            yield tmp_path / "s", "a socket"


def read_log(path):
    if path.is_dir():
        raise EmaError("a folder is a log of segments, it is a folder")
    with LogReader(path):
        pass


@pytest.mark.parametrize(
    "read",
    [lambda path: config.load(path, Actuator), load_keys, csv_records.read_csv, read_log],
    ids=["configuration", "key", "record", "log"],
)
def test_what_is_no_file_is_refused_in_one_line(no_file, read):
    path, kind = no_file
    with pytest.raises(EmaError, match=f"it is {kind}") as error:
        read(path)
    assert "\n" not in str(error.value)


def test_a_manifest_and_an_array_have_to_be_files(no_file, tmp_path):
    path, kind = no_file
    folder = tmp_path / "bundle"
    folder.mkdir()
    (folder / "manifest.json").symlink_to(path)
    with pytest.raises(EmaError, match=f"it is {kind}"):
        bundle.load(folder)


def test_a_configuration_of_any_size_is_not_read(tmp_path):
    path = tmp_path / "large.yaml"
    with path.open("wb") as file:
        file.truncate(10**12)  # takes no room on the disk
    with pytest.raises(EmaError, match="has 1000000000000 bytes, at most 16000000 make sense"):
        config.load(path, Actuator)


def test_what_exists_is_not_overwritten(tmp_path):
    path = tmp_path / "plant.yaml"
    write_new(path, "one\n")
    for write in (require_new, lambda p: write_new(p, "two\n")):
        with pytest.raises(ConfigError, match=f"{path}: exists, and is not overwritten; choose another --out"):
            write(path)
    assert path.read_text() == "one\n"
    with pytest.raises(ConfigError, match="cannot be written"):
        write_new(tmp_path / "no" / "plant.yaml", "three\n")
