#include "frontend/workflow/wire/wire_outside.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "frontend/publishing/grpc/grpc_transport.h"
#include "frontend/publishing/publisher.h"
#include "frontend/recording/event_log.h"
#include "frontend/recording/keyframe_log.h"
#include "frontend/recording/recorded_sessions.h"
#include "frontend/sink.h"

namespace relmap::workflow {

namespace {

Result<std::unique_ptr<frontend::KeyframeSink>> open_daemon_sink(const RunOptions& options,
                                                                 const publishing::PublisherOptions& publisher,
                                                                 const SessionHeader& session) {
  if (options.to != "grpc") return frontend::sink_of(publishing::Publisher::start(publisher, session));
  auto transport = publishing::GrpcTransport::open(options.server, session.robot, {.credentials = options.credentials});
  if (!transport.ok()) return transport.status();
  return frontend::sink_of(publishing::Publisher::start(publisher, session, std::move(*transport)));
}

Result<Logs::Session> open_log(const std::string& path, const std::string& choice) {
  auto opened = recording::KeyframeLog::open(path, choice);
  if (!opened.ok()) return opened.status();
  const auto log = std::make_shared<recording::KeyframeLog>(std::move(*opened));
  return Logs::Session{.header = log->session().header,
                       .next = [log] { return log->next(); },
                       .left_out = [log] { return log->left_out(); }};
}

Result<std::vector<recording::RecordedSession>> list_log(const std::string& path) {
  auto log = recording::EventLog::open(path);
  if (!log.ok()) return log.status();
  return recording::list_sessions(*log);
}

}  // namespace

Outside wire_outside() {
  Outside outside;
  outside.open_daemon_sink = open_daemon_sink;
  outside.logs = {.is_log = recording::is_event_log, .open = open_log, .list = list_log};
  return outside;
}

}  // namespace relmap::workflow
