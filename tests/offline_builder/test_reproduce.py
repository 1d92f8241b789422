"""What `ema reproduce` uses again, and what it refuses."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner
from ema_offline_builder.reproduce import reproduce, stage

from ema.core.errors import ConfigError

OF = {"bundle": "b1", "software": "1"}


class Experiment:
    def __init__(self):
        self.count = 0

    def __call__(self):
        self.count += 1
        return {"err_k": 0.01 * self.count}


def test_numbers_are_used_again_only_with_the_bundle_and_software_they_are_of(tmp_path):
    run = Experiment()
    assert stage(tmp_path, "identifier hf", run, OF) == stage(tmp_path, "identifier hf", run, OF) == {"err_k": 0.01}
    assert run.count == 1
    for other in ({"bundle": "b2"}, {"software": "2"}):
        assert stage(tmp_path, "identifier hf", run, OF | other) == {"err_k": 0.01 * run.count}
    assert run.count == 3


@pytest.mark.parametrize(
    "text", ["", '{"of": {"bundle": "b1"', "[]", json.dumps({"err_k": 0.5}), json.dumps({"of": OF})]
)
def test_a_file_that_is_not_whole_or_says_not_what_it_is_of_is_made_again(tmp_path, text):
    (tmp_path / "models.json").write_text(text)
    assert stage(tmp_path, "models", Experiment(), OF) == {"err_k": 0.01}
    assert stage(tmp_path, "models", Experiment(), OF) == {"err_k": 0.01}


def test_an_output_folder_that_is_a_file(tmp_path):
    (tmp_path / "file").write_text("precious")
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(ConfigError, match="cannot be made"):
            CliRunner().invoke(reproduce, ["--out", str(out)], catch_exceptions=False)
    assert (tmp_path / "file").read_text() == "precious"
