// Storage by its own API, in process: a long drive is written like a batch, read while it grows, and read again cold.
#include <fcntl.h>
#include <unistd.h>
#include <zstd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>

#include "frontend/tracking/bounded_queue.h"
#include "proto/base/crc32c.h"
#include "server/ops/process.h"
#include "storage/journal/journal_record.h"
#include "storage/map/part_loader.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/storage_load.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr SessionNumber kSession = 1;
constexpr std::size_t kGroup = 64;       // keyframes a batch job sends before it waits for the acknowledgement
constexpr std::size_t kGroupsAhead = 2;  // groups between two threads
constexpr std::uint32_t kSmallMap = 10'048;
constexpr std::uint32_t kReportedUpdates = 4'992;  // updates on either side of what they are reported for; whole groups
constexpr std::size_t kNeighbourhood = 20;
constexpr std::size_t kPage = 4096;

struct StorageOptions {
  std::uint32_t frames = 100'000;
  std::uint64_t memory_budget_mb = 256;
  bool light = false;
  std::string data;
  std::uint64_t seed = 1;
};

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Bytes that this process has caused to be written to the device.
double device_bytes_written() {
  std::ifstream io("/proc/self/io");
  std::string name;
  double value = 0;
  while (io >> name >> value)
    if (name == "write_bytes:") return value;
  return 0;
}

// Without the reserve, whose size does not depend on the map.
double folder_bytes(const std::string& folder) {
  double bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().filename() != "RESERVE")
      bytes += static_cast<double>(entry.file_size());
  return bytes;
}

struct AlignedBuffer {
  explicit AlignedBuffer(std::size_t size) : data(static_cast<std::uint8_t*>(std::aligned_alloc(kPage, size))) {
    if (!data) throw std::bad_alloc();
  }
  ~AlignedBuffer() { std::free(data); }
  AlignedBuffer(const AlignedBuffer&) = delete;
  AlignedBuffer& operator=(const AlignedBuffer&) = delete;
  std::uint8_t* const data;
};

// The speed of the bare disk for comparison, with a file beside the map.
class RawFile {
 public:
  static constexpr std::size_t kBytes = std::size_t{512} << 20;

  explicit RawFile(const std::string& path) : path_(path) {
    fd_ = ::open(path.c_str(), O_CREAT | O_RDWR | O_DIRECT | O_CLOEXEC, 0600);
    if (fd_ < 0) throw StatusError(Status(Reason::IO_ERROR, path + ": no direct I/O"));
    constexpr std::size_t kBlock = std::size_t{4} << 20;
    const AlignedBuffer block(kBlock);
    std::mt19937_64 random(1);
    for (std::size_t i = 0; i < kBlock; ++i) block.data[i] = static_cast<std::uint8_t>(random());
    const auto start = Clock::now();
    for (std::size_t done = 0; done < kBytes; done += kBlock)
      if (::write(fd_, block.data, kBlock) != static_cast<ssize_t>(kBlock)) fail();
    if (::fdatasync(fd_) != 0) fail();
    write_mb_s_ = static_cast<double>(kBytes) / 1e6 / seconds_since(start);
  }
  ~RawFile() {
    ::close(fd_);
    ::unlink(path_.c_str());
  }
  RawFile(const RawFile&) = delete;
  RawFile& operator=(const RawFile&) = delete;

  double write_mb_s() const { return write_mb_s_; }
  // Time of a read somewhere, microseconds.
  double read_us(std::size_t size, std::mt19937_64& random) const {
    const std::size_t whole = (size + kPage - 1) / kPage * kPage;
    const AlignedBuffer buffer(whole);
    const auto offset = static_cast<off_t>(random() % ((kBytes - whole) / kPage) * kPage);
    const auto start = Clock::now();
    if (::pread(fd_, buffer.data, whole, offset) != static_cast<ssize_t>(whole)) fail();
    return microseconds_since(start);
  }

