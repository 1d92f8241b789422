"""The wheel holds every package and data folder, under names that clash with nobody's."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from ema.core.version import RELEASE

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    source = tmp_path_factory.mktemp("source")
    # a copy: setuptools leaves its build folder in the source tree
    subprocess.run(["cp", "-r", *filter(Path.exists, map(ROOT.__truediv__, FOLDERS)), source], check=True)
    pip = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--wheel-dir",
        "dist",
        ".",
    ]
    subprocess.run(pip, cwd=source, check=True, capture_output=True, timeout=300)
    (wheel,) = (source / "dist").glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def names(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


FOLDERS = [
    *("ema", "daemon", "offline_builder", "simulator", "postflight", "demo", "dbc", "config", "systemd"),
    *("pyproject.toml", "README.md"),
]


def test_the_wheel_s_version_is_the_software_s(wheel):
    """Of a source tree without git: the release alone."""
    assert wheel.name.startswith(f"ema_monitor-{RELEASE}-")


def test_top_level_names_are_our_own(names):
    """`daemon` is a package of python-daemon; pip would silently overwrite one with the other."""
    top = {name.split("/")[0] for name in names}
    assert all(name == "ema" or name.startswith("ema_") for name in top), top


@pytest.mark.parametrize(
    ("package", "folder"), [("ema_dbc", "dbc"), ("ema_config", "config"), ("ema_systemd", "systemd")]
)
def test_data_files_are_in_the_wheel(names, package, folder):
    listed = subprocess.run(["git", "ls-files", folder], cwd=ROOT, capture_output=True, text=True, check=True)
    for line in listed.stdout.splitlines():
        assert f"{package}/{line.removeprefix(folder + '/')}" in names, line
