"""The report in a real browser: numbers equal the log's, every picture is visible, nothing is loaded, nothing fails."""

import json
import re
import shutil
import subprocess

import numpy as np
import pytest
import yaml
from axe_look import BROWSER, look
from click.testing import CliRunner
from ema_postflight.report import report
from ema_postflight.report_settings import Severity, shipped
from ema_postflight.series import MOST, OperatingTime, Series, SeverityTrack

from ema.core import resources
from ema.core.errors import ConfigError, LogError
from ema.core.names import FAULTS
from ema.log import LogReader

ALARMS = shipped()
LOOK = """<script>addEventListener("load", () => {
  const pictures = [...document.images].map(i => ({w: i.naturalWidth, shown: i.getBoundingClientRect().width}));
  const k = [...document.querySelectorAll("[data-fault]")].map(e => ({...e.dataset, text: e.innerText}));
  const counters = Object.fromEntries([...document.querySelectorAll("[data-counter]")]
    .map(e => [e.dataset.counter, e.innerText]));
  const seen = {pictures, k, counters, wide: document.documentElement.scrollWidth > innerWidth,
    loaded: performance.getEntriesByType("resource").map(e => e.name).filter(n => !n.startsWith("data:"))};
  const out = document.createElement("script"); out.type = "application/json"; out.id = "seen";
  out.textContent = JSON.stringify(seen); document.body.append(out);
})</script>"""


