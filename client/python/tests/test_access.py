"""Over TLS: certificates and tokens, roles, and who is not known."""

from __future__ import annotations

import asyncio
import pathlib
from typing import Iterator

import points_world
import pytest
import relmap
import relmap.aio
from conftest import PATIENCE_S, Daemon, program
from relmap.credentials import Credentials, parse_credentials, read_credentials


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Credentials of an operator, a robot and a reader, who has a token."""
    folder = tmp_path_factory.mktemp("access")
    program("relmap-admin", "credentials", "ca", str(folder / "ca"), "--host", "localhost")
    for name, role, more in (("anna", "operator", []), ("cart", "robot", []), ("bob", "reader", ["--token"])):
        out = str(folder / f"{name}.pem")
        program("relmap-admin", "credentials", "new", str(folder / "ca"), name, "--role", role, "--out", out, *more)
    return folder


@pytest.fixture(scope="module")
def secured(folder: pathlib.Path) -> Iterator[Daemon]:
    running = Daemon(folder / "map", "--listen", "127.0.0.1:0", "--credentials", str(folder / "ca"))
    yield running
    running.stop()


def _server(secured: Daemon) -> str:
    return "localhost:" + secured.endpoint()["address"].rpartition(":")[2]


def test_roles_are_kept(secured: Daemon, folder: pathlib.Path) -> None:
    server = _server(secured)
    with relmap.connect(server, credentials=folder / "cart.pem", timeout=PATIENCE_S) as robot:
        with robot.session("cart", points_world.CAMERA, name="over TLS") as session:
            for step in points_world.drive(3):
                session.add(step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks, features=step.features)
    with relmap.connect(server, credentials=folder / "anna.pem", timeout=PATIENCE_S) as operator:
        operator.wait_idle()
        assert operator.sessions()[0].frames == 3
        operator.set_label("1:1", "door")
        entries = operator.audit(who="anna", method="Map.SetLabel")
        assert entries and entries[0].who == "anna" and entries[0].outcome == relmap.Reason.OK
        assert operator.audit(who="nobody") == () and not entries.to_pandas().empty
    with relmap.connect(server, credentials=folder / "bob.pem", timeout=PATIENCE_S) as reader:
        assert reader.sessions()[0].frames == 3
        with pytest.raises(relmap.AccessError) as raised:
            reader.set_label("1:1", "gate")
        assert raised.value.reason == relmap.Reason.NOT_ALLOWED


def test_a_token_and_an_authority_are_enough(secured: Daemon, folder: pathlib.Path) -> None:
    bob = read_credentials(folder / "bob.pem")
    authority = folder / "authority.pem"
    authority.write_bytes(bob.authorities)
    for tls in (bob.authorities, authority, str(authority)):
        with relmap.connect(_server(secured), token=bob.token, tls=tls) as client:
            assert client.status().version
    with pytest.raises(relmap.AccessError) as raised:
        relmap.connect(_server(secured), token="wrong", tls=authority)
    assert raised.value.reason == relmap.Reason.UNAUTHENTICATED

    async def run() -> str:
        async with await relmap.aio.connect(_server(secured), credentials=folder / "bob.pem") as client:
            return (await client.status()).version

    assert asyncio.run(run())


def test_robots_send_only_as_themselves(secured: Daemon, folder: pathlib.Path) -> None:
    with relmap.connect(_server(secured), credentials=folder / "cart.pem", timeout=PATIENCE_S) as robot:
        with pytest.raises(relmap.AccessError):
            with robot.session("other", points_world.CAMERA, patience=5) as session:
                for step in points_world.drive(2):
                    session.add(step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks)
                session.flush(PATIENCE_S)


def test_without_credentials_nobody_gets_in(secured: Daemon) -> None:
    with pytest.raises(relmap.Unreachable, match="it serves TLS, and needs credentials"):
        relmap.connect(_server(secured), timeout=10)
    with relmap.connect(secured.server) as client:  # by its socket
        assert client.status().version


def test_files_of_credentials_are_checked(folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    anna = (folder / "anna.pem").read_text()
    known = parse_credentials(anna)
    assert known.key and known.certificate and known.authorities and not known.token
    assert "PRIVATE KEY" not in repr(known)
    open_to_others = tmp_path / "open.pem"
    open_to_others.write_text(anna)
    open_to_others.chmod(0o644)
    with pytest.raises(ValueError, match="others can read"):
        read_credentials(open_to_others)
    with pytest.raises(FileNotFoundError, match="nothing.pem"):
        relmap.connect("localhost:1", credentials=tmp_path / "nothing.pem")
    for data in (b"no credentials", b"\xff\xfe"):
        (tmp_path / "other.pem").write_bytes(data)
        (tmp_path / "other.pem").chmod(0o600)
        with pytest.raises(ValueError, match="other.pem holds no credentials"):
            relmap.connect("localhost:1", credentials=tmp_path / "other.pem")
    for text in ("", "no PEM", Credentials(b"").__repr__(), anna.replace("CERTIFICATE", "CERT")):
        with pytest.raises(ValueError):
            parse_credentials(text)
    with pytest.raises(ValueError):
        relmap.connect("localhost:1", credentials=folder / "anna.pem", token="t")
