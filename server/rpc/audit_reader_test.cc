#include "server/rpc/audit_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "proto/base/clock.h"
#include "proto/base/json.h"
#include "proto/base/time_text.h"
#include "server/rpc/audit_log.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::rpc {
namespace {

using ::testing::HasSubstr;

const std::function<Status()> kGoOn = [] { return Status(); };

class AuditReader : public ::testing::Test {
 protected:
  // Files of a few entries each.
  std::unique_ptr<AuditLog> open(std::uint64_t file_bytes = 2000) {
    return AuditLog::open(folder_ / "audit.jsonl", file_bytes).or_throw();
  }
  void write(AuditLog& log, int from, int to) {
    for (int i = from; i < to; ++i)
      log.write({i % 2 ? "anna" : "bert", "operator", "ipv4:10.0.0.1:5", i % 3 ? "Map.SetLabel" : "Admin.Commit",
                 "number: " + std::to_string(i), "id-" + std::to_string(i),
                 i % 5 ? Status() : Status(Reason::NO_SUCH_FRAME, "no frame"), std::chrono::microseconds(1500)});
    log.flush();
  }
  static int number_of(const AuditRead& entry) { return std::stoi(entry.request.substr(entry.request.find(' '))); }
  static std::vector<int> all(AuditLog& log, AuditQuery query, std::uint64_t* unreadable = nullptr) {
    std::vector<int> numbers;
    for (int pages = 0; pages < 1000; ++pages) {
      const AuditPage page = log.read(query, kGoOn).or_throw();
      EXPECT_LE(page.entries.size(), query.max_entries);
      for (const AuditRead& entry : page.entries) numbers.push_back(number_of(entry));
      if (unreadable) *unreadable += page.unreadable;
      query.token = page.next;
      if (query.token.empty()) return numbers;
    }
    ADD_FAILURE() << "no end";
    return numbers;
  }
  // From `last` down to `first`.
  static std::vector<int> down(int last, int first, const std::function<bool(int)>& matches = {}) {
    std::vector<int> numbers;
    for (int i = last; i >= first; --i)
      if (!matches || matches(i)) numbers.push_back(i);
    return numbers;
  }
  void append(const std::string& text) { std::ofstream(folder_ / "audit.jsonl", std::ios::app) << text; }

