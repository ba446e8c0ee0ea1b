#include "tools/bench/vast/vast_drive.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>

#include "frontend/publishing/grpc/grpc_transport.h"
#include "frontend/publishing/publisher.h"
#include "proto/base/mutex.h"
#include "tests/support/drive_evaluation.h"
#include "tools/bench/fleet/killed_daemon.h"
#include "tools/bench/stopwatch.h"

namespace relmap::bench {

namespace {

using nlohmann::json;
using std::chrono::milliseconds;

constexpr std::size_t kSpoolBytes = std::size_t{8} << 20;
constexpr std::chrono::minutes kStart{5};
constexpr std::chrono::hours kToTheEnd{24};
constexpr milliseconds kSamplePause{1000}, kQuestionPause{500};

json to_json(const VastSample& sample) {
  return {{"s", sample.s},
          {"frames", sample.frames},
          {"update_p99_us", sample.update_p99_us},
          {"lookup_lag_s", sample.lookup_lag_s},
          {"resident_mb", sample.resident_mb},
          {"closures", sample.closures}};
}

json to_json(const VastQuestion& question) { return {{"frames", question.frames}, {"ms", question.ms}}; }

template <typename Item>
json to_json(const std::vector<Item>& items) {
  json all = json::array();
  for (const Item& item : items) all.push_back(to_json(item));
  return all;
}

json to_json(const VastProgress& progress) {
  return {{"s", progress.s},
          {"cpu_s", progress.cpu_s},
          {"kills", progress.kills},
          {"starts_s", progress.starts_s},
          {"peak_resident_mb", progress.peak_resident_mb},
          {"samples", to_json(progress.samples)},
          {"route_ms", progress.route_ms},
          {"places", to_json(progress.places)},
          {"routes_refused", progress.routes_refused},
          {"places_found", progress.places_found},
          {"places_wrong", progress.places_wrong}};
}

VastProgress progress_of(const json& saved) {
  VastProgress progress;
  saved.at("s").get_to(progress.s);
  saved.at("cpu_s").get_to(progress.cpu_s);
  saved.at("kills").get_to(progress.kills);
  saved.at("starts_s").get_to(progress.starts_s);
  saved.at("peak_resident_mb").get_to(progress.peak_resident_mb);
  for (const json& s : saved.at("samples"))
    progress.samples.push_back({s.at("s"), s.at("frames"), s.at("update_p99_us"), s.at("lookup_lag_s"),
                                s.at("resident_mb"), s.at("closures")});
  saved.at("route_ms").get_to(progress.route_ms);
  for (const json& q : saved.at("places")) progress.places.push_back({q.at("frames"), q.at("ms")});
  saved.at("routes_refused").get_to(progress.routes_refused);
  saved.at("places_found").get_to(progress.places_found);
  saved.at("places_wrong").get_to(progress.places_wrong);
  return progress;
}

// What makes the run what it is; another run cannot go on with its folder.
json identity(const VastOptions& options) {
  return {
      {"keyframes", options.keyframes}, {"robots", options.robots}, {"seed", options.seed}, {"light", options.light}};
}

class VastRun {
 public:
  VastRun(const VastTown& town, const VastOptions& options)
      : town_(town), options_(options), progress_(load()), before_(progress_), daemon_(how(), kStart) {}

  VastProgress run() {
    std::vector<std::jthread> robots;
    for (std::uint32_t robot = 0; robot < town_.robots(); ++robot)
      robots.emplace_back([this, robot] { guarded([&] { drive(robot); }); });
    std::jthread asking([this] { guarded([&] { ask(); }); });
    guarded([&] { watch(); });
    ended_ = true;
    robots.clear();
    asking.join();
    if (failure_) std::rethrow_exception(failure_);
    note();
    draw();
    daemon_.stop();
    save();
    return progress_;
  }

 private:
  std::string state_file() const { return options_.folder + "/vast.json"; }

  VastProgress load() const {
    std::ifstream in(state_file());
    if (!in) return {};
    const json saved = json::parse(in);
    if (saved.at("run") != identity(options_))
      throw std::runtime_error(options_.folder + " holds another run: " + saved.at("run").dump());
    return progress_of(saved.at("progress"));
  }
  void save() {
    json saved{{"run", identity(options_)}, {"progress", {}}};
    {
      const MutexLock lock(mutex_);
      saved["progress"] = to_json(progress_);
    }
    const std::string fresh = state_file() + ".new";
    std::ofstream(fresh) << saved;
    std::filesystem::rename(fresh, state_file());
  }
  testing::DaemonOptions how() const {
    return {.data = options_.folder + "/map", .lcm = {}, .memory_budget_mb = options_.memory_budget_mb, .more = {}};
  }

