#include "server/map/record_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/edge_edit.h"
#include "server/map/testing/two_laps.h"

namespace relmap::map {
namespace {

using testing::HasSubstr;

class RecordLog : public TwoLaps {
 protected:
  std::string line(const storage::JournalRecord& record) {
    const Applied applied = drive_.apply(record);
    return log_line(drive_.map(), record, applied);
  }
};

TEST_F(RecordLog, DescribesSessionsAndOperatorEditsOnly) {
  const std::string name =
      "session 1 '" + world_.keyframe(0).session.name + "' of robot " + world_.keyframe(0).session.robot;
  storage::SessionRecord another = session_record(world_);
  another.number = 2;
  another.header.uuid.bytes[0] ^= 1;
  another.display_name = "evening#2";
  EXPECT_THAT(line(another), HasSubstr("session 2 'evening#2' of robot "));
  EXPECT_THAT(line(another), testing::EndsWith(" begins"));

  for (const std::uint32_t query : {62, 64, 66})
    EXPECT_EQ(line(*true_closure(drive_.map(), world_, query, kLap)), "") << "what places recognise is no edit";
  const std::string id = closure(62).id.to_string();
  EXPECT_EQ(line(edit_record(closure(62).id, EdgeAction::kRemove, "that is the other hall")),
            "operator: closure " + id +
                " was in force and is removed (REMOVED_BY_OPERATOR), with 2 others: that is the "
                "other hall");
  EXPECT_EQ(line(edit_record(closure(62).id, EdgeAction::kRestore)),
            "operator: closure " + id + " was removed and is in force (CONSISTENT), with 2 others");
  EXPECT_EQ(line(edit_record(closure(62).id, EdgeAction::kRemoveAlone)),
            "operator: closure " + id + " was in force and is removed (REMOVED_ALONE)");
  EXPECT_EQ(line(edit_record(closure(62).id, EdgeAction::kRemove)), "") << "there is nothing to do";

  EXPECT_EQ(line(storage::SetLabelRecord{{1, 7}, "dock"}), "operator: frame 1:7 is labelled 'dock'");
  EXPECT_EQ(line(storage::SetLabelRecord{{1, 7}, "dock", false}), "operator: frame 1:7 is no longer labelled 'dock'");

  EXPECT_EQ(line(storage::SetSessionStateRecord{1, storage::SessionState::kEnded}), name + " has ended, 90 frames");
  EXPECT_EQ(line(storage::SetSessionStateRecord{1, storage::SessionState::kFrozen}), name + " is frozen, 90 frames");
  EXPECT_EQ(line(storage::SetSessionStateRecord{1, storage::SessionState::kEnded}), "") << "of a frozen session";
  EXPECT_EQ(line(storage::SetSessionStateRecord{1, storage::SessionState::kOpen}),
            name + " is thawed, and ended as it was");
  EXPECT_EQ(line(storage::SetSessionStateRecord{1, storage::SessionState::kDeleting}),
            name + " is being deleted, 90 frames");
  EXPECT_EQ(line(storage::IdleWorkRecord{1000}), "");
}

TEST_F(RecordLog, DescribesClosuresThatGoBecauseNothingIsSeenBeyond) {
  for (const std::uint32_t query : {62, 64}) propose_wrongly(query);
  for (std::uint32_t i = 66; i < 73; ++i)
    EXPECT_EQ(line(storage::UnseenRecord{{kDriveSession, i}, closure(64).id}), "") << i;
  EXPECT_EQ(line(storage::UnseenRecord{{kDriveSession, 73}, closure(64).id}),
            "closure " + closure(64).id.to_string() +
                " and 1 that agree with it are quarantined: going on from there, the robot saw nothing of what the map "
                "shows, last in frame 1:73");
}

}  // namespace
}  // namespace relmap::map
