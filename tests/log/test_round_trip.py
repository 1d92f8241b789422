import json

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader

from ema.core.version import version
from ema.log import LogReader, LogWriter, schemas

KINDS = [kind for kind in vars(schemas).values() if isinstance(kind, schemas.Kind)]


@pytest.fixture
def log_directory(tmp_path, make):
    """A finished log with something on every channel."""
    with LogWriter(tmp_path, {"ema.dbc": b"VERSION"}, metadata={"version": "1"}) as log:
        for n in range(10):
            log.frames(make.frames(100, seed=n, start_ns=10**18 + n * 10**8), "vcan0")
        for cycle in range(3):
            log.estimate(make.estimate(cycle, actuator=3))
            log.envelope(make.envelope(cycle, actuator=3))
        log.event(make.event())
        log.status(make.status())
    return tmp_path


def test_frames_come_back_bit_for_bit(log_directory, make):
    with LogReader(log_directory) as log:
        batches = list(log.frames())
        assert log.damage == []
        assert log.unfinished == []
    expected = np.concatenate([make.frames(100, seed=n, start_ns=10**18 + n * 10**8) for n in range(10)])
    assert np.array_equal(np.concatenate([b.frames for b in batches]), expected)
    assert {b.bus for b in batches} == {"vcan0"}
    assert all(len(b.frames) <= 512 and np.ptp(b.frames["t_ns"]) < 250_000_000 for b in batches)


def test_messages_come_back_with_every_bit_of_their_numbers(log_directory, make):
    with LogReader(log_directory) as log:
        messages = list(log.messages(lambda topic: topic.startswith("/estimate")))
    assert [m.content["cycle"] for m in messages] == [0, 1, 2]
    assert messages[0].topic == "/estimate/3/linear"
    assert np.array_equal(messages[2].content["k"], make.estimate(2)["k"])


def test_what_is_not_a_number_is_null(log_directory):
    with LogReader(log_directory) as log:
        envelope = next(log.messages(lambda topic: topic == "/envelope/3")).content
    assert envelope["measured"][-1] is None


def test_attachments_and_metadata_come_back(log_directory):
    with LogReader(log_directory) as log:
        assert log.attachments() == {"ema.dbc": b"VERSION"}
        assert log.metadata() == {"software": version(), "version": "1", "segment": "1"}


def test_the_plain_mcap_library_finds_every_channel_with_a_schema_its_messages_obey(log_directory):
    (path,) = log_directory.glob("*.mcap")
    seen = set()
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
            jsonschema.validate(json.loads(message.data), json.loads(schema.data))
            seen.add(channel.topic)
    assert seen == {"/can/frames", "/estimate/3/linear", "/envelope/3", "/event", "/status"}


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_schemas_are_valid_and_say_what_each_field_means(kind):
    jsonschema.Draft202012Validator.check_schema(kind.schema)
    assert all(field.get("description") for field in kind.fields.values())


def test_a_time_range_is_half_open(log_directory):
    low, high = 10**18 + 150_000_000, 10**18 + 420_000_000
    with LogReader(log_directory, low, high) as log:
        t = np.concatenate([b.frames["t_ns"] for b in log.frames()]).astype(np.int64)
    with LogReader(log_directory) as log:
        everything = np.concatenate([b.frames["t_ns"] for b in log.frames()]).astype(np.int64)
    assert np.array_equal(t, everything[(everything >= low) & (everything < high)])


def test_the_caller_may_reuse_its_array(tmp_path, make):
    batch = make.frames(10)
    with LogWriter(tmp_path) as log:
        log.frames(batch, "vcan0")
        batch["id"] = 0
    with LogReader(tmp_path) as log:
        assert np.array_equal(next(log.frames()).frames["id"], make.frames(10)["id"])
