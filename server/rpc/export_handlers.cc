#include <memory>

#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/limits.h"
#include "server/rpc/messages.h"
#include "server/rpc/trajectory_text.h"

namespace relmap::rpc {

namespace {

constexpr std::size_t kFramesPerMessage = 2000;  // of about 100 bytes each
constexpr std::size_t kCheckStride = 256;

// Where a stream broke: the session, and how many of its frames had been sent. Written like a frame id.
struct ExportPosition {
  SessionNumber session = 0;
  std::uint32_t frames = 0;
};

struct ExportContents {
  std::optional<TrajectoryFormat> file;  // nullopt for frames
  bool landmarks = false;
};

class ExportStream {
 public:
  ExportStream(ViewKeeper& views, std::shared_ptr<const storage::MapView> view, ExportContents contents,
               std::vector<storage::Session> sessions, const Deadline& deadline)
      : views_(views),
        view_(std::move(view)),
        contents_(contents),
        sessions_(std::move(sessions)),
        deadline_(deadline) {
    for (const storage::Session& session : sessions_) total_ += session.frames;
  }

  // Skips what has been sent; the chain of poses is still followed from the start. INVALID_ARGUMENT.
  Status skip_to(ExportPosition position) {
    while (current_ < sessions_.size() && sessions_[current_].number != position.session)
      done_ += sessions_[current_++].frames;
    if (current_ == sessions_.size())
      return {Reason::INVALID_ARGUMENT, "the resume token is of an export of other sessions"};
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

  Result<std::optional<route::TrajectoryPose>> next_pose() {
    if (frames_ % kCheckStride == 0)
      if (Status status = deadline_.check(); !status.ok()) return status;
    auto pose = reader_->next();
    if (pose.ok() && pose->has_value()) ++frames_, ++done_;
    return pose;
  }

  // Fills a message; false if nothing is left of this session.
  Result<bool> fill(v1::ExportReply& reply) {
    const storage::Session& session = sessions_[current_];
    if (!header_sent_ && contents_.file) reply.set_data(trajectory_header(*contents_.file, session));
    header_sent_ = true;
    std::size_t bytes = 0;
    for (std::size_t i = 0; i < kFramesPerMessage && bytes < kUsualStreamMessageBytes; ++i) {
      auto pose = next_pose();
      if (!pose.ok()) return pose.status();
      if (!pose->has_value()) break;
      bytes += contents_.file ? add_line(**pose, reply) : add_frame(**pose, reply);
    }
    if (reply.data().empty() && reply.frames_size() == 0) return false;
    reply.set_session(session.number);
    reply.set_frames_done(done_);
    reply.set_frames_total(total_);
    reply.set_resume_token(views_.token(view_, std::to_string(session.number) + ":" + std::to_string(frames_)));
    return true;
  }

  // Both return approximately how many bytes they added.
  std::size_t add_line(const route::TrajectoryPose& pose, v1::ExportReply& reply) const {
    const std::string line = trajectory_line(*contents_.file, pose);
    reply.mutable_data()->append(line);
    if (!pose.doubtful_step) return line.size();
    *reply.add_unmeasured() = edge_message(*view_, *pose.doubtful_step);
    return line.size() + reply.unmeasured(reply.unmeasured_size() - 1).ByteSizeLong();
  }
  std::size_t add_frame(const route::TrajectoryPose& pose, v1::ExportReply& reply) const {
    v1::ExportedFrame& frame = *reply.add_frames();
    *frame.mutable_id() = relmap::to_wire(pose.frame);
    frame.set_time_us(pose.hot->time_us);
    if (!contents_.landmarks) return frame.ByteSizeLong();
    for (const std::uint32_t slot : route::shown_landmarks(*view_, pose)) {
      const storage::Landmark& landmark = pose.hot->landmarks[slot];
      const Vector3 point = landmark.point();
      for (const double coordinate : {point.x(), point.y(), point.z()})
        frame.add_landmarks(static_cast<float>(coordinate));
      frame.add_observers(static_cast<std::uint32_t>(landmark.observers.size()));
    }
    return frame.ByteSizeLong();
  }

  ViewKeeper& views_;
  const std::shared_ptr<const storage::MapView> view_;
  const ExportContents contents_;
  const std::vector<storage::Session> sessions_;
  const Deadline& deadline_;
  std::size_t current_ = 0;
  std::optional<route::TrajectoryReader> reader_;
  bool header_sent_ = false;
  std::uint32_t frames_ = 0;  // frames taken from the current session
  std::uint64_t done_ = 0, total_ = 0;
};

}  // namespace

Result<Producer<v1::ExportReply>> export_trajectories(const v1::ExportRequest& request, const Deadline& deadline,
                                                      map::Mapper& mapper, ViewKeeper& views) {
  ExportContents contents;
  switch (request.format()) {
    case v1::EXPORT_FORMAT_TUM:
      contents.file = TrajectoryFormat::kTum;
      break;
    case v1::EXPORT_FORMAT_KITTI:
      contents.file = TrajectoryFormat::kKitti;
      break;
    case v1::EXPORT_FORMAT_FRAMES:
      contents.landmarks = request.landmarks();
      break;
    default:
      return {Reason::INVALID_ARGUMENT, "export needs a format: TUM, KITTI or FRAMES"};
  }
  const auto opened = views.open(request.resume_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  auto sessions =
      route::sessions_with_trajectory(*opened->kept, {request.sessions().begin(), request.sessions().end()});
  if (!sessions.ok()) return sessions.status();
  const auto stream =
      std::make_shared<ExportStream>(views, opened->kept, contents, std::move(sessions).value(), deadline);
  if (!opened->position.empty()) {
    const auto position = FrameId::parse(opened->position);
    if (!position) return {Reason::INVALID_ARGUMENT, "the resume token is not one of an export"};
    if (Status status = stream->skip_to({position->session, position->index}); !status.ok()) return status;
  }
  return Producer<v1::ExportReply>([stream] { return stream->take(); });
}

}  // namespace relmap::rpc
