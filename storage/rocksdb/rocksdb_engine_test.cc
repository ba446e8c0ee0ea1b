#include "storage/rocksdb/rocksdb_engine.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "storage/map.h"
#include "storage/testing/engine_conformance.h"
#include "storage/testing/random_frames.h"
#include "storage/testing/temporary_folder.h"

namespace relmap {
namespace {

namespace fs = std::filesystem;

EngineStore rocksdb_store() {
  auto folder = std::make_shared<TemporaryFolder>();
  return {[folder] { return open_rocksdb(*folder / "data").value(); }, true};
}

INSTANTIATE_TEST_SUITE_P(OnDisk, EngineConformance, ::testing::Values(EngineKind{"RocksDb", rocksdb_store}),
                         [](const auto& kind) { return kind.param.name; });

TEST(RocksDbEngine, ASecondOwnerOfTheFolderIsRefused) {
  const TemporaryFolder folder;
  const auto first = open_rocksdb(folder / "data");
  ASSERT_TRUE(first.ok()) << first.status().to_string();
  EXPECT_EQ(open_rocksdb(folder / "data").reason(), Reason::FOLDER_LOCKED);
}

TEST(RocksDbEngine, AnUnknownFormatIsRefusedByName) {
  const TemporaryFolder folder;
  ASSERT_TRUE(open_rocksdb(folder / "data").ok());
  std::ofstream(folder / "data/FORMAT") << "relmap map 999\n";
  EXPECT_EQ(open_rocksdb(folder / "data").reason(), Reason::UNKNOWN_FORMAT_VERSION);
}

TEST(RocksDbEngine, ReadOnlyRefusesWrites) {
  const TemporaryFolder folder;
  const std::vector<Bytes> records{{1}, {2}};
  {
    const auto engine = open_rocksdb(folder / "data").value();
    const auto epoch = engine->acquire().value();
    ASSERT_TRUE(engine->append(epoch, records).ok());
    const std::vector<Put> puts{{"k", {5}}};
    ASSERT_TRUE(engine->commit(epoch, 1, puts, {}).ok());
  }
  RocksDbOptions options;
  options.read_only = true;
  EXPECT_EQ(open_rocksdb(folder / "nothing", options).reason(), Reason::NO_SUCH_FILE);
  const auto engine = open_rocksdb(folder / "data", options).value();
  EXPECT_EQ(engine->acquire().reason(), Reason::READ_ONLY);
  EXPECT_EQ(engine->append(1, records).reason(), Reason::READ_ONLY);
  EXPECT_EQ(engine->commit(1, 2, {}, {}).reason(), Reason::READ_ONLY);
  EXPECT_EQ(engine->last_journal_sequence(), 2u);
  EXPECT_EQ(engine->snapshot()->get("k").value(), Bytes{5});
}

TEST(RocksDbEngine, ACheckpointOpensAsTheMapItWasTakenFrom) {
  const TemporaryFolder folder;
  const auto engine = open_rocksdb(folder / "data").value();
  const auto epoch = engine->acquire().value();
  const std::vector<Bytes> records{{1}, {2}, {3}};
  ASSERT_TRUE(engine->append(epoch, records).ok());
  const std::vector<Put> puts{{"k", Bytes(50000, 5)}};
  ASSERT_TRUE(engine->commit(epoch, 2, puts, {}).ok());
  ASSERT_TRUE(engine->checkpoint(folder / "copy").ok());
  EXPECT_EQ(engine->checkpoint(folder / "copy").reason(), Reason::IO_ERROR);

  const auto copy = open_rocksdb(folder / "copy").value();
  EXPECT_EQ(copy->applied_sequence(), 2u);
  EXPECT_EQ(copy->last_journal_sequence(), 3u);
  EXPECT_EQ(copy->snapshot()->get("k").value(), Bytes(50000, 5));
}

TEST(RocksDbEngine, ALostJournalRecordIsNamed) {
  const TemporaryFolder folder;
  {
    const auto engine = open_rocksdb(folder / "data").value();
    const auto epoch = engine->acquire().value();
    for (std::uint8_t i = 1; i <= 5; ++i) {
      const std::vector<Bytes> records{Bytes(100, i)};
      ASSERT_TRUE(engine->append(epoch, records).ok());
    }
  }
  const auto segment = fs::directory_iterator(folder / "data/journal")->path();
  std::fstream file(segment, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(24 + 2 * 124 + 60);  // in the third record
  file.put(9);
  file.close();
  const auto engine = open_rocksdb(folder / "data").value();
  std::uint64_t last = 0;
  const Status read = engine->read_journal(1, [&](std::uint64_t sequence, ByteSpan) {
    last = sequence;
    return true;
  });
  EXPECT_EQ(last, 2u);
  EXPECT_EQ(read.reason(), Reason::DATA_LOSS);
  EXPECT_NE(read.message().find("3..4"), std::string::npos) << read.message();
  const std::vector<Bytes> records{{1}};
  EXPECT_EQ(engine->append(engine->acquire().value(), records).reason(), Reason::DATA_LOSS);
}

TEST(RocksDbEngine, AMapComesBackFromDisk) {
  const TemporaryFolder folder;
  RandomFrames random(3);
  MapHash hash;
  {
    const auto engine = open_rocksdb(folder / "data").value();
    auto map = Map::open(engine, engine->acquire().value(), std::make_shared<Budget>(std::size_t{64} << 20)).value();
    Session session;
    session.number = engine->allocate_session(1).value();
    map->add_session(session);
    for (std::uint32_t i = 0; i < 150; ++i) {
      map->add_frame({1, i}, random.hot({1, i}), random.warm(), random.cold());
      map->edit_session(1).last = i;
      ++map->edit_session(1).frames;
      if (i % 20 == 0) {
        ASSERT_TRUE(map->commit().ok());
      }
    }
    ASSERT_TRUE(map->commit().ok());
    hash = hash_map(*map);
  }
  const auto engine = open_rocksdb(folder / "data").value();
  const auto map =
      Map::open(engine, engine->acquire().value(), std::make_shared<Budget>(std::size_t{64} << 20)).value();
  EXPECT_EQ(hash_map(*map), hash);
}

}  // namespace
}  // namespace relmap
