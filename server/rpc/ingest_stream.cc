#include "server/rpc/ingest_stream.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "proto/base/mutex.h"
#include "proto/base/names.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "server/rpc/ingest_messages.h"

namespace relmap::rpc {

namespace {
constexpr std::size_t kMaxStreamSessions = 1024;  // on one stream
constexpr std::size_t kMaxReplies = 256;          // that wait to be sent; beyond it news are dropped
// Memory of a usual incoming keyframe and of what waits to be sent. What gRPC holds has its own limit.
constexpr std::size_t kStreamBytes = 64 * 1024;
}  // namespace

IngestStream::IngestStream(map::Mapper& mapper, const Intake& intake, Gateway& gateway,
                           grpc::CallbackServerContext* context)
    : mapper_(mapper),
      intake_(intake.server),
      call_(gateway, context, "Ingest.Stream", Lane::kIngest),
      self_(std::make_shared<Self>()) {
  {
    const MutexLock lock(self_->mutex);
    self_->stream = this;
  }
  Status admitted = call_.admit(kStreamBytes);
  if (admitted.ok() && !intake_) admitted = {Reason::UNSUPPORTED, "this server takes no keyframes in"};
  if (admitted.ok())
    StartRead(&request_);
  else
    end(admitted);
}

void IngestStream::OnReadDone(bool ok) {
  if (!ok) return end({});  // the robot has closed its side
  const Status taken = call_.guarded([&] { return take(request_); });
  if (!taken.ok()) end(taken);
}

void IngestStream::read_next() {
  const MutexLock lock(mutex_);
  if (!ending_) StartRead(&request_);
}

// Goes on when the intake has taken the message in, which may be while the map is still read for it, in another thread.
intake::IngestServer::Taken IngestStream::then_go_on(const SessionUuid& session) {
  return [self = self_, session](const Status& taken) {
    const MutexLock lock(self->mutex);
    IngestStream* const stream = self->stream;
    if (!stream) return;
    if (taken.ok()) return stream->read_next();
    stream->leave(session);
    stream->end(taken);
  };
}

Status IngestStream::take(const v1::IngestRequest& request) {
  if (Status known = call_.check_caller(); !known.ok()) return known;
  if (!subscription_) {
    if (Status begun = begin(request); !begun.ok()) return begun;
    read_next();
    return {};
  }
  intake::IngestServer& intake = *intake_;
  const intake::Sender sender{call_.caller().robot(), false, call_.unproved_from()};
  switch (request.content_case()) {
    case v1::IngestRequest::kKeyframe: {
      const v1::KeyframePayload& keyframe = request.keyframe();
      const auto uuid = uuid_from_wire(keyframe.session_uuid());
      if (!uuid.ok()) break;
      if (Status joined = join(*uuid); !joined.ok()) return joined;
      if (keyframe.payload().size() > kMaxKeyframeBytes)
        return {Reason::BAD_SIZE, "a keyframe of " + std::to_string(keyframe.payload().size()) + " bytes; at most " +
                                      std::to_string(kMaxKeyframeBytes)};
      intake.take_payload(*uuid, keyframe.sequence(), keyframe.crc32c(),
                          Bytes(keyframe.payload().begin(), keyframe.payload().end()), sender, then_go_on(*uuid));
      return {};
    }
    case v1::IngestRequest::kGap: {
      const auto gap = read_gap(request.gap());
      if (!gap.ok()) break;
      if (Status joined = join(gap->session); !joined.ok()) return joined;
      intake.take_gap(*gap, sender, then_go_on(gap->session));
      return {};
    }
    case v1::IngestRequest::kEnd: {
      const auto ended = read_end(request.end());
      if (!ended.ok()) break;
      if (Status joined = join(ended->session); !joined.ok()) return joined;
      intake.take_end(*ended, sender, then_go_on(ended->session));
      return {};
    }
    case v1::IngestRequest::kHello:
    case v1::IngestRequest::CONTENT_NOT_SET:
      break;
  }
  intake.count_foreign(Reason::INVALID_ARGUMENT);
  read_next();
  return {};
}

Status IngestStream::begin(const v1::IngestRequest& request) {
  if (!request.has_hello()) return {Reason::INVALID_ARGUMENT, "a stream of keyframes begins with hello"};
  if (const auto major = request.hello().protocol().major(); major != kProtocolMajor)
    return {Reason::UNKNOWN_PROTOCOL_VERSION,
            "protocol " + std::to_string(major) + "; known: " + std::to_string(kProtocolMajor)};
  if (Status storage = mapper_.stats().storage; storage.reason() == Reason::READ_ONLY) return storage;
  const std::string& robot = request.hello().robot();  // for the log only; keyframes name their robot themselves
  if (const std::string own = call_.caller().robot(); !own.empty() && robot != own)
    return {Reason::NOT_ALLOWED, own + " may not send keyframes as " + robot};
  who_ = (check_name("robot", robot).ok() ? "robot " + robot : "a robot without a name") + " (" + call_.peer() + ")";
  spdlog::info("{} has connected", who_);
  v1::IngestReply welcome;
  *welcome.mutable_welcome() = welcome_message(intake_->identity());
  {
    const MutexLock lock(mutex_);
    replies_.push_back(std::move(welcome));
    go_on();
  }
  subscription_ = intake_->subscribe({[this](const auto& ack, const auto& of) { hear(ack, of); },
                                      [this](const auto& news, const auto& of) { hear(news, of); },
                                      [this] {
                                        end({Reason::SHUTTING_DOWN, "the daemon is stopping"});
                                      }});
  return {};
}

// A robot that sends to another's session must hear nothing of it.
void IngestStream::leave(const SessionUuid& session) {
  const MutexLock lock(mutex_);
  sessions_.erase(session);
  acknowledgements_.erase(session);
}

Status IngestStream::join(const SessionUuid& session) {
  const MutexLock lock(mutex_);
  if (sessions_.size() >= kMaxStreamSessions && !sessions_.contains(session))
    return {Reason::BUDGET_EXCEEDED, "more than " + std::to_string(kMaxStreamSessions) + " sessions on one stream"};
  sessions_.insert(session);
  return {};
}

// Until the intake has said that it may not send to a session, a robot hears nothing of another's, either.
bool IngestStream::is_for_us(const SessionUuid& session, const std::string& robot) const {
  if (!sessions_.contains(session)) return false;
  const std::string own = call_.caller().robot();
  return own.empty() || own == robot;
}

// A caller who is no longer known hears the end of the stream instead.
bool IngestStream::may_hear(const SessionUuid& session, const std::string& robot) {
  if (ending_ || !is_for_us(session, robot)) return false;
  const Status known = call_.check_caller();
  if (known.ok()) return true;
  ending_ = known;
  go_on();
  return false;
}

void IngestStream::hear(const Acknowledgement& ack, const std::string& robot) {
  const MutexLock lock(mutex_);
  if (!may_hear(ack.session, robot)) return;
  acknowledgements_.insert_or_assign(ack.session, ack);
  go_on();
}

void IngestStream::hear(const PoseNews& news, const std::string& robot) {
  const MutexLock lock(mutex_);
  if (!may_hear(news.session, robot) || replies_.size() >= kMaxReplies) return;
  replies_.push_back(news_message(news));
  go_on();
}

void IngestStream::go_on() {
  if (write_under_way_ || finished_) return;
  if (!replies_.empty()) {
    writing_ = std::move(replies_.front());
    replies_.pop_front();
  } else if (!acknowledgements_.empty()) {
    const auto first = acknowledgements_.begin();
    writing_.Clear();
    *writing_.mutable_acknowledgement() = acknowledgement_message(first->second);
    acknowledgements_.erase(first);
  } else if (ending_) {
    finished_ = true;
    return Finish(call_.end(*ending_));
  } else {
    return;
  }
  write_under_way_ = true;
  call_.writing();
  StartWrite(&writing_);
}

void IngestStream::OnWriteDone(bool ok) {
  call_.written();
  const MutexLock lock(mutex_);
  write_under_way_ = false;
  if (!ok) {
    replies_.clear();
    acknowledgements_.clear();
    if (!ending_) ending_ = Status(Reason::DEADLINE, "the robot has gone");
  }
  go_on();
}

void IngestStream::OnDone() {
  if (!who_.empty()) spdlog::info("{} is no longer connected", who_);
  {
    const MutexLock lock(self_->mutex);
    self_->stream = nullptr;
  }
  delete this;
}

void IngestStream::OnCancel() { end({Reason::DEADLINE, "the robot has gone"}); }

// Ends the stream after what waits to be sent has been sent.
void IngestStream::end(const Status& status) {
  const MutexLock lock(mutex_);
  if (!ending_) ending_ = status;
  go_on();
}

}  // namespace relmap::rpc
