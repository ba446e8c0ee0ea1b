#include "server/map/mapper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <mutex>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "proto/base/clock.h"
#include "server/map/derived.h"
#include "server/map/lookup_queue.h"
#include "server/map/testing/points_drive.h"
#include "storage/engine/memory_engine.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/testing/digest_oracle.h"
#include "storage/testing/event_follower.h"
#include "storage/testing/fault_engine.h"
#include "storage/testing/faulty_files.h"
#include "storage/testing/forgetful_files.h"
#include "storage/testing/forwarding_engine.h"
#include "tests/paths.h"

namespace relmap::map {
namespace {

using namespace std::chrono_literals;

// Sanitized builds take their time.
std::chrono::steady_clock::time_point soon() { return std::chrono::steady_clock::now() + 600s; }

sim::PointsWorldOptions small_world(std::uint32_t frames) {
  sim::PointsWorldOptions options;
  options.frames = frames;
  options.frames_per_lap = 60;
  return options;
}

std::unique_ptr<Mapper> open_mapper(const std::shared_ptr<storage::Engine>& engine, bool deterministic = false,
                                    std::size_t budget_mb = 256) {
  MapperOptions options;
  options.deterministic = deterministic;
  options.closures = false;
  options.commit_interval = 20ms;
  return Mapper::open(engine, std::make_shared<storage::Budget>(budget_mb << 20), nullptr, options).or_throw();
}

Status feed(Mapper& mapper, const sim::PointsWorld& world, std::uint32_t from, std::uint32_t to) {
  auto session = mapper.begin_session(world.keyframe(0).session);
  if (!session.ok()) return session.status();
  for (std::uint32_t i = from; i < to; ++i) {
    storage::KeyframeRecord record = keyframe_record(world, i);
    record.session = *session;
    const auto deadline = soon();
    for (;;) {
      const Status submitted = mapper.submit(record, [](const Result<std::uint64_t>&) {});
      if (submitted.ok()) break;
      const bool behind = submitted.reason() == Reason::BUDGET_EXCEEDED;
      if (!behind || std::chrono::steady_clock::now() > deadline) return submitted;
      std::this_thread::sleep_for(5ms);
    }
  }
  return mapper.wait_idle(soon());
}

TEST(Mapper, KeyframesAreDurableThenAppliedThenVisible) {
  const sim::PointsWorld world(small_world(20));
  const auto engine = storage::make_memory_engine();
  const auto mapper = open_mapper(engine);
  const SessionNumber session = mapper->begin_session(world.keyframe(0).session).or_throw();
  storage::KeyframeRecord record = keyframe_record(world, 0);
  record.session = session;
  const std::uint64_t sequence = mapper->submit_and_wait(record).or_throw();
  EXPECT_GE(engine->last_journal_sequence(), sequence);
  ASSERT_TRUE(mapper->wait_applied(sequence, soon()).ok());
  EXPECT_TRUE(mapper->view()->hot({session, 0}));
}

TEST(Mapper, AReopenedMapIsTheSame) {
  const sim::PointsWorld world(small_world(50));
  const auto engine = storage::make_memory_engine();
  storage::MapHash before;
  {
    const auto mapper = open_mapper(engine);
    ASSERT_TRUE(feed(*mapper, world, 0, 50).ok());
    before = storage::hash_map(*mapper->view());
    ASSERT_TRUE(mapper->stop().ok());
  }
  const auto mapper = open_mapper(engine);
  EXPECT_EQ(storage::hash_map(*mapper->view()), before);
  EXPECT_THAT(derived_differences(*mapper->view()), testing::IsEmpty());
  ASSERT_TRUE(mapper->begin_session(world.keyframe(0).session).ok()) << "the session goes on";
  EXPECT_EQ(mapper->view()->sessions().size(), 1u);
}

TEST(Mapper, TheIdentityOfAMapNeverChanges) {
  const auto engine = storage::make_memory_engine();
  MapIdentity first;
  {
    const auto mapper = open_mapper(engine);
    first = mapper->identity();
    EXPECT_TRUE(first.known());
    EXPECT_GT(first.epoch, 0u);
    EXPECT_EQ(mapper->view()->state().identity, first);
  }
  EXPECT_EQ(open_mapper(engine)->identity(), first);
  EXPECT_NE(open_mapper(storage::make_memory_engine())->identity().uuid, first.uuid);
}

// What is logged while it lives.
class CapturedLog {
 public:
  CapturedLog() : before_(spdlog::default_logger()) {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("captured", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_)));
  }
  ~CapturedLog() { spdlog::set_default_logger(before_); }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;
  std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::shared_ptr<spdlog::logger> before_;
};

// Commits nothing more once it is told so.
class FullEngine : public storage::ForwardingEngine {
 public:
  explicit FullEngine(std::shared_ptr<Engine> to) : ForwardingEngine(std::move(to)) {}
  Status commit(std::uint64_t epoch, std::uint64_t applied_sequence, std::span<const storage::Put> puts,
                std::span<const std::string> deletes) override {
    if (full) return {Reason::DISK_FULL, "a commit"};
    return ForwardingEngine::commit(epoch, applied_sequence, puts, deletes);
  }
  std::atomic<bool> full = false;
};

