"""The layout shipped for Foxglove shows fields that logs have."""

import json
import re

import pytest

from ema.core import resources
from ema.log import schemas

KINDS = [kind for kind in vars(schemas).values() if isinstance(kind, schemas.Kind)]
LAYOUT = json.loads(resources.config("foxglove-layout.json").read_text())


def _paths():
    for panel in LAYOUT["configById"].values():
        yield from (path["value"] for path in panel.get("paths", []))
        if "topicPath" in panel:
            yield panel["topicPath"]


@pytest.mark.parametrize("path", sorted(_paths()))
def test_every_path_is_a_field_of_a_channel(path):
    topic, _, names = path.partition(".")
    (kind,) = [kind for kind in KINDS if re.fullmatch(re.sub(r"\{\w+\}", r"\\w+", kind.topic), topic)]
    if names:
        name, index = re.fullmatch(r"(\w+)(?:\[(\d+)\])?(?:\.\w+)?", names).groups()
        field = kind.fields[name]
        assert index is None or int(index) < field["maxItems"]


def test_every_panel_placed_is_described():
    def leaves(node):
        return [node] if isinstance(node, str) else [*leaves(node["first"]), *leaves(node["second"])]

    assert sorted(leaves(LAYOUT["layout"])) == sorted(LAYOUT["configById"])