  const storage::TemporaryFolder folder_;
};

TEST_F(AuditReader, HasTheNewestFirstOverAllFiles) {
  const auto log = open();
  write(*log, 0, 60);
  ASSERT_TRUE(std::filesystem::exists(folder_ / "audit.jsonl.3"));
  for (const std::size_t size : {1, 3, 7, 60, 100}) {
    AuditQuery query;
    query.max_entries = size;
    EXPECT_EQ(all(*log, query), down(59, 0)) << size;
  }
  const AuditPage page = log->read({}, kGoOn).or_throw();
  const AuditRead& entry = page.entries.at(58);
  EXPECT_EQ(entry.who, "anna");
  EXPECT_EQ(entry.role, "operator");
  EXPECT_EQ(entry.from, "ipv4:10.0.0.1:5");
  EXPECT_EQ(entry.method, "Map.SetLabel");
  EXPECT_EQ(entry.request_id, "id-1");
  EXPECT_EQ(entry.outcome, Reason::OK);
  EXPECT_EQ(page.entries.at(59).outcome, Reason::NO_SUCH_FRAME);
  EXPECT_EQ(page.entries.at(59).message, "no frame");
  EXPECT_DOUBLE_EQ(entry.seconds, 0.0015);
  EXPECT_NEAR(static_cast<double>(entry.time_us), static_cast<double>(now_us()), 600e6);
  EXPECT_EQ(page.unreadable, 0u);
}

// What is written meanwhile, and that files are moved on, neither repeats nor loses an entry.
TEST_F(AuditReader, PagesHoldWhileFilesAreMovedOn) {
  const auto log = open();
  write(*log, 0, 50);
  AuditQuery query;
  query.max_entries = 4;
  std::vector<int> numbers;
  int written = 50;
  do {
    const AuditPage page = log->read(query, kGoOn).or_throw();
    for (const AuditRead& entry : page.entries) numbers.push_back(number_of(entry));
    query.token = page.next;
    write(*log, written, written + 3);
    written += 3;
  } while (!query.token.empty());
  EXPECT_EQ(numbers, down(49, 0));
}

TEST_F(AuditReader, AnEmptyLogHasAnEmptyPage) {
  const auto log = open();
  const AuditPage page = log->read({}, kGoOn).or_throw();
  EXPECT_TRUE(page.entries.empty());
  EXPECT_EQ(page.next, "");
}

TEST_F(AuditReader, FiltersByWhoWhatAndOutcome) {
  const auto log = open();
  write(*log, 0, 60);
  AuditQuery query;
  query.max_entries = 3;
  query.who = "anna";
  EXPECT_EQ(all(*log, query), down(59, 0, [](int i) { return i % 2 == 1; }));
  query.method = "Admin.Commit";
  EXPECT_EQ(all(*log, query), down(59, 0, [](int i) { return i % 2 == 1 && i % 3 == 0; }));
  query.failed = true;
  EXPECT_EQ(all(*log, query), down(59, 0, [](int i) { return i % 2 == 1 && i % 3 == 0 && i % 5 == 0; }));
  query.who = "operator";  // which stands in each line
  EXPECT_TRUE(all(*log, query).empty());
}

// A file as the log has it, with entries of these times.
class FileOfTimes final : public storage::ReadFile {
 public:
  explicit FileOfTimes(const std::vector<std::int64_t>& times_s) {
    for (const std::int64_t time : times_s)
      text_ += Json()
                   .add("time", time_text(time * 1'000'000))
                   .add("who", "anna")
                   .add("method", "Admin.Commit")
                   .add("request", "number: " + std::to_string(time))
                   .add("outcome", "OK")
                   .text() +
               "\n";
  }
  std::uint64_t size() const override { return text_.size(); }
  Result<Bytes> read(std::uint64_t offset, std::size_t size) const override {
    if (offset + size > text_.size()) return Status(Reason::IO_ERROR, "beyond the end");
    bytes_read += size;
    const auto begin = text_.begin() + static_cast<std::ptrdiff_t>(offset);
    return Bytes(begin, begin + static_cast<std::ptrdiff_t>(size));
  }
  mutable std::uint64_t bytes_read = 0;

