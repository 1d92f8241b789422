"""How modules of the finder rest on each other: longest chain, circles, and modules that no test imports.

python tools/imports.py                      of ema.discrepancy
python tools/imports.py ema.identification   of another package
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp

ROOT = Path(__file__).parent.parent
Imports = Mapping[str, frozenset[str]]  # of each module, those of the same package that it imports when it runs


def imports(package: str) -> Imports:
    """Who imports whom within a package; what only a type checker reads is left out, as in the import contracts."""
    graph = grimp.build_graph(package.split(".")[0], exclude_type_checking_imports=True)
    within = {m for m in graph.modules if m == package or m.startswith(f"{package}.")}
    return {m: frozenset(graph.find_modules_directly_imported_by(m) & within) for m in within}


def circle(of: Imports) -> list[str]:
    """Modules that import each other in a circle, from one back to it; empty where there is none."""
    try:
        TopologicalSorter(of).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def longest_chain(of: Imports) -> list[str]:
    """The longest way from a module to one that imports nothing of the package. There must be no circle."""
    chain: dict[str, list[str]] = {}
    for module in TopologicalSorter(of).static_order():
        chain[module] = [module, *max((chain[m] for m in sorted(of[module])), key=len, default=[])]
    return max(chain.values(), key=len, default=[])


def untested(of: Imports, tests: Iterable[Path]) -> list[str]:
    """Modules with code of their own that no test imports by name."""
    named = {name for path in tests for name in _named(ast.parse(path.read_text(encoding="utf-8")))}
    return sorted(m for m in of if m not in named and not _is_empty(m))


def _named(tree: ast.AST) -> Iterable[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def _is_empty(module: str) -> bool:
    """Whether it is a package whose file holds no function of its own."""
    path = ROOT.joinpath(*module.split("."), "__init__.py")
    return path.exists() and "\ndef " not in path.read_text(encoding="utf-8")


def main(package: str = "ema.discrepancy") -> None:
    """Print all of it."""
    found = imports(package)
    around = circle(found)
    print(f"{package}: {len(found)} modules")
    print("circle:", " → ".join(around) or "none")
    if not around:
        chain = longest_chain(found)
        print(f"longest chain: {len(chain)}", *chain, sep="\n  ")
    alone = untested(found, (ROOT / "tests").rglob("*.py"))
    print(f"imported by no test: {len(alone)}", *alone, sep="\n  ")


if __name__ == "__main__":
    main(*sys.argv[1:2])