// As if a program that knows nothing of digests had written to the map last.
void forget_digests(storage::Engine& engine) {
  auto state = storage::decode_state(engine.snapshot()->get(storage::keys::map_state()).value().value()).or_throw();
  EXPECT_NE(state.digests_commit, 0u);
  state.digests_commit = 0;
  const storage::Put put{storage::keys::map_state(), storage::encode_state(state)};
  ASSERT_TRUE(
      engine.commit(engine.acquire().or_throw(), state.applied_sequence, std::vector<storage::Put>{put}, {}).ok());
}

TEST(Mapper, DigestsAreSaidToBeMadeOnceTheyAreStored) {
  const sim::PointsWorld world(small_world(200));
  const auto engine = std::make_shared<FullEngine>(storage::make_memory_engine());
  {
    const auto mapper = open_mapper(engine);
    ASSERT_TRUE(feed(*mapper, world, 0, 200).ok());
    ASSERT_TRUE(mapper->stop().ok());
  }
  forget_digests(*engine);
  MapperOptions options;
  options.closures = false;
  const auto stopped_start = [&](bool full) {
    const CapturedLog log;
    options.leaving = [&engine, full] {
      engine->full = full;
      return true;
    };
    EXPECT_EQ(Mapper::open(engine, std::make_shared<storage::Budget>(64u << 20), nullptr, options).reason(),
              Reason::SHUTTING_DOWN);
    engine->full = false;
    return log.text();
  };
  const std::string lost = stopped_start(true);
  EXPECT_THAT(lost, testing::Not(testing::HasSubstr("are made; the next start makes the others")));
  EXPECT_THAT(lost, testing::HasSubstr("could not be kept; the next start makes them again: DISK_FULL: a commit"));
  EXPECT_THAT(stopped_start(false),
              testing::HasSubstr("digests of 64 of 200 frames are made; the next start makes the others"));
}

TEST(Mapper, AStopWhileDigestsAreMadeLeavesTheRestToTheNextStart) {
  const sim::PointsWorld world(small_world(200));
  const auto engine = storage::make_memory_engine();
  storage::MapHash hash;
  {
    const auto mapper = open_mapper(engine);
    ASSERT_TRUE(feed(*mapper, world, 0, 200).ok());
    hash = storage::hash_map(*mapper->view());
    ASSERT_TRUE(mapper->stop().ok());
  }
  forget_digests(*engine);

  MapperOptions options;
  options.closures = false;
  std::size_t asked = 0;
  options.leaving = [&] { return ++asked == 3; };
  const auto open = [&] {
    return Mapper::open(engine, std::make_shared<storage::Budget>(64u << 20), nullptr, options);
  };
  EXPECT_EQ(open().reason(), Reason::SHUTTING_DOWN);
  EXPECT_EQ(asked, 3u) << "it is asked after each chunk";
  asked = 3;
  const auto mapper = open().or_throw();
  EXPECT_EQ(asked, 4u) << "the next start made the one that was left";
  EXPECT_EQ(storage::hash_map(*mapper->view()), hash);
  EXPECT_EQ(storage::digests_visited(*mapper->view()), storage::digests_of_frames(*mapper->view()));
  const auto state =
      storage::decode_state(engine->snapshot()->get(storage::keys::map_state()).value().value()).or_throw();
  EXPECT_EQ(state.digests_commit, engine->snapshot()->commit_number());
}

// So that a user who keeps data derived from the map between runs misses no edit.
TEST(Mapper, TheFirstWatcherIsToldOfAllEditsSinceTheMapWasOpened) {
  const sim::PointsWorld world(small_world(70));
  const auto mapper = open_mapper(storage::make_memory_engine());
  ASSERT_TRUE(feed(*mapper, world, 0, 66).ok());
  std::mutex mutex;
  std::set<storage::ChunkId> told;
  std::uint64_t last = 0;
  mapper->watch_edits([&](std::uint64_t version, std::span<const storage::ChunkId> chunks) {
    const std::lock_guard lock(mutex);
    told.insert(chunks.begin(), chunks.end());
    EXPECT_GE(version, last);
    last = version;
  });
  const SessionNumber session = mapper->view()->sessions()[0].number;
  {
    const std::lock_guard lock(mutex);
    EXPECT_THAT(told, testing::ElementsAre(storage::ChunkId{session, 0}, storage::ChunkId{session, 1}));
    told.clear();
  }
  ASSERT_TRUE(feed(*mapper, world, 66, 70).ok());
  mapper->watch_edits({});
  EXPECT_TRUE(told.contains(storage::ChunkId{session, 1}));
  told.clear();
  mapper->watch_edits(
      [&](std::uint64_t, std::span<const storage::ChunkId> chunks) { told.insert(chunks.begin(), chunks.end()); });
  EXPECT_TRUE(told.empty()) << "only the first";
}

TEST(DeterministicMapper, GivesTheSameMapFromTheSameInput) {
  sim::PointsWorldOptions world_options = small_world(66);
  world_options.births = 30;
  world_options.appearance = 150;
  const sim::PointsWorld world(world_options);
  const auto vocabulary =
      place::Vocabulary::load(std::string(RELMAP_SOURCE_DIR) + "/server/place/data/places.vocab").or_throw();
  std::optional<storage::MapHash> first;
  for (int run = 0; run < 2; ++run) {
    MapperOptions options;
    options.deterministic = true;
    options.rba.idle_delta_eps = 0.001;  // px: so that something is left for idle time
    const auto mapper = Mapper::open(storage::make_memory_engine(),
                                     std::make_shared<storage::Budget>(std::size_t{256} << 20), vocabulary, options)
                            .or_throw();
    ASSERT_TRUE(feed(*mapper, world, 0, 66).ok());
    const auto view = mapper->view();
    EXPECT_GT(view->state().closures_accepted, 0u);
    EXPECT_GT(view->state().applied_sequence, 67u + view->state().closures_accepted) << "idle work was journalled";
    EXPECT_EQ(view->sessions()[0].frames, 66u);
    const storage::MapHash hash = storage::hash_map(*view);
    if (first) {
      EXPECT_EQ(hash, *first);
    }
    first = hash;
    EXPECT_TRUE(mapper->stop().ok());
  }
}

