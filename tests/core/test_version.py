"""The version names the commit of a checkout, and what is installed from elsewhere says what its metadata say."""

from __future__ import annotations

import subprocess
from importlib import metadata

import pytest

from ema.core import version as module
from ema.core.version import RELEASE, version


@pytest.fixture
def root(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "ROOT", tmp_path)
    version.cache_clear()
    yield tmp_path
    version.cache_clear()


def git(folder, *words):
    name = ("-c", "user.name=x", "-c", "user.email=x@example.org")
    return subprocess.run(["git", "-C", folder, *name, *words], capture_output=True, text=True, check=True).stdout


def test_a_checkout_names_its_commit_and_whether_files_differ(root):
    (root / "pyproject.toml").write_text("")
    git(root, "init", "-q")
    git(root, "add", ".")
    git(root, "commit", "-q", "-m", "x")
    commit = git(root, "rev-parse", "--short=9", "HEAD").strip()
    assert version() == f"{RELEASE}+g{commit}"
    (root / "pyproject.toml").write_text("changed")
    version.cache_clear()
    assert version() == f"{RELEASE}+g{commit}.dirty"


def test_a_source_distribution_keeps_what_was_written_into_it(root):
    (root / "pyproject.toml").write_text("")
    assert version() == RELEASE
    (root / "PKG-INFO").write_text("Metadata-Version: 2.4\nName: ema-monitor\nVersion: 9.9+g123\n")
    version.cache_clear()
    assert version() == "9.9+g123"


def test_an_installed_wheel_says_what_its_metadata_say(root):
    assert version() == metadata.version("ema-monitor")