 private:
  [[noreturn]] void fail() const { throw StatusError(Status(Reason::IO_ERROR, path_)); }
  const std::string path_;
  int fd_ = -1;
  double write_mb_s_ = 0;
};

// Reads chunks that nobody has read yet, and as many raw bytes in turn, while the map grows.
class ChunkReader {
 public:
  ChunkReader(const storage::Engine& engine, std::shared_ptr<storage::Budget> budget, const RawFile& raw)
      : engine_(engine), budget_(std::move(budget)), raw_(raw), thread_([this] { run(); }) {}
  ~ChunkReader() { stop(); }
  void stop() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  void grown_to(std::uint32_t frames) { frames_ = frames; }  // committed
  const std::vector<double>& chunk_us() const { return chunk_us_; }
  const std::vector<double>& raw_us() const { return raw_us_; }

 private:
  void run() {
    std::mt19937_64 random(2);
    std::size_t bytes = kPage;
    for (std::uint32_t next = 0; !stopping_;) {
      // Not the chunks written last, which caches may still hold.
      if (frames_ / storage::kFramesPerChunk < next + 100) {
        pause();
        continue;
      }
      // Each after a pause, in random order, so that the disk is equally busy for both.
      const bool raw_first = random() % 2 == 0;
      if (raw_first) read_raw(bytes, random);
      bytes = read_chunk({kSession, next++});
      if (!raw_first) read_raw(bytes, random);
    }
  }
  static void pause() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }
  void read_raw(std::size_t bytes, std::mt19937_64& random) {
    pause();
    raw_us_.push_back(raw_.read_us(bytes, random));
  }
  std::size_t read_chunk(storage::ChunkId id) {
    pause();
    const auto snapshot = engine_.snapshot();
    const auto start = Clock::now();
    const auto loaded = storage::load_packed<storage::FrameHot>(*snapshot, id, budget_);
    const bool sound = loaded.commit != 0 && loaded.part->sound();
    chunk_us_.push_back(microseconds_since(start));
    if (!sound) throw StatusError(Status(Reason::DATA_LOSS, "chunk " + id.to_string()));
    return loaded.part->record(0).owner->size();  // of the whole chunk
  }

  const storage::Engine& engine_;
  const std::shared_ptr<storage::Budget> budget_;
  const RawFile& raw_;
  std::vector<double> chunk_us_, raw_us_;
  std::atomic<std::uint32_t> frames_ = 0;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

struct Store {
  std::shared_ptr<storage::Budget> budget;
  std::shared_ptr<storage::Engine> engine;
  std::uint64_t epoch = 0;
  std::unique_ptr<storage::Map> map;

  static Store open(const StorageOptions& options, const std::string& folder) {
    Store store;
    store.budget = std::make_shared<storage::Budget>(options.memory_budget_mb << 20);
    storage::RocksDbOptions how;
    how.cache_bytes = store.budget->allowance(storage::Share::kEngine);
    store.engine = storage::open_rocksdb(folder, how).or_throw();
    store.epoch = store.engine->acquire().or_throw();
    store.map = storage::Map::open(store.engine, store.epoch, store.budget).or_throw();
    return store;
  }
  // As in the mapper, the disk writes while the next records are applied.
  void begin_commit() {
    if (Status status = map->begin_commit({}); !status.ok()) throw StatusError(status);
    budget->set(storage::Share::kEngine, engine->memory_bytes());
  }
  void finish_commit() {
    if (const auto status = map->finish_commit(); status && !status->ok()) throw StatusError(*status);
    budget->set(storage::Share::kEngine, engine->memory_bytes());
  }
};

// The first frames breadth-first from `root`, each with its landmarks; how many landmarks there were.
std::size_t read_neighbourhood(const storage::Graph& graph, FrameId root) {
  std::vector<FrameId> found{root};
  std::size_t landmarks = 0;
  for (std::size_t i = 0; i < found.size() && i < kNeighbourhood; ++i) {
    const auto hot = graph.hot(found[i]);
    landmarks += hot->landmarks.size();
    for (const storage::Neighbour& step : storage::neighbours(graph, found[i], *hot))
      if (std::find(found.begin(), found.end(), step.frame) == found.end()) found.push_back(step.frame);
  }
  return landmarks;
}