TEST(Mapper, TheWatcherHearsOfEveryClosureThatIsFoundComesIntoForceOrGoes) {
  for (const bool deterministic : {false, true}) {
    const sim::PointsWorld world(small_world(75));
    const auto mapper = open_mapper(storage::make_memory_engine(), deterministic);
    std::vector<storage::Edge> heard;
    mapper->watch_closures([&](const storage::Graph& map, const storage::Edge& closure) {
      EXPECT_EQ(map.session(closure.b.session)->number, kDriveSession);
      heard.push_back(closure);
      throw std::runtime_error("a watcher's trouble is its own");
    });
    ASSERT_TRUE(feed(*mapper, world, 0, 75).ok());
    for (std::uint32_t i = 64; i < 72; ++i)
      ASSERT_TRUE(mapper->submit_and_wait(*true_closure(*mapper->view(), world, i, 60)).ok());
    ASSERT_TRUE(mapper->wait_idle(soon()).ok());
    ASSERT_EQ(heard.size(), 9u);
    EXPECT_EQ(heard.front().state, storage::EdgeState::kCandidate) << "the first awaits another";
    for (const storage::Edge& closure : std::span(heard).subspan(1))
      EXPECT_EQ(closure.state, storage::EdgeState::kAccepted);
    EXPECT_EQ(heard.back().a, (FrameId{kDriveSession, 11}));
    EXPECT_EQ(heard.back().b, (FrameId{kDriveSession, 71}));

    heard.clear();
    ASSERT_TRUE(mapper
                    ->submit_and_wait(
                        storage::SetEdgeStateRecord{{{kDriveSession, 70}, 1}, storage::EdgeState::kRemoved, "wrong"})
                    .ok());
    ASSERT_TRUE(mapper->wait_idle(soon()).ok());
    ASSERT_FALSE(heard.empty());
    for (const storage::Edge& closure : heard) EXPECT_NE(closure.state, storage::EdgeState::kAccepted);

    heard.clear();
    mapper->watch_closures({});
    ASSERT_TRUE(mapper
                    ->submit_and_wait(
                        storage::SetEdgeStateRecord{{{kDriveSession, 70}, 1}, storage::EdgeState::kAccepted, "right"})
                    .ok());
    ASSERT_TRUE(mapper->wait_idle(soon()).ok());
    EXPECT_TRUE(heard.empty());
  }
}

TEST(Mapper, EveryCommitIsToldOnceReadersHaveIt) {
  const sim::PointsWorld world(small_world(20));
  const auto mapper = open_mapper(storage::make_memory_engine());
  std::mutex mutex;
  std::uint64_t commits = 0, last = 0;
  mapper->watch_commits([&] {
    const std::uint64_t number = mapper->view()->committed()->commit_number();
    const std::lock_guard lock(mutex);
    EXPECT_GT(number, last);
    last = number;
    ++commits;
  });
  ASSERT_TRUE(feed(*mapper, world, 0, 20).ok());
  const std::uint64_t applied = mapper->commit(soon()).or_throw();
  {
    const std::lock_guard lock(mutex);
    EXPECT_GE(commits, 1u);
    EXPECT_EQ(last, mapper->view()->committed()->commit_number());
  }
  EXPECT_EQ(storage::newest_event(*mapper->view()->committed()).or_throw().sequence, applied);
  mapper->watch_commits([] { throw std::runtime_error("a watcher that fails"); });
  (void)mapper->commit(soon()).or_throw();
  mapper->watch_commits({});
  const std::uint64_t told = commits;
  (void)mapper->commit(soon()).or_throw();
  EXPECT_EQ(commits, told);
}

