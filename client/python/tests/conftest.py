"""A real relmapd for the tests. RELMAP_BIN names the folder of the programs; default: build/release/bin.

Tests fail without mypy, nbclient, build and wheel (tools/packages.txt), unless RELMAP_TESTS_WITHOUT_TOOLS is set: then those
that need them are skipped.
"""

from __future__ import annotations

import importlib
import os
import pathlib
import signal
import subprocess
import sys
import time
from types import ModuleType
from typing import Iterator, List, Optional

import pytest

os.environ.setdefault("GRPC_VERBOSITY", "NONE")
PYTHON = pathlib.Path(__file__).resolve().parents[1]
SOURCE = PYTHON.parents[1]
BIN = pathlib.Path(os.environ.get("RELMAP_BIN", SOURCE / "build/release/bin"))
for folder in (PYTHON, PYTHON / "notebooks", PYTHON / "bench"):
    sys.path.insert(0, str(folder))
os.environ["PYTHONPATH"] = os.pathsep.join([str(PYTHON), os.environ.get("PYTHONPATH", "")])

import points_world  # noqa: E402
import relmap  # noqa: E402

PATIENCE_S = 600.0  # for what hangs; no test depends on it


def needed(module: str) -> ModuleType:
    """A module without which a test fails, or is skipped where that was asked for."""
    if os.environ.get("RELMAP_TESTS_WITHOUT_TOOLS"):
        pytest.importorskip(module)
    return importlib.import_module(module)


class Daemon:
    """A relmapd on a folder of its own."""

    def __init__(self, data: pathlib.Path, *options: str) -> None:
        self.data, self.options = data, options
        self._process: Optional["subprocess.Popen[bytes]"] = None
        self.start()

    @property
    def server(self) -> str:
        return str(self.data)

    def endpoint(self) -> dict[str, str]:
        path = self.data / "endpoint"
        lines = path.read_text().splitlines() if path.exists() else []
        return {key: value for key, _, value in (line.partition(" ") for line in lines)}

    def start(self) -> None:
        log = open(f"{self.data}.log", "ab")
        command = [str(BIN / "relmapd"), "--data", str(self.data), "--memory-budget-mb", "256", *self.options]
        self._process = subprocess.Popen(command, stdout=log, stderr=log)
        until = time.monotonic() + PATIENCE_S
        while self.endpoint().get("pid") != str(self._process.pid):
            if self._process.poll() is not None or time.monotonic() > until:
                raise RuntimeError("relmapd does not serve: " + pathlib.Path(f"{self.data}.log").read_text()[-2000:])
            time.sleep(0.02)

    def kill(self) -> None:
        assert self._process is not None
        self._process.kill()
        self._process.wait()

    def stop(self) -> int:
        assert self._process is not None
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
        return self._process.wait(PATIENCE_S)


def program(name: str, *arguments: str) -> "subprocess.CompletedProcess[str]":
    """Runs a program of the build to its end. RuntimeError, with what it said: it failed."""
    done = subprocess.run([str(BIN / name), *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"{name} ended with {done.returncode}: {done.stderr[-2000:]}")
    return done


def ingest(client: relmap.Client, name: str, frames: int, start: int = 0) -> int:
    """A drive through the world of points; returns the session's number."""
    with client.session("cart", points_world.CAMERA, name=name) as session:
        for step in points_world.drive(frames, start=start):
            session.add(step.time, step.T_odom_frame, step.step_cov, tracks=step.tracks, features=step.features)
    client.wait_idle(timeout=PATIENCE_S)
    return session.number


@pytest.fixture(scope="session")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """A daemon with a map of two sessions, which closures join; tests leave it as it was."""
    folder = tmp_path_factory.mktemp("relmap")
    running = Daemon(folder / "map", "--backup-root", str(folder), "--deterministic")
    with relmap.connect(running.server, timeout=PATIENCE_S) as client:
        ingest(client, "morning", 80)
        ingest(client, "evening", 40, start=20)
        client.set_label("1:10", "kitchen")
        client.set_label("1:50", "fountain <b>&")
    yield running
    running.stop()


@pytest.fixture
def own_daemon(tmp_path: pathlib.Path) -> Iterator[Daemon]:
    """A daemon with an empty map, for one test."""
    running = Daemon(tmp_path / "map")
    yield running
    running.stop()


@pytest.fixture
def client(daemon: Daemon) -> Iterator[relmap.Client]:
    with relmap.connect(daemon.server, timeout=PATIENCE_S) as connected:
        yield connected


def frontend_arguments(file: pathlib.Path) -> List[str]:
    """Of relmap-frontend, to make the keyframes of the drive beside this file of keyframes."""
    options = "--robot cart --session pictures --uuid 7a0c1f52-5f0e-4c7d-9d43-0a8f6b1f2e11 --quiet"
    return ["--source", "sim", str(file.with_suffix("")), *options.split()]


@pytest.fixture(scope="session")
def keyframe_files(tmp_path_factory: pytest.TempPathFactory) -> List[pathlib.Path]:
    """Keyframes as C++ writes them: of points; and of pictures, with JPEGs."""
    folder = tmp_path_factory.mktemp("keyframes")
    program("relmap-sim", "points", "--out", str(folder / "points"), "--frames", "60", "--appearance", "100")
    program("relmap-sim", "pictures", "--out", str(folder / "drive"), "--pairs", "24", "--laps", "0.15")
    program("relmap-frontend", *frontend_arguments(folder / "drive.bin"), "--out", str(folder / "drive.bin"))
    return [folder / "points/keyframes.bin", folder / "drive.bin"]
