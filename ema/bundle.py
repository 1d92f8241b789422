"""What the builder hands the daemon: a folder of numpy arrays (no pickle) and a manifest with their hashes."""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from pydantic import ConfigDict

from ema.core.config import Settings, digest, validate
from ema.core.errors import BundleError, ConfigError
from ema.core.files import require_file
from ema.core.names import FAULTS
from ema.core.signatures import TrustedKey, sign, signer
from ema.core.version import version
from ema.faults import N_FAULTS
from ema.identification.known_error import KnownError, n_terms
from ema.identification.noise import N_START, NoiseModel
from ema.identification.nuisance import Nuisance
from ema.identification.sampling import Sampler
from ema.models.actuator import Actuator
from ema.models.lf2 import Lf2

FORMAT = "ema-bundle"
VERSION = 7
SIGNATURE = "manifest.sig"
_LF2 = tuple(field.name for field in fields(Lf2) if field.name != "i0")
SHAPES = {
    "i0": ("n_t",), "v1": ("n_t",), "eigenvalue_share": ("r",), "schedule": ("n_omega",), "A": ("n_omega", 6),
    "A_full": ("n_t", 6), "A_step": (6,), "Q": ("n_omega", 6), "R": (6, 6),
    "noise_switching": ("n_omega", "n_omega"), "noise_start": ("n_omega", "n_omega"),
    "noise_start_k": ("n_omega", "n_omega"), "start_B": ("n_omega", N_START),
    "start_scale": (2,), "noise_sizes": ("n_levels",), "noise_spreads": (2,),
    "noise_linear": (2, "n_levels", "n_omega", "n_omega"), "noise_lf2": (2, "n_levels", "n_omega", "n_omega"),
    "error_lf2": ("n_terms", "n_omega"), "noise_lf1": (2, "n_levels", "n_omega", "n_omega"),
    "error_lf1": ("n_terms", "n_omega"), "lf1_tuning": (2,),
    "noise_rms": ("n_t",),
    "i_SF": ("n_t",), "i_PH": (3, "n_t"), "f1": ("n_f1",), "f2": ("n_f2",),
    "k2_levels": ("n_k2",), "i_BLK": ("n_k2", "n_t"),
    "k6_levels": ("n_k6",), "i_zeta": ("n_k6", "n_t"),
}  # fmt: skip
_ROUNDING = 1e-12  # of a covariance, as a share of its largest eigenvalue
NUISANCE_SHAPES = {"nuisance_A": ("n_omega", "m")}  # of a bundle that carries nuisance parameters


class _Entry(Settings):
    """What the manifest says of an array."""

    sha256: str
    shape: list[int]
    dtype: str


class _Manifest(Settings):
    """What is read of a manifest whose format, version and order of k fit; see `Bundle.plant`, `Bundle.nuisance`."""

    model_config = ConfigDict(extra="ignore")

    software: str
    plant: dict[str, Any]
    plant_hash: str
    builder: dict[str, Any]
    builder_hash: str
    figures: dict[str, float]
    arrays: dict[str, _Entry]


