"""Typed YAML configuration: declared once with unit, meaning and range; unknown keys are refused."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Hashable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast, get_args

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator

from .errors import ConfigError
from .files import require_file
from .units import to_unit

S = TypeVar("S", bound="Settings")


class Settings(BaseModel):
    """Base of every configuration section: immutable, unknown keys refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)

    @field_validator("*", mode="before")
    @classmethod
    def _number_with_unit(cls, value: Any, info: ValidationInfo) -> Any:
        field = cls.model_fields[info.field_name or ""]
        if holds_bool(value) and not _may_hold_bool(cast(Hashable, field.annotation)):
            raise ValueError("true and false are no numbers")  # which Python takes them for
        extra = field.json_schema_extra
        if isinstance(value, str) and isinstance(extra, dict) and "unit" in extra:
            return to_unit(value, str(extra["unit"]))
        return value


def holds_bool(value: Any) -> bool:
    """Whether true or false is anywhere in it, where numbers are meant."""
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return isinstance(value, bool) or any(holds_bool(part) for part in parts)


@cache
def _may_hold_bool(annotation: Any) -> bool:
    """Whether a field of this type may be given true or false: itself, or a section, which looks for itself."""
    if annotation in (bool, Any) or (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
        return True
    return any(_may_hold_bool(part) for part in get_args(annotation))


_MOST_VALUES = 1_000_000
_MOST_BYTES = 16_000_000  # of a file


def _n_values(node: Any, known: dict[int, int]) -> int:
    """Values below a node, references written out; one that holds itself has more than any number."""
    if id(node) not in known:
        known[id(node)] = _MOST_VALUES + 1
        parts = node.value if isinstance(node, yaml.CollectionNode) else []
        nodes = [n for pair in parts for n in pair] if isinstance(node, yaml.MappingNode) else parts
        known[id(node)] = 1 + sum(_n_values(part, known) for part in nodes)
    return known[id(node)]


class _UniqueKeyLoader(yaml.SafeLoader):
    """SafeLoader that refuses a key given twice, instead of keeping the last one, and what references blow up."""

    def get_single_node(self) -> Any:
        node = super().get_single_node()
        if node is not None and _n_values(node, {}) > _MOST_VALUES:
            raise yaml.composer.ComposerError(
                None, None, f"more than {_MOST_VALUES} values, by references to references", node.start_mark
            )
        return node

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        if isinstance(node, yaml.MappingNode):
            seen = set()
            for key_node, _ in node.value:
                key = self.construct_object(key_node, deep=True)
                if isinstance(key, list | dict):
                    raise yaml.constructor.ConstructorError(None, None, "a key must be plain text", key_node.start_mark)
                if key in seen:
                    raise yaml.constructor.ConstructorError(
                        None, None, f"key {key!r} is given twice", key_node.start_mark
                    )
                seen.add(key)
        return super().construct_mapping(node, deep)


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Read a YAML mapping; ConfigError names the file and the line."""
    path = Path(path)
    try:
        text = require_file(path, _MOST_BYTES).read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: is not UTF-8 text (byte {error.start})") from error
    try:
        data = yaml.load(text, Loader=_UniqueKeyLoader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        raise ConfigError(f"{path}{where}: is not valid YAML ({getattr(error, 'problem', None) or error})") from error
    if not isinstance(data, dict):
        raise ConfigError(
            f"{path}: must be a mapping of keys to values, is {'empty' if data is None else type(data).__name__}"
        )
    return data


def validate(data: Any, kind: type[S], where: str | Path) -> S:
    """Check `data` against the settings class `kind`; ConfigError names file, key, value and range."""
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise ConfigError(f"{where}: {_describe(error, kind)}") from error


def load(path: str | Path, kind: type[S]) -> S:
    """Read and check a YAML file."""
    return validate(read_yaml(path), kind, path)


def digest(settings: Settings) -> str:
    """SHA-256 of the settings' canonical JSON: equal for equal meaning, whatever the file looked like."""
    text = json.dumps(settings.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def _sections_with(kind: type[Settings], key: str) -> list[str]:
    """Keys of `kind` whose value is a mapping that may hold `key`."""
    return [
        name
        for name, field in kind.model_fields.items()
        for own in (field.annotation, *get_args(field.annotation))
        if isinstance(own, type) and issubclass(own, Settings) and key in own.model_fields
    ]


def _keyed(key: str, value: Any) -> str:
    """A key and its value before what is wrong with it; nothing where it is the file as a whole."""
    text = repr(value)
    return f"key '{key}' = {text if len(text) <= 60 else text[:57] + '...'}: " if key else ""


def _describe(error: ValidationError, kind: type[Settings]) -> str:
    parts = []
    for e in error.errors()[:3]:
        key = ".".join(str(part) for part in e["loc"])
        if e["type"] == "extra_forbidden":
            within = _sections_with(kind, str(e["loc"][-1]))
            parts.append(f"key '{key}' is unknown" + (f"; it belongs to '{within[0]}'" if within else ""))
        elif e["type"] == "missing":
            parts.append(f"key '{key}' is missing")
        else:
            message = e["msg"].removeprefix("Value error, ")
            parts.append(f"{_keyed(key, e.get('input'))}{message[0].lower() + message[1:]}")
    more = error.error_count() - len(parts)
    return "; ".join(parts) + (f" (and {more} more)" if more > 0 else "")
