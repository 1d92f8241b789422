"""Attacks on a real daemon process: `make test-adversary`. Each says what came of it; the table is docs/reliability.md.

`--long` attacks more often; `--reliability FILE` writes the table into a page, between its marks.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from adversary_table import Row, as_text, attacks, replaced
from attacked import Attacked

HERE = Path(__file__).parent


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="attack more often")
    parser.addoption("--reliability", metavar="FILE", help="write the table of attacks into this page")


def pytest_collection_modifyitems(items):
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.adversary)


@pytest.fixture
def attack(tmp_path, coarse_bundle):
    """Starts daemons to attack, by settings; ends them."""
    made = []

    def start(**settings):
        folder = tmp_path / f"daemon-{len(made)}"
        folder.mkdir()
        made.append(Attacked(folder, coarse_bundle, **settings))
        made[-1].actuator.start()
        return made[-1].start()

    yield start
    for one in made:
        one.close()


@pytest.fixture
def times(request):
    """How often something is done: in CI, in the long form."""
    return lambda short, long: long if request.config.getoption("--long", default=False) else short


@pytest.fixture
def tell(request):
    """Says what came of an attack: a row of the table."""

    def row(attack, times, outcome, lost):
        request.node.user_properties.append(("attack", [attack, times, outcome, lost]))

    return row


def pytest_terminal_summary(terminalreporter, config):
    rows = []
    for outcome in ("passed", "failed"):
        for report in terminalreporter.stats.get(outcome, []):
            test = report.nodeid.split("::")[-1].split("[")[0]
            said = [Row(*value, test) for name, value in report.user_properties if name == "attack"]
            if "adversary" in report.keywords and outcome == "failed":
                said = [Row(test, "", "FAILED: not defended", "?", test)]
            rows += said
    if rows:
        rows.sort(key=lambda row: (row.test, row.attack))
        terminalreporter.write_line(as_text(rows))
    page = config.getoption("--reliability", default=None)
    if page and rows:
        path = Path(page)
        whole = path.with_name(f"{path.name}.new")  # the tests beside this one read the page
        whole.write_text(replaced(path.read_text(), rows, attacks(HERE)))
        whole.replace(path)
