#!/usr/bin/python3
"""What a localise call costs from Python, beside the same call of the C++ client: both in turns, to the same daemon.

usage: client/python/bench/localise_cost.py [--calls N] [--json]     (PYTHONPATH=client/python)

Makes a map of a drive through points, and asks for the place of what one of its frames saw. Needs
ninja -C build/release relmap_python_tests.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
for folder in (HERE.parent, HERE.parent / "notebooks", HERE.parent / "tests"):
    sys.path.insert(0, str(folder))

import conftest  # noqa: E402
import relmap  # noqa: E402

ROUND = 50
FRAME = relmap.FrameId(2, 8)


def measure(calls: int) -> dict[str, float]:
    """Microseconds a call of both, and their ratio."""
    with tempfile.TemporaryDirectory() as folder:
        daemon = conftest.Daemon(pathlib.Path(folder) / "map")
        try:
            with relmap.connect(daemon.server, timeout=600) as client:
                conftest.ingest(client, "first", 80)
                conftest.ingest(client, "second", 40, start=20)
                return compare(client, daemon.server, calls)
        finally:
            daemon.stop()


def compare(client: relmap.Client, server: str, calls: int) -> dict[str, float]:
    """The same, of a daemon that runs."""
    command = [str(conftest.BIN.parent / "tests" / "relmap_localise_loop"), server, str(FRAME)]
    loop = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert loop.stdin and loop.stdout
    view = relmap.View(frame=FRAME)

    def cpp() -> float:
        assert loop.stdin and loop.stdout
        loop.stdin.write(f"{ROUND}\n")
        loop.stdin.flush()
        return float(loop.stdout.readline())

    def python() -> float:
        begin = time.perf_counter()
        for _ in range(ROUND):
            client.localise(view)
        return time.perf_counter() - begin

    cpp(), python()  # warm
    of_cpp = of_python = 0.0
    rounds = max(calls // ROUND, 1)
    for _ in range(rounds):
        of_cpp += cpp()
        of_python += python()
    loop.stdin.close()
    loop.wait()
    each = 1e6 / (rounds * ROUND)
    return {"cpp_us": of_cpp * each, "python_us": of_python * each, "ratio": of_python / of_cpp}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=1000)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    result = measure(options.calls)
    if options.json:
        print(json.dumps(result))
    else:
        print("C++ {cpp_us:.0f} us, Python {python_us:.0f} us a call: {ratio:.3f}".format(**result))


if __name__ == "__main__":
    main()