  // The first failure ends the run.
  template <typename Work>
  void guarded(Work work) {
    try {
      work();
    } catch (...) {
      const MutexLock lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      ended_ = true;
      for (publishing::Publisher* publisher : publishers_) publisher->interrupt();
    }
  }

  void drive(std::uint32_t number) {
    const SessionHeader header = town_.header(number);
    publishing::PublisherOptions how;
    how.spool = options_.folder + "/robots/" + std::to_string(number);
    how.recording = "vast";
    how.spool_bytes = kSpoolBytes;
    const auto publisher =
        publishing::Publisher::start(how, header,
                                     publishing::GrpcTransport::open(options_.folder + "/map", header.robot).or_throw())
            .or_throw();
    {
      const MutexLock lock(mutex_);
      publishers_.push_back(publisher.get());
    }
    const std::shared_ptr<void> leave(nullptr, [&](void*) {
      const MutexLock lock(mutex_);
      std::erase(publishers_, publisher.get());
    });
    const std::uint32_t first = publisher->next_sequence();
    sim::CityRobot robot = town_.robot(number, first);
    for (std::uint32_t i = first; i < town_.frames(number) && !ended_; ++i)
      if (Status pushed = publisher->push(robot.next()); !pushed.ok()) throw StatusError(pushed);
    if (!ended_ && !publisher->finish(Clock::now() + kToTheEnd).all_settled())
      throw std::runtime_error("not all keyframes of robot " + std::to_string(number + 1) + " were settled");
    ++arrived_;
  }

  std::unique_ptr<client::Client> client() const {
    client::ClientOptions patient;
    patient.deadline = std::chrono::minutes(60);
    auto connected = client::Client::connect(options_.folder + "/map", patient);
    return connected.ok() ? std::move(*connected) : nullptr;
  }

  std::uint64_t keyframes() const {
    std::uint64_t all = 0;
    for (std::uint32_t robot = 0; robot < town_.robots(); ++robot) all += town_.frames(robot);
    return all;
  }

  // Samples the daemon and kills it at the times that are due, until all robots have arrived and the map is idle.
  void watch() {
    auto asked = client();
    for (; !ended_; std::this_thread::sleep_for(kSamplePause)) {
      const auto status = asked ? asked->status() : Result<client::DaemonStatus>(Status(Reason::UNREACHABLE, ""));
      if (!status.ok()) {
        asked = client();
        continue;
      }
      const double now = before_.s + seconds_since(begin_);
      VastSample sample;
      sample.s = now;
      sample.frames = status->frames;
      sample.update_p99_us = status->relaxation_p99_us;
      sample.lookup_lag_s = status->lookup_lag_s;
      sample.resident_mb = static_cast<double>(daemon_.running().process().peak_resident_bytes()) / (1 << 20);
      sample.closures = status->closures_accepted;
      {
        const MutexLock lock(mutex_);
        progress_.samples.push_back(sample);
      }
      if (progress_.samples.size() % 10 == 0) {
        std::cerr << status->frames << " of " << options_.keyframes << " keyframes, " << status->closures_accepted
                  << " closures, lookups " << sample.lookup_lag_s << " s behind\n";
        note();
        save();
      }
      const bool kill_due = progress_.kills < options_.kills &&
                            static_cast<double>(status->frames) >=
                                static_cast<double>(keyframes()) * (progress_.kills + 0.5) / options_.kills;
      if (kill_due) {
        asked.reset();
        (void)daemon_.restart();
        ++progress_.kills;
        progress_.starts_s.push_back(daemon_.starts_s().back());
      } else if (arrived_ == town_.robots() && progress_.kills >= options_.kills) {
        if (Status idle = asked->wait_idle(); idle.ok()) return;
        asked.reset();
      }
    }
  }

