"""The offline phase as a contract: resumable, deterministic, the same from any number of workers."""

from __future__ import annotations

import resource
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from ema_offline_builder import campaign, snapshots
from ema_offline_builder.build import build, read
from ema_offline_builder.claim import claimed
from ema_offline_builder.runs import plan

from ema import bundle
from ema.core.errors import BundleError, ConfigError


class Counting(Executor):
    """Runs tasks at once and counts them."""

    def __init__(self):
        self.count = 0

    def submit(self, fn, /, *args, **kwargs):
        self.count += 1
        future: Future = Future()
        future.set_result(fn(*args, **kwargs))
        return future


class Breaking(ThreadPoolExecutor):
    """Finishes `limit` tasks one after the other, then is interrupted."""

    def __init__(self, limit):
        super().__init__(1)
        self.limit = limit

    def submit(self, fn, /, *args, **kwargs):
        self.limit -= 1
        return super().submit(fn if self.limit >= 0 else self._interrupt, *args, **kwargs)

    @staticmethod
    def _interrupt(*args):
        raise KeyboardInterrupt


@pytest.fixture(scope="session")
def built(tiny, plant, tmp_path_factory):
    out = tmp_path_factory.mktemp("built") / "bundle"
    with ThreadPoolExecutor(8) as pool:
        build(tiny, plant, out, pool)
    return bundle.load(out)


def test_the_same_bits_from_one_worker_or_eight_and_after_an_interruption(tiny, plant, built, tmp_path):
    out = tmp_path / "bundle"
    with Breaking(2) as pool, pytest.raises(KeyboardInterrupt):
        build(tiny, plant, out, pool)
    done = sum((tmp_path / "bundle.work" / snapshots.DONE).read_bytes())
    assert 1 <= done <= 2
    assert not out.exists()

    again = Counting()
    build(tiny, plant, out, again)
    n_blocks = -(-len(plan(tiny, plant)) // campaign.BLOCK)
    assert again.count == n_blocks - done, "finished runs must not be repeated"
    other = bundle.load(out)
    for name, entry in built.manifest["arrays"].items():
        assert other.manifest["arrays"][name]["sha256"] == entry["sha256"], name
    assert not (tmp_path / "bundle.work").exists()


def test_another_configuration_does_not_take_over_unfinished_work(tiny, plant, tmp_path):
    out = tmp_path / "bundle"
    with Breaking(1) as pool, pytest.raises(KeyboardInterrupt):
        build(tiny, plant, out, pool)
    changed = tiny.model_copy(update={"seed": 8})
    with pytest.raises(BundleError, match="another configuration"):
        build(changed, plant, out, Counting())


def test_where_no_bundle_can_be_is_said_before_the_first_run(tiny, plant, tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    Path("file").write_text("precious")
    pool = Counting()
    for out, says in ((".", "working directory"), ("..", "working directory"), ("/", "working directory"),
                      ("file", "is not a bundle"), ("file/bundle", "Not a directory")):  # fmt: skip
        with pytest.raises(BundleError, match=says):
            build(tiny, plant, Path(out), pool)
    assert pool.count == 0
    assert [path.name for path in tmp_path.rglob("*")] == ["here", "file"]
    assert Path("file").read_text() == "precious"


def test_two_builds_into_one_folder_do_not_meet(tiny, plant, tmp_path):
    out = tmp_path / "bundle"
    with claimed(tmp_path / "bundle.work"), pytest.raises(BundleError, match="another build is at work here"):
        build(tiny, plant, out, Counting())
    assert not out.exists()
    with claimed(tmp_path / "bundle.work"):
        pass


def test_a_worker_that_dies_costs_only_its_own_runs(tiny, plant, tmp_path):
    class Dying(Counting):
        def submit(self, fn, /, *args, **kwargs):
            if self.count < 2:
                return super().submit(fn, *args, **kwargs)
            future: Future = Future()
            future.set_exception(BrokenExecutor())
            return future

    runs = plan(tiny, plant)
    with pytest.raises(BundleError, match=rf"worker process died .* {2 * campaign.BLOCK} of {len(runs)} runs"):
        campaign.run(runs, plant, tmp_path, Dying())
    kept = snapshots.Snapshots(tmp_path, len(runs), plant.n_samples, campaign.BLOCK)
    assert len(kept.missing()) == -(-len(runs) // campaign.BLOCK) - 2


def test_no_room_on_the_disk_is_said_before_the_first_run(tiny, plant, tmp_path):
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000_000, limit[1]))
    try:
        with pytest.raises(BundleError, match=r"no room for the 0\.\d+ GB"):
            campaign.run(plan(tiny, plant), plant, tmp_path, Counting())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)


