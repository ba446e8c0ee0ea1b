"""Who the caller is: a file of `relmap-admin credentials new`, or a token and the authority that issued the daemon's certificate."""

from __future__ import annotations

import base64
import os
import re
import stat
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional, Union

import grpc

PathLike = Union[str, "os.PathLike[str]"]
"""The path of a file."""

_BLOCK = re.compile(r"-----BEGIN ([A-Z0-9 ]+)-----\s*(.*?)-----END \1-----\n?", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Credentials:
    """What is shown to a daemon that serves TLS.

    Attributes:
        authorities: certificates (PEM) of those that may have issued the daemon's.
        certificate, key: the caller's own (PEM); empty: he is known by token.
        token: empty: he is known by certificate, or not at all.
    """

    authorities: bytes
    certificate: bytes = b""
    key: bytes = field(default=b"", repr=False)
    token: str = field(default="", repr=False)

    def channel_credentials(self) -> Any:
        """The same as grpc.ChannelCredentials."""
        tls = grpc.ssl_channel_credentials(self.authorities, self.key or None, self.certificate or None)
        if not self.token:
            return tls
        return grpc.composite_channel_credentials(tls, grpc.access_token_call_credentials(self.token))


def parse_credentials(text: str) -> Credentials:
    """The credentials of a file's text: PEM blocks, as proto/access/credentials.h describes. ValueError: it is malformed."""
    authorities, certificate, key, token = b"", b"", b"", ""
    for match in _BLOCK.finditer(text):
        kind, body, block = match[1], match[2], match[0].encode()
        if kind == "RELMAP TOKEN":
            token = base64.b64decode("".join(body.split()), validate=True).decode()
        elif kind.endswith("PRIVATE KEY"):
            key = block
        elif kind == "CERTIFICATE":
            if key and not certificate:
                certificate = block
            else:
                authorities += block
    if bool(key) == bool(token):
        raise ValueError("there are a private key and a token" if key else "there is neither a private key nor a token")
    if key and not certificate:
        raise ValueError("there is no certificate after the private key")
    if not authorities:
        raise ValueError("there is no certificate of the authority that issued the daemon's")
    return Credentials(authorities, certificate, key, token)


def read_credentials(path: PathLike) -> Credentials:
    """The credentials of a file. OSError: it cannot be read. ValueError: others can read it, or it is malformed."""
    data = Path(path).read_bytes()
    if os.stat(path).st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise ValueError(f"others can read {os.fspath(path)}: chmod 600 {os.fspath(path)}")
    try:
        return parse_credentials(data.decode())
    except ValueError as error:  # UnicodeDecodeError, too
        raise ValueError(f"{os.fspath(path)} holds no credentials: {error}") from error


def credentials_of(
    credentials: Optional[PathLike], token: Optional[str], tls: Union[None, bool, bytes, PathLike]
) -> Optional[Credentials]:
    """The credentials that the arguments of connect() mean; None: no TLS. OSError: a file cannot be read. ValueError: it holds
    none, or the arguments do not go together."""
    if credentials is not None:
        if token is not None or tls not in (None, True):
            raise ValueError("a file of credentials has the token and the authority itself: give either it or token and tls")
        return read_credentials(credentials)
    if tls is None or tls is False:
        if token is not None:
            raise ValueError("a token needs tls: the path or the bytes of the authority's certificate")
        return None
    if tls is True:
        raise ValueError("tls needs the path or the bytes of the authority's certificate (ca.crt), or credentials")
    word = (token or "").strip()  # a file that holds it ends with a new line
    if token is not None and not re.fullmatch(r"[!-~]+", word):
        raise ValueError("the token is empty, or holds characters that no token has")
    if isinstance(tls, bytes):
        if b"-----BEGIN CERTIFICATE-----" not in tls:
            raise ValueError("tls holds no certificate in PEM; it is the path or the bytes of the authority's certificate")
        return Credentials(tls, token=word)
    authority = Path(tls).read_bytes()
    if b"-----BEGIN CERTIFICATE-----" not in authority:
        raise ValueError(f"{os.fspath(tls)} holds no certificate in PEM")
    return Credentials(authority, token=word)
