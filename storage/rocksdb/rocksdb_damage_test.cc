// A data folder with damage: it opens as far as it can be read, and what is damaged is named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "storage/rocksdb/manifest_log.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class RocksDbDamage : public ::testing::Test {
 protected:
  // Three commits of a small and a large value, each in files of their own; a record of the journal is not applied.
  void SetUp() override {
    for (std::uint8_t number = 1; number <= 3; ++number) {
      const auto engine = open().or_throw();
      const auto epoch = engine->acquire().or_throw();
      const std::uint64_t sequence = engine->append(epoch, std::vector<Bytes>{Bytes(100, number)}).or_throw();
      const std::string n = std::to_string(number);
      const std::vector<Put> puts{{"small" + n, Bytes(10, number)}, {"large" + n, Bytes(20000, number)}};
      ASSERT_TRUE(engine->commit(epoch, sequence, puts, {}).ok());
      if (number == 3) {
        ASSERT_TRUE(engine->append(epoch, std::vector<Bytes>{Bytes(100, 4)}).ok());
      }
    }
  }
  Result<std::shared_ptr<Engine>> open() const {
    RocksDbOptions options;
    options.or_read_only = true;
    return open_rocksdb(folder_ / "data", options);
  }
  std::vector<fs::path> files(const std::string& extension) const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(folder_ / "data/map"))
      if (entry.path().extension() == extension) found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    return found;
  }
  static void flip(const fs::path& file, std::uint64_t at) {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    char c = 0;
    bytes.seekg(static_cast<std::streamoff>(at)).get(c);
    bytes.seekp(static_cast<std::streamoff>(at)).put(static_cast<char>(c ^ 1));
  }
  // Every value is as it was, or its loss is said; returns how many are lost.
  static int lost(const Engine& engine) {
    int errors = 0;
    for (std::uint8_t number = 1; number <= 3; ++number)
      for (const char* kind : {"small", "large"}) {
        const auto value = engine.snapshot()->get(kind + std::to_string(number));
        if (value.ok() && *value) {
          EXPECT_EQ(**value, Bytes(kind[0] == 's' ? 10 : 20000, number));
        } else {
          ++errors;
        }
      }
    return errors;
  }

  const TemporaryFolder folder_;
};

TEST_F(RocksDbDamage, AFlippedBitInAFileIsNamedWhereItIsReadAndTheRestAnswers) {
  for (const char* extension : {".sst", ".blob"}) {
    const fs::path file = files(extension).at(0);
    flip(file, 40);
    const auto engine = open();
    ASSERT_TRUE(engine.ok()) << engine.status().to_string();
    const int errors = lost(**engine);
    EXPECT_GE(errors, 1) << file;
    EXPECT_LT(errors, 6) << file;
    flip(file, 40);
  }
}

TEST_F(RocksDbDamage, AMissingOrTruncatedFileIsNamedAndTheRestIsServedReadOnly) {
  for (const char* extension : {".sst", ".blob"}) {
    for (const bool missing : {true, false}) {
      const fs::path file = files(extension).at(0), aside = folder_ / "aside";
      fs::copy_file(file, aside, fs::copy_options::overwrite_existing);
      missing ? void(fs::remove(file)) : fs::resize_file(file, fs::file_size(file) / 2);
      const auto engine = open();
      ASSERT_TRUE(engine.ok()) << file << ": " << engine.status().to_string();
      EXPECT_LT(lost(**engine), 6) << file;
      EXPECT_GE(lost(**engine), 1) << file;
      const Status owned = (*engine)->acquire().status();
      EXPECT_TRUE(owned.ok() || owned.reason() == Reason::DATA_LOSS || owned.reason() == Reason::IO_ERROR);
      if (!owned.ok()) {
        EXPECT_THAT(owned.message(), HasSubstr(file.filename().string().substr(0, 6)));
      }
      fs::copy_file(aside, file, fs::copy_options::overwrite_existing);
    }
  }
  EXPECT_TRUE(open().or_throw()->acquire().ok()) << "nothing was changed meanwhile";
}

