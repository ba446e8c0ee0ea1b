#include "frontend/sink.h"

#include <cctype>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "frontend/capture/keyframe_file.h"

namespace relmap::frontend {

namespace {

class PublisherSink : public KeyframeSink {
 public:
  explicit PublisherSink(std::unique_ptr<publishing::Publisher> publisher) : publisher_(std::move(publisher)) {}
  const SessionHeader& session() const override { return publisher_->session(); }
  std::optional<Keyframe> last_keyframe() const override { return publisher_->last_keyframe(); }
  Status await_map(double patience_s) override { return publisher_->await_map(after(patience_s)); }
  Status push(const Keyframe& keyframe) override { return publisher_->push(keyframe); }
  void hear(std::function<void(const PoseNews&)> listener) override { publisher_->hear(std::move(listener)); }
  publishing::PublishSummary progress() const override { return publisher_->progress(); }
  void interrupt() override { publisher_->interrupt(); }
  void end_session(double patience_s) override { (void)publisher_->end_session(after(patience_s)); }
  Status trouble() const override { return publisher_->trouble(); }

  Result<publishing::PublishSummary> finish(double patience_s, bool) override {
    const auto patience = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s));
    auto moved = Clock::now();
    auto settled = publisher_->progress().settled;
    for (;;) {
      const auto before = Clock::now();
      const publishing::PublishSummary summary = publisher_->finish(before + std::chrono::seconds(1));
      if (summary.all_settled()) return summary;
      if (summary.must_begin_anew) return summary.session;
      if (summary.settled > settled) {
        settled = summary.settled;
        moved = Clock::now();
      }
      const bool interrupted = Clock::now() - before < std::chrono::milliseconds(500);
      if (interrupted || Clock::now() - moved > patience) return summary;
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  static Clock::time_point after(double seconds) {
    return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  std::unique_ptr<publishing::Publisher> publisher_;
};

class FileSink : public KeyframeSink {
 public:
  FileSink(capture::KeyframeFileWriter writer, SessionHeader session)
      : writer_(std::move(writer)), session_(std::move(session)) {}
  const SessionHeader& session() const override { return session_; }
  std::optional<Keyframe> last_keyframe() const override { return std::nullopt; }
  Status push(const Keyframe& keyframe) override {
    if (Status status = writer_.write(keyframe); !status.ok()) return status;
    ++summary_.pushed;
    ++summary_.settled;
    return {};
  }
  Status await_map(double) override { return {}; }
  void hear(std::function<void(const PoseNews&)>) override {}
  publishing::PublishSummary progress() const override { return summary_; }
  void interrupt() override {}
  void end_session(double) override {}
  Status trouble() const override { return {}; }
  Result<publishing::PublishSummary> finish(double, bool complete) override {
    if (Status status = complete ? writer_.close() : Status(); !status.ok()) return status;
    return summary_;
  }

 private:
  capture::KeyframeFileWriter writer_;
  SessionHeader session_;
  publishing::PublishSummary summary_;
};

// Makes a name usable as a part of a path.
std::string as_folder(const std::string& name) {
  std::string folder;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    folder += std::isalnum(byte) || c == '-' || c == '_' ? c : '_';
  }
  return folder;
}

}  // namespace

Result<std::unique_ptr<KeyframeSink>> sink_of(Result<std::unique_ptr<publishing::Publisher>> publisher) {
  if (!publisher.ok()) return publisher.status();
  return std::unique_ptr<KeyframeSink>(std::make_unique<PublisherSink>(std::move(*publisher)));
}

Result<std::unique_ptr<KeyframeSink>> open_file_sink(const std::string& path, const SessionHeader& session) {
  auto writer = capture::KeyframeFileWriter::create(path);
  if (!writer.ok()) return writer.status();
  SessionHeader named = session;
  if (named.uuid.is_nil()) named.uuid = SessionUuid::random();
  return std::unique_ptr<KeyframeSink>(std::make_unique<FileSink>(std::move(*writer), std::move(named)));
}

std::string default_spool(const SessionHeader& session) {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  const std::string base = state && *state ? state : std::string(home && *home ? home : ".") + "/.local/state";
  return base + "/relmap/spool/" + as_folder(session.robot) + "." + as_folder(session.name);
}

}  // namespace relmap::frontend
