"""A daemon of a few methods in Python, which fails where a test wants it to."""

from __future__ import annotations

from concurrent import futures
from typing import Any, Callable, Dict, Tuple

import grpc
from relmap.v1 import (
    common_pb2,
    evidence_pb2,
    graph_pb2,
    map_pb2,
    reason_pb2,
    skeleton_pb2,
    status_pb2,
    watch_pb2,
)


def refuse(context: Any, code: grpc.StatusCode, reason: int, message: str) -> None:
    """Fails as relmapd does."""
    details = reason_pb2.Error(message=message, request_id="fake")
    details.reason = reason  # type: ignore[assignment]
    context.set_trailing_metadata((("grpc-status-details-bin", details.SerializeToString()),))
    context.abort(code, message)


class FakeDaemon:
    """Serves at `address`. Methods are functions of (request, context); those of streams are generators."""

    def __init__(self, **methods: Callable[[Any, Any], Any]) -> None:
        self.calls: Dict[str, list[Any]] = {}
        self._server = grpc.server(futures.ThreadPoolExecutor(8))
        methods.setdefault("GetStatus", lambda request, context: status_pb2.GetStatusReply(version="fake"))
        handlers = {name: self._handler(name, method) for name, method in methods.items()}
        self._server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("relmap.v1.Map", handlers),))
        self.address = f"127.0.0.1:{self._server.add_insecure_port('127.0.0.1:0')}"
        self._server.start()

    def _handler(self, name: str, method: Callable[[Any, Any], Any]) -> Any:
        service = map_pb2.DESCRIPTOR.services_by_name["Map"]
        described = service.methods_by_name[name]
        request_kind, streams = _KINDS[described.input_type.name], name in _STREAMS

        def seen(request: Any, context: Any) -> Any:
            kept = type(request)()
            kept.CopyFrom(request)
            self.calls.setdefault(name, []).append(kept)
            return method(request, context)

        make = grpc.unary_stream_rpc_method_handler if streams else grpc.unary_unary_rpc_method_handler
        return make(seen, request_kind.FromString, lambda message: message.SerializeToString())

    def __enter__(self) -> "FakeDaemon":
        return self

    def __exit__(self, *_: object) -> None:
        self._server.stop(0).wait()


_STREAMS = {"FindRoute", "Export", "WatchMap", "GetSkeleton"}
_KINDS = {
    name: getattr(module, name)
    for module in (map_pb2, status_pb2, evidence_pb2, skeleton_pb2, watch_pb2)
    for name in module.DESCRIPTOR.message_types_by_name
    if name.endswith("Request")
}


def edge(index: int) -> graph_pb2.Edge:
    """An odometry edge to frame 1:index."""
    ends: Tuple[common_pb2.FrameId, ...] = tuple(common_pb2.FrameId(session=1, index=i) for i in (index - 1, index))
    return graph_pb2.Edge(id=common_pb2.EdgeId(frame=ends[1]), a=ends[0], b=ends[1], kind=graph_pb2.EDGE_KIND_ODOMETRY)
