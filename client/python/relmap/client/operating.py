# Made of relmap/aio/operating.py by client/python/make_sync; do not edit.
"""An operator's calls: verify, back up, delete, the audit log."""

from __future__ import annotations

import uuid as uuids
from typing import Any, List, Optional

from relmap.client.base import LONG_S, ClientBase, copied
from relmap.ids import SessionLike, SessionsLike
from relmap.operations import (
    AuditLog,
    Backup,
    Compaction,
    Finding,
    OnProgress,
    StoreStats,
    VerifySummary,
    read_audit_entry,
    read_finding,
    read_progress,
    read_stats,
    read_verify_summary,
)
from relmap.times import TimeLike, as_us
from relmap.v1 import admin_pb2


class OperatorCalls(ClientBase):
    """Calls for operators."""

    def verify(
        self,
        sessions: SessionsLike = (),
        *,
        on_progress: Optional[OnProgress] = None,
        timeout: Optional[float] = LONG_S,
    ) -> VerifySummary:
        """Checks everything that is stored, and changes nothing. Damage is in the result's findings.

        Args:
            sessions: only these; empty: all.
            on_progress: called several times a second; if it raises, the work ends.

        Raises:
            DaemonError: BUDGET_EXCEEDED: the daemon verifies, backs up or compacts already.
        """
        countdown = self._caller.countdown(timeout)
        request = admin_pb2.VerifyRequest(sessions=self._numbers(sessions, countdown))
        findings: List[Finding] = []
        summary = admin_pb2.VerifySummary()
        for reply in self._caller.stream(self._admin.Verify, request, countdown):
            findings.extend(read_finding(finding) for finding in reply.findings)
            if reply.HasField("summary"):
                summary = reply.summary
            if on_progress is not None and reply.HasField("progress"):
                on_progress(read_progress(reply.progress))
        return read_verify_summary(summary, tuple(findings))

    def backup(
        self, folder: str, *, on_progress: Optional[OnProgress] = None, timeout: Optional[float] = LONG_S
    ) -> Backup:
        """Writes a data folder on the daemon's machine with all that was durable when the call came.

        Args:
            folder: absolute, below one of the daemon's --backup-root, and not there yet.
            on_progress: as in verify().

        Raises:
            RequestError: INVALID_ARGUMENT: the folder.
            DaemonError: BUDGET_EXCEEDED, UNSUPPORTED, DISK_FULL.
        """
        outcome = self._work(self._admin.Backup, admin_pb2.BackupRequest(folder=folder), on_progress, timeout)
        return Backup(outcome.backup.folder, outcome.backup.bytes, outcome.backup.durable_sequence)

    def compact(
        self, *, on_progress: Optional[OnProgress] = None, timeout: Optional[float] = LONG_S
    ) -> Compaction:
        """Frees the disk space of replaced and deleted data; meanwhile it needs room for a second copy of the map.
        DaemonError: BUDGET_EXCEEDED, DISK_FULL."""
        outcome = self._work(self._admin.Compact, admin_pb2.CompactRequest(), on_progress, timeout)
        return Compaction(outcome.compact.bytes_before, outcome.compact.bytes_after)

    def repair(self, sessions: SessionsLike = (), *, timeout: Optional[float] = None) -> None:
        """Always refused (DaemonError, FOLDER_LOCKED), since a map is repaired only while no daemon serves it; the message
        says how."""
        countdown = self._caller.countdown(timeout)
        request = admin_pb2.RepairRequest(sessions=self._numbers(sessions, countdown))
        for _ in self._caller.stream(self._admin.Repair, request, countdown):
            pass

    def reindex(self, vocabulary: str = "", *, timeout: Optional[float] = None) -> None:
        """Always refused (DaemonError, FOLDER_LOCKED), since words are computed anew only while no daemon serves the map; the
        message says how."""
        request = admin_pb2.ReindexRequest(vocabulary=vocabulary)
        for _ in self._caller.stream(self._admin.Reindex, request, timeout):
            pass

    def stats(self, *, timeout: Optional[float] = None) -> StoreStats:
        """Sizes of what is stored."""
        return read_stats(self._ask(self._admin.GetStats, admin_pb2.GetStatsRequest(), timeout))

    def wait_idle(self, *, timeout: Optional[float] = None) -> int:
        """Returns when everything durable is applied, looked up and relaxed, and deletions are complete, with the journal
        sequence up to which it is. DeadlineExceeded: it took longer."""
        reply = self._ask(self._admin.WaitIdle, admin_pb2.WaitIdleRequest(), timeout)
        return int(reply.applied_sequence)

    def commit(self, *, timeout: Optional[float] = None) -> int:
        """Commits now what is dirty, and returns the journal sequence up to which the map is committed."""
        reply = self._ask(self._admin.Commit, admin_pb2.CommitRequest(), timeout)
        return int(reply.applied_sequence)

    def set_log_level(self, level: str = "", *, timeout: Optional[float] = None) -> str:
        """Changes what the daemon's log tells (trace, debug, info, warning, error), and returns the former level. Empty: only
        asks. RequestError: there is no such level."""
        reply = self._ask(self._admin.SetLogLevel, admin_pb2.SetLogLevelRequest(level=level), timeout)
        return str(reply.former)

    def freeze_session(
        self, session: SessionLike, frozen: bool = True, *, timeout: Optional[float] = None
    ) -> None:
        """Freezes a session, or thaws it: a frozen one takes no keyframes, and its edges and landmarks do not change.
        RequestError: NO_SUCH_SESSION, SESSION_DELETED."""
        countdown = self._caller.countdown(timeout)
        request = admin_pb2.FreezeSessionRequest(session=self._number(session, countdown), frozen=frozen)
        self._edit(self._admin.FreezeSession, request, countdown)

    def delete_session(
        self,
        session: SessionLike,
        uuid: str,
        *,
        on_progress: Optional[OnProgress] = None,
        timeout: Optional[float] = LONG_S,
    ) -> None:
        """Deletes a session for good; returns when all its frames are gone.

        Args:
            session, uuid: both must be of the session, as a safeguard.
            on_progress: as in verify(); the deletion continues even if it raises.

        Raises:
            RequestError: NO_SUCH_SESSION, INVALID_ARGUMENT: the uuid is another's.
            DeadlineExceeded: the deletion continues; the same call reports its progress.
        """
        countdown = self._caller.countdown(timeout)
        number = self._number(session, countdown)
        request = admin_pb2.DeleteSessionRequest(session=number, uuid=uuid, idempotency_key=uuids.uuid4().hex)
        self._work(self._admin.DeleteSession, request, on_progress, countdown)

    def audit(
        self,
        *,
        since: Optional[TimeLike] = None,
        until: Optional[TimeLike] = None,
        who: str = "",
        method: str = "",
        failed: bool = False,
        limit: int = 1000,
        timeout: Optional[float] = None,
    ) -> AuditLog:
        """What operators did and tried, the newest first. If entries are deleted while it is read, it is read again.

        Args:
            since, until: entries since then, and before then.
            who: of this caller; empty: of all.
            method: of this method, such as "Map.SetEdgeState"; empty: of all.
            failed: only what did not succeed.
            limit: at most so many.

        Raises:
            DaemonError: UNSUPPORTED: the daemon keeps no audit log.
            ViewExpired: entries were deleted again and again; ask for fewer, by `limit` or `since`.
        """
        request = admin_pb2.ListAuditRequest(
            from_us=0 if since is None else as_us(since),
            until_us=0 if until is None else as_us(until),
            who=who,
            method=method,
            failed=failed,
            page_size=min(limit, 1000),
        )
        countdown = self._caller.countdown(timeout)

        def read() -> AuditLog:
            entries: List[Any] = []
            if limit > 0:
                for reply in self._pages(self._admin.ListAudit, copied(request), countdown):
                    entries.extend(read_audit_entry(entry) for entry in reply.entries)
                    if len(entries) >= limit:
                        break
            return AuditLog(entries[:limit])

        return self._restarted(read)
