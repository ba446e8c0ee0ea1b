#include "tests/support/power_failures.h"

#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "proto/base/crc32c.h"
#include "server/intake/ingest_server.h"
#include "server/map/map_builder.h"
#include "server/map/mapper.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/engine/memory_engine.h"
#include "storage/events/event_block.h"
#include "storage/events/event_log.h"
#include "storage/testing/forwarding_engine.h"
#include "tests/support/patience.h"
#include "tests/support/small_world.h"
#include "tests/support/verify_findings.h"

namespace relmap::testing {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr std::uint32_t kFrames = 160, kLap = 70;

// Every record that became durable, over all lives. Thread-safe.
class Journal {
 public:
  void keep(std::uint64_t sequence, ByteSpan bytes) {
    const std::lock_guard lock(mutex_);
    records_[sequence].assign(bytes.begin(), bytes.end());
    const auto decoded = storage::decode_record(bytes);
    if (!decoded.ok()) return;
    if (const auto* keyframe = std::get_if<storage::KeyframeRecord>(&decoded->record))
      keyframes_[keyframe->crc] = sequence;
  }
  // Where the keyframe with this checksum stands; 0: nowhere.
  std::uint64_t sequence_of(std::uint32_t crc) const {
    const std::lock_guard lock(mutex_);
    const auto found = keyframes_.find(crc);
    return found == keyframes_.end() ? 0 : found->second;
  }
  std::map<std::uint64_t, Bytes> records() const {
    const std::lock_guard lock(mutex_);
    return records_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::uint64_t, Bytes> records_;
  std::map<std::uint32_t, std::uint64_t> keyframes_;
};

// Passes everything on, and keeps every record that became durable.
class KeptJournal final : public storage::ForwardingEngine {
 public:
  KeptJournal(std::shared_ptr<storage::Engine> to, Journal& kept, std::uint64_t& commits)
      : ForwardingEngine(std::move(to)), kept_(kept), commits_(commits) {
    // An append that failed may have become durable all the same.
    (void)engine().read_journal(engine().first_journal_sequence(), [&](std::uint64_t sequence, ByteSpan record) {
      kept_.keep(sequence, record);
      return true;
    });
  }

  Result<std::uint64_t> append(std::uint64_t epoch, std::span<const Bytes> records) override {
    const auto appended = engine().append(epoch, records);
    for (std::size_t i = 0; appended.ok() && i < records.size(); ++i)
      kept_.keep(*appended - records.size() + 1 + i, records[i]);
    return appended;
  }
  Status commit(std::uint64_t epoch, std::uint64_t applied, std::span<const storage::Put> puts,
                std::span<const std::string> deletes) override {
    const Status status = engine().commit(epoch, applied, puts, deletes);
    commits_ += status.ok();
    return status;
  }

 private:
  Journal& kept_;
  std::uint64_t& commits_;
};

class MapperSink final : public intake::KeyframeSink {
 public:
  explicit MapperSink(map::Mapper& mapper) : mapper_(mapper) {}
  void begin_session(const SessionHeader& header, Begun begun) override {
    mapper_.begin_session(header, std::move(begun));
  }
  std::optional<SessionNumber> find_session(const SessionUuid& uuid) const override {
    return mapper_.find_session(uuid);
  }
  Status submit(storage::JournalRecord record, Done done) override {
    return mapper_.submit(std::move(record), std::move(done));
  }
  std::shared_ptr<const void> hold_session(SessionNumber session) override { return mapper_.hold_session(session); }
  std::shared_ptr<const storage::Graph> view() const override { return mapper_.view(); }
  std::size_t free_bytes() const override { return std::size_t{1} << 20; }

 private:
  map::Mapper& mapper_;
};

// The daemon between two failures of the power, without RPC and LCM.
class Life {
 public:
  using Watch = std::function<void(const Acknowledgement&)>;
  Life(std::shared_ptr<storage::Engine> engine, const std::shared_ptr<const place::Vocabulary>& vocabulary,
       std::uint8_t boot, Watch watch)
      : budget_(std::make_shared<storage::Budget>(std::size_t{256} << 20)) {
    map::MapperOptions options;
    options.commit_interval = milliseconds(30);
    mapper_ = map::Mapper::open(std::move(engine), budget_, vocabulary, options).or_throw();
    sink_ = std::make_unique<MapperSink>(*mapper_);
    ingest_ = std::make_unique<intake::IngestServer>(*sink_, *budget_, BootId{boot});
    subscription_ = ingest_->subscribe({[this, watch = std::move(watch)](const Acknowledgement& ack, const auto&) {
                                          watch(ack);
                                          const std::lock_guard lock(mutex_);
                                          next_sequence_ = std::max(next_sequence_, ack.next_sequence);
                                        },
                                        {},
                                        {}});
  }
  ~Life() { end(); }

