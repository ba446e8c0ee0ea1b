#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "relmap/v1/admin.pb.h"
#include "server/rpc/audit_log.h"
#include "server/rpc/handlers.h"
#include "server/rpc/testing/served_map.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::rpc {
namespace {

using testing::HasSubstr;

class AdminHandlers : public testing::Test {
 protected:
  template <typename Reply>
  std::vector<Reply> read(Result<Producer<Reply>> stream) {
    EXPECT_TRUE(stream.ok()) << stream.status().to_string();
    std::vector<Reply> messages;
    while (stream.ok()) {
      auto message = (*stream)();
      EXPECT_TRUE(message.ok()) << message.status().to_string();
      if (!message.ok() || !message->has_value()) break;
      messages.push_back(std::move(**message));
    }
    return messages;
  }

  ServedMap map_;
  Deadline deadline_;
};

TEST_F(AdminHandlers, VerifyReadsAllOfASoundMap) {
  ASSERT_TRUE(call(*map_.core, commit, {}, deadline_).ok());
  const auto replies = read(call(*map_.core, verify_request, {}, deadline_));
  ASSERT_FALSE(replies.empty());
  const v1::VerifySummary& summary = replies.back().summary();
  EXPECT_EQ(summary.sessions(), 2u);
  EXPECT_EQ(summary.frames(), ServedMap::kFrames + ServedMap::kElsewhere);
  EXPECT_GT(summary.edges(), summary.frames() - 3);
  EXPECT_GT(summary.observations(), summary.landmarks());
  EXPECT_EQ(summary.findings(), 0u);
  for (const auto& reply : replies)
    for (const auto& finding : reply.findings()) ADD_FAILURE() << finding.message();
  EXPECT_EQ(map_.mapper->budget().used(storage::Share::kReplies), 0u);
}

TEST_F(AdminHandlers, VerifyOfAnUnknownSessionIsRefused) {
  v1::VerifyRequest request;
  request.add_sessions(7);
  EXPECT_EQ(call(*map_.core, verify_request, request, deadline_).reason(), Reason::NO_SUCH_SESSION);
}

TEST_F(AdminHandlers, LongWorkEndsWithItsCaller) {
  Deadline gone;
  gone.interrupted = [] { return Status(Reason::DEADLINE, "the caller has gone"); };
  auto stream = call(*map_.core, verify_request, {}, gone).or_throw();
  Status end;
  while (end.ok()) {
    const auto message = stream();
    end = message.status();
    ASSERT_FALSE(message.ok() && !message->has_value()) << "verified to the end";
  }
  EXPECT_EQ(end.reason(), Reason::DEADLINE);
}

TEST_F(AdminHandlers, LongWorkRunsOneAtATime) {
  const auto held = map_.core->maintenance.take("Admin.Compact");
  const auto refused = call(*map_.core, verify_request, {}, deadline_);
  EXPECT_EQ(refused.reason(), Reason::BUDGET_EXCEEDED);
  EXPECT_THAT(refused.status().message(), HasSubstr("Admin.Compact"));
}

TEST_F(AdminHandlers, RepairSaysWhatToDoInstead) {
  const auto refused = call(*map_.core, repair_request, {}, deadline_);
  EXPECT_EQ(refused.reason(), Reason::FOLDER_LOCKED);
  EXPECT_THAT(refused.status().message(), HasSubstr("relmap-admin repair /data"));
}

TEST_F(AdminHandlers, ReindexSaysWhatToDoInstead) {
  const auto refused = call(*map_.core, reindex_request, {}, deadline_);
  EXPECT_EQ(refused.reason(), Reason::FOLDER_LOCKED);
  EXPECT_THAT(refused.status().message(), HasSubstr("relmap-admin reindex /data"));
}

TEST_F(AdminHandlers, BackupNeedsAnAbsolutePathAndAnEngineThatSupportsIt) {
  v1::BackupRequest request;
  request.set_folder("copy");
  EXPECT_EQ(call(*map_.core, backup, request, deadline_).reason(), Reason::INVALID_ARGUMENT);
  request.set_folder("/tmp/copy");
  const auto nowhere = call(*map_.core, backup, request, deadline_);
  EXPECT_EQ(nowhere.reason(), Reason::NOT_ALLOWED);
  EXPECT_THAT(nowhere.status().message(), HasSubstr("--backup-root"));
  map_.core->facts.backup_roots = {"/tmp"};
  auto stream = call(*map_.core, backup, request, deadline_).or_throw();
  Result<std::optional<v1::Progress>> message = stream();
  while (message.ok() && message->has_value()) message = stream();
  EXPECT_EQ(message.reason(), Reason::UNSUPPORTED);
}

TEST_F(AdminHandlers, CompactSaysWhatItGained) {
  const auto replies = read(call(*map_.core, compact, {}, deadline_));
  ASSERT_FALSE(replies.empty());
  EXPECT_GT(replies.back().compact().bytes_before(), 0u);
  EXPECT_EQ(replies.back().compact().bytes_after(), replies.back().compact().bytes_before());
}

TEST_F(AdminHandlers, CommitLeavesNothingInTheJournal) {
  const auto applied = call(*map_.core, commit, {}, deadline_);
  ASSERT_TRUE(applied.ok()) << applied.status().to_string();
  EXPECT_EQ(applied->applied_sequence(), map_.mapper->stats().applied_sequence);
  const auto stats = call(*map_.core, get_stats, {}, deadline_);
  ASSERT_TRUE(stats.ok());
  EXPECT_EQ(stats->journal_records(), 0u);
  EXPECT_EQ(stats->status().frames(), ServedMap::kFrames + ServedMap::kElsewhere);
  EXPECT_EQ(stats->disk_bytes(), stats->map_bytes() + stats->journal_bytes());
  EXPECT_GT(stats->map_bytes(), stats->status().frames() * 1000);
}

TEST_F(AdminHandlers, TheAuditLogIsListed) {
  v1::ListAuditRequest request;
  const auto without = call(*map_.core, list_audit, request, deadline_);
  EXPECT_EQ(without.reason(), Reason::UNSUPPORTED);
  EXPECT_THAT(without.status().message(), HasSubstr("audit"));

  const storage::TemporaryFolder folder;
  const auto log = AuditLog::open(folder / "audit.jsonl").or_throw();
  map_.core->audit.log = log.get();
  for (int i = 0; i < 250; ++i)  // what is queued is told, too
    log->write({"anna", "operator", "", "Admin.Commit", std::to_string(i), "", Status(), {}, "trace"});
  std::vector<int> numbers;
  int pages = 0;
  do {
    const auto page = call(*map_.core, list_audit, request, deadline_).or_throw();
    for (const v1::AuditEntry& entry : page.entries()) {
      numbers.push_back(std::stoi(entry.request()));
      EXPECT_EQ(entry.who(), "anna");
      EXPECT_EQ(entry.trace_id(), "trace");
      EXPECT_EQ(entry.outcome(), v1::REASON_OK);
    }
    request.set_page_token(page.next_page_token());
    ++pages;
  } while (!request.page_token().empty());
  EXPECT_EQ(numbers.size(), 250u);
  EXPECT_EQ(numbers.front(), 249);
  EXPECT_TRUE(std::is_sorted(numbers.rbegin(), numbers.rend()));
  EXPECT_EQ(pages, 3) << "of 100 entries";

  request.Clear();
  request.set_failed(true);
  EXPECT_EQ(call(*map_.core, list_audit, request, deadline_)->entries_size(), 0);
  request.set_from_us(5);
  request.set_until_us(5);
  EXPECT_EQ(call(*map_.core, list_audit, request, deadline_).reason(), Reason::INVALID_ARGUMENT);
  request.set_from_us(-1);
  EXPECT_EQ(call(*map_.core, list_audit, request, deadline_).reason(), Reason::INVALID_ARGUMENT);
  request.Clear();
  request.set_page_token("not one");
  EXPECT_EQ(call(*map_.core, list_audit, request, deadline_).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(map_.mapper->budget().used(storage::Share::kReplies), 0u);
}

}  // namespace
}  // namespace relmap::rpc
