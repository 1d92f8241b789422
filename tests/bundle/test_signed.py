"""Where trusted keys are configured, only what one of them has signed is taken, to the last bit."""

import os
import shutil
import subprocess

import numpy as np
import pytest
from ema_daemon.settings import load, load_bundles

from ema import bundle as bundles
from ema.core.errors import BundleError, ConfigError
from ema.core.signatures import load_private, load_trusted, sign, signer


def keys(folder, name):
    """Made as the documentation says."""
    private, public = folder / f"{name}.pem", folder / f"{name}.pub"
    subprocess.run(["openssl", "genpkey", "-algorithm", "ed25519", "-out", private], check=True, capture_output=True)
    private.chmod(0o600)
    subprocess.run(["openssl", "pkey", "-in", private, "-pubout", "-out", public], check=True, capture_output=True)
    return private, public


@pytest.fixture(scope="module")
def builder(tmp_path_factory):
    return keys(tmp_path_factory.mktemp("keys"), "builder")


@pytest.fixture(scope="module")
def stranger(tmp_path_factory):
    return keys(tmp_path_factory.mktemp("keys"), "stranger")


@pytest.fixture
def signed(coarse_bundle, builder, tmp_path):
    """A signed copy of a bundle, to be changed."""
    shutil.copytree(coarse_bundle.path, tmp_path / "bundle")
    manifest = (tmp_path / "bundle" / "manifest.json").read_bytes()
    (tmp_path / "bundle" / bundles.SIGNATURE).write_text(sign(manifest, load_private(builder[0])))
    return tmp_path / "bundle"


def test_a_bundle_is_saved_with_its_signature(coarse_bundle, builder, stranger, tmp_path):
    made = bundles.save(
        tmp_path / "b", coarse_bundle.plant, coarse_bundle.manifest["builder"], coarse_bundle.arrays,
        load_private(builder[0]), builder_hash="", figures={},
    )  # fmt: skip
    trusted = [load_trusted(stranger[1]), load_trusted(builder[1])]
    loaded = bundles.load(tmp_path / "b", trusted)
    assert loaded.signed_by == trusted[1].fingerprint
    assert loaded.sha256 == made.sha256 != coarse_bundle.sha256
    assert bundles.load(tmp_path / "b").signed_by == "", "nobody has looked"


def test_an_unsigned_bundle_is_refused(coarse_bundle, builder):
    with pytest.raises(BundleError, match="is not signed, and the configuration trusts signed bundles only"):
        bundles.load(coarse_bundle.path, [load_trusted(builder[1])])


def test_a_bundle_signed_by_somebody_else_is_refused(signed, stranger):
    with pytest.raises(BundleError, match=r"by no trusted key \(.*stranger\.pub\)"):
        bundles.load(signed, [load_trusted(stranger[1])])


def test_any_flipped_bit_is_refused(signed, builder):
    """Of the manifest, of the signature, or of an array."""
    rng, trusted = np.random.default_rng(2), [load_trusted(builder[1])]
    files = [signed / "manifest.json", signed / bundles.SIGNATURE, signed / "A.npy", signed / "schedule.npy"]
    for n in range(60):
        file = files[n % len(files)]
        content = file.read_bytes()
        size = len(content) - (file.name == bundles.SIGNATURE)  # but for its final newline
        changed = bytearray(content)
        changed[rng.integers(size)] ^= 1 << rng.integers(8)
        file.write_bytes(changed)
        with pytest.raises(BundleError):
            bundles.load(signed, trusted)
        file.write_bytes(content)
    assert bundles.load(signed, trusted).signed_by


def test_an_array_changed_with_its_hash_in_the_manifest_is_refused(signed, builder):
    """Whoever can write into the folder can make a bundle that is whole; not one that is signed."""
    import hashlib

    before = hashlib.sha256((signed / "A.npy").read_bytes()).hexdigest()
    np.save(signed / "A.npy", 2 * np.load(signed / "A.npy"))
    after = hashlib.sha256((signed / "A.npy").read_bytes()).hexdigest()
    manifest = signed / "manifest.json"
    manifest.write_text(manifest.read_text().replace(before, after))
    assert bundles.load(signed).signed_by == ""
    with pytest.raises(BundleError, match="is not the one that was signed"):
        bundles.load(signed, [load_trusted(builder[1])])


def test_the_daemon_takes_what_its_configuration_trusts(signed, coarse_bundle, builder, tmp_path):
    (tmp_path / "log").mkdir()
    shutil.copy(builder[1], tmp_path / "builder.pub")
    config = tmp_path / "daemon.yaml"

    def write(path):
        config.write_text(
            f"trusted_keys: [builder.pub]\nactuators: {{0: {{bundle: {path}}}}}\nlog: {{directory: log}}\n"
        )
        return load_bundles(load(config))

    assert write(signed)[0].signed_by == load_trusted(builder[1]).fingerprint
    with pytest.raises(BundleError, match="is not signed"):
        write(coarse_bundle.path)


def test_rfc_8032_literature(tmp_path):
    """Section 7.1, test 1: the library's Ed25519 is what signs."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    secret = bytes.fromhex("9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60")
    key = Ed25519PrivateKey.from_private_bytes(secret)
    assert key.public_key().public_bytes_raw().hex() == (
        "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a"
    )
    assert signer(b"", sign(b"", key), []) is None


@pytest.mark.parametrize(
    ("load", "text", "mode", "said"),
    [
        (load_private, "no key", 0o600, "is no private key in PEM"),
        (load_private, None, 0o600, "cannot be read"),
        (load_private, "no key", 0o644, "others can read it: chmod 600"),
        (load_trusted, "no key", 0o644, "is no public key in PEM; make it: openssl pkey"),
        (load_trusted, None, 0o644, "cannot be read"),
    ],
)
def test_a_bad_key_file_is_refused_in_one_line(tmp_path, load, text, mode, said):
    path = tmp_path / "key.pem"
    if text is not None:
        path.write_text(text)
        path.chmod(mode)
    with pytest.raises(ConfigError, match=said) as caught:
        load(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("load", [load_private, load_trusted])
def test_a_key_that_is_a_pipe_is_refused_at_once(tmp_path, load):
    os.mkfifo(tmp_path / "key.pem", 0o600)
    with pytest.raises(ConfigError, match="it is a pipe"):
        load(tmp_path / "key.pem")


def test_another_kind_of_key_is_refused(tmp_path):
    path = tmp_path / "ec.pem"
    words = ["openssl", "genpkey", "-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256", "-out", path]
    subprocess.run(words, check=True, capture_output=True)
    path.chmod(0o600)
    with pytest.raises(ConfigError, match="is no Ed25519 key"):
        load_private(path)