@dataclass(frozen=True)
class Bundle:
    """An offline phase's result. `arrays` by name; those used most are properties."""

    path: Path
    manifest: dict[str, Any]
    arrays: dict[str, np.ndarray]
    signed_by: str = ""  # fingerprint of the trusted key it is signed with, where that was asked for

    @property
    def sha256(self) -> str:
        """Hash of the whole bundle: of the manifest's content, which holds those of the arrays."""
        return _hash(self.manifest)

    @cached_property
    def plant(self) -> Actuator:
        """The actuator the bundle was built for."""
        return validate(self.manifest["plant"], Actuator, self.path / "manifest.json")

    @property
    def t(self) -> np.ndarray:
        """Sample times of a cycle, shape (n_t,). [s]"""
        return self.plant.time()

    @property
    def rate(self) -> float:
        """Sampling rate. [Hz]"""
        return self.plant.control.rate

    @property
    def schedule(self) -> np.ndarray:
        """Sample indices kept of each cycle, shape (n_omega,)."""
        return self.arrays["schedule"]

    @property
    def i0(self) -> np.ndarray:
        """Nominal envelope, shape (n_t,). [A]"""
        return self.arrays["i0"]

    @property
    def A(self) -> np.ndarray:
        """Jacobian at the schedule, shape (n_omega, 6). [A]"""
        return self.arrays["A"]

    @property
    def N(self) -> np.ndarray:
        """Jacobian of the nuisance parameters at the schedule, shape (n_omega, m). [A]"""
        return self.arrays.get("nuisance_A", np.zeros((len(self.schedule), 0)))

    @cached_property
    def nuisance(self) -> Nuisance:
        """What is estimated beside the faults; mostly nothing."""
        found = _carried(self)
        if not len(found):
            return found
        return found.seen(np.hstack([self.A, self.N]), self.arrays["noise_switching"])

    @cached_property
    def sampler(self) -> Sampler:
        """Takes measurements at the schedule; one for all actuators of this bundle."""
        return Sampler(self.plant, self.schedule)

    @cached_property
    def essence(self) -> Bundle:
        """The bundle without what identifiers are made from: manifest, schedule and what `nuisance` needs."""
        needed = {"schedule", "A", "noise_switching", *NUISANCE_SHAPES}
        return replace(self, arrays={name: array for name, array in self.arrays.items() if name in needed})

    def lf2(self) -> Lf2:
        """The LF2 library over the whole cycle."""
        return Lf2(i0=self.i0, **{name: self.arrays[name] for name in _LF2})

    def known_error(self, method: str) -> KnownError:
        """HF less the model of the identifier `method`, at the schedule."""
        return KnownError(self.arrays[f"error_{method}"])

    def noise(self, method: str) -> NoiseModel:
        """Noise model at the schedule for the identifier `method`; HF has no error of its own."""
        a = self.arrays
        return NoiseModel(
            switching=a["noise_switching"],
            sizes=a["noise_sizes"],
            spreads=a["noise_spreads"],
            model_error=a.get(f"noise_{method}", np.zeros((2, len(a["noise_sizes"]), 1, 1))),
            start=a["noise_start"],
            start_k=a["noise_start_k"],
            B=a["start_B"],
            start_scale=a["start_scale"],
            start_sd=np.array([self.plant.sensors.lvdt_sd, 0.0]),
        )


def check_target(path: Path) -> None:
    """BundleError where a bundle cannot be saved without replacing what is none."""
    if Path.cwd().is_relative_to(path.resolve()):
        raise BundleError(f"{path}: is the working directory or above it; choose another --out")
    try:
        if path.exists() and not (path / "manifest.json").exists() and (not path.is_dir() or any(path.iterdir())):
            raise BundleError(f"{path}: exists and is not a bundle; choose another --out or remove it")
    except OSError as error:
        raise BundleError(f"{path}: cannot be looked into ({error.strerror})") from error


def save(
    path: Path,
    plant: Actuator,
    builder: dict[str, Any],
    arrays: dict[str, np.ndarray],
    key: Ed25519PrivateKey | None = None,
    **facts: Any,
) -> Bundle:
    """Write a bundle whole and fit to be loaded, or not at all; refuses to replace anything that is not a bundle.

    With a `key` the manifest is signed, and with it, through their hashes, the arrays.
    """
    path = Path(path)
    check_target(path)
    home = path.resolve()
    scratch = home.with_name(home.name + ".unfinished")
    shutil.rmtree(scratch, ignore_errors=True)
    try:
        scratch.mkdir(parents=True)
        entries = {}
        for name, array in sorted(arrays.items()):
            np.save(scratch / f"{name}.npy", np.ascontiguousarray(array), allow_pickle=False)
            entries[name] = {
                "sha256": _sha256(scratch / f"{name}.npy"),
                "shape": list(array.shape),
                "dtype": str(array.dtype),
            }
        manifest = {
            "format": FORMAT, "version": VERSION, "software": version(), "order_of_k": list(FAULTS),
            "plant": plant.model_dump(mode="json"), "plant_hash": digest(plant),
            "builder": builder, **facts, "arrays": entries,
        }  # fmt: skip
        text = json.dumps(manifest, indent=1, ensure_ascii=False) + "\n"
        (scratch / "manifest.json").write_text(text, encoding="utf-8")
        if key is not None:
            (scratch / SIGNATURE).write_text(sign(text.encode(), key), encoding="ascii")
        load(scratch)
        _put(scratch, home)
    except OSError as error:
        raise BundleError(f"{path}: cannot be written ({error.strerror})") from error
    except BundleError as error:
        shutil.rmtree(scratch)
        raise BundleError(f"{path}: is not written, for it could not be used: {error}") from error
    return Bundle(path, manifest, arrays)


