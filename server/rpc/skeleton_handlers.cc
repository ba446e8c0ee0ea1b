#include <memory>

#include "proto/base/bytes.h"
#include "proto/base/crc32c.h"
#include "relmap/v1/map.pb.h"
#include "server/map/suspicion.h"
#include "server/rpc/charge.h"
#include "server/rpc/handlers.h"
#include "server/rpc/limits.h"
#include "server/rpc/messages.h"
#include "server/skeleton/skeleton.h"

namespace relmap::rpc {

namespace {

std::int64_t milliseconds(std::int64_t us) { return us >= 0 ? us / 1000 : -((999 - us) / 1000); }  // rounded down

template <typename Message>
void add_transform(const SE3& T, Message& numbers) {
  const Vector3 turn = so3_log(T.R);
  for (const double number : {T.t.x(), T.t.y(), T.t.z(), turn.x(), turn.y(), turn.z()})
    numbers.Add(static_cast<float>(number));
}

void tell_chain(const skeleton::Chain& chain, v1::SkeletonChain& message) {
  message.set_session(chain.session);
  const int points = static_cast<int>(chain.points.size());
  message.mutable_index()->Reserve(points);
  message.mutable_time_ms()->Reserve(points);
  message.mutable_step()->Reserve(6 * (points - 1));
  message.mutable_variance()->Reserve(2 * (points - 1));
  message.mutable_frames()->Reserve(points - 1);
  std::uint32_t index = 0;
  std::int64_t time_ms = 0;
  for (std::size_t i = 0; i < chain.points.size(); ++i) {
    const skeleton::Point& point = chain.points[i];
    message.add_index(point.index - index);
    message.add_time_ms(milliseconds(point.time_us) - time_ms);
    index = point.index;
    time_ms = milliseconds(point.time_us);
    if (i == 0) continue;
    add_transform(point.T_before_this, *message.mutable_step());
    message.add_variance(point.translation_variance);
    message.add_variance(point.rotation_variance);
    message.add_frames(point.frames);
    if (point.unmeasured) message.add_unmeasured(static_cast<std::uint32_t>(i));
    if (point.carried) message.add_carried(static_cast<std::uint32_t>(i));
  }
}

void tell_closure(const skeleton::Closure& closure, v1::SkeletonClosures& message) {
  const storage::ClosureDigest& digest = closure.digest;
  message.add_session_b(digest.id.frame.session);
  message.add_index_b(digest.id.frame.index);
  message.add_ordinal(digest.id.ordinal);
  message.add_session_a(digest.a.session);
  message.add_index_a(digest.a.index);
  message.add_state(to_wire(digest.state));
  message.add_carries(digest.carries);
  add_transform(digest.T_ab, *message.mutable_a_from_b());
  message.add_variance(digest.translation_variance);
  message.add_variance(digest.rotation_variance);
  message.add_suspicion(closure.suspicion);
  message.add_alike(closure.alike);
}

// Stands for what is asked for. A position belongs to one choice of frames and closures: read on with another, the
// closures that were told would not be those whose ends became points.
std::string fingerprint(v1::GetSkeletonRequest request) {
  request.clear_resume_token();
  const std::string bytes = request.SerializeAsString();
  return std::to_string(crc32c(as_bytes(bytes)));
}

class SkeletonStream {
 public:
  SkeletonStream(ViewKeeper& views, std::shared_ptr<const storage::MapView> view, std::string asked,
                 storage::Budget& budget, const Deadline& deadline)
      : views_(views),
        view_(std::move(view)),
        asked_(std::move(asked)),
        charge_(budget, storage::Share::kReplies),
        deadline_(deadline) {}

  Status open(skeleton::SkeletonOptions options, const std::string& position) {
    const auto proceed = [this](std::size_t bytes) {
      const Status going = deadline_.check();
      return going.ok() ? charge_.grow_to(bytes) : going;
    };
    auto reader = skeleton::SkeletonReader::open(view_, std::move(options), map::suspicion_value, proceed);
    if (!reader.ok()) return reader.status();
    reader_ = *std::move(reader);
    if (position.empty()) return {};
    const std::size_t comma = position.find(',');
    const auto parsed =
        comma == std::string::npos ? std::nullopt : skeleton::Position::parse(position.substr(comma + 1));
    if (!parsed) return {Reason::INVALID_ARGUMENT, "the resume token is not one of a skeleton"};
    if (position.substr(0, comma) != asked_)
      return {Reason::INVALID_ARGUMENT,
              "the resume token is of a skeleton of another level, of other sessions, or with other candidates"};
    reader_->resume(*parsed);
    return {};
  }

  Result<std::optional<v1::GetSkeletonReply>> take() {
    auto page = reader_->next();
    if (!page.ok()) return page.status();
    if (!page->has_value() && told_) return std::optional<v1::GetSkeletonReply>();
    v1::GetSkeletonReply reply;  // also of a map without frames there is one
    told_ = true;
    reply.set_map_version(view_->version());
    reply.set_commit_number(view_->committed()->commit_number());
    reply.set_frames_total(reader_->frames_total());
    if (!page->has_value()) return std::optional<v1::GetSkeletonReply>(std::move(reply));
    for (const skeleton::Chain& chain : (*page)->chains) tell_chain(chain, *reply.add_chains());
    for (const skeleton::Closure& closure : (*page)->closures) tell_closure(closure, *reply.mutable_closures());
    reply.set_frames_done((*page)->end.frames_done);
    reply.set_resume_token(views_.token(view_, asked_ + ',' + (*page)->end.to_string()));
    return std::optional<v1::GetSkeletonReply>(std::move(reply));
  }

 private:
  ViewKeeper& views_;
  const std::shared_ptr<const storage::MapView> view_;
  const std::string asked_;
  Charge charge_;
  const Deadline& deadline_;
  std::unique_ptr<skeleton::SkeletonReader> reader_;
  bool told_ = false;
};

}  // namespace

Result<Producer<v1::GetSkeletonReply>> get_skeleton(const v1::GetSkeletonRequest& request, const Deadline& deadline,
                                                    map::Mapper& mapper, ViewKeeper& views) {
  if (request.sessions_size() > kMaxNamedSessions)
    return Status(Reason::INVALID_ARGUMENT, "more than " + std::to_string(kMaxNamedSessions) + " sessions");
  const auto opened = views.open(request.resume_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  skeleton::SkeletonOptions options;
  options.level = request.level();
  options.sessions.assign(request.sessions().begin(), request.sessions().end());
  options.candidates = request.candidates();
  options.page_bytes = kUsualStreamMessageBytes;
  const auto stream =
      std::make_shared<SkeletonStream>(views, opened->kept, fingerprint(request), mapper.budget(), deadline);
  if (Status status = stream->open(std::move(options), opened->position); !status.ok()) return status;
  return Producer<v1::GetSkeletonReply>([stream] { return stream->take(); });
}

}  // namespace relmap::rpc