double time_of_neighbourhood(const storage::Graph& graph, FrameId root) {
  const auto start = Clock::now();
  if (read_neighbourhood(graph, root) == 0) throw StatusError(Status(Reason::DATA_LOSS, root.to_string()));
  return microseconds_since(start);
}

// Makes keyframes and has the journal hold them, a group at a time and some groups ahead of the map: on two threads, as
// the intake and the journal of the daemon.
class JournalThreads {
 public:
  struct Group {
    std::vector<Keyframe> keyframes;
    std::vector<std::uint32_t> crcs;
    std::vector<Bytes> records;
    std::uint64_t before = 0;  // journal sequence before the first of them
  };

  JournalThreads(std::uint32_t frames, SessionNumber session, KeyframeLoad load, const Store& store)
      : engine_(store.engine), epoch_(store.epoch), session_(session), load_(std::move(load)) {
    maker_ = std::thread([this, frames] {
      for (std::uint32_t made = 0; made < frames; made += kGroup)
        if (!made_.push(make(std::min<std::size_t>(kGroup, frames - made)))) return;
    });
    journal_ = std::thread([this] {
      try {
        while (auto group = made_.pop()) {
          group->before = engine_->append(epoch_, group->records).or_throw() - group->records.size();
          group->records.clear();
          if (!durable_.push(std::move(*group))) return;
        }
      } catch (...) {
        failure_ = std::current_exception();
        durable_.close();
      }
    });
  }
  ~JournalThreads() {
    made_.cancel();
    durable_.cancel();
    maker_.join();
    journal_.join();
  }

  Group next() {
    auto group = durable_.pop();
    if (!group) std::rethrow_exception(failure_);
    return std::move(*group);
  }
  // Of all that was made; to be asked for after the last group has come.
  double payload_bytes() const { return payload_bytes_; }
  double zstd_bytes() const { return zstd_bytes_; }

 private:
  Group make(std::size_t count) {
    Group group;
    while (group.keyframes.size() < count) {
      group.keyframes.push_back(load_.next());
      storage::KeyframeRecord record{session_, 0, encode_keyframe(group.keyframes.back())};
      record.crc = crc32c(record.payload);
      group.crcs.push_back(record.crc);
      payload_bytes_ += static_cast<double>(record.payload.size());
      if (group.keyframes.back().sequence % 64 == 0) {
        compressed_.resize(ZSTD_compressBound(record.payload.size()));
        zstd_bytes_ += 64 * static_cast<double>(ZSTD_compress(compressed_.data(), compressed_.size(),
                                                              record.payload.data(), record.payload.size(), 3));
      }
      group.records.push_back(storage::encode_record(storage::JournalRecord(std::move(record)), 0));
    }
    return group;
  }

  const std::shared_ptr<storage::Engine> engine_;
  const std::uint64_t epoch_;
  const SessionNumber session_;
  KeyframeLoad load_;
  Bytes compressed_;
  double payload_bytes_ = 0, zstd_bytes_ = 0;
  tracking::BoundedQueue<Group> made_{kGroupsAhead}, durable_{kGroupsAhead};
  std::exception_ptr failure_;  // before durable_ is closed
  std::thread maker_, journal_;
};

// Writes a long drive to a map.
class Feed {
 public:
  Feed(const StorageOptions& options, std::uint32_t frames, std::uint64_t seed, Store& store)
      : store_(store), frames_(frames), number_(store.engine->allocate_session(store.epoch).or_throw()) {
    KeyframeLoad load(options.light ? kLightLoad : LoadSize{}, seed);
    storage::Session session;
    session.number = number_;
    session.header = load.header();
    session.display_name = load.header().name;
    store.map->add_session(session);
    journal_ = std::make_unique<JournalThreads>(frames, number_, std::move(load), store);
  }