def _put(new: Path, home: Path) -> None:
    """Move a folder to where another may be; at no moment is there neither of them."""
    aside = home.with_name(home.name + ".replaced")
    if home.exists():
        shutil.rmtree(aside, ignore_errors=True)
        os.replace(home, aside)
    os.replace(new, home)
    shutil.rmtree(aside, ignore_errors=True)


def load(path: str | Path, trusted: Sequence[TrustedKey] = ()) -> Bundle:
    """Read a bundle and check it: format, version, order of k, hashes, shapes, finite numbers.

    With `trusted` keys its manifest must be signed by one of them, and that comes before anything it says.
    """
    path = Path(path)
    manifest, signed_by = _manifest(path, trusted)
    manifest_path = path / "manifest.json"
    try:
        entries = validate(manifest, _Manifest, manifest_path).arrays
        arrays = {name: _array(path, name, entry.sha256) for name, entry in entries.items()}
        bundle = Bundle(path, manifest, arrays, signed_by)
        _check(bundle)
    except ConfigError as error:
        raise BundleError(str(error)) from error
    return bundle


def fingerprint(path: str | Path, trusted: Sequence[TrustedKey] = ()) -> str:
    """`Bundle.sha256` of the bundle that is there now, by its manifest alone; refused as by `load`."""
    manifest, _ = _manifest(Path(path), trusted)
    return _hash(manifest)


