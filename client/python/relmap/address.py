"""Finds the address of a daemon, as client/server_address.cc does."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Optional

from relmap.errors import error_of
from relmap.reason import Reason


@dataclass(frozen=True, slots=True)
class ServerAddress:
    """Where a daemon answers.

    Attributes:
        address: host:port, or unix:PATH.
        boot_id: of the daemon that wrote DIR/endpoint; empty: the address was given.
        pid: of that daemon; 0: the address was given.
    """

    address: str
    boot_id: str = ""
    pid: int = 0

    @property
    def is_socket(self) -> bool:
        """Whether it is a Unix socket of this machine, where no credentials are asked for."""
        return self.address.startswith("unix:")


def _is_host_port(text: str) -> bool:
    host, colon, port = text.rpartition(":")
    return bool(colon and host) and "/" not in host and port.isascii() and port.isdecimal() and 0 < int(port) < 65536


def _uri_of_socket(path: str) -> str:
    for character in "%?#":  # gRPC reads the address as a URI; % first
        path = path.replace(character, f"%{ord(character):02x}")
    return "unix:" + path


def _reachable(address: str) -> str:
    for any_interface in ("0.0.0.0:", "[::]:"):
        if address.startswith(any_interface):
            return "localhost:" + address[len(any_interface) :]
    return address


def _refused(what: str) -> Exception:
    return error_of(
        Reason.NOT_ALLOWED,
        f"you may not read {what}: run this as the user of the daemon, or as a member of the group that may use its socket",
    )


def resolve_server(server: "str | os.PathLike[str]") -> ServerAddress:
    """The address of `server`: HOST:PORT, unix:PATH, or a data folder, whose file `endpoint` says where its daemon answers.

    RequestError: it is none of these. Unreachable: no daemon serves the folder. AccessError: it may not be read.
    """
    text = os.fspath(server)
    try:
        folder = Path(text).is_dir()
    except PermissionError:
        raise _refused(text) from None
    if not folder:
        if _is_host_port(text) or text.startswith("unix:/"):
            return ServerAddress(text)
        raise error_of(
            Reason.INVALID_ARGUMENT, f"'{text}' is neither a data folder that exists nor HOST:PORT, such as map.lab:50070"
        )
    path = Path(text) / "endpoint"
    try:
        lines = path.read_text().splitlines()
    except PermissionError:
        raise _refused(str(path)) from None
    except OSError:
        raise error_of(Reason.UNREACHABLE, f"no daemon serves {text} (there is no {path})") from None
    values = {key: value for key, _, value in (line.partition(" ") for line in lines)}
    socket: Optional[str] = values.get("socket")
    address, boot = values.get("address", ""), values.get("boot", "")
    if not (socket or _is_host_port(address)) or not boot:
        raise error_of(Reason.CORRUPT, f"{path} does not say where the daemon answers")
    pid = values.get("pid", "0")
    where = _uri_of_socket(socket) if socket else _reachable(address)
    return ServerAddress(where, boot, int(pid) if pid.isdecimal() else 0)
