// Has the log say why handshakes of TLS fail: whoever calls learns little more than that the connection was closed.
#pragma once

namespace relmap::rpc {

// From now on failed handshakes of the whole process are logged, at most one a minute and the number of the others.
// gRPC's other messages are dropped, but for an assertion that ends the process. Does nothing where GRPC_VERBOSITY asks
// for gRPC's own log.
void log_failed_handshakes();

}  // namespace relmap::rpc
