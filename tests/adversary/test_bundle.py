"""A signed bundle, changed: refused at the start, and told when the configuration is read again."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess

import numpy as np
import pytest
from attacked import refusal, statuses

from ema.bundle import SIGNATURE
from ema.core.signatures import load_private, sign
from ema.core.status import ServiceState, Status


@pytest.fixture
def builder(tmp_path):
    """Private and public key, made as the documentation says."""
    private, public = tmp_path / "builder.pem", tmp_path / "builder.pub"
    subprocess.run(["openssl", "genpkey", "-algorithm", "ed25519", "-out", private], check=True, capture_output=True)
    private.chmod(0o600)
    subprocess.run(["openssl", "pkey", "-in", private, "-pubout", "-out", public], check=True, capture_output=True)
    return private, public


@pytest.fixture
def signed(coarse_bundle, builder, tmp_path):
    """A signed copy of a bundle, to be changed."""
    folder = tmp_path / "signed"
    shutil.copytree(coarse_bundle.path, folder)
    (folder / SIGNATURE).write_text(sign((folder / "manifest.json").read_bytes(), load_private(builder[0])))
    return folder


def another_array(folder):
    """Another A, and its hash in the manifest."""
    np.save(folder / "A.npy", 2.0 * np.load(folder / "A.npy"))
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["arrays"]["A"]["sha256"] = _sha256(folder / "A.npy")
    (folder / "manifest.json").write_text(json.dumps(manifest))


def _sha256(path):
    return subprocess.run(["sha256sum", path], check=True, capture_output=True, text=True).stdout.split()[0]


def one_bit_of_the_signature(folder):
    path = folder / SIGNATURE
    path.write_text(path.read_text().swapcase())


def no_signature(folder):
    (folder / SIGNATURE).unlink()


CHANGES = {
    "an array changed, its hash with it": another_array,
    "another signature": one_bit_of_the_signature,
    "no signature": no_signature,
}


def test_a_signed_bundle_is_changed(attack, signed, builder, tell, tmp_path):
    """Under a running daemon: that goes on with what it has checked, and none is started on what is there now."""
    daemon = attack(actuators={0: {"bundle": str(signed)}}, trusted_keys=[str(builder[1])])
    daemon.until_state(ServiceState.RUNNING)
    sound = tmp_path / "sound"
    shutil.copytree(signed, sound)
    for what, change in CHANGES.items():
        change(signed)
        daemon.signal(signal.SIGHUP)
        assert set(statuses(daemon.estimates(2))) == {Status.VALID}
        said = refusal("--config", daemon.config).replace(str(tmp_path), "…")
        tell(f"a signed bundle, {what}", 1, f"reload and start refused: “{said[:140]}”; the running one goes on",
             "nothing")  # fmt: skip
        shutil.rmtree(signed)
        shutil.copytree(sound, signed)
    daemon.signal(signal.SIGHUP)
    daemon.estimates(1)
    assert daemon.stop() == 0
    codes = [event["code"] for event in daemon.events() if event["code"].startswith("reload")]
    assert codes == ["reload_refused"] * len(CHANGES) + ["reloaded"]
