#include <algorithm>
#include <charconv>
#include <memory>

#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/trajectory.h"

namespace relmap {

namespace {

constexpr std::size_t kFramesPerMessage = 2000;  // of about 100 bytes
constexpr std::size_t kCheckStride = 256;

// Where a stream broke: in this session so many frames had been sent. Written like a frame id.
struct Position {
  SessionNumber session = 0;
  std::uint32_t frames = 0;
};

class ExportStream {
 public:
  ExportStream(Core& core, std::shared_ptr<const MapView> view, TrajectoryFormat format, std::vector<Session> sessions,
               const Deadline& deadline)
      : core_(core), view_(std::move(view)), format_(format), sessions_(std::move(sessions)), deadline_(deadline) {
    for (const Session& session : sessions_) total_ += session.frames;
  }

  // Leaves out what had been sent; the chain is followed all the same. INVALID_ARGUMENT.
  Status skip_to(Position position) {
    while (current_ < sessions_.size() && sessions_[current_].number != position.session)
      done_ += sessions_[current_++].frames;
    if (current_ == sessions_.size())
      return {Reason::INVALID_ARGUMENT, "the resume token is of another choice of sessions"};
    open();
    header_sent_ = position.frames > 0;
    for (std::uint32_t i = 0; i < position.frames; ++i) {
      auto pose = next_pose();
      if (!pose.ok()) return pose.status();
      if (!pose->has_value()) break;
    }
    return {};
  }

  Result<std::optional<v1::ExportReply>> take() {
    while (current_ < sessions_.size()) {
      if (!reader_) open();
      v1::ExportReply reply;
      auto filled = fill(reply);
      if (!filled.ok()) return filled.status();
      if (*filled) return std::optional(std::move(reply));
      reader_.reset();
      ++current_;
    }
    return std::optional<v1::ExportReply>();
  }

 private:
  void open() {
    reader_.emplace(*view_, sessions_[current_]);
    frames_ = 0;
    header_sent_ = false;
  }

  Result<std::optional<TrajectoryPose>> next_pose() {
    if (frames_ % kCheckStride == 0)
      if (Status status = deadline_.check(); !status.ok()) return status;
    auto pose = reader_->next();
    if (pose.ok() && pose->has_value()) ++frames_, ++done_;
    return pose;
  }

  // False: nothing is left of this session.
  Result<bool> fill(v1::ExportReply& reply) {
    const Session& session = sessions_[current_];
    std::string& data = *reply.mutable_data();
    if (!header_sent_) data = trajectory_header(format_, session);
    header_sent_ = true;
    for (std::size_t i = 0; i < kFramesPerMessage; ++i) {
      auto pose = next_pose();
      if (!pose.ok()) return pose.status();
      if (!pose->has_value()) break;
      data += trajectory_line(format_, **pose);
    }
    if (data.empty()) return false;
    reply.set_session(session.number);
    reply.set_frames_done(done_);
    reply.set_frames_total(total_);
    reply.set_resume_token(core_.views.token(view_, std::to_string(session.number) + ":" + std::to_string(frames_)));
    return true;
  }

  Core& core_;
  const std::shared_ptr<const MapView> view_;
  const TrajectoryFormat format_;
  const std::vector<Session> sessions_;
  const Deadline& deadline_;
  std::size_t current_ = 0;
  std::optional<TrajectoryReader> reader_;
  bool header_sent_ = false;
  std::uint32_t frames_ = 0;  // taken from the current session
  std::uint64_t done_ = 0, total_ = 0;
};

Result<std::vector<Session>> chosen_sessions(const MapView& view, const v1::ExportRequest& request) {
  if (request.sessions_size() == 0) {
    std::vector<Session> sessions = view.sessions();
    std::erase_if(sessions,
                  [](const Session& session) { return !session.header.camera.is_stereo() || is_deleted(session); });
    return sessions;
  }
  std::vector<SessionNumber> numbers(request.sessions().begin(), request.sessions().end());
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  std::vector<Session> sessions;
  for (const SessionNumber number : numbers) {
    auto session = view.session(number);
    if (!session) return {Reason::NO_SUCH_SESSION, "no session " + std::to_string(number)};
    if (is_deleted(*session)) return {Reason::SESSION_DELETED, "session " + std::to_string(number) + " was deleted"};
    if (!session->header.camera.is_stereo())
      return {Reason::NOT_STEREO, "session " + std::to_string(number) + " is of one camera: it has no trajectory"};
    sessions.push_back(*std::move(session));
  }
  return sessions;
}

}  // namespace

Result<Producer<v1::ExportReply>> export_trajectories(Core& core, const v1::ExportRequest& request,
                                                      const Deadline& deadline) {
  if (request.format() != v1::EXPORT_FORMAT_TUM && request.format() != v1::EXPORT_FORMAT_KITTI)
    return {Reason::INVALID_ARGUMENT, "export needs a format: TUM or KITTI"};
  const auto format = request.format() == v1::EXPORT_FORMAT_TUM ? TrajectoryFormat::kTum : TrajectoryFormat::kKitti;
  const auto opened = core.views.open(request.resume_token(), core.mapper.view());
  if (!opened.ok()) return opened.status();
  auto sessions = chosen_sessions(*opened->kept, request);
  if (!sessions.ok()) return sessions.status();
  const auto stream = std::make_shared<ExportStream>(core, opened->kept, format, std::move(sessions).value(), deadline);
  if (!opened->position.empty()) {
    const auto position = FrameId::parse(opened->position);
    if (!position) return {Reason::INVALID_ARGUMENT, "the resume token is not one of an export"};
    if (Status status = stream->skip_to({position->session, position->index}); !status.ok()) return status;
  }
  return Producer<v1::ExportReply>([stream] { return stream->take(); });
}

}  // namespace relmap