  std::uint32_t done() const { return done_; }
  std::uint32_t committed() const { return committed_; }
  const JournalThreads& journal() const { return *journal_; }

  // The next group of keyframes; microseconds of each update.
  std::vector<double> step() {
    std::vector<double> update_us;
    auto group = journal_->next();
    for (std::size_t i = 0; i < group.keyframes.size(); ++i, ++done_) {
      const auto before = Clock::now();
      add_frame(*store_.map, number_, group.before + i + 1, group.crcs[i], std::move(group.keyframes[i]));
      store_.map->publish();
      if (store_.map->commit_is_due() || Clock::now() - last_commit_ > std::chrono::seconds(1)) {
        store_.begin_commit();  // when it returns, the one before is through
        committed_ = begun_;
        begun_ = done_;
        last_commit_ = Clock::now();
      }
      update_us.push_back(microseconds_since(before));
    }
    if (done_ == frames_) {
      store_.begin_commit();
      store_.finish_commit();
    }
    return update_us;
  }

 private:
  Store& store_;
  const std::uint32_t frames_;
  const SessionNumber number_;
  std::unique_ptr<JournalThreads> journal_;
  std::uint32_t done_ = 0, begun_ = 0, committed_ = 0;
  Clock::time_point last_commit_ = Clock::now();
};

struct Ingest {
  std::vector<double> early_us, late_us;  // updates around frame 10,000, and the last
  double seconds = 0, cpu_seconds = 0;
  double payload_bytes = 0, zstd_bytes = 0;
};

Ingest ingest(const StorageOptions& options, Store& store, ChunkReader& reader) {
  Ingest result;
  const auto start = Clock::now();
  const double cpu_start = cpu_seconds();
  Feed feed(options, options.frames, options.seed, store);
  while (feed.done() < options.frames) {
    const std::uint32_t first = feed.done();
    const std::vector<double> us = feed.step();
    reader.grown_to(feed.committed());
    if (first + kReportedUpdates >= kSmallMap && first < kSmallMap + kReportedUpdates)
      result.early_us.insert(result.early_us.end(), us.begin(), us.end());
    if (first + 2 * kReportedUpdates >= options.frames)
      result.late_us.insert(result.late_us.end(), us.begin(), us.end());
  }
  result.seconds = seconds_since(start);
  result.cpu_seconds = cpu_seconds() - cpu_start;
  result.payload_bytes = feed.journal().payload_bytes();
  result.zstd_bytes = feed.journal().zstd_bytes();
  return result;
}

