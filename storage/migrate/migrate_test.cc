#include "storage/migrate/migrate.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "storage/maintenance/verify.h"
#include "storage/map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"

namespace relmap {
namespace {

// Of relmap 0.1.0: 90 keyframes of two laps with 10 loop closures and two labels; see tests/fixtures/README.md.
constexpr const char* kFormat1 = RELMAP_SOURCE_DIR "/tests/fixtures/map-format-1.tar.xz";

class Migrate : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(map_);
    ASSERT_EQ(std::system(("tar -C " + map_ + " -xJf " + kFormat1).c_str()), 0);
  }
  void write_format(const std::string& line) const { std::ofstream(map_ + "/FORMAT") << line << '\n'; }

  // What the fixture's daemon said of its map.
  void expect_the_map() const {
    auto engine = open_rocksdb(map_, {}).or_throw();
    const std::uint64_t epoch = engine->acquire().or_throw();
    const auto map = Map::open(engine, epoch, std::make_shared<Budget>(std::size_t{64} << 20)).or_throw();
    EXPECT_EQ(map->state().keyframes, 90U);
    EXPECT_EQ(map->state().closures_accepted, 10U);
    EXPECT_EQ(map->labelled("dock"), (std::vector<FrameId>{{1, 7}}));
    EXPECT_EQ(map->labelled("Trafalgar Square"), (std::vector<FrameId>{{1, 33}}));
    for (std::uint32_t i = 0; i < 90; ++i) {
      const auto cold = map->cold({1, i});
      EXPECT_GT(cold->appearance.size(), 20U);
      EXPECT_EQ(cold->appearance.size(), map->hot({1, i})->appearance_count);
      EXPECT_EQ(cold->words.size(), cold->appearance.size());
      EXPECT_GT(map->warm({1, i})->observations.size(), 20U);
    }
    // Of its `relmap edges --json`.
    const auto edge = find_edge(*map, {{1, 1}, 0});
    ASSERT_TRUE(edge);
    EXPECT_NEAR(edge->T_ab.t.z(), 0.19244786469131184, 1e-8);
    std::vector<std::string> findings;
    const auto verified =
        verify(*map->view(), {}, [&](const Finding& finding) { findings.push_back(finding.what); }, {});
    ASSERT_TRUE(verified.ok()) << verified.status().to_string();
    EXPECT_EQ(verified->frames, 90U);
    EXPECT_EQ(findings, std::vector<std::string>{});
    EXPECT_EQ(engine->allocate_session(epoch).or_throw(), 2U);
    EXPECT_EQ(engine->last_journal_sequence(), map->state().applied_sequence);
  }

  const TemporaryFolder folder_;
  const std::string map_ = folder_ / "map";
};

TEST_F(Migrate, BringsAMapOfFormat1ToThePresentOneAndKeepsTheOld) {
  EXPECT_EQ(open_rocksdb(map_, {}).status().reason(), Reason::UNKNOWN_FORMAT_VERSION);
  std::uint64_t last = 0;
  const auto summary = migrate_folder(map_ + "/", [&](std::uint64_t done, std::uint64_t total) {
    EXPECT_EQ(total, 90U);
    last = done;
  });
  ASSERT_TRUE(summary.ok()) << summary.status().to_string();
  EXPECT_EQ(summary->from, 1);
  EXPECT_EQ(summary->to, 2);
  EXPECT_EQ(summary->frames, 90U);
  EXPECT_EQ(last, 90U);
  EXPECT_EQ(summary->kept, map_ + ".format-1");
  EXPECT_TRUE(std::filesystem::exists(summary->kept + "/FORMAT"));
  EXPECT_FALSE(std::filesystem::exists(map_ + ".migrating"));
  expect_the_map();

  const auto again = migrate_folder(map_, {});
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->from, again->to);
  EXPECT_EQ(again->kept, "");
}

TEST_F(Migrate, BeginsAnewAfterAnInterruption) {
  std::filesystem::create_directories(map_ + ".migrating/map");
  std::ofstream(map_ + ".migrating/map/CURRENT") << "half\n";
  ASSERT_TRUE(migrate_folder(map_, {}).ok());
  expect_the_map();
}

TEST_F(Migrate, FinishesWhatWasInterruptedAfterTheMapsChangedPlaces) {
  ASSERT_TRUE(migrate_folder(map_, {}).ok());
  std::filesystem::rename(map_ + ".format-1", map_ + ".migrating");
  const auto summary = migrate_folder(map_, {});
  ASSERT_TRUE(summary.ok());
  EXPECT_EQ(summary->kept, map_ + ".format-1");
  expect_the_map();
}

TEST_F(Migrate, RefusesWhatItDoesNotKnow) {
  write_format("relmap map 3");
  EXPECT_EQ(migrate_folder(map_, {}).reason(), Reason::UNKNOWN_FORMAT_VERSION);
  write_format("relmap map 0");
  EXPECT_EQ(migrate_folder(map_, {}).reason(), Reason::UNKNOWN_FORMAT_VERSION);
  write_format("another product's file");
  EXPECT_EQ(migrate_folder(map_, {}).reason(), Reason::UNKNOWN_FORMAT_VERSION);
  EXPECT_EQ(migrate_folder(folder_ / "nothing", {}).reason(), Reason::NO_SUCH_FILE);
}

TEST_F(Migrate, RefusesAFolderInUse) {
  RocksDbOptions options;
  options.read_only = true;
  options.format = 1;
  const auto owner = open_rocksdb(map_, options).or_throw();
  EXPECT_EQ(migrate_folder(map_, {}).reason(), Reason::FOLDER_LOCKED);
}

TEST_F(Migrate, NamesDamageAndLeavesTheFolderAsItIs) {
  const std::string log = map_ + "/map/000004.log";
  std::fstream file(log, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(log) / 2));
  file << "damage";
  file.close();
  const auto result = migrate_folder(map_, {});
  EXPECT_EQ(result.reason(), Reason::DATA_LOSS);
  EXPECT_TRUE(std::filesystem::exists(map_ + "/FORMAT"));
  EXPECT_FALSE(std::filesystem::exists(map_ + ".format-1"));
}

}  // namespace
}  // namespace relmap