def test_rows_come_back_as_they_were_written(tmp_path):
    rows = np.random.default_rng(1).standard_normal((70, 11)).astype(np.float32)
    kept = snapshots.Snapshots(tmp_path, 70, 11, 32)
    for block in reversed(kept.missing()):
        kept.write(block, rows[block])
    assert not snapshots.Snapshots(tmp_path, 70, 11, 32).missing()
    assert np.array_equal(kept[:], rows)
    assert np.array_equal(kept.part(slice(10, 60))[5:90], rows[15:60])
    assert np.array_equal(kept.part(slice(10, 60)).at(np.array([3, 4])), rows[10:60, 3:5].astype(float))


def test_the_jacobian_is_that_of_independent_runs(built, plant):
    """Column j against a difference made here, with other seeds and another step."""
    from ema.models import hf

    k = np.repeat(np.vstack([np.zeros(6), 0.04 * np.eye(6)]), 32, axis=0)
    e = hf.simulate(plant, k, seeds=np.arange(len(k)) + 99, n_threads=2).envelope.reshape(7, 32, -1).mean(axis=1)
    columns = ((e[1:] - e[0]) / 0.04).T
    for j in range(6):
        cosine = columns[:, j] @ built.arrays["A_full"][:, j]
        cosine /= np.linalg.norm(columns[:, j]) * np.linalg.norm(built.arrays["A_full"][:, j])
        assert cosine > 0.95


def test_the_library_reproduces_its_own_levels(built, plant):
    """LF2 at one fault alone is what HF says there, to a fifth of the change."""
    from ema.models import hf

    lf2 = built.lf2()
    for j, level in ((0, 0.5), (1, 0.3), (2, 0.3), (5, 0.5)):
        k = np.zeros((16, 6))
        k[:, j] = level
        e = hf.simulate(plant, k, seeds=np.arange(16) + 500, n_threads=2).envelope.mean(axis=0)
        assert np.linalg.norm(lf2(k[0]) - e) < 0.2 * np.linalg.norm(e - built.i0)


def test_qr_belongs_to_a(built):
    a = built.arrays
    assert np.allclose(a["Q"] @ a["R"], a["A"])
    assert np.array_equal(a["A"], a["A_full"][built.schedule])


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("seed: 20260101", "seed: -1", "seed"),
        ("n_snapshots: 800", "n_snapshots: 3", "n_snapshots"),
        ("method: som", "method: best", "schedule.method"),
        ("k_max: 0.5", "k_max: 1.5", "k_max"),
        ("k1_levels: [0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0]", "k1_levels: []", "library.k1_levels.* at least 1 item"),
        ("k2_levels: [0.02, 0.05", "k2_levels: [0.05, 0.02", "library.k2_levels.*ascending"),
        ("phase_levels: [0.05", "phase_levels: [-0.05", r"library.phase_levels.0.*greater than 0"),
        ("k6_levels: [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7]", "k6_levels: [0.5, 3.0]", r"k6_levels.1.*equal to 1"),
        ("k_max: [0.02, 0.05, 0.1, 0.2, 0.3, 0.5]", "k_max: [0.1]", "heldout.k_max.* at least 2 items"),
        ("k_max: [0.02, 0.05", "k_max: [0.05, 0.05", "heldout.k_max.*each value once"),
        ("steps: [0.02", "steps: [0", r"jacobian.steps.0.*greater than 0"),
        ("plant: actuator.yaml", "plant: nowhere.yaml", "nowhere.yaml"),
        ("n_seeds: 24", "n_seeds: many", "n_seeds"),
        ("n_seeds: 24", "n_seeds: 24\nspeed: 1", "speed"),
    ],
)
def test_a_wrong_builder_file_is_refused_in_one_line(tmp_path, old, new, says):
    from ema.core import resources

    text = resources.config("builder-quick.yaml").read_text()
    assert old in text
    path = tmp_path / "builder.yaml"
    path.write_text(text.replace(old, new))
    with pytest.raises(ConfigError, match=says) as error:
        read(path)
    assert "\n" not in str(error.value)
