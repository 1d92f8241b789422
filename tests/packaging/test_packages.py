from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SETUP = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = SETUP["tool"]["setuptools"]["packages"]
FOLDERS = SETUP["tool"]["setuptools"]["package-dir"]
PROGRAMS = {folder for package, folder in FOLDERS.items() if package == f"ema_{folder}"}
NOT_SHIPPED = {"tests", "benchmarks", "tools", "docs", "build"}


def folder_of(package: str) -> str:
    top, *rest = package.split(".")
    return "/".join([FOLDERS[top], *rest])


def test_every_folder_with_an_init_is_a_package():
    found = {
        str(path.parent.relative_to(ROOT))
        for path in ROOT.rglob("__init__.py")
        if not path.relative_to(ROOT).parts[0].startswith(".") and path.relative_to(ROOT).parts[0] not in NOT_SHIPPED
    }
    assert found == {folder_of(package) for package in PACKAGES}


@pytest.mark.parametrize("folder", sorted(PROGRAMS))
def test_programs_import_themselves_relatively(folder):
    """`daemon` is python-daemon's name: an absolute import would find the wrong package."""
    for path in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                assert (node.module or "").split(".")[0] not in PROGRAMS, path
            elif isinstance(node, ast.Import):
                assert not {alias.name.split(".")[0] for alias in node.names} & PROGRAMS, path


def test_nothing_in_the_product_reads_outside_the_repository():
    for folder in {FOLDERS[package.split(".")[0]] for package in PACKAGES}:
        for path in (ROOT / folder).rglob("*.py"):
            assert "../shared" not in path.read_text(), path
