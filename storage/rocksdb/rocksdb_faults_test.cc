// A disk that is full, read-only or broken for a while: what is affected gets an error that names it, the rest answers,
// nothing that was acknowledged is lost, and the engine goes on by itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/rocksdb/testing/faulty_map_files.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::storage {
namespace {

using ::testing::HasSubstr;

class RocksDbFaults : public ::testing::Test {
 protected:
  void TearDown() override { map_faults_->hang = false; }  // the engine waits for its flushes
  void open(const std::string& only = "") {
    RocksDbOptions options;
    options.cache_bytes = std::size_t{8} << 20;  // memtables of 1 MiB
    options.space.ask_every = options.space.believe_failure = std::chrono::milliseconds(0);
    options.journal_files = faulty_files(posix_file_system(), journal_faults_);
    options.map_files = std::make_shared<FaultyMapFiles>(map_faults_, only);
    engine_.reset();
    engine_ = open_rocksdb(folder_ / "data", options).or_throw();
    epoch_ = engine_->acquire().or_throw();
  }

  // A record and the commit that applies it: 100 KB in a table or in a blob file.
  Status append() { return engine_->append(epoch_, std::vector<Bytes>{{1, 2, 3}}).status(); }
  Status commit(std::uint64_t number, std::size_t bytes = 100'000) {
    const auto byte = static_cast<std::uint8_t>(number);
    const std::vector<Put> puts{{"k" + std::to_string(number), Bytes(bytes, byte)}, {"newest", {byte}}};
    return engine_->commit(epoch_, engine_->last_journal_sequence(), puts, {});
  }
  void expect_committed(std::uint64_t through) {
    const auto snapshot = engine_->snapshot();
    for (std::uint64_t number = 1; number <= through; ++number) {
      const auto value = snapshot->get("k" + std::to_string(number)).or_throw();
      EXPECT_TRUE(value && value->front() == static_cast<std::uint8_t>(number)) << number;
    }
    EXPECT_EQ(snapshot->get("newest").or_throw(), Bytes{static_cast<std::uint8_t>(through)});
    EXPECT_FALSE(snapshot->get("k" + std::to_string(through + 1)).or_throw()) << "a commit that failed";
  }
  std::set<std::string> logs() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "data/map"))
      if (entry.path().extension() == ".log") names.insert(entry.path().filename());
    return names;
  }
  bool reserved() const { return std::filesystem::exists(folder_ / "data/RESERVE"); }

  const TemporaryFolder folder_;
  const std::shared_ptr<DiskFaults> journal_faults_ = std::make_shared<DiskFaults>();
  const std::shared_ptr<DiskFaults> map_faults_ = journal_faults_;
  std::shared_ptr<Engine> engine_;
  std::uint64_t epoch_ = 0;
};

TEST_F(RocksDbFaults, BelowTheLowWaterMarkNothingIsTakenInAndCommitsGoOn) {
  open();
  ASSERT_TRUE(append().ok());
  journal_faults_->free = 8 << 20;
  const Status refused = append();
  EXPECT_EQ(refused.reason(), Reason::DISK_FULL);
  EXPECT_THAT(refused.message(), HasSubstr("8 MiB of"));
  EXPECT_EQ(engine_->allocate_session(epoch_).reason(), Reason::DISK_FULL);
  EXPECT_TRUE(commit(1).ok());
  journal_faults_->free = 1 << 20;  // less than RocksDB may need to flush what it has
  const Status held = commit(1);
  EXPECT_EQ(held.reason(), Reason::DISK_FULL);
  EXPECT_THAT(held.message(), HasSubstr("needed for a commit"));
  journal_faults_->free = std::uint64_t{1} << 40;
  EXPECT_TRUE(append().ok());
  EXPECT_EQ(engine_->last_journal_sequence(), 2u);
  EXPECT_TRUE(commit(2).ok());
}

TEST_F(RocksDbFaults, ALogOfRocksDbThatCannotBeWrittenToEndsNothing) {
  const auto faults = std::make_shared<DiskFaults>();
  faults->write = Reason::DISK_FULL;
  RocksDbOptions options;
  options.map_files = std::make_shared<FaultyMapFiles>(faults, "/LOG");
  engine_ = open_rocksdb(folder_ / "data", options).or_throw();
  epoch_ = engine_->acquire().or_throw();
  ASSERT_TRUE(append().ok());
  EXPECT_TRUE(commit(1).ok());
  expect_committed(1);
  (void)open_rocksdb(folder_ / "other").or_throw();
  const auto size = [&](const std::string& data) { return std::filesystem::file_size(folder_ / (data + "/map/LOG")); };
  EXPECT_LT(size("data") * 3, size("other") * 2) << "of each line that fails half is written";
}

TEST_F(RocksDbFaults, ACommitThatFindsTheDiskFullTakesTheReserve) {
  open();
  ASSERT_TRUE(append().ok());
  ASSERT_TRUE(reserved());
  journal_faults_->write = Reason::DISK_FULL;
  journal_faults_->removal_helps = true;
  journal_faults_->free = 0;
  EXPECT_TRUE(commit(1).ok());
  EXPECT_FALSE(reserved());
  EXPECT_EQ(append().reason(), Reason::DISK_FULL) << "what the reserve left is for commits";
  journal_faults_->free = std::uint64_t{1} << 40;
  EXPECT_TRUE(append().ok());
  EXPECT_TRUE(reserved());
  expect_committed(1);
}