TEST_F(RocksDbDamage, WithoutItsCurrentOrManifestTheMapIsRefusedByNameAndNothingIsDeleted) {
  const std::size_t tables = files(".sst").size();
  const fs::path current = folder_ / "data/map/CURRENT", aside = folder_ / "aside";
  fs::rename(current, aside);
  EXPECT_THAT(open().status().to_string(), AllOf(HasSubstr("DATA_LOSS"), HasSubstr("CURRENT")));
  fs::rename(aside, current);
  std::string manifest;
  std::ifstream(current) >> manifest;
  flip(folder_ / ("data/map/" + manifest), 20);
  const auto engine = open();
  EXPECT_TRUE(!engine.ok() || !(*engine)->acquire().ok());
  flip(folder_ / ("data/map/" + manifest), 20);
  EXPECT_EQ(files(".sst").size(), tables);
  EXPECT_EQ(lost(*open().or_throw()), 0);
}

TEST_F(RocksDbDamage, AListOfFilesWithATornEndIsNoLossAndOneWithAFlippedBitThereIsDamaged) {
  std::string name;
  std::ifstream(folder_ / "data/map/CURRENT") >> name;
  std::ostringstream before;
  before << std::ifstream(folder_ / ("data/map/" + name), std::ios::binary).rdbuf();
  const std::size_t begin = before.str().size();
  ByteWriter w;
  w.put_bytes(as_bytes(before.str()));
  put_log_record(w, Bytes(700, 7));  // as of a flush whose sync has not returned
  const Bytes whole = w.take();
  fs::rename(folder_ / "data", folder_ / "kept");
  const auto open_with = [&](const Bytes& manifest) {
    fs::remove_all(folder_ / "data");
    fs::copy(folder_ / "kept", folder_ / "data", fs::copy_options::recursive);
    std::ofstream(folder_ / ("data/map/" + name), std::ios::binary)
        .write(reinterpret_cast<const char*>(manifest.data()), static_cast<std::streamsize>(manifest.size()));
    return open();
  };

  EXPECT_EQ(length_without_torn_end(whole), whole.size());
  Bytes flipped = whole;
  flipped[whole.size() - 100] ^= 1;
  EXPECT_EQ(length_without_torn_end(flipped), whole.size());
  const auto damaged = open_with(flipped);
  EXPECT_TRUE(!damaged.ok() || (*damaged)->acquire().reason() == Reason::DATA_LOSS);

  // Each sector of the record may be the one that was not written.
  for (std::size_t at = begin; at < whole.size(); at = (at / 512 + 1) * 512) {
    Bytes torn = whole;
    const std::size_t end = std::min(whole.size(), (at / 512 + 1) * 512);
    std::fill(torn.begin() + static_cast<std::ptrdiff_t>(at), torn.begin() + static_cast<std::ptrdiff_t>(end), 0);
    const auto engine = open_with(torn);
    ASSERT_TRUE(engine.ok()) << at << ": " << engine.status().to_string();
    EXPECT_TRUE((*engine)->acquire().ok()) << at;
    EXPECT_EQ(lost(**engine), 0);
  }
}

TEST_F(RocksDbDamage, ALogThatTheJournalCoversIsNoLossAndOneThatItDoesNotIsNamed) {
  const fs::path log = files(".log").back();
  ASSERT_GT(fs::file_size(log), 1000u);
  flip(log, 200);  // the first of the commits in it
  {
    const auto engine = open();
    ASSERT_TRUE(engine.ok()) << engine.status().to_string();
    EXPECT_TRUE((*engine)->acquire().ok());
    EXPECT_LT((*engine)->applied_sequence(), 3u);
    EXPECT_EQ((*engine)->last_journal_sequence(), 4u);
    std::uint64_t read = 0;
    EXPECT_TRUE(
        (*engine)->read_journal((*engine)->applied_sequence() + 1, [&](auto, auto) { return ++read > 0; }).ok());
    EXPECT_EQ(read, 4 - (*engine)->applied_sequence());
  }
}

TEST_F(RocksDbDamage, ALogThatTheJournalDoesNotCoverIsServedReadOnly) {
  flip(files(".log").back(), 200);
  for (const auto& entry : fs::directory_iterator(folder_ / "data/journal")) fs::remove(entry.path());
  std::ofstream(folder_ / "data/journal/journal-00000000000000000004.log");  // what was trimmed
  const auto engine = open();
  ASSERT_TRUE(engine.ok()) << engine.status().to_string();
  const Status owned = (*engine)->acquire().status();
  EXPECT_EQ(owned.reason(), Reason::DATA_LOSS);
  EXPECT_THAT(owned.message(), HasSubstr("data/map"));
  EXPECT_LT(lost(**engine), 6);
}

}  // namespace
}  // namespace relmap::storage
