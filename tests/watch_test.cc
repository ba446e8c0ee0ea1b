// Somebody who follows the map from its beginning, through a kill and restarts of the daemon, ends with what the lists
// say; who reads nothing holds up nobody; and what `relmap watch` prints.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "client/relmap_client.h"
#include "client/server_address.h"
#include "proto/base/mutex.h"
#include "relmap/v1/map.grpc.pb.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// What a list or a watcher says of a map.
struct Contents {
  std::map<SessionNumber, std::string> sessions;  // robot, name and state
  std::map<FrameId, std::int64_t> frames;         // times
  std::map<EdgeId, std::string> closures;         // state, reason and ends
  std::map<FrameId, std::set<std::string>> labels;

  void put(const client::Edge& edge) {
    closures[edge.id] = std::string(name_of(edge.state)) + " " + std::string(reason_name(edge.reason)) + " " +
                        edge.a.to_string() + " " + edge.b.to_string();
  }
  template <typename Session>
  void put(SessionNumber number, const Session& session) {
    sessions[number] = session.robot + " " + session.name + " " + session.uuid + " " + name_of(session.state);
  }
};

Contents listed(client::Client& client) {
  Contents contents;
  for (const client::Session& session : client.sessions().or_throw()) contents.put(session.number, session);
  const Status exported = client.export_frames({}, false, [&](const client::ExportedFrame& frame) {
    contents.frames[frame.id] = frame.time_us;
    return Status();
  });
  EXPECT_TRUE(exported.ok()) << exported.to_string();
  client::EdgeFilter loops;
  loops.kinds = {client::EdgeKind::kLoop};
  for (const client::Edge& edge : client.edges(loops).or_throw()) contents.put(edge);
  for (const client::LabelledFrames& label : client.labels().or_throw())
    for (const FrameId frame : label.frames) contents.labels[frame].insert(label.label);
  return contents;
}

