#include "storage/migrate/migrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

#include "storage/format/chunk_codec.h"
#include "storage/format/keys.h"
#include "storage/journal/journal_record.h"
#include "storage/journal/journal_segment.h"
#include "storage/maintenance/verify.h"
#include "storage/map/map.h"
#include "storage/migrate/facts.h"
#include "storage/migrate/rehearsal.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/digest_oracle.h"
#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// See tests/fixtures/README.md. The hashes are those that the programs of format 2 computed: of the first fixture
// after they had migrated it, of the second as they had made it.
constexpr const char* kFormat1 = RELMAP_SOURCE_DIR "/tests/fixtures/map-format-1.tar.xz";
constexpr const char* kFormat2 = RELMAP_SOURCE_DIR "/tests/fixtures/map-format-2.tar.xz";
constexpr MapHash kHash1{0x6140cdcef75fba29, 0x07d4e8dac7dd9907};
constexpr MapHash kHash2{0x43f0d141ac3d0a73, 0x588bbff2dc00a3ae};

class Migrate : public ::testing::Test {
 protected:
  void unpack(const char* fixture) const {
    fs::create_directory(map_);
    ASSERT_EQ(std::system(("tar -C " + map_ + " -xJf " + fixture).c_str()), 0);
  }
  void write_format(const std::string& line) const { std::ofstream(map_ + "/FORMAT") << line << '\n'; }

  static std::unique_ptr<Map> open(const std::shared_ptr<Engine>& engine, std::uint64_t epoch) {
    return Map::open(engine, epoch, std::make_shared<Budget>(std::size_t{64} << 20)).or_throw();
  }
  static void expect_sound(const Map& map) {
    EXPECT_TRUE(map.digests_hold());
    EXPECT_EQ(digests_visited(*map.view()), digests_of_frames(map));
    std::vector<std::string> findings;
    const auto verified =
        verify(*map.view(), {}, [&](const Finding& finding) { findings.push_back(finding.what); }, {});
    ASSERT_TRUE(verified.ok()) << verified.status().to_string();
    EXPECT_EQ(verified->frames, map.view()->state().keyframes);
    EXPECT_EQ(findings, std::vector<std::string>{});
  }

  // What the first fixture's daemon said of its map.
  void expect_the_map_of_format1() const {
    auto engine = open_rocksdb(map_, {}).or_throw();
    const std::uint64_t epoch = engine->acquire().or_throw();
    const auto map = open(engine, epoch);
    EXPECT_EQ(hash_map(*map), kHash1);
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
    // From its `relmap edges --json`.
    const auto edge = find_edge(*map, {{1, 1}, 0});
    ASSERT_TRUE(edge);
    EXPECT_NEAR(edge->T_ab.t.z(), 0.19244786469131184, 1e-8);
    expect_sound(*map);
    const auto snapshot = engine->snapshot();
    throw_if(snapshot->scan("", [&](std::string_view key, ByteSpan value) {
      if (const auto part = keys::part_of(key); part && !part->slot) {
        EXPECT_LE(PartReader::open(value, part->part, part->chunk).or_throw().commit(), snapshot->commit_number());
      }
      return true;
    }));
    EXPECT_EQ(engine->allocate_session(epoch).or_throw(), 2U);
    EXPECT_EQ(engine->last_journal_sequence(), map->state().applied_sequence);
  }

  const TemporaryFolder folder_;
  const std::string map_ = folder_ / "map";
};

TEST_F(Migrate, BringsAMapOfFormat1ToThePresentOneAndKeepsTheOld) {
  unpack(kFormat1);
  EXPECT_EQ(open_rocksdb(map_, {}).status().reason(), Reason::UNKNOWN_FORMAT_VERSION);
  std::uint64_t last = 0;
  const auto summary = migrate_folder(map_ + "/", [&](std::uint64_t done, std::uint64_t total) {
    EXPECT_EQ(total, 90U);
    last = done;
  });
  ASSERT_TRUE(summary.ok()) << summary.status().to_string();
  EXPECT_EQ(summary->from, 1);
  EXPECT_EQ(summary->to, 3);
  EXPECT_EQ(summary->frames, 90U);
  EXPECT_EQ(last, 90U);
  EXPECT_EQ(summary->kept, map_ + ".format-1");
  EXPECT_TRUE(fs::exists(summary->kept + "/FORMAT"));
  EXPECT_FALSE(fs::exists(map_ + ".migrating"));
  expect_the_map_of_format1();

  const auto again = migrate_folder(map_, {});
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->from, again->to);
  EXPECT_EQ(again->kept, "");
}