// Updates by a new session of the map and of one of 5,000 to 15,000 keyframes, in turn, so that all else is the same
// for both: what the threads beside them and the rest of the machine are at changes more between two minutes than
// either figure. Each has the time of the other's turn to finish its commit.
void measure_updates(const StorageOptions& options, Store& store, const std::string& folder, Report& report) {
  Store small_store = Store::open(options, folder);
  Feed before(options, kSmallMap - kReportedUpdates, options.seed, small_store);
  while (before.done() < kSmallMap - kReportedUpdates) (void)before.step();
  Feed small(options, 2 * kReportedUpdates, options.seed + 2, small_store),
      large(options, 2 * kReportedUpdates, options.seed + 2, store);
  std::vector<double> small_us, large_us;
  const auto append = [](std::vector<double>& all, const std::vector<double>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  while (large.done() < 2 * kReportedUpdates) {
    append(small_us, small.step());
    append(large_us, large.step());
  }
  report.add("update_in_turn_p50_us", quantile(large_us, 0.5), "10,000 keyframes more, by another session");
  report.add("update_in_turn_p99_us", quantile(large_us, 0.99), "");
  report.add("update_in_turn_p50_us_at_10k", quantile(small_us, 0.5), "as many of a map of 10,000, in turn");
  report.add("update_in_turn_p99_us_at_10k", quantile(small_us, 0.99), "");
}

// What a worker reads of the map while its robot drives through `frames` frames from `first` on: round each the nearest
// with their landmarks and observations. Microseconds a frame.
double time_of_drive(const storage::Graph& graph, FrameId first, std::uint32_t frames) {
  const auto start = Clock::now();
  for (std::uint32_t k = 0; k < frames; ++k) {
    const FrameId at{first.session, first.index + k};
    read_neighbourhood(graph, at);
    for (std::uint32_t back = 0; back <= std::min<std::uint32_t>(at.index, kNeighbourhood / 2); ++back)
      if (!graph.warm({at.session, at.index - back})) throw StatusError(Status(Reason::DATA_LOSS, at.to_string()));
  }
  return microseconds_since(start) / frames;
}

// Times in turn until one keyframe is durable, and a bare append with fdatasync.
void measure_acknowledgement(const StorageOptions& options, Store& store, const std::string& folder, Report& report) {
  KeyframeLoad load(options.light ? kLightLoad : LoadSize{}, options.seed + 1);
  const std::string path = folder + "/raw-append";
  const int fd = ::open(path.c_str(), O_CREAT | O_WRONLY | O_APPEND | O_CLOEXEC, 0600);
  std::vector<double> ack_us, raw_us;
  for (int k = 0; k < 400; ++k) {
    storage::KeyframeRecord record{kSession, 0, encode_keyframe(load.next())};
    const Bytes bytes = storage::encode_record(storage::JournalRecord(std::move(record)), 0);
    auto start = Clock::now();
    store.engine->append(store.epoch, {&bytes, 1}).or_throw();
    ack_us.push_back(microseconds_since(start));
    start = Clock::now();
    const bool written = ::write(fd, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
    if (!written || ::fdatasync(fd) != 0) throw StatusError(Status(Reason::IO_ERROR, path));
    raw_us.push_back(microseconds_since(start));
  }
  ::close(fd);
  ::unlink(path.c_str());
  report.add("ack_p50_us", quantile(ack_us, 0.5), "one keyframe appended to the journal and durable");
  report.add("raw_append_p50_us", quantile(raw_us, 0.5), "as many bytes by write and fdatasync, in turn");
}

void run(const StorageOptions& options, Report& report) {
  std::optional<storage::TemporaryFolder> own;
  if (options.data.empty()) own.emplace();
  const std::string base = own ? *own / "" : options.data;
  std::filesystem::create_directories(base);
  const std::string folder = base + "/map";
  if (std::filesystem::exists(folder))
    throw StatusError(Status(Reason::INVALID_ARGUMENT, folder + " exists: give another --data"));
  const RawFile raw(base + "/raw");

  Ingest taken;
  double written = device_bytes_written();
  {
    Store store = Store::open(options, folder);
    ChunkReader reader(*store.engine, store.budget, raw);
    taken = ingest(options, store, reader);
    reader.stop();
    const auto settling = Clock::now();
    store.map.reset();
    store.engine.reset();
    written = device_bytes_written() - written;
    report.add("frames", options.frames, "");
    report.add("budget_mb", static_cast<double>(options.memory_budget_mb), "");
    report.add("ingest_frames_per_s", options.frames / taken.seconds, "making the keyframes, journal and map");
    report.add("cores_busy", taken.cpu_seconds / taken.seconds, "meanwhile");
    report.add("write_mb_s", written / 1e6 / taken.seconds, "to the device, meanwhile");
    report.add("raw_write_mb_s", raw.write_mb_s(), "one file written in order by direct I/O");
    report.add("close_s", seconds_since(settling), "");
    report.add("payload_bytes_per_frame", taken.payload_bytes / options.frames, "as the robot sends it");
    report.add("payload_zstd_bytes_per_frame", taken.zstd_bytes / options.frames,
               "the same after zstd -3, each by itself");
    report.add("disk_bytes_per_frame", folder_bytes(folder) / options.frames,
               "map and journal, garbage included (without the reserve, 64 MiB)");
    report.add("write_amplification", written / taken.payload_bytes, "bytes written to the device over payload");
    report.add("update_p50_us", quantile(taken.late_us, 0.5), "apply, publish and commit; the last 10,000 keyframes");
    report.add("update_p99_us", quantile(taken.late_us, 0.99), "");
    report.add("update_p50_us_at_10k", quantile(taken.early_us, 0.5), "the same around keyframe 10,000");
    report.add("update_p99_us_at_10k", quantile(taken.early_us, 0.99), "");
    report.add("chunk_reads", static_cast<double>(reader.chunk_us().size()),
               "during ingest, of chunks read for the first time");
    report.add("chunk_read_p50_us", quantile(reader.chunk_us(), 0.5), "hot part, checksums verified");
    report.add("chunk_read_p99_us", quantile(reader.chunk_us(), 0.99), "");
    report.add("raw_read_p50_us", quantile(reader.raw_us(), 0.5), "direct read of as many bytes, in turn");
    report.add("raw_read_p99_us", quantile(reader.raw_us(), 0.99), "");
  }

  std::mt19937_64 random(options.seed);
  const auto anywhere = [&] { return FrameId{kSession, static_cast<std::uint32_t>(random() % options.frames)}; };
  const auto opening = Clock::now();
  Store store = Store::open(options, folder);
  time_of_neighbourhood(*store.map->view(), anywhere());
  report.add("open_s", seconds_since(opening), "to the first answer");
  std::vector<double> cold_us, warm_us;
  for (int k = 0; k < 300; ++k) {
    const FrameId root = anywhere();
    cold_us.push_back(time_of_neighbourhood(*store.map->view(), root));
    for (int again = 0; again < 5; ++again) warm_us.push_back(time_of_neighbourhood(*store.map->view(), root));
  }
  report.add("cold_neighbourhood_p50_us", quantile(cold_us, 0.5), "20 frames with landmarks, anywhere");
  report.add("warm_neighbourhood_p50_us", quantile(warm_us, 0.5), "the same again");
  // The most that reading ahead of a robot could save.
  std::vector<double> cold_drive_us, warm_drive_us;
  constexpr std::uint32_t kDrive = 640;
  for (int k = 0; k < 20; ++k) {
    const FrameId first{kSession, static_cast<std::uint32_t>(random() % (options.frames - kDrive))};
    cold_drive_us.push_back(time_of_drive(*store.map->view(), first, kDrive));
    warm_drive_us.push_back(time_of_drive(*store.map->view(), first, kDrive));
  }
  report.add("cold_drive_us_per_frame", quantile(cold_drive_us, 0.5),
             "640 frames on end, round each the nearest 20 with landmarks and observations");
  report.add("warm_drive_us_per_frame", quantile(warm_drive_us, 0.5), "the same again");
  measure_acknowledgement(options, store, base, report);
  report.add("rss_max_mb", static_cast<double>(ops::peak_resident_bytes()) / (1 << 20),
             "peak resident size, all of the above");
  measure_updates(options, store, base + "/small", report);
}

}  // namespace

Run declare_storage(CLI::App& app) {
  auto options = std::make_shared<StorageOptions>();
  app.add_option("--frames", options->frames, "Keyframes to take in")
      ->check(CLI::Range(20'000U, 100'000'000U))
      ->capture_default_str();
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "Memory budget, MiB")
      ->check(CLI::Range(16U, 1U << 20))
      ->capture_default_str();
  app.add_flag("--light", options->light, "45 observations, 12 landmarks, no appearance (else 120, 40, 300 features)");
  app.add_option("--data", options->data, "Folder for the map, which is kept (default: a temporary one)");
  app.add_option("--seed", options->seed, "Seed of the content")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