  // Says its last acknowledgements.
  void end() {
    ingest_->stop();
    (void)mapper_->stop();
  }

  map::Mapper& mapper() { return *mapper_; }
  intake::IngestServer& ingest() { return *ingest_; }
  // Every sequence below has been acknowledged.
  std::uint64_t acknowledged() const {
    const std::lock_guard lock(mutex_);
    return next_sequence_;
  }

 private:
  std::shared_ptr<storage::Budget> budget_;
  std::unique_ptr<map::Mapper> mapper_;
  std::unique_ptr<MapperSink> sink_;
  std::unique_ptr<intake::IngestServer> ingest_;
  mutable std::mutex mutex_;
  std::uint64_t next_sequence_ = 0;
  std::unique_ptr<intake::IngestServer::Subscription> subscription_;
};

class Run {
 public:
  Run(FailingDisk& disk, std::uint64_t seed, bool watch) : disk_(disk), watch_(watch), random_(seed) {
    const sim::PointsWorld world(small_world(kFrames, kLap, 120));
    uuid_ = world.options().uuid;
    for (std::uint32_t i = 0; i < world.size(); ++i) payloads_.push_back(encode_keyframe(world.keyframe(i)));
    result_.keyframes = kFrames;
  }

  PowerFailureRun everything(int failures) {
    for (int life = 0; life <= failures && right(); ++life) {
      try {
        live(life, life == failures);
      } catch (const StatusError& error) {
        // A disk that has lost what it promised may say so itself.
        if (disk_.has_power()) wrong("life " + std::to_string(life) + ": " + error.what());
      }
      disk_.restart();
    }
    if (right()) replay();
    return result_;
  }

 private:
  void live(int number, bool last) {
    const auto engine = std::make_shared<KeptJournal>(disk_.open().or_throw(), journal_, result_.commits);
    verify_clean(*engine);
    if (!right()) return;
    Life life(engine, vocabulary_, static_cast<std::uint8_t>(number + 1), [&](const Acknowledgement& ack) {
      if (watch_ && ack.next_sequence > 0) watch(*engine, ack.next_sequence - 1);
    });
    check(life.mapper());
    if (!right()) return;
    if (!last) disk_.fail_power_after(1 + random_() % 90);
    feed(life);
    if (!last) {
      life.end();
      acknowledged_ = std::max(acknowledged_, life.acknowledged());
      result_.acknowledged_at_failures += acknowledged_;
      return;
    }
    acknowledged_ = life.acknowledged();
    if (const Status idle = life.mapper().wait_idle(steady_clock::now() + kPatience); !idle.ok())
      return wrong(idle.to_string());
    check(life.mapper());
    final_ = storage::hash_map(*life.mapper().view());
    (void)life.mapper().commit(steady_clock::now() + kPatience).or_throw();
    told_ = told(*life.mapper().view()->committed());
    result_.closures_accepted = life.mapper().view()->state().closures_accepted;
    if (life.mapper().view()->state().keyframes != kFrames) wrong("keyframes counted twice");
  }

  // Called as an acknowledgement of everything through `keyframe` leaves.
  void watch(const storage::Engine& engine, std::uint64_t keyframe) {
    const std::uint64_t sequence = journal_.sequence_of(crc32c(payloads_.at(keyframe)));
    std::uint64_t first = 0, certain = 0;
    do {  // until nothing is trimmed meanwhile
      first = engine.first_journal_sequence();
      certain = disk_.certain_through(first);
    } while (engine.first_journal_sequence() != first);
    if (sequence == 0 || sequence > std::max(certain, engine.applied_sequence()))
      wrong("keyframe " + std::to_string(keyframe) + " was acknowledged before its sync returned");
  }

  void verify_clean(const storage::Engine& engine) {
    for (const std::string& finding : verify_findings(engine)) wrong(finding);
  }