 private:
  std::string text_;
};

TEST_F(AuditReader, ReadsOnlyFilesOfTheTimesThatAreAskedFor) {
  std::vector<std::unique_ptr<storage::ReadFile>> files;
  const auto add = [&](std::int64_t from, std::int64_t to) {
    std::vector<std::int64_t> times;
    for (std::int64_t time = from; time < to; ++time) times.push_back(time);
    files.push_back(std::make_unique<FileOfTimes>(times));
    return static_cast<const FileOfTimes*>(files.back().get());
  };
  const auto* newest = add(30'000, 40'000);
  const auto* second = add(20'000, 30'000);
  const auto* third = add(10'000, 20'000);
  const auto* oldest = add(0, 10'000);
  AuditQuery query;
  query.from_us = std::int64_t{15'000} * 1'000'000;
  query.until_us = std::int64_t{15'010} * 1'000'000;
  const AuditPage page = read_audit(files, query, kGoOn).or_throw();
  ASSERT_EQ(page.entries.size(), 10u);
  EXPECT_EQ(number_of(page.entries.front()), 15'009);
  EXPECT_EQ(number_of(page.entries.back()), 15'000);
  EXPECT_EQ(page.next, "");
  EXPECT_LT(newest->bytes_read, newest->size() / 2);
  EXPECT_LT(second->bytes_read, second->size() / 2);
  EXPECT_GE(third->bytes_read, third->size());
  EXPECT_LT(oldest->bytes_read, oldest->size() / 2);
}

// A page reads no more than it needs, and ends after so many bytes, even if nothing matched.
TEST_F(AuditReader, APageIsBounded) {
  std::vector<std::int64_t> times;
  for (std::int64_t time = 0; time < 20'000; ++time) times.push_back(time);
  std::vector<std::unique_ptr<storage::ReadFile>> files;
  files.push_back(std::make_unique<FileOfTimes>(times));
  const auto* file = static_cast<const FileOfTimes*>(files[0].get());
  AuditQuery query;
  query.max_entries = 10;
  EXPECT_EQ(read_audit(files, query, kGoOn)->entries.size(), 10u);
  EXPECT_LE(file->bytes_read, 70'000u);
  query.who = "bert";
  constexpr std::uint64_t kMax = 200'000;
  int pages = 0;
  for (; pages == 0 || !query.token.empty(); ++pages) {
    file->bytes_read = 0;
    const AuditPage page = read_audit(files, query, kGoOn, kMax).or_throw();
    EXPECT_TRUE(page.entries.empty());
    EXPECT_LE(file->bytes_read, kMax + 80'000);
    query.token = page.next;
  }
  EXPECT_EQ(pages, static_cast<int>(file->size() / kMax) + 1);
  query.token = "";
  int asked = 0;
  const auto late = read_audit(files, query, [&] { return ++asked > 3 ? Status(Reason::DEADLINE, "late") : Status(); });
  EXPECT_EQ(late.reason(), Reason::DEADLINE);
}

TEST_F(AuditReader, LeavesOutWhatIsNoEntry) {
  {
    const auto log = open(1 << 20);
    write(*log, 0, 3);
  }
  append("a foreign line\n{\"time\":\"yesterday\",\"method\":\"x\",\"outcome\":\"OK\"}\n\n{}\n[1,2]\n");
  append(std::string(300'000, 'x') + "\n");
  append(std::string("\0\xff\x80", 3) + "\n{\"time\":\"2026-03-04T05:06:07.089Z\",\"outcome\":\"OK\"}\n");
  append(R"({"time":"2026-03-04T05:06:07.089Z","who":"an)");  // torn, and not even ended
  const auto log = open(1 << 20);                             // goes on, on a line of its own
  write(*log, 3, 6);
  for (const std::size_t size : {1, 2, 100}) {
    AuditQuery query;
    query.max_entries = size;
    std::uint64_t unreadable = 0;
    EXPECT_EQ(all(*log, query, &unreadable), down(5, 0));
    EXPECT_EQ(unreadable, 8u) << "the empty line is none";
  }
}

TEST_F(AuditReader, TokensAreChecked) {
  const auto log = open();
  write(*log, 0, 50);
  AuditQuery query;
  query.max_entries = 45;
  const std::string token = log->read(query, kGoOn)->next;
  ASSERT_NE(token, "");
  for (const std::string& wrong : {std::string("rubbish"), token + "x", token.substr(0, 8), token.substr(0, 9),
                                   token.substr(0, 9) + "0", token.substr(0, 9) + "-1"}) {
    query.token = wrong;
    EXPECT_EQ(log->read(query, kGoOn).reason(), Reason::INVALID_ARGUMENT) << wrong;
  }
  query.token = token.substr(0, 9) + "99999999";  // beyond its end: all of the file
  EXPECT_TRUE(log->read(query, kGoOn).ok());
  query.token = token;
  EXPECT_TRUE(log->read(query, kGoOn).ok());
  write(*log, 50, 250);  // the file is deleted
  const auto gone = log->read(query, kGoOn);
  EXPECT_EQ(gone.reason(), Reason::VIEW_EXPIRED);
  EXPECT_THAT(gone.status().message(), HasSubstr("deleted"));
}

}  // namespace
}  // namespace relmap::rpc