struct Fault {
  std::string of;  // which files
  bool sync;       // on sync, otherwise on write
  Reason reason;
};
void PrintTo(const Fault& fault, std::ostream* out) {
  *out << reason_name(fault.reason) << (fault.sync ? " on sync of " : " on write to ") << fault.of;
}

class PassingFault : public RocksDbFaults, public ::testing::WithParamInterface<Fault> {};

TEST_P(PassingFault, PassesWithItsCauseAndLosesNothing) {
  const Fault& fault = GetParam();
  open(fault.of);
  std::uint64_t number = 0;
  ASSERT_TRUE(append().ok());
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(commit(++number).ok());
  const std::string log = *logs().rbegin();
  // Until it strikes: the files of a flush are written beside the commits.
  (fault.sync ? map_faults_->sync : map_faults_->write) = fault.reason;
  Status failed;
  for (int i = 0; i < 60 && failed.ok(); ++i)
    if (failed = commit(number + 1); failed.ok()) ++number;
  EXPECT_EQ(failed.reason(), fault.reason) << failed.to_string() << " after " << number;
  EXPECT_FALSE(commit(number + 1).ok());
  expect_committed(number);

  map_faults_->sync = map_faults_->write = Reason::OK;
  const Status again = commit(++number, 10);
  ASSERT_TRUE(again.ok()) << again.to_string();
  EXPECT_NE(*logs().rbegin(), log) << "the log that failed is written to again";
  for (int i = 0; i < 15; ++i) ASSERT_TRUE(commit(++number).ok());
  ASSERT_TRUE(append().ok());
  expect_committed(number);
  open();
  expect_committed(number);
  EXPECT_EQ(engine_->last_journal_sequence(), 2u);
}

INSTANTIATE_TEST_SUITE_P(Disk, PassingFault,
                         ::testing::Values(Fault{"/", false, Reason::DISK_FULL}, Fault{"/", false, Reason::READ_ONLY},
                                           Fault{"/", true, Reason::IO_ERROR}, Fault{".log", false, Reason::DISK_FULL},
                                           Fault{".log", false, Reason::IO_ERROR},
                                           Fault{".log", true, Reason::IO_ERROR},
                                           Fault{".sst", false, Reason::DISK_FULL},
                                           Fault{".blob", true, Reason::IO_ERROR},
                                           Fault{"MANIFEST", true, Reason::IO_ERROR}));

// Two memtables wait when the first flush fails.
TEST_F(RocksDbFaults, SlowFlushesThatFailAreResumedFrom) {
  open(".sst");
  ASSERT_TRUE(append().ok());
  map_faults_->hang = true;
  std::uint64_t number = 0;
  while (number < 23) ASSERT_TRUE(commit(++number).ok());
  map_faults_->write = Reason::DISK_FULL;
  map_faults_->hang = false;
  Status failed;
  while (failed.ok() && number < 60)
    if (failed = commit(number + 1); failed.ok()) ++number;
  for (int i = 0; i < 2; ++i) EXPECT_EQ(commit(number + 1).reason(), Reason::DISK_FULL) << number;
  map_faults_->write = Reason::OK;
  const Status again = commit(++number);
  ASSERT_TRUE(again.ok()) << again.to_string();
  while (number < 80) ASSERT_TRUE(commit(++number).ok());
  expect_committed(number);
}

class PassingReadFault : public RocksDbFaults, public ::testing::WithParamInterface<const char*> {};

TEST_P(PassingReadFault, OfACompactionPassesWithItsCause) {
  open(GetParam());
  ASSERT_TRUE(append().ok());
  for (int i = 1; i <= 20; ++i) ASSERT_TRUE(commit(i).ok());
  const EngineProgress patient = [](std::uint64_t, std::uint64_t) { return Status(); };
  ASSERT_TRUE(engine_->compact(patient).ok());
  for (int i = 21; i <= 40; ++i) ASSERT_TRUE(commit(i).ok());
  map_faults_->read = Reason::IO_ERROR;
  EXPECT_EQ(engine_->compact(patient).reason(), Reason::IO_ERROR);
  map_faults_->read = Reason::OK;
  ASSERT_TRUE(commit(41).ok());
  const Status again = engine_->compact(patient);
  EXPECT_TRUE(again.ok()) << again.to_string();
  expect_committed(41);
  open();
  expect_committed(41);
}

INSTANTIATE_TEST_SUITE_P(Disk, PassingReadFault, ::testing::Values(".sst", ".blob"));

TEST_F(RocksDbFaults, APartThatCannotBeReadIsNamedAndTheRestAnswers) {
  open();
  ASSERT_TRUE(append().ok());
  ASSERT_TRUE(commit(1).ok());
  open(".blob");  // out of the memtable
  map_faults_->read = Reason::IO_ERROR;
  const auto snapshot = engine_->snapshot();
  const auto broken = snapshot->get("k1");
  EXPECT_EQ(broken.reason(), Reason::IO_ERROR);
  EXPECT_THAT(broken.status().message(), HasSubstr(".blob"));
  EXPECT_EQ(snapshot->get("newest").or_throw(), Bytes{1});
  EXPECT_TRUE(commit(2).ok());
  map_faults_->read = Reason::OK;
  expect_committed(2);
}

}  // namespace
}  // namespace relmap::storage