// As a robot and an operator do, with a stop in between, in a mapper that also finds closures by itself.
TEST(Mapper, WhenAndByWhomOutlastsARestart) {
  const sim::PointsWorld world(small_world(90));
  const auto engine = storage::make_memory_engine();
  const std::int64_t begun = now_us();
  EdgeId id;
  SessionNumber session = 0;
  storage::MapHash hash;
  {
    const auto mapper = open_mapper(engine);
    ASSERT_TRUE(feed(*mapper, world, 0, 90).ok());
    session = mapper->view()->sessions().at(0).number;
    auto proposal = *true_closure(*mapper->view(), world, 62, 60);
    ASSERT_EQ(proposal.query.session, session);
    (void)mapper->submit_and_wait(proposal).or_throw();
    ASSERT_TRUE(mapper->wait_idle(soon()).ok());
    id = mapper->view()->hot(proposal.query)->edges.back().id;
    storage::SetEdgeStateRecord accept{id, storage::EdgeState::kAccepted, "I was there", true};
    accept.submitted.author = "ann";
    (void)mapper->submit_and_wait(accept).or_throw();
    storage::SetLabelRecord label{{session, 7}, "kitchen"};
    label.submitted = {123, "bob"};
    (void)mapper->submit_and_wait(label).or_throw();
    ASSERT_TRUE(mapper->wait_idle(soon()).ok());
    hash = storage::hash_map(*mapper->view());
    ASSERT_TRUE(mapper->stop().ok());
  }
  const std::int64_t ended = now_us();
  const auto mapper = open_mapper(engine);
  EXPECT_EQ(storage::hash_map(*mapper->view()), hash);
  const auto history = mapper->view()->hot(id.frame)->edge(id)->history;
  ASSERT_EQ(history.size(), 2u);
  for (const storage::EdgeEvent& event : history) {
    EXPECT_GE(event.time_us, begun);
    EXPECT_LE(event.time_us, ended);
  }
  EXPECT_EQ(history[0].author, "") << "nobody: a lookup would have found it";
  EXPECT_EQ(history[1].author, "ann");
  storage::EventFollower follower;
  follower.follow(*mapper->view()->committed());
  EXPECT_EQ(follower.map(), storage::ToldMap::of(*mapper->view()));
  const storage::Event& began = follower.events().front();
  EXPECT_TRUE(std::holds_alternative<storage::SessionEvent>(began.content));
  EXPECT_GE(began.submitted.time_us, begun);
  const auto label = std::ranges::find_if(follower.events(), [](const storage::Event& event) {
    return std::holds_alternative<storage::LabelsEvent>(event.content);
  });
  ASSERT_NE(label, follower.events().end());
  EXPECT_EQ(label->submitted, (storage::Submission{123, "bob"}));
}

// The deletion is stopped by the end of the daemon, whether it has begun by then or not, and goes on at the next start.
TEST(Mapper, WhoDeletedASessionOutlastsARestart) {
  const sim::PointsWorld world(small_world(300));
  const auto engine = storage::make_memory_engine();
  std::int64_t begun = 0;
  {
    const auto mapper = open_mapper(engine);
    ASSERT_TRUE(feed(*mapper, world, 0, 300).ok());
    storage::SetSessionStateRecord deleting{mapper->view()->sessions().at(0).number, storage::SessionState::kDeleting};
    deleting.submitted.author = "ann";
    begun = now_us();
    (void)mapper->submit_and_wait(deleting).or_throw();
    ASSERT_TRUE(mapper->stop().ok());
  }
  const auto mapper = open_mapper(engine);
  ASSERT_TRUE(mapper->wait_idle(soon()).ok());
  (void)mapper->commit(soon()).or_throw();
  storage::EventFollower follower;
  follower.follow(*mapper->view()->committed());
  EXPECT_EQ(follower.map(), storage::ToldMap::of(*mapper->view()));
  std::size_t told = 0;
  for (const storage::Event& event : follower.events()) {
    if (!std::holds_alternative<storage::FramesRemovedEvent>(event.content) &&
        !std::holds_alternative<storage::SessionDeletedEvent>(event.content))
      continue;
    ++told;
    EXPECT_EQ(event.submitted.author, "ann");
    EXPECT_GE(event.submitted.time_us, begun);
    EXPECT_LE(event.submitted.time_us, event.committed_us);
  }
  EXPECT_EQ(told, 6u) << "five chunks, and the session";
}

TEST(Mapper, ASessionKeepsItsCalibration) {
  const sim::PointsWorld world(small_world(3));
  const auto mapper = open_mapper(storage::make_memory_engine());
  SessionHeader header = world.keyframe(0).session;
  ASSERT_TRUE(mapper->begin_session(header).ok());
  header.camera.f += 1;
  EXPECT_EQ(mapper->begin_session(header).reason(), Reason::CALIBRATION_CHANGED);
}

TEST(Mapper, ANewUuidUnderATakenNameIsAnotherSession) {
  const sim::PointsWorld world(small_world(3));
  const auto mapper = open_mapper(storage::make_memory_engine());
  SessionHeader header = world.keyframe(0).session;
  const SessionNumber first = mapper->begin_session(header).or_throw();
  header.uuid = SessionUuid::random();
  const SessionNumber second = mapper->begin_session(header).or_throw();
  EXPECT_NE(first, second);
  ASSERT_TRUE(mapper->wait_idle(soon()).ok());
  EXPECT_EQ(mapper->view()->session(second)->display_name, header.name + "#2");
}