// Watches in a thread of its own, and keeps what the events add up to.
class Follower {
 public:
  explicit Follower(std::unique_ptr<client::Client> client) : client_(std::move(client)) {
    thread_ = std::thread([this] {
      client::WatchOptions options;
      options.from = client::WatchOptions::From::kOldest;
      options.stopped = [this] { return stop_.load(); };
      ended_ = client_->watch(options, [this](const client::WatchEvent& event) {
        const MutexLock lock(mutex_);
        std::visit([&](const auto& what) RELMAP_REQUIRES(mutex_) { take(what, event); }, event.what);
        changed_.notify_all();
        return Status();
      });
    });
  }
  ~Follower() { stop(); }
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    EXPECT_TRUE(ended_.ok()) << ended_.to_string();
  }

  // Waits until all is told up to this sequence.
  Contents up_to(std::uint64_t sequence) {
    const MutexLock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(mutex_, kPatience, [&]() RELMAP_REQUIRES(mutex_) { return caught_up_ >= sequence; }));
    return contents_;
  }
  std::vector<std::string> authors() {
    const MutexLock lock(mutex_);
    return {authors_.begin(), authors_.end()};
  }
  std::vector<std::string> notes() {
    const MutexLock lock(mutex_);
    return {notes_.begin(), notes_.end()};
  }
  int connections() {
    const MutexLock lock(mutex_);
    return connections_;
  }
  int losses() {
    const MutexLock lock(mutex_);
    return losses_;
  }

 private:
  void note(const client::WatchEvent& event) RELMAP_REQUIRES(mutex_) {
    EXPECT_GT(event.journal_sequence, 0u);
    if (!event.author.empty()) authors_.insert(event.author);
    if (!event.note.empty()) notes_.insert(event.note);
  }
  void take(const client::SessionChanged& e, const client::WatchEvent& event) RELMAP_REQUIRES(mutex_) {
    note(event);
    contents_.put(e.session, e);
  }
  void take(const client::FramesAdded& e, const client::WatchEvent& event) RELMAP_REQUIRES(mutex_) {
    note(event);
    for (const client::AddedFrame& frame : e.frames)
      EXPECT_TRUE(contents_.frames.emplace(frame.frame, frame.time_us).second) << "told twice";
  }
  void take(const client::FramesRemoved& e, const client::WatchEvent&) RELMAP_REQUIRES(mutex_) {
    const FrameId first{e.session, e.first}, end{e.session + 1, 0};
    contents_.frames.erase(contents_.frames.lower_bound(first), contents_.frames.lower_bound(end));
    contents_.labels.erase(contents_.labels.lower_bound(first), contents_.labels.lower_bound(end));
  }
  void take(const client::SessionDeleted& e, const client::WatchEvent&) RELMAP_REQUIRES(mutex_) {
    contents_.sessions.erase(e.session);
  }
  void take(const client::EdgeChanged& e, const client::WatchEvent& event) RELMAP_REQUIRES(mutex_) {
    note(event);
    contents_.put(e.edge);
  }
  void take(const client::EdgeRemoved& e, const client::WatchEvent&) RELMAP_REQUIRES(mutex_) {
    contents_.closures.erase(e.edge);
  }
  void take(const client::LabelsChanged& e, const client::WatchEvent& event) RELMAP_REQUIRES(mutex_) {
    note(event);
    contents_.labels[e.frame] = {e.labels.begin(), e.labels.end()};
    if (e.labels.empty()) contents_.labels.erase(e.frame);
  }
  void take(const client::CaughtUp& e, const client::WatchEvent&) RELMAP_REQUIRES(mutex_) {
    caught_up_ = e.journal_sequence;
  }
  void take(const client::Resynced& e, const client::WatchEvent&) RELMAP_REQUIRES(mutex_) {
    ADD_FAILURE() << "events were lost: " << e.message;
  }
  void take(const client::WatchConnected&, const client::WatchEvent&) RELMAP_REQUIRES(mutex_) { ++connections_; }
  void take(const client::WatchDisconnected& e, const client::WatchEvent&) RELMAP_REQUIRES(mutex_) {
    EXPECT_FALSE(e.why.ok());
    ++losses_;
  }
  void take(const client::FramesMoved&, const client::WatchEvent&) {}
  void take(const client::SequencesSkipped&, const client::WatchEvent&) {}
  void take(const client::RobotChanged&, const client::WatchEvent&) {}
  void take(const client::StorageChanged&, const client::WatchEvent&) {}

  const std::unique_ptr<client::Client> client_;
  std::atomic<bool> stop_{false};
  Status ended_;  // by the thread
  Mutex mutex_;
  ConditionVariable changed_;
  Contents contents_ RELMAP_GUARDED_BY(mutex_);
  std::set<std::string> authors_ RELMAP_GUARDED_BY(mutex_), notes_ RELMAP_GUARDED_BY(mutex_);
  std::uint64_t caught_up_ RELMAP_GUARDED_BY(mutex_) = 0;
  int connections_ RELMAP_GUARDED_BY(mutex_) = 0, losses_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::thread thread_;
};

class WatchTest : public ::testing::Test {
 protected:
  WatchTest() { start(); }
  void start() { daemon_ = std::make_unique<RunningDaemon>(options_); }

  std::string drive(const std::string& name, std::uint32_t frames, std::uint32_t seed) const {
    const Finished made =
        run_program({built_program("relmap-sim"), "points", "--out", folder_ / name, "--frames", std::to_string(frames),
                     "--frames-per-lap", "40", "--appearance", "140", "--seed", std::to_string(seed)});
    EXPECT_EQ(made.exit_code, 0) << made.standard_error;
    return folder_ / name;
  }
  std::vector<std::string> robot(const std::string& drive, const std::string& session) const {
    return {built_program("relmap-frontend"),
            "--source",
            "sim",
            drive,
            "--robot",
            "cart-" + session,
            "--session",
            session,
            "--server",
            options_.data,
            "--spool",
            folder_ / "spool-" + session,
            "--quiet"};
  }
  void send(const std::string& drive, const std::string& session) const {
    const Finished sent = run_program(robot(drive, session));
    EXPECT_EQ(sent.exit_code, 0) << sent.standard_error;
  }
  Finished relmap(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {built_program("relmap"), "--server", options_.data});
    return run_program(arguments);
  }

  const storage::TemporaryFolder folder_;
  const DaemonOptions options_{.data = folder_ / "map", .lcm = "", .more = {}};
  std::unique_ptr<RunningDaemon> daemon_;
};

