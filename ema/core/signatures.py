"""Ed25519 signatures (RFC 8032) of what one machine makes and another must be able to trust; keys are PEM files.

(umask 077; openssl genpkey -algorithm ed25519 -out builder.pem)      # signs; stays with the builder
openssl pkey -in builder.pem -pubout -out builder.pub                 # verifies; goes to every monitor
"""

from __future__ import annotations

import base64
import hashlib
import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

from .errors import ConfigError
from .files import require_file

_LARGEST = 1 << 16  # a key file [B]


class TrustedKey(NamedTuple):
    """A key whose signatures count."""

    path: Path
    key: Ed25519PublicKey

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the raw key."""
        return hashlib.sha256(self.key.public_bytes_raw()).hexdigest()


def load_private(path: Path) -> Ed25519PrivateKey:
    """The key that signs, from a file that nobody but its owner can read; ConfigError otherwise."""
    content, mode = _read(path)
    if mode & 0o077:
        raise ConfigError(f"key {path}: others can read it: chmod 600 {path}")
    try:
        key = serialization.load_pem_private_key(content, None)
    except (ValueError, TypeError, UnsupportedAlgorithm):
        raise ConfigError(f"key {path}: is no private key in PEM without a password") from None
    if not isinstance(key, Ed25519PrivateKey):
        raise ConfigError(f"key {path}: is no Ed25519 key; make one: openssl genpkey -algorithm ed25519")
    return key


def load_trusted(path: Path) -> TrustedKey:
    """A key that verifies; ConfigError where the file is none."""
    content, _ = _read(path)
    try:
        key = serialization.load_pem_public_key(content)
    except (ValueError, UnsupportedAlgorithm):
        raise ConfigError(f"key {path}: is no public key in PEM; make it: openssl pkey -in KEY -pubout") from None
    if not isinstance(key, Ed25519PublicKey):
        raise ConfigError(f"key {path}: is no Ed25519 key")
    return TrustedKey(path, key)


def sign(content: bytes, key: Ed25519PrivateKey) -> str:
    """The signature as text."""
    return base64.b64encode(key.sign(content)).decode() + "\n"


def signer(content: bytes, signature: str, trusted: Iterable[TrustedKey]) -> TrustedKey | None:
    """Whose of the trusted keys the signature is; None if of none."""
    try:
        raw = base64.b64decode(signature.strip(), validate=True)
    except ValueError:
        return None
    for one in trusted:
        try:
            one.key.verify(raw, content)
        except InvalidSignature:
            continue
        return one
    return None


def _read(path: Path) -> tuple[bytes, int]:
    """Content and mode of a file."""
    try:
        with require_file(path).open("rb") as file:
            return file.read(_LARGEST), os.fstat(file.fileno()).st_mode
    except OSError as error:
        raise ConfigError(f"key {path}: cannot be read ({error.strerror})") from error