def _hash(manifest: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(manifest, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def _manifest(path: Path, trusted: Sequence[TrustedKey]) -> tuple[dict[str, Any], str]:
    """The manifest and who has signed it."""
    manifest_path = path / "manifest.json"
    try:
        content = require_file(manifest_path).read_bytes()
        signed_by = _signer(path, content, trusted) if trusted else ""
        manifest = json.loads(content.decode())
    except FileNotFoundError as error:
        raise BundleError(f"{path}: is not a bundle (no manifest.json); make one with 'ema build'") from error
    except NotADirectoryError as error:
        raise BundleError(f"{path}: is a file; a bundle is a folder, made with 'ema build'") from error
    except OSError as error:
        raise BundleError(f"{manifest_path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise BundleError(f"{manifest_path}: is damaged ({error})") from error
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise BundleError(f"{manifest_path}: is not the manifest of an actuator bundle")
    if manifest.get("version") != VERSION:
        raise BundleError(
            f"{manifest_path}: version {manifest.get('version')!r}, this software reads {VERSION}; build it again"
        )
    if manifest.get("order_of_k") != list(FAULTS):
        raise BundleError(f"{manifest_path}: order of k is not {', '.join(FAULTS)}")
    return manifest, signed_by


def _array(path: Path, name: str, sha256: str) -> np.ndarray:
    file = path / f"{name}.npy"
    if Path(name).name != name:
        raise BundleError(f"{path / 'manifest.json'}: array entry '{name[:40]}' is damaged")
    try:
        content = require_file(file).read_bytes()  # once, so that what is used is what was checked
        if hashlib.sha256(content).hexdigest() != sha256:
            raise BundleError(f"{file}: is damaged (SHA-256 differs from the manifest's)")
        array = np.load(io.BytesIO(content), allow_pickle=False)
    except OSError as error:
        raise BundleError(f"{file}: cannot be read ({error.strerror or error})") from error
    except (ValueError, EOFError) as error:
        raise BundleError(f"{file}: cannot be read ({error})") from error
    if not isinstance(array, np.ndarray):
        array.close()
        raise BundleError(f"{file}: is an archive of arrays (.npz); one array (.npy) is wanted")
    return array


def _signer(path: Path, content: bytes, trusted: Sequence[TrustedKey]) -> str:
    """Fingerprint of the key the manifest is signed with; BundleError where that is none of the trusted ones."""
    try:
        signature = require_file(path / SIGNATURE, 1 << 12).read_text(encoding="ascii")
    except FileNotFoundError as error:
        raise BundleError(f"{path}: is not signed, and the configuration trusts signed bundles only") from error
    except UnicodeDecodeError as error:
        raise BundleError(f"{path / SIGNATURE}: is damaged") from error
    found = signer(content, signature, trusted)
    if found is None:
        keys = ", ".join(str(key.path) for key in trusted)
        raise BundleError(f"{path}: its manifest is not the one that was signed, or by no trusted key ({keys})")
    return found.fingerprint


def _carried(bundle: Bundle) -> Nuisance:
    """The manifest's entry 'nuisance'."""
    try:
        return Nuisance.of(bundle.manifest.get("nuisance", []))
    except (KeyError, TypeError, ValueError) as error:
        where = bundle.path / "manifest.json"
        raise BundleError(f"{where}: entry 'nuisance' is damaged ({error!r})") from error


def _check(bundle: Bundle) -> None:
    m = len(_carried(bundle))
    size: dict[str, int] = {"n_t": bundle.plant.n_samples, "n_terms": n_terms(N_FAULTS + m), "m": m}
    for name, shape in (SHAPES | (NUISANCE_SHAPES if m else {})).items():
        if name not in bundle.arrays:
            raise BundleError(f"{bundle.path / 'manifest.json'}: lists no array '{name}'")
        array = bundle.arrays[name]
        if array.ndim != len(shape) or array.dtype.kind not in "fi":
            raise BundleError(f"{bundle.path / name}.npy: must be numbers of {len(shape)} dimensions")
        for have, want in zip(array.shape, shape, strict=True):
            expected = want if isinstance(want, int) else size.setdefault(want, have)
            if have != expected:
                raise BundleError(f"{bundle.path / name}.npy: shape {array.shape} does not fit ({want} = {expected})")
        if not array.size:
            raise BundleError(f"{bundle.path / name}.npy: is empty")
        if not np.isfinite(array).all():
            raise BundleError(f"{bundle.path / name}.npy: holds numbers that are not finite")
        if shape[-2:] == ("n_omega", "n_omega") and not _is_covariance(array, name == "noise_switching"):
            raise BundleError(f"{bundle.path / name}.npy: is no covariance (symmetric, no negative eigenvalues)")
    if digest(bundle.plant) != bundle.manifest.get("plant_hash"):
        raise BundleError(f"{bundle.path / 'manifest.json'}: the plant does not match its hash")
    s = bundle.schedule
    if s.dtype.kind != "i" or (np.diff(s) <= 0).any() or s[0] < 0 or s[-1] >= size["n_t"]:
        raise BundleError(f"{bundle.path / 'schedule.npy'}: sample indices must increase within 0…{size['n_t'] - 1}")


def _is_covariance(S: np.ndarray, definite: bool) -> bool:
    """Whether matrices (..., n, n) are symmetric and positive semidefinite to rounding, or `definite`.

    One that is definite stays so with any of the others added, and residuals can be weighted by its inverse.
    """
    eigenvalues = np.linalg.eigvalsh(S)
    least, rounding = eigenvalues[..., 0], _ROUNDING * np.abs(eigenvalues[..., -1])
    symmetric = np.abs(S - np.swapaxes(S, -1, -2)).max(axis=(-2, -1)) <= rounding
    return bool((symmetric & (least > 0.0 if definite else least >= -rounding)).all())


def _sha256(path: Path) -> str:
    return hashlib.sha256(require_file(path).read_bytes()).hexdigest()
