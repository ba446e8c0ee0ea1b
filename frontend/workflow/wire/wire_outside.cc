#include "frontend/workflow/wire/wire_outside.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "frontend/publishing/grpc/grpc_transport.h"
#include "frontend/publishing/lcm/lcm_transport.h"
#include "frontend/publishing/publisher.h"
#include "frontend/recording/event_log.h"
#include "frontend/recording/keyframe_log.h"
#include "frontend/recording/recorded_sessions.h"
#include "frontend/sink.h"
#include "proto/access/certificate.h"
#include "proto/access/credentials.h"
#include "proto/access/principal.h"

namespace relmap::workflow {

namespace {

// The credentials in a file; none without one. BAD_CONFIG if the daemon would refuse this robot's keyframes with them.
Result<std::optional<access::Credentials>> credentials_of(const std::string& file, const std::string& robot,
                                                          bool over_lcm) {
  if (file.empty()) return std::optional<access::Credentials>();
  const auto credentials = access::read_credentials(file);
  if (!credentials.ok()) return credentials.status();
  if (!credentials->certificate.empty())
    if (const auto facts = access::read_certificate(credentials->certificate); facts.ok() && facts->principal) {
      const auto& [role, name] = *facts->principal;
      const bool may_send = role == access::Role::kOperator ? !over_lcm : role == access::Role::kRobot && name == robot;
      if (!may_send)
        return Status(Reason::BAD_CONFIG, file + " is for the " + std::string(access::role_name(role)) + " " + name +
                                              ", and this is the robot " + robot + " (--robot)");
    }
  if (over_lcm && !credentials->robot_key)
    return Status(Reason::BAD_CONFIG,
                  file + " has no key for LCM; relmap-admin credentials new makes one for --role robot");
  return std::optional(*credentials);
}

Result<std::unique_ptr<frontend::KeyframeSink>> open_daemon_sink(const RunOptions& options,
                                                                 const publishing::PublisherOptions& publisher,
                                                                 const SessionHeader& session) {
  const bool over_lcm = options.to != "grpc";
  const auto credentials = credentials_of(options.credentials, session.robot, over_lcm);
  if (!credentials.ok()) return credentials.status();
  if (over_lcm) {
    const auto key = *credentials ? (*credentials)->robot_key : std::nullopt;
    auto lcm = publishing::LcmTransport::open(publisher.lcm_url, {key});
    if (!lcm.ok()) return lcm.status();
    return frontend::sink_of(publishing::Publisher::start(publisher, session, std::move(*lcm)));
  }
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
