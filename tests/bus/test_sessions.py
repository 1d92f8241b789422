from concurrent.futures import ThreadPoolExecutor

import pytest

from ema.bus import sessions as module
from ema.bus.sessions import Sessions
from ema.core.errors import BusError


def test_a_number_is_never_given_twice_over_restarts(tmp_path):
    given = [session.take() for session in (Sessions(tmp_path / "s") for _ in range(5)) for _ in range(150)]
    assert given == sorted(set(given))


def test_several_at_once_share_a_file(tmp_path):
    with ThreadPoolExecutor(8) as pool:
        given = list(pool.map(lambda _: Sessions(tmp_path / "s").take(), range(40)))
    assert len(set(given)) == len(given)


def test_the_number_is_on_the_disk_before_it_is_used(tmp_path):
    given = Sessions(tmp_path / "s").take()
    assert int((tmp_path / "s").read_text()) > given


def test_the_clock_does_not_matter_once_there_is_a_file(tmp_path, monkeypatch):
    first = Sessions(tmp_path / "s").take()
    monkeypatch.setattr(module.time, "time", lambda: 0.0)
    assert Sessions(tmp_path / "s").take() > first


def test_who_takes_over_on_another_machine_begins_later_sessions(tmp_path, monkeypatch):
    """It was started first, and has its own file; its first session begins when it takes over."""
    clock = [1_790_000_000]
    monkeypatch.setattr(module.time, "time", lambda: float(clock[0]))
    standby = Sessions(tmp_path / "standby")
    clock[0] += 3600
    main = Sessions(tmp_path / "main").take()
    clock[0] += 3600
    assert standby.take() > main


def test_a_clock_in_the_next_century_is_not_followed(tmp_path, monkeypatch):
    first = Sessions(tmp_path / "s").take()
    monkeypatch.setattr(module.time, "time", lambda: 4.2e9)
    assert Sessions(tmp_path / "s").take() < first + 1000


@pytest.mark.parametrize("text", ["no number\n", "-5", "99999999999", "1\n2"])
def test_a_damaged_file_is_refused_and_left_as_it_is(tmp_path, text):
    (tmp_path / "s").write_text(text)
    with pytest.raises(BusError, match="is damaged; write a number into it"):
        Sessions(tmp_path / "s")
    assert (tmp_path / "s").read_text() == text


@pytest.mark.parametrize("where", [".", "nowhere/s"])
def test_a_file_that_cannot_be_kept_is_refused(tmp_path, where):
    with pytest.raises(BusError, match="cannot be kept"):
        Sessions(tmp_path / where)
