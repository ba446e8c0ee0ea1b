// A disk that is really full or read-only: a small file system in memory, which only root can mount. Injected disk
// faults are tested elsewhere (rocksdb_faults_test, mapper_test).
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>

#include "server/map/mapper.h"
#include "server/map/testing/points_drive.h"
#include "storage/maintenance/verify.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::testing {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr std::uint32_t kFrames = 1500;

// Mounted for this process alone, and gone with it.
class SmallDisk {
 public:
  explicit SmallDisk(const std::string& folder) : folder_(folder) {
    std::filesystem::create_directories(folder);
    // Not to be seen outside, nor to be left behind.
    mounted_ = ::unshare(CLONE_NEWNS) == 0 && ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               ::mount("none", folder.c_str(), "tmpfs", 0, "size=64m") == 0;
    if (!mounted_) why_ = std::strerror(errno);
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(folder_.c_str(), MNT_DETACH);
  }
  bool mounted() const { return mounted_; }
  const std::string& why() const { return why_; }

  void fill() const {
    std::ofstream ballast(folder_ + "/ballast", std::ios::binary | std::ios::app);
    const std::string block(4096, 'x');
    while (ballast.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) continue;
  }
  void free() const { std::filesystem::remove(folder_ + "/ballast"); }
  int make_read_only(bool read_only) const {
    return ::mount("none", folder_.c_str(), nullptr, MS_REMOUNT | (read_only ? MS_RDONLY : 0), "size=64m");
  }

 private:
  const std::string folder_;
  bool mounted_ = false;
  std::string why_;
};

class FullDisk : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!disk_.mounted()) GTEST_SKIP() << "NOT RUN: no file system can be mounted here: " << disk_.why();
    sim::PointsWorldOptions options;
    options.frames = kFrames;
    options.frames_per_lap = 200;
    options.appearance = 60;
    world_ = std::make_unique<sim::PointsWorld>(options);
  }

  void open() {
    storage::RocksDbOptions options;
    options.cache_bytes = std::size_t{8} << 20;
    options.or_read_only = true;
    engine_ = storage::open_rocksdb(folder_ / "disk/data", options).or_throw();
    map::MapperOptions map_options;
    map_options.closures = false;
    map_options.commit_interval = 50ms;
    map_options.folder = folder_ / "disk/data";
    mapper_ = map::Mapper::open(engine_, std::make_shared<storage::Budget>(std::size_t{64} << 20), nullptr, map_options)
                  .or_throw();
  }
  void close() {
    mapper_.reset();
    engine_.reset();
  }

  // As a robot does: what is not taken is sent again. Ends at `to`, or when `until` holds.
  void feed(std::uint32_t to, const std::function<bool()>& until) {
    const auto deadline = steady_clock::now() + 100s;
    auto session = mapper_->begin_session(world_->keyframe(0).session);
    while (next_ < to && !until()) {
      ASSERT_LT(steady_clock::now(), deadline) << mapper_->stats().storage.to_string();
      if (!session.ok()) session = mapper_->begin_session(world_->keyframe(0).session);
      Result<std::uint64_t> durable = session.status();
      if (session.ok()) {
        storage::KeyframeRecord record = map::keyframe_record(*world_, next_);
        record.session = *session;
        durable = mapper_->submit_and_wait(std::move(record));
      }
      if (durable.ok())
        ++next_;
      else
        std::this_thread::sleep_for(10ms);
    }
  }
  void feed(std::uint32_t to) {
    feed(to, [] { return false; });
  }

  void expect_everything() {
    ASSERT_TRUE(mapper_->wait_idle(steady_clock::now() + 60s).ok());
    const auto view = mapper_->view();
    EXPECT_EQ(view->sessions().at(0).frames, next_);
    for (std::uint32_t i = 0; i < next_; ++i) EXPECT_TRUE(view->hot({1, i})) << i;
  }
  void expect_clean() {
    const auto found = [](const storage::Finding& f) { ADD_FAILURE() << f.frame.to_string() << " " << f.what; };
    EXPECT_TRUE(storage::verify(*engine_->snapshot(), {}, found, {}).ok());
    EXPECT_TRUE(storage::verify_journal(*engine_, found, {}).ok());
  }

  const storage::TemporaryFolder folder_;
  const SmallDisk disk_{folder_ / "disk"};
  std::unique_ptr<sim::PointsWorld> world_;
  std::shared_ptr<storage::Engine> engine_;
  std::unique_ptr<map::Mapper> mapper_;
  std::uint32_t next_ = 0;
};

TEST_F(FullDisk, HoldsRobotsBackServesWhatThereIsAndGoesOnByItself) {
  open();
  feed(100);
  for (int time = 0; time < 3; ++time) {
    const std::uint32_t before = next_;
    std::thread other([&] { disk_.fill(); });  // while keyframes come
    feed(kFrames, [&] { return mapper_->stats().storage.reason() == Reason::DISK_FULL; });
    other.join();
    EXPECT_LT(next_, kFrames);
    std::this_thread::sleep_for(500ms);  // commits take the reserve, if they need it
    const Status storage = mapper_->stats().storage;
    EXPECT_EQ(storage.reason(), Reason::DISK_FULL) << storage.to_string();
    EXPECT_EQ(mapper_->submit_and_wait(storage::IdleWorkRecord{1}).reason(), Reason::DISK_FULL);
    EXPECT_TRUE(mapper_->view()->hot({1, 50}));
    if (time == 1) {  // and stopped meanwhile
      close();
      open();
      EXPECT_GE(mapper_->view()->sessions().at(0).frames, before) << "nothing acknowledged is lost";
      EXPECT_EQ(mapper_->view()->sessions().at(0).next_sequence, next_);
    }
    disk_.free();
    if (mapper_->stats().storage.reason() == Reason::READ_ONLY) {  // not even the reserve was enough to begin with
      close();
      open();
    }
    feed(next_ + 100);
    EXPECT_TRUE(mapper_->stats().storage.ok()) << mapper_->stats().storage.to_string();
  }
  expect_everything();
  close();
  open();
  expect_everything();
  expect_clean();
}

TEST_F(FullDisk, AReadOnlyDiskIsServedAndNothingIsTakenIn) {
  open();
  feed(100);
  close();
  ASSERT_EQ(disk_.make_read_only(true), 0) << std::strerror(errno);
  open();
  EXPECT_EQ(mapper_->view()->sessions().at(0).frames, 100u);
  EXPECT_TRUE(mapper_->view()->hot({1, 99}));
  EXPECT_EQ(mapper_->submit_and_wait(storage::IdleWorkRecord{1}).reason(), Reason::READ_ONLY);
  sim::PointsWorldOptions other;
  other.frames = 1;
  other.uuid = SessionUuid::random();
  EXPECT_EQ(mapper_->begin_session(sim::PointsWorld(other).keyframe(0).session).reason(), Reason::READ_ONLY);
  EXPECT_EQ(mapper_->stats().storage.reason(), Reason::READ_ONLY);
  EXPECT_THAT(mapper_->stats().storage.message(), ::testing::HasSubstr("Read-only file system"));
  close();
  ASSERT_EQ(disk_.make_read_only(false), 0);
  open();
  feed(200);
  expect_everything();
  expect_clean();
}

}  // namespace
}  // namespace relmap::testing