TEST_F(WatchTest, WhoFollowsFromTheBeginningEndsWithWhatTheListsSay) {
  const std::string first = drive("one", 100, 1), second = drive("two", 60, 1), third = drive("three", 30, 2);
  Follower follower(daemon_->client());
  send(first, "morning");
  auto client = daemon_->client();
  ASSERT_TRUE(client->wait_idle().ok());
  ASSERT_TRUE(client->set_label({1, 7}, "dock").ok());
  ASSERT_TRUE(client->set_label({1, 7}, "gate").ok());
  ASSERT_TRUE(client->set_label({1, 9}, "gone").ok());
  ASSERT_TRUE(client->set_label({1, 9}, "gone", false).ok());
  client::EdgeFilter accepted;
  accepted.kinds = {client::EdgeKind::kLoop};
  accepted.states = {client::EdgeState::kAccepted};
  const auto closures = client->edges(accepted).or_throw();
  ASSERT_GE(closures.size(), 2u) << "the drive is of two and a half laps";
  const EdgeId removed = closures.front().id, restored = closures.back().id;
  client::EditOptions noted;
  noted.note = "a mirror";
  ASSERT_TRUE(client->edit_edge(removed, client::EdgeAction::kRemove, noted).ok());
  ASSERT_TRUE(client->edit_edge(removed, client::EdgeAction::kRestore).ok());
  ASSERT_TRUE(client->edit_edge(restored, client::EdgeAction::kRemoveAlone).ok());

  // A robot drives while the daemon is killed, and goes on.
  {
    Process frontend(robot(second, "noon"), {folder_ / "noon.log", folder_ / "noon.log"});
    while (client->sessions().or_throw().size() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    daemon_->process().kill();
    start();
    ASSERT_EQ(frontend.wait(kPatience), 0) << read_text(folder_ / "noon.log");
  }
  client = daemon_->client();
  send(third, "night");
  ASSERT_TRUE(client->wait_idle().ok());
  ASSERT_TRUE(client->set_label({3, 3}, "far away").ok());
  ASSERT_TRUE(client->freeze_session(3).ok());
  const Contents with_all = follower.up_to(client->commit().or_throw());
  EXPECT_EQ(with_all.sessions.size(), 3u);
  EXPECT_EQ(with_all.frames.size(), 190u);

  const std::string uuid = client->sessions().or_throw().at(1).uuid;
  ASSERT_TRUE(client->delete_session(2, uuid, [](const client::Progress&) { return true; }).ok());
  ASSERT_TRUE(client->wait_idle().ok());
  daemon_->stop();
  client.reset();
  start();
  client = daemon_->client();
  const Contents told = follower.up_to(client->commit().or_throw()), truth = listed(*client);
  EXPECT_EQ(told.sessions, truth.sessions);
  EXPECT_EQ(told.frames, truth.frames);
  EXPECT_EQ(told.closures, truth.closures);
  EXPECT_EQ(told.labels, truth.labels);
  EXPECT_EQ(truth.sessions.size(), 2u);
  EXPECT_EQ(truth.frames.size(), 130u);
  EXPECT_THAT(follower.authors(), Contains("local")) << "whoever uses the socket";
  EXPECT_THAT(follower.notes(), Contains("a mirror"));
  EXPECT_EQ(follower.connections(), 3);
  EXPECT_GE(follower.losses(), 2);
  follower.stop();
}

TEST_F(WatchTest, WhoReadsNothingHoldsUpNobody) {
  const auto channel =
      grpc::CreateChannel(client::resolve_server(options_.data).or_throw().address, grpc::InsecureChannelCredentials());
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::MapEvent>>> asleep;
  const auto stub = v1::Map::NewStub(channel);
  for (int i = 0; i < 5; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    asleep.push_back(stub->WatchMap(contexts.back().get(), {}));
  }
  Follower follower(daemon_->client());
  send(drive("one", 200, 1), "morning");
  const auto client = daemon_->client();
  ASSERT_TRUE(client->wait_idle().ok());
  EXPECT_EQ(follower.up_to(client->commit().or_throw()).frames.size(), 200u);
  follower.stop();
  // They take up where they were, or are told what they missed.
  for (const auto& one : asleep) {
    v1::MapEvent event;
    std::uint64_t frames = 0;
    while (frames < 200 && one->Read(&event) && !event.has_resync())
      frames += static_cast<std::uint64_t>(event.frames_added().frames_size());
    EXPECT_TRUE(frames == 200 || event.has_resync());
  }
  for (const auto& context : contexts) context->TryCancel();
  asleep.clear();
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

TEST_F(WatchTest, TheCommandTellsPeopleAndProgramsAndGoesOnWhereItWas) {
  send(drive("one", 100, 1), "morning");
  const auto client = daemon_->client();
  ASSERT_TRUE(client->wait_idle().ok());
  ASSERT_TRUE(client->commit().ok());
  const Finished all = relmap({"watch", "--from", "oldest", "--for", "2"});
  EXPECT_EQ(all.exit_code, 0) << all.standard_error;
  EXPECT_THAT(all.standard_output,
              AllOf(HasSubstr("session 1 'morning' of cart-morning is open"), HasSubstr("added (0.."),
                    HasSubstr("..99)"), HasSubstr("closure 1:"), HasSubstr("accepted")));
  EXPECT_EQ(all.standard_error, "");

  const std::string state = folder_ / "token";
  ASSERT_EQ(relmap({"watch", "--state", state, "--for", "1"}).exit_code, 0);
  ASSERT_TRUE(std::filesystem::exists(state));
  ASSERT_TRUE(client->set_label({1, 7}, "dock").ok());
  ASSERT_TRUE(client->commit().ok());
  const Finished news = relmap({"watch", "--state", state, "--for", "2"});
  EXPECT_THAT(news.standard_output,
              AllOf(HasSubstr("frame 1:7 is labelled 'dock', by local"), Not(HasSubstr("added"))));
  EXPECT_THAT(relmap({"watch", "--state", state, "--for", "1"}).standard_output, Not(HasSubstr("dock")));

  const Finished json =
      relmap({"--json", "watch", "--from", "oldest", "--no-frames", "--session", "morning", "--for", "2"});
  std::istringstream lines(json.standard_output);
  std::set<std::string> kinds;
  for (std::string line; std::getline(lines, line);) {
    const auto event = nlohmann::json::parse(line);
    EXPECT_TRUE(event.contains("resumeToken")) << line;
    for (const char* kind : {"sessionChanged", "edgeChanged", "frameLabels", "caughtUp", "framesAdded", "framesMoved"})
      if (event.contains(kind)) kinds.insert(kind);
    if (!event.contains("sessionChanged")) continue;
    std::set<std::string> carried;
    for (const auto& [key, value] : event["sessionChanged"].items()) carried.insert(key);
    EXPECT_EQ(carried, (std::set<std::string>{"number", "uuid", "robot", "name", "state"})) << line;
  }
  EXPECT_EQ(kinds, (std::set<std::string>{"sessionChanged", "edgeChanged", "frameLabels", "caughtUp"}));

  const Finished mangled = relmap({"watch", "--resume", "yesterday", "--for", "5"});
  EXPECT_EQ(mangled.exit_code, 1);
  EXPECT_THAT(mangled.standard_error, HasSubstr("INVALID_ARGUMENT"));
}

TEST_F(WatchTest, TheCommandEndsCleanlyAndSaysThatTheDaemonIsGone) {
  const std::string out = folder_ / "out", errors = folder_ / "err";
  Process watching({built_program("relmap"), "--server", options_.data, "watch"}, {out, errors});
  const auto says = [&](const std::string& file, const std::string& text) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (read_text(file).find(text) == std::string::npos && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_THAT(read_text(file), HasSubstr(text));
  };
  // Until it watches, nothing is told to it.
  const auto end = std::chrono::steady_clock::now() + kPatience;
  for (int n = 0; !std::filesystem::exists(out) || read_text(out).empty(); ++n) {
    if (n == 0) send(drive("one", 20, 1), "morning");
    ASSERT_TRUE(daemon_->client()->freeze_session(1, n % 2 == 0).ok());
    ASSERT_TRUE(daemon_->client()->commit().ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ASSERT_LT(std::chrono::steady_clock::now(), end);
  }
  daemon_->stop();
  says(errors, "no connection, trying again: ");
  start();
  says(errors, "connected again");
  watching.signal(SIGTERM);
  EXPECT_EQ(watching.wait(kPatience), 0) << read_text(errors);
}

}  // namespace
}  // namespace relmap::testing