TEST(Mapper, AFullQueueRefusesAndLosesNothing) {
  const sim::PointsWorld world(small_world(60));
  const auto mapper = open_mapper(storage::make_memory_engine(), false, 1);
  const SessionNumber session = mapper->begin_session(world.keyframe(0).session).or_throw();
  std::vector<storage::KeyframeRecord> records;
  for (std::uint32_t i = 0; i < 60; ++i) {
    records.push_back(keyframe_record(world, i));
    records.back().session = session;
  }
  bool refused = false;
  for (std::uint32_t i = 0; i < 60;) {
    const Status submitted = mapper->submit(records[i], [](const Result<std::uint64_t>&) {});
    if (submitted.ok()) {
      ++i;
      continue;
    }
    ASSERT_EQ(submitted.reason(), Reason::BUDGET_EXCEEDED);
    refused = true;
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_TRUE(refused);
  ASSERT_TRUE(mapper->wait_idle(soon()).ok());
  EXPECT_EQ(mapper->view()->session(session)->frames, 60u);
}

TEST(Mapper, AWaitForADeletionTellsHowManyFramesAreLeft) {
  const sim::PointsWorld world(small_world(20));
  const auto mapper = open_mapper(storage::make_memory_engine());
  ASSERT_TRUE(feed(*mapper, world, 0, 20).ok());
  const SessionNumber session = mapper->view()->sessions().front().number;
  EXPECT_EQ(mapper->wait_deleted(session, std::chrono::steady_clock::now()).or_throw(), 20u) << "nothing deletes it";
  const storage::SetSessionStateRecord deleting{session, storage::SessionState::kDeleting};
  ASSERT_TRUE(mapper->submit_and_wait(deleting).ok());
  EXPECT_EQ(mapper->wait_deleted(session, soon()).or_throw(), 0u);
  EXPECT_EQ(mapper->view()->session(session)->frames, 0u) << "as readers see it";
  EXPECT_EQ(mapper->wait_deleted(session, std::chrono::steady_clock::now()).or_throw(), 0u);
}

TEST(Mapper, AfterStopNothingIsTaken) {
  const auto mapper = open_mapper(storage::make_memory_engine());
  ASSERT_TRUE(mapper->stop().ok());
  EXPECT_EQ(mapper->submit_and_wait(storage::IdleWorkRecord{1}).reason(), Reason::SHUTTING_DOWN);
}

// Hands out a journal in which one record is damaged, or ends in an exception as it is applied.
class DamagedJournal final : public storage::ForwardingEngine {
 public:
  DamagedJournal(std::shared_ptr<storage::Engine> engine, std::uint64_t damaged, bool throws = false)
      : ForwardingEngine(std::move(engine)), damaged_(damaged), throws_(throws) {}

  Status read_journal(std::uint64_t from, const std::function<bool(std::uint64_t, ByteSpan)>& visit) const override {
    return engine().read_journal(from, [&](std::uint64_t sequence, ByteSpan record) {
      if (throws_ && sequence == damaged_) throw std::runtime_error("as told");
      return visit(sequence, sequence == damaged_ ? record.first(record.size() / 2) : record);
    });
  }
  Status trim(std::uint64_t) override { return {}; }
  // Nothing is ever committed, so that all is replayed.
  Status commit(std::uint64_t, std::uint64_t, std::span<const storage::Put>, std::span<const std::string>) override {
    return {Reason::IO_ERROR, "as told"};
  }

 private:
  const std::uint64_t damaged_;
  const bool throws_;
};

// Otherwise a crash could take it back, and robots would have the identity of a map that does not exist.
TEST(Mapper, AnIdentityThatIsNotDurableIsNotTold) {
  const auto engine = storage::make_memory_engine();
  EXPECT_FALSE(open_mapper(std::make_shared<DamagedJournal>(engine, 0))->identity().known());  // keeps commits away
  EXPECT_TRUE(open_mapper(engine)->identity().known());
}

TEST(Mapper, ADamagedJournalIsServedReadOnlyAsFarAsItGoes) {
  const sim::PointsWorld world(small_world(30));
  const auto engine = storage::make_memory_engine();
  {
    const auto mapper = open_mapper(std::make_shared<DamagedJournal>(engine, 0));  // none: only keeps commits away
    (void)feed(*mapper, world, 0, 30);
  }
  for (const bool throws : {false, true}) {
    const auto mapper = open_mapper(std::make_shared<DamagedJournal>(engine, 12, throws));
    const auto view = mapper->view();
    EXPECT_EQ(view->state().applied_sequence, 11u);
    EXPECT_TRUE(view->hot({1, 5}));
    const Status storage = mapper->stats().storage;
    EXPECT_EQ(storage.reason(), Reason::READ_ONLY);
    EXPECT_THAT(storage.message(), testing::HasSubstr(throws ? "beyond record 11" : "journal record 12"));
    EXPECT_EQ(mapper->submit_and_wait(storage::IdleWorkRecord{1}).reason(), Reason::READ_ONLY);
    EXPECT_EQ(mapper->wait_idle(soon()).reason(), Reason::READ_ONLY);
    EXPECT_EQ(mapper->wait_applied(12, soon()).reason(), Reason::READ_ONLY);
    const SessionNumber session = view->sessions().front().number;
    EXPECT_EQ(mapper->wait_deleted(session, soon()).reason(), Reason::READ_ONLY) << "no frame would go";
  }
}

// A map on a disk whose journal or commits fail while they are told to.
struct FailingDisk {
  std::shared_ptr<storage::DiskFaults> journal = std::make_shared<storage::DiskFaults>(),
                                       commits = std::make_shared<storage::DiskFaults>();
  std::shared_ptr<storage::ForgetfulFiles> files = storage::ForgetfulFiles::create(1);
  std::shared_ptr<storage::Engine> open() const {
    return storage::open_fault_engine(
               storage::faulty_files(storage::faulty_files(files, journal, "journal"), commits, "commits"))
        .or_throw();
  }
};

// As the intake does: what is not taken is offered again, in order.
void feed_patiently(Mapper& mapper, const sim::PointsWorld& world, std::uint32_t from, std::uint32_t to) {
  const auto deadline = soon();
  const auto again = [&](const Status& status) {
    EXPECT_LT(std::chrono::steady_clock::now(), deadline) << status.to_string();
    std::this_thread::sleep_for(5ms);
  };
  auto session = mapper.begin_session(world.keyframe(0).session);
  for (; !session.ok(); session = mapper.begin_session(world.keyframe(0).session)) again(session.status());
  for (std::uint32_t i = from; i < to && !testing::Test::HasFailure();) {
    storage::KeyframeRecord record = keyframe_record(world, i);
    record.session = *session;
    const auto durable = mapper.submit_and_wait(std::move(record));
    durable.ok() ? void(++i) : again(durable.status());
  }
}

TEST(Mapper, AFailingJournalIsReportedAndRecoversByItself) {
  const sim::PointsWorld world(small_world(30));
  const FailingDisk disk;
  const auto mapper = open_mapper(disk.open());
  feed_patiently(*mapper, world, 0, 10);
  ASSERT_TRUE(mapper->wait_idle(soon()).ok());
  std::uint32_t next = 10;
  for (const Reason reason : {Reason::DISK_FULL, Reason::READ_ONLY}) {
    disk.journal->write = reason;
    EXPECT_EQ(mapper->submit_and_wait(storage::SetLabelRecord{{1, 3}, "here", true}).reason(), reason);
    EXPECT_EQ(mapper->submit(storage::SetLabelRecord{{1, 3}, "here", true}, [](const auto&) {}).reason(), reason)
        << "at once";
    EXPECT_EQ(mapper->stats().storage.reason(), reason);
    EXPECT_EQ(mapper->view()->hot({1, 3})->labels.size(), 0u) << "what is there answers";
    disk.journal->write = Reason::OK;
    feed_patiently(*mapper, world, next, next + 10);
    next += 10;
    EXPECT_TRUE(mapper->stats().storage.ok());
  }
  ASSERT_TRUE(mapper->wait_idle(soon()).ok());
  EXPECT_EQ(mapper->view()->sessions()[0].frames, 30u);
  EXPECT_THAT(derived_differences(*mapper->view()), testing::IsEmpty());
}

// While the disk takes nothing of what lookups find, these fall behind: that is not what is wrong.
TEST(Mapper, WhileLookupsWaitForAFailingDiskTheReasonIsTheDisks) {
  sim::PointsWorldOptions world_options = small_world(118);
  world_options.births = 30;
  world_options.appearance = 150;
  const sim::PointsWorld world(world_options);
  const FailingDisk disk;
  MapperOptions options;
  options.lookup_threads = 1;
  const auto mapper =
      Mapper::open(
          disk.open(), std::make_shared<storage::Budget>(std::size_t{256} << 20),
          place::Vocabulary::load(std::string(RELMAP_SOURCE_DIR) + "/server/place/data/places.vocab").or_throw(),
          options)
          .or_throw();
  std::uint32_t next = 60;  // a lap
  ASSERT_TRUE(feed(*mapper, world, 0, next).ok());
  // The disk may fail too late, when all lookups of these ten frames have ended.
  const auto waits = [&] {
    while (mapper->stats().lookup_lag > 1 && mapper->stats().lookup_lag_s < 1.5e-3 * kMaxLookupLag.count())
      std::this_thread::sleep_for(5ms);
    return mapper->stats().lookup_lag > 1;
  };
  do {
    disk.journal->write = Reason::OK;
    feed_patiently(*mapper, world, next, next + 10);
    next += 10;
    disk.journal->write = Reason::DISK_FULL;
  } while (!waits() && next < 110);
  ASSERT_LT(next, 110u);
  storage::KeyframeRecord record = keyframe_record(world, next);
  record.session = mapper->view()->sessions()[0].number;
  EXPECT_EQ(mapper->submit(record, [](const auto&) {}).reason(), Reason::DISK_FULL);
  disk.journal->write = Reason::OK;
  EXPECT_TRUE(mapper->wait_idle(soon()).ok());
  EXPECT_EQ(mapper->stats().lookup_lag, 0u);
}

// Records that queue behind a failing one fail with it, so that they do not overtake it.
TEST(Mapper, RefusedRecordsKeepTheirOrder) {
  const FailingDisk disk;
  const auto mapper = open_mapper(disk.open());
  std::mutex mutex;
  std::vector<bool> outcomes;
  disk.journal->sync = Reason::IO_ERROR;
  std::size_t taken = 0;
  for (int i = 0; i < 200; ++i) {
    taken += mapper
                 ->submit(storage::IdleWorkRecord{1},
                          [&](const Result<std::uint64_t>& result) {
                            const std::lock_guard lock(mutex);
                            outcomes.push_back(result.ok());
                          })
                 .ok();
    if (taken == 3) disk.journal->sync = Reason::OK;
  }
  (void)mapper->stop();
  ASSERT_EQ(outcomes.size(), taken);
  EXPECT_TRUE(std::is_sorted(outcomes.begin(), outcomes.end())) << "a record was taken, and an earlier one was not";
}

TEST(Mapper, WhileCommitsFailIntakeIsLimitedToWhatFitsInMemory) {
  const sim::PointsWorld world(small_world(600));
  const FailingDisk disk;
  const auto mapper = open_mapper(disk.open(), false, 1);
  feed_patiently(*mapper, world, 0, 5);
  disk.commits->write = Reason::IO_ERROR;
  std::thread robot([&] { feed_patiently(*mapper, world, 5, 600); });
  const storage::Budget& budget = mapper->budget();
  // What a commit that fails gives back may have been edited meanwhile, and is then held once: a few more may fit after
  // the share is full. That none comes for a while says nothing before it is: the machine may be busy.
  const auto full = [&] { return budget.used(storage::Share::kDirty) > budget.allowance(storage::Share::kDirty); };
  std::uint64_t taken = 0, before = 0;
  const auto deadline = soon();
  do {
    before = taken;
    std::this_thread::sleep_for(300ms);
    taken = mapper->stats().durable_sequence;
  } while ((!full() || taken != before) && std::chrono::steady_clock::now() < deadline);
  EXPECT_EQ(taken, before);
  EXPECT_EQ(mapper->stats().storage.reason(), Reason::IO_ERROR);
  EXPECT_GT(budget.used(storage::Share::kDirty), budget.allowance(storage::Share::kDirty));
  EXPECT_LT(taken, 600u);
  disk.commits->write = Reason::OK;
  robot.join();
  ASSERT_TRUE(mapper->wait_idle(soon()).ok());
  EXPECT_EQ(mapper->view()->sessions()[0].frames, 600u);
  EXPECT_TRUE(mapper->stop().ok());
}

TEST(DeterministicMapper, GivesTheSameMapDespiteDiskFailures) {
  sim::PointsWorldOptions world_options = small_world(66);
  world_options.births = 30;
  world_options.appearance = 150;
  const sim::PointsWorld world(world_options);
  const auto vocabulary =
      place::Vocabulary::load(std::string(RELMAP_SOURCE_DIR) + "/server/place/data/places.vocab").or_throw();
  std::vector<storage::MapHash> maps;
  for (const bool fails : {false, true}) {
    const FailingDisk disk;
    MapperOptions options;
    options.deterministic = true;
    options.commit_interval = 20ms;
    const auto mapper =
        Mapper::open(disk.open(), std::make_shared<storage::Budget>(std::size_t{256} << 20), vocabulary, options)
            .or_throw();
    std::atomic<bool> done = false;
    std::thread trouble([&] {
      for (int i = 0; fails && !done; ++i) {
        (i % 3 == 0 ? disk.commits : disk.journal)->write = i % 2 == 0 ? Reason::DISK_FULL : Reason::IO_ERROR;
        std::this_thread::sleep_for(10ms);
        disk.commits->write = disk.journal->write = Reason::OK;
        std::this_thread::sleep_for(400ms);
      }
    });
    feed_patiently(*mapper, world, 0, 66);
    done = true;
    trouble.join();
    ASSERT_TRUE(mapper->wait_idle(soon()).ok());
    EXPECT_GT(mapper->view()->state().closures_accepted, 0u);
    maps.push_back(storage::hash_map(*mapper->view()));
  }
  EXPECT_EQ(maps[0], maps[1]);
}

// Two drives of a robot; the first is deleted while the second goes on.
class ADriveIsDeleted : public testing::Test {
 protected:
  ADriveIsDeleted() {
    options_.deterministic = true;
    options_.rba.idle_delta_eps = 0.001;
    options_.commit_interval = 20ms;
    for (std::uint32_t i = 0; i < 66; ++i) input_.emplace_back(keyframe_record(first_, i));
    for (std::uint32_t i = 0; i < 66; ++i) {
      storage::KeyframeRecord record = keyframe_record(again_, i);
      record.session = 2;
      input_.emplace_back(std::move(record));
      if (i == 40) {
        deletion_ = input_.size();
        input_.emplace_back(storage::SetSessionStateRecord{1, storage::SessionState::kDeleting});
      }
    }
  }
  std::unique_ptr<Mapper> open(std::shared_ptr<storage::Engine> engine) const {
    auto mapper = Mapper::open(std::move(engine), std::make_shared<storage::Budget>(std::size_t{256} << 20),
                               vocabulary_, options_)
                      .or_throw();
    if (mapper->view()->sessions().empty()) {
      EXPECT_EQ(mapper->begin_session(first_.keyframe(0).session).or_throw(), 1u);
      EXPECT_EQ(mapper->begin_session(again_.keyframe(0).session).or_throw(), 2u);
    }
    return mapper;
  }
  // Submits what is not durable yet, until the queue is full.
  void submit(Mapper& mapper) {
    for (std::size_t i = durable_; i < input_.size(); ++i)
      if (!mapper.submit(input_[i], [&](const Result<std::uint64_t>& result) { durable_ += result.ok(); }).ok()) break;
  }
  // Submits what is not durable yet, and waits until all is applied.
  void finish(Mapper& mapper) {
    do {
      submit(mapper);
      ASSERT_TRUE(mapper.wait_idle(soon()).ok());
    } while (durable_ < input_.size());
  }
  static storage::MapHash hash(const Mapper& mapper) {
    const auto view = mapper.view();
    EXPECT_TRUE(storage::is_deleted(*view->session(1)));
    EXPECT_EQ(view->session(2)->frames, 66u);
    EXPECT_THAT(derived_differences(*view), testing::IsEmpty());
    return storage::hash_map(*view);
  }
  storage::MapHash undisturbed() {
    durable_ = 0;
    const auto mapper = open(storage::make_memory_engine());
    finish(*mapper);
    const storage::MapHash map = hash(*mapper);
    durable_ = 0;
    return map;
  }

  const sim::PointsWorld first_{drive(1)}, again_{drive(2)};
  std::vector<storage::JournalRecord> input_;
  std::size_t deletion_ = 0;  // the record in `input_`
  std::atomic<std::size_t> durable_ = 0;

 private:
  static sim::PointsWorldOptions drive(std::uint8_t number) {
    sim::PointsWorldOptions world = small_world(66);
    world.births = 30;
    world.appearance = 150;
    if (number == 1) return world;
    world.noise_seed = number;
    world.uuid.bytes[15] = number;
    world.session = "again";
    return world;
  }
  MapperOptions options_;
  const std::shared_ptr<const place::Vocabulary> vocabulary_ =
      place::Vocabulary::load(std::string(RELMAP_SOURCE_DIR) + "/server/place/data/places.vocab").or_throw();
};

TEST_F(ADriveIsDeleted, StopsWithAFullQueueGiveTheSameMap) {
  const storage::MapHash map = undisturbed();
  const auto engine = storage::make_memory_engine();
  auto mapper = open(engine);
  std::mt19937 random(3);
  int stopped = 0;
  for (; durable_ < input_.size(); ++stopped) {
    submit(*mapper);
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 60));
    ASSERT_TRUE(mapper->stop().ok());
    mapper = open(engine);
  }
  ASSERT_TRUE(mapper->wait_idle(soon()).ok());
  EXPECT_GT(stopped, 3);
  EXPECT_EQ(hash(*mapper), map);
}

