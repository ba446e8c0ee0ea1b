#include <algorithm>
#include <tuple>

#include "proto/wire/convert.h"
#include "relmap/v1/status.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/ingest_messages.h"
#include "server/rpc/messages.h"

namespace relmap::rpc {

namespace {

const Status kNoIntake{Reason::UNSUPPORTED, "this server does not take keyframes"};

void add_counts(const std::map<Reason, std::uint64_t>& counts,
                google::protobuf::RepeatedPtrField<v1::ReasonCount>& to) {
  for (const auto& [reason, count] : counts) add_count(to, reason, count);
}

void put_robot(const intake::RobotStats& stats, v1::Robot& robot) {
  robot.set_uuid(stats.uuid.to_string());
  robot.set_session(stats.session);
  robot.set_robot(stats.robot);
  robot.set_name(stats.name);
  robot.set_keyframes_per_s(stats.keyframes_per_s);
  robot.set_bytes_per_s(stats.bytes_per_s);
  robot.set_silent_us(stats.silent_us);
  robot.set_lag_us(stats.lag_us);
  robot.set_next_sequence(stats.next_sequence);
  robot.set_seen(stats.seen_end);
  robot.set_missing(stats.missing);
  robot.set_incomplete(stats.incomplete);
  robot.set_pending(stats.pending);
  robot.set_queued_messages(stats.queued);
  robot.set_dropped_messages(stats.dropped);
  robot.set_credits(stats.credits);
  add_counts(stats.refused, *robot.mutable_refused());
  add_counts(stats.not_taken, *robot.mutable_not_taken());
  robot.set_blocked(to_wire(stats.blocked));
  robot.set_limit_hz(stats.limit_hz);
  for (const SessionUuid& other : stats.same_name) robot.add_same_name(other.to_string());
  robot.set_silent(stats.silent);
}

}  // namespace

Result<v1::ListRobotsReply> list_robots(const v1::ListRobotsRequest&, const Deadline&, map::Mapper& mapper,
                                        const Intake& intake) {
  if (!intake.server) return kNoIntake;
  std::vector<intake::RobotStats> robots = intake.server->robots();
  const auto view = mapper.view();
  std::erase_if(robots,
                [&](const intake::RobotStats& robot) { return intake::has_left(robot, view->session(robot.session)); });
  for (intake::RobotStats& robot : robots)
    if (const auto session = view->session(robot.session)) robot.name = session->display_name;
  std::sort(robots.begin(), robots.end(), [](const intake::RobotStats& a, const intake::RobotStats& b) {
    return std::tie(a.robot, a.session, a.uuid) < std::tie(b.robot, b.session, b.uuid);
  });
  v1::ListRobotsReply reply;
  for (const intake::RobotStats& robot : robots) put_robot(robot, *reply.add_robots());
  return reply;
}

Result<v1::Acknowledgement> get_acknowledgement(const v1::GetAcknowledgementRequest& request, const Deadline&,
                                                const Intake& intake) {
  if (!intake.server) return kNoIntake;
  const auto uuid = uuid_from_wire(request.session_uuid());
  if (!uuid.ok()) return uuid.status();
  const auto ack = intake.server->acknowledgement(*uuid);
  if (!ack.ok()) return ack.status();
  return acknowledgement_message(*ack);
}

}  // namespace relmap::rpc
