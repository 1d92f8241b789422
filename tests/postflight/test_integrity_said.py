"""Every command that reads a log says what is wrong with it, and its exit status tells it from a sound one."""

import shutil

import pytest
from click.testing import CliRunner
from ema_postflight.export import export
from ema_postflight.recover import recover
from ema_postflight.replay import replay
from ema_postflight.report import report
from mcap.opcode import Opcode

from ema.core.errors import NegativeAnswer
from ema.log import LogReader
from ema.log.records import RECORD


def _first_chunk(data):
    at = 8
    while data[at] != Opcode.CHUNK:
        at += RECORD.size + RECORD.unpack_from(data, at)[1]
    return at, at + RECORD.size + RECORD.unpack_from(data, at)[1]


def _flipped_in_a_chunk(data):
    _, end = _first_chunk(data)
    data[end - 50] ^= 4
    return data


def _opcode(data):
    begin, _ = _first_chunk(data)
    data[begin] = Opcode.MESSAGE_INDEX
    return data


def _cut(data):
    return data[: len(data) * 2 // 3]


def _without_a_chunk(data):
    begin, end = _first_chunk(data)
    return data[:begin] + data[end:]


DAMAGES = [_flipped_in_a_chunk, _opcode, _cut, _without_a_chunk]
COMMANDS = {
    "tables": lambda log, out: (export, [log, "--out", out / "t"]),
    "frames": lambda log, out: (export, [log, "--out", out / "f.asc"]),
    "report": lambda log, out: (report, [log, "--out", out / "r.html"]),
    "replay": lambda log, out: (replay, [log, "--onto", "virtual:said", "--speed", "inf"]),
}


def _invoke(name, log, out):
    command, arguments = COMMANDS[name](log, out)
    return CliRunner().invoke(command, [str(a) for a in arguments])


@pytest.fixture(params=DAMAGES, ids=lambda damage: damage.__name__.strip("_"))
def damaged(request, flight, tmp_path):
    copy = tmp_path / "log"
    shutil.copytree(flight, copy)
    path = sorted(copy.iterdir())[1]
    path.write_bytes(request.param(bytearray(path.read_bytes())))
    return copy, path


@pytest.mark.parametrize("name", COMMANDS)
def test_damage_is_said_and_the_exit_status_is_another(name, damaged, tmp_path):
    log, path = damaged
    answer = _invoke(name, log, tmp_path)
    assert isinstance(answer.exception, NegativeAnswer), answer.output  # exit status 1
    assert str(path) in answer.stderr
    assert "not all that was written" in str(answer.exception)


@pytest.mark.parametrize("name", COMMANDS)
def test_nothing_is_said_of_a_sound_log(name, flight, tmp_path):
    answer = _invoke(name, flight, tmp_path)
    assert answer.exception is None, answer.output
    assert str(flight) not in answer.stderr


def test_recovery_says_what_is_missing_and_a_copy_says_of_what_it_is_one(flight, tmp_path):
    source = tmp_path / "a.mcap"
    source.write_bytes(_without_a_chunk(bytearray(sorted(flight.iterdir())[1].read_bytes())))
    answer = CliRunner().invoke(recover, [str(source)])
    assert isinstance(answer.exception, NegativeAnswer)
    assert "message on /status missing between" in answer.output
    copy = tmp_path / "a.recovered.mcap"
    with LogReader(copy) as log:
        assert sum(1 for _ in log.messages()) > 0
        assert log.complaints() == []
        (remark,) = log.remarks()
    assert "is a copy of a.mcap, in which was wrong" in remark
    assert CliRunner().invoke(recover, [str(copy)]).exception is None
