import json

import pytest
from click.testing import CliRunner
from ema_postflight.recover import recover

from ema.core.errors import LogError, NegativeAnswer
from ema.log import LogSettings, recovery, schemas
from ema.log.scan import McapFile
from ema.log.segmented import SegmentedLog

EVENT = {"t_ns": 10**18, "level": "info", "code": "x", "text": "y", "actuator": None}


@pytest.fixture
def unfinished(tmp_path):
    log = SegmentedLog(tmp_path, {}, LogSettings(keep_free=0), 0, 0.0)
    log.write(schemas.EVENT.encode(EVENT))
    log.tick(0, 1.0)
    return log.path


def test_a_copy_is_written_beside_the_log(unfinished):
    answer = CliRunner().invoke(recover, [str(unfinished)])
    assert isinstance(answer.exception, NegativeAnswer)  # exit status 1: it was not sound
    assert answer.output.startswith(f"{unfinished.with_suffix('')}.recovered.mcap: 1 messages")


def test_a_directory_is_searched_and_copies_are_not_copied_again(unfinished):
    for _ in range(2):
        answer = CliRunner().invoke(recover, [str(unfinished.parent), "--json"])
    (one,) = json.loads(answer.output)
    assert "exists, and is not overwritten" in one["error"]
    assert isinstance(answer.exception, LogError)


@pytest.mark.parametrize("error", [LogError("cannot be read at byte 7"), OSError(28, "no space"), KeyboardInterrupt()])
def test_no_half_of_a_copy_is_left(unfinished, monkeypatch, error):
    whole = McapFile.blocks

    def blocks(self):
        yield from whole(self)
        raise error

    monkeypatch.setattr(McapFile, "blocks", blocks)
    target = unfinished.with_suffix(".recovered.mcap")
    with pytest.raises((LogError, KeyboardInterrupt)):
        recovery.recover(unfinished, target)
    assert not target.exists()
    monkeypatch.undo()
    assert recovery.recover(unfinished, target).messages == 1


def test_a_sound_log_is_left_alone(unfinished):
    CliRunner().invoke(recover, [str(unfinished)])
    (copy,) = unfinished.parent.glob("*.recovered.mcap")
    answer = CliRunner().invoke(recover, [str(copy)])
    assert "nothing to recover" in answer.output
    assert len(list(unfinished.parent.iterdir())) == 2
