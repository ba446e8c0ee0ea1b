#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "relmap/v1/admin.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/testing/served_map.h"

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
  ASSERT_TRUE(commit(*map_.core, {}, deadline_).ok());
  const auto replies = read(verify_request(*map_.core, {}, deadline_));
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

TEST_F(AdminHandlers, VerifyOfASessionThatIsNotThereIsRefused) {
  v1::VerifyRequest request;
  request.add_sessions(7);
  EXPECT_EQ(verify_request(*map_.core, request, deadline_).reason(), Reason::NO_SUCH_SESSION);
}

TEST_F(AdminHandlers, LongWorkEndsWithItsCaller) {
  Deadline gone;
  gone.interrupted = [] { return Status(Reason::DEADLINE, "the caller has gone"); };
  auto stream = verify_request(*map_.core, {}, gone).or_throw();
  Status end;
  while (end.ok()) {
    const auto message = stream();
    end = message.status();
    ASSERT_FALSE(message.ok() && !message->has_value()) << "verified to the end";
  }
  EXPECT_EQ(end.reason(), Reason::DEADLINE);
}

TEST_F(AdminHandlers, OneLongWorkAtATime) {
  const auto held = map_.core->maintenance.take("Admin.Compact");
  const auto refused = verify_request(*map_.core, {}, deadline_);
  EXPECT_EQ(refused.reason(), Reason::BUDGET_EXCEEDED);
  EXPECT_THAT(refused.status().message(), HasSubstr("Admin.Compact"));
}

TEST_F(AdminHandlers, RepairSaysWhatToDoInstead) {
  const auto refused = repair_request(*map_.core, {}, deadline_);
  EXPECT_EQ(refused.reason(), Reason::FOLDER_LOCKED);
  EXPECT_THAT(refused.status().message(), HasSubstr("relmap-admin repair /data"));
}

TEST_F(AdminHandlers, ReindexSaysWhatToDoInstead) {
  const auto refused = reindex_request(*map_.core, {}, deadline_);
  EXPECT_EQ(refused.reason(), Reason::FOLDER_LOCKED);
  EXPECT_THAT(refused.status().message(), HasSubstr("relmap-admin reindex /data"));
}

TEST_F(AdminHandlers, BackupNeedsAnAbsolutePathAndAnEngineThatCan) {
  v1::BackupRequest request;
  request.set_folder("copy");
  EXPECT_EQ(backup(*map_.core, request, deadline_).reason(), Reason::INVALID_ARGUMENT);
  request.set_folder("/tmp/copy");
  auto stream = backup(*map_.core, request, deadline_).or_throw();
  Result<std::optional<v1::Progress>> message = stream();
  while (message.ok() && message->has_value()) message = stream();
  EXPECT_EQ(message.reason(), Reason::UNSUPPORTED);
}

TEST_F(AdminHandlers, CompactSaysWhatItGained) {
  const auto replies = read(compact(*map_.core, {}, deadline_));
  ASSERT_FALSE(replies.empty());
  EXPECT_GT(replies.back().compact().bytes_before(), 0u);
  EXPECT_EQ(replies.back().compact().bytes_after(), replies.back().compact().bytes_before());
}

TEST_F(AdminHandlers, CommitLeavesNothingInTheJournal) {
  const auto applied = commit(*map_.core, {}, deadline_);
  ASSERT_TRUE(applied.ok()) << applied.status().to_string();
  EXPECT_EQ(applied->applied_sequence(), map_.mapper->stats().applied_sequence);
  const auto stats = get_stats(*map_.core, {}, deadline_);
  ASSERT_TRUE(stats.ok());
  EXPECT_EQ(stats->journal_records(), 0u);
  EXPECT_EQ(stats->status().frames(), ServedMap::kFrames + ServedMap::kElsewhere);
  EXPECT_EQ(stats->disk_bytes(), stats->map_bytes() + stats->journal_bytes());
  EXPECT_GT(stats->map_bytes(), stats->status().frames() * 1000);
}

}  // namespace
}  // namespace relmap::rpc