// What follows from a record is journalled before the next one, even if the disk, and then a stop, hold it up.
TEST_F(ADriveIsDeleted, FailingCommitsGiveTheSameMapWithAStopAndWithout) {
  const storage::MapHash map = undisturbed();
  for (const bool stops : {false, true}) {
    durable_ = 0;
    const FailingDisk disk;
    auto mapper = open(disk.open());
    std::vector<storage::JournalRecord> later;
    std::swap(later, input_);
    input_.assign(later.begin(), later.begin() + static_cast<std::ptrdiff_t>(deletion_));
    finish(*mapper);
    disk.commits->write = Reason::IO_ERROR;
    ASSERT_EQ(mapper->commit(soon()).reason(), Reason::IO_ERROR);
    std::swap(later, input_);
    submit(*mapper);
    while (durable_ <= deletion_) std::this_thread::sleep_for(1ms);
    std::this_thread::sleep_for(50ms);  // time in which no later record may become durable
    EXPECT_EQ(durable_, deletion_ + 1);
    EXPECT_GT(mapper->view()->session(1)->frames, 0u) << "what a removal edits could not leave memory";
    if (stops) {
      EXPECT_EQ(mapper->stop().reason(), Reason::IO_ERROR);
      mapper.reset();
      disk.commits->write = Reason::OK;
      mapper = open(disk.open());
    }
    disk.commits->write = Reason::OK;
    finish(*mapper);
    EXPECT_EQ(hash(*mapper), map) << (stops ? "with a stop" : "without a stop");
  }
}