TEST_F(Migrate, TakesAMapOfFormat2OverAsItIs) {
  unpack(kFormat2);
  const auto refused = open_rocksdb(map_, {});
  EXPECT_EQ(refused.reason(), Reason::UNKNOWN_FORMAT_VERSION);
  EXPECT_THAT(refused.status().message(), HasSubstr("relmap-admin migrate"));
  const auto summary = migrate_folder(map_, {});
  ASSERT_TRUE(summary.ok()) << summary.status().to_string();
  EXPECT_EQ(summary->from, 2);
  EXPECT_EQ(summary->to, 3);
  EXPECT_EQ(summary->frames, 137U);
  EXPECT_EQ(summary->kept, map_ + ".format-2");
  EXPECT_FALSE(fs::exists(map_ + ".migrating"));

  MapHash edited;
  {
    auto engine = open_rocksdb(map_, {}).or_throw();
    const std::uint64_t epoch = engine->acquire().or_throw();
    const auto map = open(engine, epoch);
    EXPECT_EQ(hash_map(*map), kHash2);
    expect_sound(*map);
    EXPECT_EQ(map->session(1)->state, SessionState::kFrozen);
    EXPECT_EQ(map->session(2)->state, SessionState::kEnded);
    EXPECT_EQ(map->session(2)->given_up, 3U);
    EXPECT_EQ(map->labelled("dock"), (std::vector<FrameId>{{1, 7}}));
    EXPECT_EQ(map->state().closures_accepted, 10U);
    EXPECT_EQ(map->state().closures_removed, 47U);
    // Its daemon was killed before it had committed the last edit, which stands in a segment without a salt.
    std::vector<std::string> labels;
    ASSERT_TRUE(engine
                    ->read_journal(engine->applied_sequence() + 1,
                                   [&](std::uint64_t, ByteSpan record) {
                                     const auto decoded = decode_record(record);
                                     labels.push_back(std::get<SetLabelRecord>(decoded->record).label);
                                     return true;
                                   })
                    .ok());
    EXPECT_EQ(labels, (std::vector<std::string>{"gate"}));

    const Bytes next = encode_record(IdleWorkRecord{1}, 0);
    ASSERT_TRUE(engine->append(epoch, {&next, 1}).ok());
    map->edit_hot({1, 3}).unknown = {{1000, {1, 2, 3}}};
    ASSERT_TRUE(map->commit().ok());
    edited = hash_map(*map);
    EXPECT_NE(edited, kHash2);
    EXPECT_EQ(engine->allocate_session(epoch).or_throw(), 3U);
  }
  {
    const auto engine = open_rocksdb(map_, {}).or_throw();
    EXPECT_EQ(engine->last_journal_sequence(), engine->applied_sequence() + 2);
    EXPECT_EQ(hash_map(*open(engine, engine->acquire().or_throw())), edited);
  }
  std::size_t salted = 0;
  for (const auto& entry : fs::directory_iterator(map_ + "/journal"))
    salted += SegmentName::parse(entry.path().filename())->salt.has_value();
  EXPECT_EQ(salted, 1U);

  // The old map shares tables with the new one, and is what it was.
  RocksDbOptions options;
  options.read_only = true;
  options.format = 2;
  const auto old = open_rocksdb(summary->kept, options).or_throw();
  EXPECT_EQ(hash_map(*open(old, 0)), kHash2);
}

TEST_F(Migrate, BeginsAnewAfterAnInterruption) {
  for (const char* fixture : {kFormat1, kFormat2}) {
    fs::remove_all(map_);
    unpack(fixture);
    fs::create_directories(map_ + ".migrating/map");
    std::ofstream(map_ + ".migrating/map/CURRENT") << "half\n";
    ASSERT_TRUE(migrate_folder(map_, {}).ok());
    const auto engine = open_rocksdb(map_, {}).or_throw();
    EXPECT_EQ(hash_map(*open(engine, engine->acquire().or_throw())), fixture == kFormat1 ? kHash1 : kHash2);
  }
}

