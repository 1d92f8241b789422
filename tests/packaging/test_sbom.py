"""The bill of materials that `make wheel` writes: all that the installed service is locked to, with its version."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_it_lists_what_is_locked(tmp_path):
    (line,) = re.findall(r"^SBOM := \$\(BIN\)/(.*)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    program, *arguments = line.split()
    out = tmp_path / "sbom.json"
    command = [Path(sys.executable).with_name(program), *arguments, "--output-file", out]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    bill = json.loads(out.read_text())
    assert bill["bomFormat"] == "CycloneDX"
    assert bill["metadata"]["component"]["name"] == "ema-monitor"
    locked = re.findall(r"^([\w.-]+)==([^\s;\\]+)", (ROOT / "requirements-run.lock").read_text(), re.MULTILINE)
    assert locked
    assert {(c["name"], c["version"]) for c in bill["components"]} == set(locked)
    assert all(c["purl"].startswith("pkg:pypi/") for c in bill["components"])