TEST(Mapper, AnUnreadablePartIsReportedWithAdvice) {
  const sim::PointsWorld world(small_world(30));
  const auto disk = storage::ForgetfulFiles::create(1);
  const auto faults = std::make_shared<storage::Faults>();
  {
    const auto mapper = open_mapper(storage::open_fault_engine(disk).or_throw());
    ASSERT_TRUE(feed(*mapper, world, 0, 20).ok());
  }
  const auto mapper = open_mapper(storage::open_fault_engine(disk, faults).or_throw());
  ASSERT_TRUE(mapper->begin_session(world.keyframe(0).session).ok());  // its record is in memory from now on
  // As an edit does, and before the map fails.
  auto waits = std::async(std::launch::async, [&, next = mapper->stats().durable_sequence + 1] {
    return mapper->wait_applied(next, soon());
  });
  EXPECT_EQ(waits.wait_for(20ms), std::future_status::timeout);
  faults->reads = 1000;
  EXPECT_EQ(feed(*mapper, world, 20, 21).reason(), Reason::READ_ONLY);
  EXPECT_EQ(waits.get().reason(), Reason::READ_ONLY);
  const Status storage = mapper->stats().storage;
  EXPECT_EQ(storage.reason(), Reason::READ_ONLY);
  EXPECT_THAT(storage.message(), testing::HasSubstr("relmap-admin repair"));
  faults->reads = 0;
  const auto view = mapper->view();
  EXPECT_TRUE(view->hot({1, 5})) << "the map is served";
  EXPECT_EQ(view->sessions()[0].frames, 20u);
  std::this_thread::sleep_for(100ms);  // some commits would have been due
  EXPECT_EQ(mapper->view()->version(), view->version()) << "as it was last published";
  EXPECT_EQ(mapper->begin_session(world.keyframe(0).session).ok(), true) << "which is known";
}

TEST(Mapper, ReadersSeeConsistentMapsWhileItGrows) {
  const sim::PointsWorld world(small_world(60));
  const auto mapper = open_mapper(storage::make_memory_engine());
  std::atomic<bool> done = false;
  std::uint32_t looks = 0;
  std::thread reader([&] {
    while (!done) {
      const auto view = mapper->view();
      for (const storage::Session& session : view->sessions()) {
        if (session.frames == 0) continue;
        const FrameId last{session.number, session.last};
        EXPECT_TRUE(view->hot(last));
        EXPECT_FALSE(view->hot({session.number, session.last + 1}));
        EXPECT_EQ(view->warm(last)->observations.empty(), false);
        ++looks;
      }
    }
  });
  EXPECT_TRUE(feed(*mapper, world, 0, 60).ok());
  done = true;
  reader.join();
  EXPECT_GT(looks, 0u);
}

}  // namespace
}  // namespace relmap::map
