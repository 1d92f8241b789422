"""A damaged, foreign or newer bundle is refused with one clear line; nothing that is not a bundle is overwritten."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ema import bundle
from ema.core.errors import BundleError, EmaError

KEYS = [
    *("format", "version", "software", "order_of_k", "plant", "plant_hash"),
    *("builder", "builder_hash", "figures", "arrays"),
]
FACTS = {"builder_hash": "", "figures": {}}


@pytest.fixture
def copy(small_bundle, tmp_path):
    return shutil.copytree(small_bundle.path, tmp_path / "bundle")


def edited(path, **changes):
    manifest = json.loads((path / "manifest.json").read_text())
    manifest.update(changes)
    (path / "manifest.json").write_text(json.dumps(manifest))
    return path


def test_a_sound_bundle_loads_as_it_was_saved(small_bundle):
    again = bundle.load(small_bundle.path)
    for name, array in small_bundle.arrays.items():
        assert np.array_equal(again.arrays[name], array)


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda p: shutil.rmtree(p), "no manifest.json"),
        (lambda p: (shutil.rmtree(p), p.write_text("kind: ema")), "is a file; a bundle is a folder"),
        (lambda p: (p / "manifest.json").write_text("{"), "damaged"),
        (lambda p: (p / "manifest.json").write_text("[]"), "not the manifest"),
        (lambda p: edited(p, format="other"), "not the manifest"),
        (lambda p: edited(p, version=99), "version 99"),
        (lambda p: edited(p, order_of_k=["k2", "k1", "k3", "k4", "k5", "k6"]), "order of k"),
        (lambda p: edited(p, arrays={}), "lists no array"),
        (lambda p: edited(p, nuisance=[{"parameter": "magnet_flux.change"}]), "entry 'nuisance' is damaged"),
        (lambda p: edited(p, arrays={"A": "sound"}), "key 'arrays.A' = 'sound'"),
        (lambda p: edited(p, plant={}), "manifest.json"),
        (lambda p: (p / "A.npy").write_bytes((p / "A.npy").read_bytes()[:-8]), "A.npy: is damaged"),
        (lambda p: (p / "A.npy").unlink(), "A.npy: cannot be read"),
        (lambda p: edited(p, plant_hash="0"), "does not match its hash"),
    ],
)
def test_damage_is_named(copy, damage, says):
    damage(copy)
    with pytest.raises(EmaError, match=says) as error:
        bundle.load(copy)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("key", KEYS)
def test_a_manifest_without_a_key_is_refused(copy, key):
    manifest = json.loads((copy / "manifest.json").read_text())
    assert list(manifest) == KEYS
    del manifest[key]
    (copy / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(BundleError, match="manifest") as error:
        bundle.load(copy)
    assert "\n" not in str(error.value)


def indefinite(S):
    return S - 2.0 * np.eye(len(S))[0] * np.eye(len(S))


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("schedule", lambda a: a[:0], "schedule.npy: is empty"),
        ("f1", lambda a: a[:0], "f1.npy: is empty"),
        ("noise_switching", indefinite, "noise_switching.npy: is no covariance"),
        ("noise_switching", lambda S: np.diag(np.arange(len(S), dtype=float)), "noise_switching.npy: is no covariance"),
        ("noise_switching", lambda S: S + 1e-6 * np.triu(S @ np.ones_like(S), 1), "is no covariance"),
        ("noise_start_k", indefinite, "noise_start_k.npy: is no covariance"),
        ("noise_lf2", lambda M: np.stack([M[0], -M[1]]), "noise_lf2.npy: is no covariance"),
    ],
)
def test_arrays_no_estimate_could_be_made_with_are_refused(small_bundle, name, change, says):
    arrays = small_bundle.arrays | {name: change(small_bundle.arrays[name])}
    with pytest.raises(BundleError, match=says) as error:
        bundle.save(small_bundle.path, small_bundle.plant, {}, arrays, **FACTS)
    assert "\n" not in str(error.value)


def test_a_folder_that_is_no_bundle_is_not_overwritten(small_bundle, tmp_path):
    (tmp_path / "precious.txt").write_text("mine")
    with pytest.raises(EmaError, match="is not a bundle"):
        bundle.save(tmp_path, small_bundle.plant, {}, small_bundle.arrays, **FACTS)
    assert (tmp_path / "precious.txt").read_text() == "mine"


def test_a_bundle_that_could_not_be_loaded_does_not_replace_one(small_bundle):
    broken = small_bundle.arrays | {"A": np.full_like(small_bundle.A, np.nan)}
    with pytest.raises(EmaError, match=r"bundle: is not written.*A\.npy: holds numbers that are not finite") as error:
        bundle.save(small_bundle.path, small_bundle.plant, {}, broken, **FACTS)
    assert "\n" not in str(error.value)
    assert np.array_equal(bundle.load(small_bundle.path).A, small_bundle.A)
    assert [path.name for path in small_bundle.path.parent.iterdir()] == ["bundle"]


@pytest.mark.parametrize("moment", [0, 1])
def test_whenever_replacing_is_interrupted_a_whole_bundle_is_there(small_bundle, monkeypatch, moment):
    moves = []

    def interrupted(*names):
        moves.append(names)
        if len(moves) > moment:
            raise KeyboardInterrupt
        rename(*names)

    rename = bundle.os.replace
    monkeypatch.setattr(bundle.os, "replace", interrupted)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            bundle.save(small_bundle.path, small_bundle.plant, {}, small_bundle.arrays, **FACTS)
    old = [path for path in small_bundle.path.parent.iterdir() if path.suffix != ".unfinished"]
    assert len(old) == 1
    assert np.array_equal(bundle.load(old[0]).A, small_bundle.A)
    monkeypatch.undo()
    bundle.save(small_bundle.path, small_bundle.plant, {}, small_bundle.arrays, **FACTS)
    assert [path.name for path in small_bundle.path.parent.iterdir()] == ["bundle"]


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], derandomize=True)
@given(data=st.binary(max_size=300))
def test_arbitrary_bytes_are_refused(copy, data):
    (copy / "A.npy").write_bytes(data)
    with pytest.raises(EmaError):
        bundle.load(copy)
    (copy / "manifest.json").write_bytes(data)
    with pytest.raises(EmaError):
        bundle.load(copy)


def test_an_archive_in_the_place_of_an_array_is_refused(copy):
    import hashlib

    file = copy / "i0.npy"
    with file.open("wb") as stream:
        np.savez(stream, i0=np.load(copy / "A.npy"))
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["arrays"]["i0"]["sha256"] = hashlib.sha256(file.read_bytes()).hexdigest()
    with pytest.raises(BundleError, match=r"i0\.npy: is an archive of arrays"):
        bundle.load(edited(copy, **manifest))