  // Asks for routes between any two frames and for the places that frames show.
  void ask() {
    std::mt19937_64 random(options_.seed);
    std::vector<client::Session> sessions;
    const auto any_frame = [&]() -> FrameId {
      const client::Session& session = sessions[random() % sessions.size()];
      return {session.number,
              session.first + static_cast<std::uint32_t>(random() % (session.last - session.first + 1))};
    };
    auto asked = client();
    for (std::uint64_t round = 0; !ended_; ++round, std::this_thread::sleep_for(kQuestionPause)) {
      if (round % 60 == 0 || sessions.empty() || !asked) {
        if (!asked) asked = client();
        if (!asked) continue;
        auto listed = asked->sessions();
        if (!listed.ok()) {
          asked.reset();
          continue;
        }
        sessions = std::move(*listed);
        std::erase_if(sessions, [](const client::Session& session) { return session.frames == 0; });
        if (sessions.empty()) continue;
      }
      const client::RouteRequest request{.from = any_frame(),
                                         .to = any_frame(),
                                         .by = round % 2 == 0 ? client::RouteBy::kDistance : client::RouteBy::kTime};
      auto begin = Clock::now();
      const auto route = asked->find_route(request);
      const double route_ms = 1e3 * seconds_since(begin);
      client::View view;
      view.frame = any_frame();
      begin = Clock::now();
      const auto place = asked->localise(view);
      const double place_ms = 1e3 * seconds_since(begin);
      const MutexLock lock(mutex_);
      if (route.ok())
        progress_.route_ms.push_back(route_ms);
      else
        ++progress_.routes_refused;
      const auto is_listed = [&](const client::Session& session) { return session.number == place->frame.session; };
      if (place.ok() && std::any_of(sessions.begin(), sessions.end(), is_listed)) {
        ++progress_.places_found;
        progress_.places_wrong += is_wrong_place(sessions, *view.frame, *place);
      }
      if (place.reason() != Reason::UNREACHABLE && !progress_.samples.empty())
        progress_.places.push_back({progress_.samples.back().frames, place_ms});
      if (route.reason() == Reason::UNREACHABLE || place.reason() == Reason::UNREACHABLE) asked.reset();
    }
  }

  bool is_wrong_place(const std::vector<client::Session>& sessions, FrameId frame, const client::Localisation& place) {
    const auto pose = [&](FrameId of) {
      const auto session = std::find_if(sessions.begin(), sessions.end(),
                                        [&](const client::Session& s) { return s.number == of.session; });
      if (session == sessions.end()) throw std::runtime_error("an answer is of an unknown session");
      auto& robot = asked_robots_.try_emplace(of.session).first->second;
      if (!robot) robot = std::make_unique<sim::CityRobot>(town_.robot(town_.robot_of(session->name)));
      return robot->T_world_frame(of.index);
    };
    return testing::is_wrong((pose(place.frame).inverse() * pose(frame)).inverse() * place.T_frame_view,
                             place.covariance);
  }

  // The picture is no part of the measurement: if it cannot be drawn, the reason is told.
  void draw() const {
    if (options_.picture.empty()) return;
    const auto drawn = testing::run_program({testing::built_program("relmap"), "--server", options_.folder + "/map",
                                             "map", "--title", "a town", "--out", options_.picture},
                                            std::chrono::hours(1));
    if (drawn.exit_code != 0) std::cerr << "the map was not drawn: " << drawn.standard_error;
  }

  void note() {
    const MutexLock lock(mutex_);
    progress_.s = before_.s + seconds_since(begin_);
    progress_.cpu_s = before_.cpu_s + daemon_.cpu();
    progress_.peak_resident_mb = std::max(progress_.peak_resident_mb, daemon_.peak_resident_mb());
  }

  const VastTown& town_;
  const VastOptions& options_;
  const Clock::time_point begin_ = Clock::now();
  Mutex mutex_;
  VastProgress progress_;
  const VastProgress before_;  // of the run's earlier parts
  KilledDaemon daemon_;
  std::atomic<bool> ended_ = false;
  std::atomic<std::uint32_t> arrived_ = 0;
  std::exception_ptr failure_;
  std::vector<publishing::Publisher*> publishers_;  // of robots on their way
  std::map<SessionNumber, std::unique_ptr<sim::CityRobot>> asked_robots_;
};

}  // namespace

VastProgress drive_town(const VastTown& town, const VastOptions& options) {
  std::filesystem::create_directories(options.folder + "/robots");
  return VastRun(town, options).run();
}

}  // namespace relmap::bench
