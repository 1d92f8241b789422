"""What makes the estimates: software, bundle and configuration, by their hashes; on the bus and in every log."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ema.bundle import Bundle
from ema.core.version import version

ATTACHMENT = "identification.json"
_VERSION = re.compile(r"(\d+)\.(\d+)\.(\d+)(?:\+g([0-9a-f]{1,16}))?(\.dirty)?.*")


@dataclass(frozen=True)
class Identity:
    """Hashes as hexadecimal digits; `bundles` and `signers` (empty where not asked for) by actuator."""

    software: str
    configuration: str
    bundles: Mapping[int, str]
    signers: Mapping[int, str]

    @classmethod
    def of(cls, bundles: Mapping[int, Bundle], *configuration: bytes) -> Identity:
        """Identity of a monitor; `configuration`: daemon.yaml and alarms.yaml, as the log holds them."""
        return cls(
            version(),
            _digest(configuration),
            {number: bundle.sha256 for number, bundle in bundles.items()},
            {number: bundle.signed_by for number, bundle in bundles.items()},
        )

    def configured(self, *configuration: bytes) -> Identity:
        """The same monitor with another configuration."""
        return replace(self, configuration=_digest(configuration))

    def as_json(self) -> bytes:
        """For the log."""
        content = {
            "software": self.software,
            "configuration": self.configuration,
            "bundles": {str(n): {"sha256": h, "signed_by": self.signers[n] or None} for n, h in self.bundles.items()},
        }
        return json.dumps(content, indent=1).encode()

    def signals(self, actuator: int) -> dict[str, Any]:
        """Signals of the frame `Identification` of one actuator."""
        known = _VERSION.fullmatch(self.software)
        major, minor, patch, commit, dirty = known.groups() if known else ("0", "0", "0", None, None)
        return {
            "bundle": _words(self.bundles[actuator], 2),
            "configuration": _words(self.configuration, 2),
            "signer": _words(self.signers[actuator] or "0" * 16, 1)[0],
            "commit": np.uint64(int(commit or "0", 16)),
            "major": int(major),
            "minor": int(minor),
            "patch": int(patch),
            "changed": int(dirty is not None),
        }


def _digest(texts: Iterable[bytes]) -> str:
    return hashlib.sha256(b"".join(texts)).hexdigest()


def _words(digits: str, count: int) -> np.ndarray:
    """The first 64-bit words of a hash, shape (count,)."""
    return np.array([int(digits[16 * n : 16 * (n + 1)], 16) for n in range(count)], np.uint64)