  // As a robot does: what is not acknowledged is sent, and sent again.
  void feed(Life& life) {
    const auto deadline = steady_clock::now() + kPatience;
    std::uint64_t sent = acknowledged_;
    auto resend = steady_clock::now() + milliseconds(100);
    while (disk_.has_power() && life.acknowledged() < kFrames) {
      const std::uint64_t from = std::max(life.acknowledged(), acknowledged_);
      if (steady_clock::now() > resend) {
        sent = life.acknowledged();
        resend = steady_clock::now() + milliseconds(100);
      }
      for (; sent < std::min<std::uint64_t>(from + 8, kFrames); ++sent)
        life.ingest().take_payload(uuid_, static_cast<std::uint32_t>(sent), crc32c(payloads_[sent]), payloads_[sent],
                                   {});
      if (steady_clock::now() > deadline) return wrong("keyframes are not acknowledged any more");
      std::this_thread::sleep_for(milliseconds(1));
    }
  }

  void check(const map::Mapper& mapper) {
    const auto view = mapper.view();
    const auto sessions = view->sessions();
    if (sessions.size() > 1) return wrong("a session is there twice");
    if (sessions.empty()) return acknowledged_ == 0 ? void() : wrong("the session is lost");
    const storage::Session& session = sessions.front();
    if (session.next_sequence < acknowledged_)
      return wrong("acknowledged through " + std::to_string(acknowledged_) + ", there through " +
                   std::to_string(session.next_sequence));
    std::uint64_t before = 0;
    for (std::uint32_t i = 0; i < session.next_sequence; ++i) {
      const auto hot = view->hot({session.number, i});
      if (!hot) return wrong("keyframe " + std::to_string(i) + " is lost");
      if (hot->payload_crc != crc32c(payloads_[i])) return wrong("keyframe " + std::to_string(i) + " is another");
      if (hot->journal_sequence <= before)
        return wrong("keyframe " + std::to_string(i) + " is doubled or out of order");
      before = hot->journal_sequence;
    }
    if (session.frames != session.next_sequence || session.refused + session.given_up > 0)
      wrong("the session's counts are wrong");
  }

  // What the log of events tells, but for what moved, which depends on when commits were made.
  Bytes told(const storage::EngineSnapshot& snapshot) {
    storage::EventBlock events;
    storage::EventsRead read;
    do {
      read = storage::read_events(snapshot, read.through, std::size_t{1} << 20).or_throw();
      if (read.gap) wrong("the log of events has a gap");
      for (const storage::Event& event : read.events)
        if (event.at.ordinal != storage::kMovedOrdinal) events.add(event);
    } while (read.more);
    return events.events.take();
  }

  // The journal alone gives the same map, and tells the same.
  void replay() {
    auto engine = storage::make_memory_engine();
    const std::uint64_t epoch = engine->acquire().or_throw();
    const auto map =
        storage::Map::open(engine, epoch, std::make_shared<storage::Budget>(std::size_t{1} << 30)).or_throw();
    map::MapBuilder builder(
        *map, [this](std::span<const AppearanceFeature> features) { return vocabulary_->words(features); },
        map::MapperOptions().rba);
    std::uint64_t expected = 0;
    for (const auto& [sequence, bytes] : journal_.records()) {
      if (sequence != ++expected) return wrong("the journal has a hole at " + std::to_string(expected));
      builder.apply(sequence, storage::decode_record(bytes).or_throw().record);
    }
    const storage::MapHash again = storage::hash_map(*map->publish());
    if (again.structure != final_.structure) wrong("the same journal gives another structure");
    if (again.estimates != final_.estimates) wrong("the same journal gives other estimates");
    throw_if(map->commit());
    if (told_.empty() || told(*map->view()->committed()) != told_) wrong("the same journal tells other events");
  }

  bool right() {
    const std::lock_guard lock(mutex_);
    return result_.wrong.empty();
  }
  void wrong(const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (result_.wrong.empty()) result_.wrong = what;
  }

  FailingDisk& disk_;
  const bool watch_;
  std::mutex mutex_;  // of result_.wrong
  std::mt19937_64 random_;
  const std::shared_ptr<const place::Vocabulary> vocabulary_ = place::random_vocabulary(1000, 60, 1);
  SessionUuid uuid_;
  std::vector<Bytes> payloads_;
  Journal journal_;
  std::uint64_t acknowledged_ = 0;
  storage::MapHash final_;
  Bytes told_;
  PowerFailureRun result_;
};

}  // namespace

PowerFailureRun run_with_power_failures(FailingDisk& disk, int failures, std::uint64_t seed, bool watch) {
  return Run(disk, seed, watch).everything(failures);
}

}  // namespace relmap::testing
