import cantools
import numpy as np
import pytest

from ema.bus.codec import Codec
from ema.core import frames as fr
from ema.core import resources
from ema.core.errors import BusError


def plain(value):
    return int(value) if isinstance(value, np.integer) else float(value)


@pytest.mark.parametrize("name", sorted(Codec().messages))
def test_batches_decode_as_cantools_decodes_frame_by_frame(codec, name):
    message = codec.messages[name]
    witness = cantools.database.load_file(resources.dbc()).get_message_by_name(name)
    frames = fr.empty(40)
    frames["length"] = message.length
    frames["data"][:, : message.length] = np.random.default_rng(2).integers(0, 256, (40, message.length))
    values = message.decode(frames)
    for n, frame in enumerate(frames):
        expected = witness.decode(frame["data"][: message.length].tobytes(), decode_choices=False)
        for signal, array in values.items():
            if array.ndim == 1:
                assert plain(array[n]) == pytest.approx(expected[signal], rel=1e-15)
            else:
                names = [k for k in expected if k.rstrip("0123456789").rstrip("_") == signal]
                assert array[n].tolist() == pytest.approx([expected[k] for k in names], rel=1e-15)


@pytest.mark.parametrize("name", sorted(Codec().messages))
def test_what_is_encoded_is_decoded(codec, name):
    message = codec.messages[name]
    rng = np.random.default_rng(3)
    values = {}
    for key, field in message.fields.items():
        shape = (5, field.n_values) if field.n_values else (5,)
        if field.dtype.kind == "f":
            raw = rng.standard_normal(shape).astype(field.dtype.newbyteorder("="))
        else:
            raw = rng.integers(int(field.raw_min), int(field.raw_max), shape, dtype=field.dtype.newbyteorder("="))
        values[key] = raw if field.is_count else raw * field.scale + field.offset
    frames = codec.encode(name, 63, values, t_ns=np.arange(5))
    assert codec.find(int(frames["id"][0])) is message
    for key, array in message.decode(frames).items():
        assert np.array_equal(array, values[key])


def test_a_value_has_the_number_that_the_dbc_gives_it(codec):
    assert codec.number("EstimateNuisance", "method", "hf") == 2
    with pytest.raises(BusError, match=r"ema\.dbc: signal CycleStart\.motion_kind has no value 'sine'"):
        codec.number("CycleStart", "motion_kind", "sine")


def test_out_of_range_is_clipped_as_a_converter_does(codec):
    frames = codec.encode("Supply", 0, {"u_dc": [-1.0, 1e9], "temp_w": [-1e9, 1e9]})
    values = codec.messages["Supply"].decode(frames)
    assert values["u_dc"].tolist() == pytest.approx([0, 655.35])
    assert values["temp_w"].tolist() == pytest.approx([-327.68, 327.67])


def test_a_fault_cannot_be_sent_above_one(codec):
    frames = codec.encode("SimulatorControl", 0, {"k": np.full(6, 1.2), "ramp_time": 0.0})
    assert codec.messages["SimulatorControl"].decode(frames)["k"].max() == 1.0


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"u_dc": 48.0}, "missing or unknown: temp_w"),
        ({"u_dc": 48.0, "temp_w": 20.0, "x": 1}, "missing or unknown: x"),
        ({"u_dc": np.nan, "temp_w": 20.0}, "'u_dc' is not finite"),
        ({"u_dc": np.zeros(2), "temp_w": np.zeros(3)}, "shape mismatch"),
    ],
)
def test_bad_values_are_refused(codec, values, said):
    with pytest.raises(BusError, match=said):
        codec.encode("Supply", 0, values)


def test_a_batch_is_split_by_message_in_order(codec, currents):
    supply = codec.encode("Supply", 1, {"u_dc": [1.0, 2.0], "temp_w": 0.0})
    foreign = fr.empty(1)
    mixed = np.concatenate([supply[:1], currents(3), foreign, supply[1:]])
    parts = {message.name: frames for message, frames in codec.split(mixed)}
    assert parts.keys() == {"Supply", "PhaseCurrents"}
    assert codec.messages["Supply"].decode(parts["Supply"])["u_dc"].tolist() == [1.0, 2.0]
    assert np.array_equal(parts["PhaseCurrents"], currents(3))


def test_an_empty_batch_is_no_problem(codec, currents):
    assert list(codec.split(currents(0))) == []
    assert codec.messages["PhaseCurrents"].decode(fr.empty(0))["i_a"].shape == (0, 10)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("not a dbc", "is not a valid DBC"),
        ('VERSION ""\nBU_: A\nBO_ 2147483649 M: 8 A\n SG_ x : 3|12@1+ (1,0) [0|0] "" A\n', "M.x is not a byte-aligned"),
    ],
)
def test_a_dbc_this_codec_cannot_use_is_refused_in_one_line(tmp_path, text, said):
    path = tmp_path / "bad.dbc"
    path.write_text(text)
    with pytest.raises(BusError, match=said):
        Codec(path)
    with pytest.raises(BusError, match="cannot be read"):
        Codec(tmp_path / "missing.dbc")
