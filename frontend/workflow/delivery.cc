#include "frontend/workflow/delivery.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "frontend/workflow/daemon_silence.h"
#include "frontend/workflow/session_options.h"

namespace relmap::workflow {

namespace {

using Clock = std::chrono::steady_clock;

unsigned long long printed(std::uint64_t count) { return count; }

}  // namespace

Delivery::Delivery(Run& run) : run_(run), pace_(run.waits.slowed) {}

Result<std::unique_ptr<Delivery>> Delivery::open(Run& run, const SessionHeader& session, const std::string& recording,
                                                 const std::string& spool_suffix) {
  const auto header = session_header(run.options, session);
  if (!header.ok()) return header.status();
  const auto options = publisher_options(run.options, *header, recording, spool_suffix);
  std::unique_ptr<Delivery> delivery(new Delivery(run));
  if (delivery->sends() && !options.in_memory) run.summary.spool = options.spool;
  if (Status status = delivery->open_sink_in_its_map(options, *header); !status.ok()) return status;
  delivery->begin();
  return delivery;
}

Status Delivery::open_sink_in_its_map(publishing::PublisherOptions options, const SessionHeader& header) {
  for (;;) {
    auto sink = sends() ? run_.outside.open_daemon_sink(run_.options, options, header)
                        : frontend::open_file_sink(run_.options.out, header);
    if (!sink.ok()) return sink.status();
    sink_ = std::move(*sink);
    if (options.begin_anew || !options.repeatable()) return {};
    const Status map = await_map();
    if (map.ok() || run_.stop) return {};
    std::fprintf(stderr, "%s: the recording is sent to it from its beginning\n", map.message().c_str());
    sink_.reset();
    options.begin_anew = true;
  }
}

// Ends early if the run is to stop.
Status Delivery::await_map() {
  const std::jthread watcher([this](const std::stop_token& done) {
    while (!done.stop_requested() && !run_.stop) std::this_thread::sleep_for(run_.waits.look);
    if (run_.stop) sink_->interrupt();
  });
  return sink_->await_map(run_.waits.map_s);
}

void Delivery::begin() {
  watcher_ = std::jthread([this](const std::stop_token& done) { watch(done); });
  sink_->hear([this](const PoseNews& news) { hear(news); });
  frontend::RunSummary& summary = run_.summary;
  summary.robot = session().robot;
  summary.session = session().name;
  summary.uuid = session().uuid.to_string();
  last_keyframe_ = sink_->last_keyframe();
  if (!last_keyframe_) return;
  summary.gone_on = last_keyframe_->sequence;
  if (!run_.options.quiet)
    std::fprintf(stderr, "session %s goes on after keyframe %u, kept in %s\n", summary.session.c_str(),
                 last_keyframe_->sequence, summary.spool.c_str());
}

// Called on a thread of the transport.
void Delivery::hear(const PoseNews& news) {
  if (const auto line = pace_.hear(news, Clock::now()); line && !run_.options.quiet)
    std::fprintf(stderr, "%s\n", line->c_str());
  const auto recovery = localisation_.hear(news);
  if (recovery && !run_.options.quiet)
    std::fprintf(stderr, "keyframe %s found again, %.2f m from frame %s (unmeasured steps before it: %llu)\n",
                 recovery->keyframe.to_string().c_str(), recovery->distance_m, recovery->frame.to_string().c_str(),
                 printed(recovery->steps));
}

// Interrupts the sink when the run is to stop, and tells the user when the daemon does not answer.
void Delivery::watch(const std::stop_token& done) {
  DaemonSilence silence(
      {.daemon = daemon(), .kept_in = run_.summary.spool, .live = run_.options.live, .patience = run_.waits.silence},
      run_.begin);
  for (; !done.stop_requested() && !run_.stop; std::this_thread::sleep_for(run_.waits.look)) {
    if (!sends()) continue;
    pace_.look(Clock::now());
    const Status trouble = sink_->trouble();
    if (const auto line = silence.look(Clock::now(), sink_->progress().heard, trouble))
      std::fprintf(stderr, "%s\n", line->c_str());
  }
  if (run_.stop) sink_->interrupt();
}

const std::string& Delivery::daemon() const {
  return run_.options.to == "grpc" ? run_.options.server : run_.options.publisher.lcm_url;
}

Status Delivery::push(const Keyframe& keyframe) {
  localisation_.publishing(keyframe);  // before the daemon can answer
  if (Status status = sink_->push(keyframe); !status.ok()) return status;
  frontend::RunSummary& summary = run_.summary;
  ++summary.keyframes;
  if (keyframe.source != MotionSource::kStart) {
    ++summary.steps;
    summary.metric_steps += is_vision(keyframe.source);
  }
  if (last_position_) summary.path_m += (keyframe.T_odom_frame.t - *last_position_).norm();
  last_position_ = keyframe.T_odom_frame.t;
  return {};
}

void Delivery::begin_progress(std::uint64_t total, const char* what) {
  using frontend::ProgressStyle;
  const ProgressStyle style = run_.options.progress_json ? ProgressStyle::kJson
                              : run_.options.quiet       ? ProgressStyle::kNone
                                                         : ProgressStyle::kText;
  progress_.emplace(total, style, what);
}

void Delivery::show_progress() { progress_->show(run_.summary, sink_->progress(), sink_->trouble()); }

Status Delivery::finish(bool complete) {
  frontend::RunSummary& summary = run_.summary;
  if (!complete && !sends() && summary.keyframes > 0)
    std::fprintf(stderr, "the file is incomplete: %s.part has the keyframes so far\n", run_.options.out.c_str());
  auto published = settle(complete);
  if (published.ok() && published->heard && published->all_settled()) {
    // The daemon does not confirm the end of a session that an operator has frozen or deleted.
    if (!run_.stop && published->session.ok())
      sink_->end_session(run_.options.publisher.in_memory ? run_.options.patience_s : run_.waits.end_s);
    await_news();
  }
  watcher_ = {};
  sink_->hear({});
  summary.recognised = localisation_.counts();
  summary.place = localisation_.place();
  if (!published.ok()) return published.status();
  summary.publishing = std::move(*published);
  summary.slow_downs = pace_.slow_downs();
  tell_what_is_missing();
  const Status& session = summary.publishing.session;
  return session.reason() == Reason::SESSION_DELETED ? session : Status();
}

// Shows progress while it waits, since settling may take longer than tracking did.
Result<publishing::PublishSummary> Delivery::settle(bool complete) {
  std::jthread teller([this](const std::stop_token& done) {
    for (; progress_ && !done.stop_requested(); std::this_thread::sleep_for(run_.waits.look)) show_progress();
  });
  auto published = sink_->finish(run_.stop ? 0 : run_.options.patience_s, complete);
  teller = {};
  if (progress_) progress_->end();
  return published;
}

// The daemon looks keyframes up after they are settled, so news of them comes later. Waits until there has been none
// for a while.
void Delivery::await_news() const {
  const auto deadline = Clock::now() + run_.waits.max_news_wait;
  auto heard = localisation_.counts().heard;
  for (auto last = Clock::now(); !run_.stop && Clock::now() < std::min(deadline, last + run_.waits.news_silence);) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (const auto now = localisation_.counts().heard; std::exchange(heard, now) != now) last = Clock::now();
  }
}

void Delivery::tell_what_is_missing() const {
  const frontend::RunSummary& summary = run_.summary;
  const std::uint64_t restored = summary.publishing.lost_in_restores;
  if (restored > 0)
    std::fprintf(
        stderr,
        "MAP_RESTORED: the map was restored from a backup; it lacks %llu keyframes that the spool has no more\n",
        printed(restored));
  if (const std::uint64_t given_up = summary.publishing.gaps - restored; given_up > 0)
    std::fprintf(stderr, "%llu keyframes were given up: they are gaps in the map\n", printed(given_up));
  const Status trouble = sink_->trouble();
  if (!summary.publishing.all_settled() && !run_.stop && (!summary.publishing.heard || !trouble.ok()))
    std::fprintf(
        stderr, "%s\n",
        silence_of(daemon(), is_refusal(trouble) ? "relmapd takes nothing" : "no relmapd answers", trouble).c_str());
  if (summary.gone_on && summary.keyframes == 0 && !run_.stop && !run_.options.quiet)
    std::fprintf(stderr, "there is nothing after keyframe %u, with which the session goes on\n", *summary.gone_on);
}

}  // namespace relmap::workflow
