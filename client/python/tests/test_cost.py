"""A call from Python costs at most a tenth more than from C++."""

from __future__ import annotations

import localise_cost
import relmap
from conftest import PATIENCE_S, Daemon, ingest


def test_a_call_costs_little_more_than_from_cpp(own_daemon: Daemon) -> None:
    with relmap.connect(own_daemon.server, timeout=PATIENCE_S) as client:
        ingest(client, "first", 80)
        ingest(client, "second", 40, start=20)
        ratios = []
        for _ in range(8):  # whatever else the machine does in between
            ratios.append(localise_cost.compare(client, own_daemon.server, 200)["ratio"])
            if ratios[-1] <= 1.10:
                return
        raise AssertionError(f"a call costs {min(ratios):.2f} times that of C++")