TEST_F(Migrate, FinishesWhatWasInterruptedAfterTheMapsChangedPlaces) {
  unpack(kFormat1);
  ASSERT_TRUE(migrate_folder(map_, {}).ok());
  fs::rename(map_ + ".format-1", map_ + ".migrating");
  const auto summary = migrate_folder(map_, {});
  ASSERT_TRUE(summary.ok());
  EXPECT_EQ(summary->kept, map_ + ".format-1");
  expect_the_map_of_format1();
}

TEST_F(Migrate, ARehearsalSeesEveryFactThatDiffers) {
  unpack(kFormat2);
  fs::create_directory(folder_ / "scratch");
  const auto rehearsal =
      rehearse_migration(map_, folder_ / "scratch", [](const char*, auto, auto) { return Status(); });
  ASSERT_TRUE(rehearsal.ok()) << rehearsal.status().to_string();
  EXPECT_EQ(rehearsal->differences, std::vector<std::string>{});
  EXPECT_EQ(rehearsal->facts.frames, 137U);
  EXPECT_EQ(rehearsal->facts.labels, 2U);
  EXPECT_EQ(rehearsal->facts.journal_records, 1U);

  const auto facts = [&] { return sum_facts(*open_rocksdb(rehearsal->map, {}).or_throw(), 3, {}).or_throw(); };
  EXPECT_EQ(facts(), rehearsal->facts);
  const auto edited = [&](const std::function<void(Map&)>& edit) {
    {
      const auto engine = open_rocksdb(rehearsal->map, {}).or_throw();
      const auto map = open(engine, engine->acquire().or_throw());
      edit(*map);
      EXPECT_TRUE(map->commit().ok());
    }
    return facts();
  };
  MapFactSums last = facts();
  const auto expect_changed = [&](const char* what, const std::function<void(Map&)>& edit) {
    const MapFactSums now = edited(edit);
    EXPECT_NE(now.hash, last.hash) << what;
    last = now;
  };
  expect_changed("a label", [](Map& map) { map.set_label({1, 9}, "gate", true); });
  EXPECT_EQ(last.labels, 3U);
  expect_changed("a time", [](Map& map) { ++map.edit_hot({1, 9}).time_us; });
  expect_changed("an estimate", [](Map& map) { map.edit_hot({1, 9}).edges.front().T_ab.t.x() += 1e-6; });
  expect_changed("a pixel", [](Map& map) { map.edit_warm({1, 9}).observations.front().v += 0.5F; });
  expect_changed("a session's name", [](Map& map) { map.edit_session(1).display_name = "another"; });
}

TEST_F(Migrate, RefusesWhatItDoesNotKnow) {
  unpack(kFormat2);
  write_format("relmap map 4");
  EXPECT_EQ(migrate_folder(map_, {}).reason(), Reason::UNKNOWN_FORMAT_VERSION);
  write_format("relmap map 0");
  EXPECT_EQ(migrate_folder(map_, {}).reason(), Reason::UNKNOWN_FORMAT_VERSION);
  write_format("another product's file");
  EXPECT_EQ(migrate_folder(map_, {}).reason(), Reason::UNKNOWN_FORMAT_VERSION);
  EXPECT_EQ(migrate_folder(folder_ / "nothing", {}).reason(), Reason::NO_SUCH_FILE);
}

TEST_F(Migrate, RefusesAFolderInUse) {
  unpack(kFormat1);
  RocksDbOptions options;
  options.read_only = true;
  options.format = 1;
  const auto owner = open_rocksdb(map_, options).or_throw();
  EXPECT_EQ(migrate_folder(map_, {}).reason(), Reason::FOLDER_LOCKED);
}

TEST_F(Migrate, NamesDamageAndLeavesTheFolderAsItIs) {
  unpack(kFormat1);
  const std::string log = map_ + "/map/000004.log";
  std::fstream file(log, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(fs::file_size(log) / 2));
  file << "damage";
  file.close();
  const auto result = migrate_folder(map_, {});
  EXPECT_EQ(result.reason(), Reason::DATA_LOSS);
  EXPECT_TRUE(fs::exists(map_ + "/FORMAT"));
  EXPECT_FALSE(fs::exists(map_ + ".format-1"));
}

}  // namespace
}  // namespace relmap::storage