@pytest.fixture(scope="module")
def page(flight, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    answer = CliRunner().invoke(report, [str(flight), "--out", str(path)], catch_exceptions=False)
    assert answer.exit_code == 0, answer.output
    return path


@pytest.fixture(scope="module")
def browser(page):
    """What a browser makes of the page, and what it complains of."""
    if BROWSER is None:
        pytest.skip("no chromium here: apt-get install chromium")
    copy = page.with_name("looked-at.html")
    copy.write_text(page.read_text().replace("</body>", LOOK + "</body>"))
    profile = f"--user-data-dir={page.parent / 'profile'}"
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--window-size=1280,900", "--enable-logging=stderr"]
    command = [BROWSER, *options, profile, "--virtual-time-budget=5000", "--dump-dom", copy.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    found = re.search(r'<script type="application/json" id="seen">(.*?)</script>', done.stdout, re.S)
    complaints = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return json.loads(found.group(1)), complaints


SCREENS = {
    "laptop": (1280, 900, False),
    "laptop, dark": (1280, 900, True),
    "phone": (390, 844, False),
    "phone, dark": (390, 844, True),
}


@pytest.fixture(scope="module", params=SCREENS)
def violations(request, page):
    """What axe-core finds wrong with the page on a screen, and whether the page is wider than that."""
    if BROWSER is None:
        pytest.skip("no chromium here: apt-get install chromium")
    return look(page, *SCREENS[request.param])


def test_nothing_keeps_anybody_from_reading_it_on_any_screen(violations):
    assert violations["found"] == []
    assert violations["n_rules"] > 20


def test_the_page_is_no_wider_than_the_screen(violations):
    assert not violations["wide"]


def test_no_error_is_on_the_console_and_nothing_is_loaded(browser):
    seen, complaints = browser
    assert complaints == []
    assert seen["loaded"] == []


def test_every_picture_is_visible_and_the_page_fits_a_laptop(browser):
    seen, _ = browser
    assert len(seen["pictures"]) == 2 * 3  # for each actuator: trend, last and least likely envelope
    assert all(p["w"] > 100 and p["shown"] > 100 for p in seen["pictures"])
    assert not seen["wide"]


def test_the_numbers_shown_are_those_of_the_log(browser, flight):
    seen, _ = browser
    with LogReader(flight) as log:
        last = {m.content["actuator"]: m.content for m in log.messages(lambda t: t.startswith("/estimate"))}
        status = [m.content for m in log.messages(lambda t: t == "/status")][-1]
    assert len(seen["k"]) == 12
    for cell in seen["k"]:
        index = int(cell["fault"][1]) - 1
        content = last[int(cell["actuator"])]
        assert float(cell["k"]) == content["k"][index]
        assert float(cell["sd"]) == content["sd"][index]
        assert cell["text"].split()[0] == f"{content['k'][index]:.3f}"
    assert {name: int(n) for name, n in seen["counters"].items()} == status["counters"]


def test_the_page_holds_what_it_should(page):
    text = page.read_text()
    for part in ("Health now", "remaining life", "Changes of severity", "Envelope at the schedule", "lost frames",
                 "one frame lost", "Data quality", "starts of the daemon", "manifest.json", "ema-monitor"):  # fmt: skip
        assert part in text, part
    assert re.findall(r'(?:src|href)="(?!data:)', text) == []
    assert "http" not in re.sub(r'base64,[^"]*', "", text)


def test_what_a_log_says_is_never_taken_for_markup(flight, tmp_path):
    from ema.log import LogWriter, contents

    with LogReader(flight) as old, LogWriter(tmp_path, {"daemon.yaml": b"</pre><script>alert(1)</script>"}) as new:
        for message in old.messages(lambda t: t.startswith("/estimate")):
            new.estimate(message.content)
        new.event(contents.event(message.t_ns, "info", "x", "<img src=x onerror=alert(1)>"))
    CliRunner().invoke(report, [str(tmp_path), "--out", str(tmp_path / "r.html")], catch_exceptions=False)
    text = (tmp_path / "r.html").read_text()
    assert "<script" not in text
    assert "<img src=x" not in text


def test_severity_needs_persistence():
    ok, watch, alarm = 0.01, 0.10, 0.20

    def run(*k, sd=0.001):
        track = SeverityTrack("k1", ALARMS)
        changes = [(at, track.severity) for at, value in enumerate(k) if track.add(value, sd) is not None]
        return changes, track.severity

    assert run(ok, ok, ok, alarm, ok, ok, alarm) == ([], Severity.OK)
    assert run(ok, ok, ok, watch, alarm, watch, watch) == ([(5, Severity.WATCH)], Severity.WATCH)
    assert run(alarm, alarm, alarm, ok, watch, ok, ok)[1] == Severity.OK
    assert run(ok, ok) == ([], None)  # too few to know


def test_severity_is_that_of_the_lower_end():
    def severity(sd):
        track = SeverityTrack("k1", ALARMS)
        for _ in range(5):
            track.add(0.07, sd)
        return track.severity

    assert severity(0.002) == Severity.WATCH
    assert severity(0.02) == Severity.OK


def test_a_fault_of_a_short_flight_is_not_ok(faulty_flight, tmp_path):
    """The tutorial's: twelve cycles in which k1 grows to 0.1, of which LF2 saw three."""
    arguments = [str(faulty_flight), "--out", str(tmp_path / "r.html")]
    CliRunner().invoke(report, arguments, catch_exceptions=False)
    text = (tmp_path / "r.html").read_text()
    health = text[text.index('id="health"') : text.index("</table>")]
    assert '<span class="badge watch">' in health
    assert "lf2" in health


def test_thresholds_come_from_the_configuration(flight, tmp_path):
    thresholds = yaml.safe_load(resources.config("alarms.yaml").read_text())
    thresholds["faults"]["k1"] = {"watch": 0.9, "alarm": 0.99}
    (tmp_path / "a.yaml").write_text(yaml.safe_dump(thresholds))
    arguments = [str(flight), "--out", str(tmp_path / "r.html"), "--alarms", str(tmp_path / "a.yaml")]
    CliRunner().invoke(report, arguments, catch_exceptions=False)
    assert "Changes of severity" not in (tmp_path / "r.html").read_text()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"severity": {}}, "'severity' is unknown"),
        ({"alarms": {"faults": {}}}, "faults"),
        ({"colour": "red"}, "'colour' is unknown"),
        ({"methods": ["hf", "lf1"]}, r"r\.yaml: key 'methods' .*identifier 'lf1' is not in logs; linear, lf2, hf are"),
    ],
)
def test_a_wrong_configuration_is_refused(flight, tmp_path, change, message):
    thresholds = yaml.safe_load(resources.config("report.yaml").read_text()) | change
    (tmp_path / "r.yaml").write_text(yaml.safe_dump(thresholds))
    arguments = [str(flight), "--out", str(tmp_path / "r.html"), "--config", str(tmp_path / "r.yaml")]
    with pytest.raises(ConfigError, match=message):
        CliRunner().invoke(report, arguments, catch_exceptions=False)


