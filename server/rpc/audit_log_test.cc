#include "server/rpc/audit_log.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "relmap/v1/map.pb.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::rpc {
namespace {

using ::testing::HasSubstr;

std::vector<nlohmann::json> lines_of(const std::string& file) {
  std::vector<nlohmann::json> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

TEST(AuditLog, HasOneObjectALineForItsOwnerOnly) {
  const storage::TemporaryFolder folder;
  const std::string file = folder / "audit.jsonl";
  {
    const auto log = AuditLog::open(file).or_throw();
    v1::SetLabelRequest request;
    request.mutable_frame()->set_session(3);
    request.set_label("a \"quoted\"\nlabel");
    log->write({"anna", "operator", "ipv4:10.0.0.1:5", "Map.SetLabel", AuditLog::text_of(request), "id-1",
                Status(Reason::NO_SUCH_FRAME, "no frame 3:0"), std::chrono::microseconds(1500)});
    log->write({"", "reader", "ipv4:10.0.0.2:5", "Admin.Backup", "", "id-2", Status(Reason::UNAUTHENTICATED, "who?")});
  }
  struct stat facts {};
  ASSERT_EQ(stat(file.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0077, 0u);
  const auto log = AuditLog::open(file).or_throw();  // goes on behind what is there
  log->write({"anna", "operator", "", "Admin.Commit", "", "id-3", Status()});
  log->flush();
  const auto lines = lines_of(file);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0]["who"], "anna");
  EXPECT_EQ(lines[0]["role"], "operator");
  EXPECT_EQ(lines[0]["from"], "ipv4:10.0.0.1:5");
  EXPECT_EQ(lines[0]["method"], "Map.SetLabel");
  EXPECT_THAT(lines[0]["request"].get<std::string>(), HasSubstr("session: 3"));
  EXPECT_EQ(lines[0]["request_id"], "id-1");
  EXPECT_EQ(lines[0]["outcome"], "NO_SUCH_FRAME");
  EXPECT_EQ(lines[0]["message"], "no frame 3:0");
  EXPECT_DOUBLE_EQ(lines[0]["seconds"].get<double>(), 0.0015);
  EXPECT_THAT(lines[0]["time"].get<std::string>(), ::testing::MatchesRegex("20..-..-..T..:..:..\\....Z"));
  EXPECT_EQ(lines[1]["who"], "");
  EXPECT_EQ(lines[1]["role"], "");
  EXPECT_EQ(lines[2]["outcome"], "OK");
}

TEST(AuditLog, IsRotatedAndBounded) {
  const storage::TemporaryFolder folder;
  const std::string file = folder / "audit.jsonl";
  const auto log = AuditLog::open(file, 1000).or_throw();
  for (int i = 0; i < 200; ++i) log->write({"anna", "operator", "", "Admin.Commit", std::to_string(i), "", Status()});
  log->flush();
  EXPECT_TRUE(std::filesystem::exists(file + ".8"));
  EXPECT_FALSE(std::filesystem::exists(file + ".9"));
  std::vector<std::string> names{file};
  for (int i = 1; i <= AuditLog::kOldFiles; ++i) names.push_back(file + "." + std::to_string(i));
  int last = 200;
  for (const std::string& name : names) {
    EXPECT_LT(std::filesystem::file_size(name), 1300u);
    const auto lines = lines_of(name);
    for (auto line = lines.rbegin(); line != lines.rend(); ++line)
      EXPECT_EQ((*line)["request"], std::to_string(--last)) << name;
  }
}

// Where the file cannot be opened again after it was moved, the old ones stay.
TEST(AuditLog, OldFilesStayWhereNoNewOneCanBeOpened) {
  const storage::TemporaryFolder folder;
  const std::string file = folder / "audit.jsonl";
  const auto log = AuditLog::open(file, 1000).or_throw();
  const auto write = [&](int from, int to) {
    for (int i = from; i < to; ++i)
      log->write({"anna", "operator", "", "Admin.Commit", std::to_string(i), "", Status()});
    log->flush();
  };
  write(0, 30);
  ASSERT_TRUE(std::filesystem::exists(file + ".3"));
  const auto oldest = lines_of(file + ".3");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit none{0, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  write(30, 130);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  write(130, 131);
  int found = 0;
  for (int i = 1; i <= AuditLog::kOldFiles; ++i)
    if (const std::string name = file + "." + std::to_string(i); std::filesystem::exists(name))
      found += static_cast<int>(lines_of(name).size());
  EXPECT_GE(found, 30);
  EXPECT_EQ(lines_of(file).back()["request"], "130");
  EXPECT_TRUE(std::filesystem::exists(file + ".4"));
  EXPECT_EQ(lines_of(file + ".4"), oldest) << "moved on once";
}

// A reader that is refused without end must not push out what operators did.
TEST(AuditLog, OfManyFailuresOfACallerTheNumberIsWritten) {
  const storage::TemporaryFolder folder;
  const std::string file = folder / "audit.jsonl";
  {
    const auto log = AuditLog::open(file).or_throw();
    const Status refused(Reason::NOT_ALLOWED, "Map.SetLabel is for the role operator");
    for (int i = 0; i < 500; ++i) log->write({"dash", "reader", "ipv4:10.0.0.1:5", "Map.SetLabel", "", "", refused});
    for (int i = 0; i < 100; ++i) log->write({"anna", "operator", "ipv4:10.0.0.2:5", "Map.SetLabel", "", "", Status()});
  }
  int refusals = 0, edits = 0, sums = 0;
  for (const nlohmann::json& line : lines_of(file)) {
    const std::string message = line["message"];
    sums += message.starts_with("440 calls within a minute failed and are not listed, this one last: Map.SetLabel");
    refusals += line["who"] == "dash";
    edits += line["who"] == "anna";
  }
  EXPECT_EQ(refusals, AuditLog::kFailuresListed + 1);
  EXPECT_EQ(sums, 1);
  EXPECT_EQ(edits, 100);
}

// The file is a pipe that nobody reads, which is a disk that hangs.
TEST(AuditLog, NoCallWaitsForTheDiskAndWhatIsLostIsCounted) {
  const storage::TemporaryFolder folder;
  const std::string file = folder / "audit.jsonl";
  ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
  const int reader = ::open(file.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  std::string text;
  const auto read_all = [&] {
    std::array<char, 65536> buffer{};
    for (;;) {
      const ssize_t size = ::read(reader, buffer.data(), buffer.size());
      if (size == 0) return;
      if (size > 0)
        text.append(buffer.data(), static_cast<std::size_t>(size));
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  std::thread drain;
  {
    const auto log = AuditLog::open(file).or_throw();
    const AuditLog::Entry entry{"anna", "operator", "", "Admin.Commit", std::string(1000, 'x'), "", Status()};
    for (int i = 0; i < 3000; ++i) log->write(entry);  // the pipe takes some sixty
    drain = std::thread(read_all);
    log->flush();
    log->write(entry);
  }
  drain.join();
  ::close(reader);
  EXPECT_THAT(text, ::testing::ContainsRegex("\"[0-9]+ lines are lost"));
}

TEST(AuditLog, LargeRequestsAreCutOff) {
  v1::ImportGraphRequest graph;
  for (int i = 0; i < 40000; ++i) graph.add_loops();
  EXPECT_THAT(AuditLog::text_of(graph), ::testing::MatchesRegex("[0-9]+ bytes"));
  v1::SetLabelRequest label;
  label.set_label(std::string(10000, 'x'));
  EXPECT_LE(AuditLog::text_of(label).size(), AuditLog::kMaxRequest + 3);
}

// Neither a link nor a folder is written to, and where nothing can be written calls go on.
TEST(AuditLog, WhatCannotBeWrittenIsRefusedAtTheStart) {
  const storage::TemporaryFolder folder;
  EXPECT_EQ(AuditLog::open(folder / "nowhere/audit.jsonl").reason(), Reason::IO_ERROR);
  std::filesystem::create_symlink(folder / "other", folder / "audit.jsonl");
  EXPECT_EQ(AuditLog::open(folder / "audit.jsonl").reason(), Reason::IO_ERROR);
  EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

}  // namespace
}  // namespace relmap::rpc