def test_nothing_is_overwritten_and_an_empty_log_is_told(flight, page, tmp_path):
    with pytest.raises(LogError, match="exists"):
        CliRunner().invoke(report, [str(flight), "--out", str(page)], catch_exceptions=False)
    arguments = [str(flight), "--out", str(tmp_path / "r.html"), "--start", "9999"]
    with pytest.raises(LogError, match="no estimate"):
        CliRunner().invoke(report, arguments, catch_exceptions=False)


def _series(n, sd=0.01):
    rng = np.random.default_rng(4)
    series = Series(ALARMS)
    k = 0.1 * np.linspace(0, 1, n)[:, None] + sd * rng.standard_normal((n, 6))
    for at, row in enumerate(k):
        content = {"t_ns": at, "cycle": at, "status": "valid", "reasons": [], "k": row.tolist(), "sd": [sd] * 6}
        series.add(content, float(at))
    return series, k


def test_the_same_flight_given_ten_times_makes_the_same_report(faulty_flight, tmp_path):
    (log,) = faulty_flight.iterdir()
    copies = [tmp_path / f"copy-{n}.mcap" for n in range(10)]
    for copy in copies:
        shutil.copy(log, copy)
    shown = []
    for number, given in enumerate(([log], [log, *copies])):
        path = tmp_path / f"{number}.html"
        answer = CliRunner().invoke(report, [*map(str, given), "--out", str(path)], catch_exceptions=False)
        assert answer.exit_code == 0
        shown.append(re.findall(r'data-k=.*? data-sd=".*?"|<tr><td>valid.*', path.read_text()))
    assert len(shown[0]) == len(FAULTS) + 1
    assert shown[0] == shown[1]
    assert answer.stderr.count("is the same flight as") == 10
    assert path.read_text().count("is the same flight as") == 10


def test_a_long_series_is_kept_in_bounded_memory_without_losing_its_mean_last_value_or_information():
    n, sd = 5 * MOST + 3, 0.01
    series, k = _series(n, sd)
    points = series.points
    assert MOST // 2 <= len(points.t_op) <= MOST
    assert (np.diff(points.t_op) > 0).all()
    assert points.weight.sum(axis=0) == pytest.approx(n / sd**2)
    mean = (points.weight * points.k).sum(axis=0) / points.weight.sum(axis=0)
    assert mean == pytest.approx(k.mean(axis=0), rel=1e-9)
    assert points.sd == pytest.approx(sd)
    assert series.last.k.tolist() == k[-1].tolist()
    assert (series.last.cycle, series.n_changes) == (
        n - 1,
        sum(_n_changes(f, column, sd) for f, column in zip(FAULTS, k.T, strict=True)),
    )


def _n_changes(fault, k, sd):
    track = SeverityTrack(fault, ALARMS)
    return sum(track.add(value, sd) is not None for value in k)


def test_breaks_between_flights_are_not_time_of_operation():
    time = OperatingTime(60.0)
    t = [0, 10, 20, 3620, 3630, 3625, 0, 5]  # a break of an hour, an estimate that comes late, a clock set back
    assert [time.at(round(x * 1e9)) for x in t] == [0, 10, 20, 20, 30, 25, 30, 35]
    assert list(time.breaks) == [(20.0, 3600.0)]
