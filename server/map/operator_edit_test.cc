#include "server/map/operator_edit.h"

#include <gtest/gtest.h>

#include "server/place/testing/hand_made_graph.h"

namespace relmap::map {
namespace {

constexpr FrameId kLabelled{1, 7}, kDeleted{2, 0};

// A frame with the labels "dock" and " ", of which the second is no longer valid, and a session that is being deleted.
class OperatorEdit : public ::testing::Test {
 protected:
  OperatorEdit() {
    for (const SessionNumber session : {1u, 2u}) graph_.add_session(session, {});
    for (const FrameId frame : {kLabelled, kDeleted}) graph_.add_frame(frame);
    graph_.edit_hot(kLabelled).labels = {" ", "dock"};
    graph_.edit_session(kDeleted.session).state = storage::SessionState::kDeleting;
  }
  Status set(const std::string& label, FrameId frame = kLabelled) { return check_label_edit(graph_, {frame, label}); }
  Status remove(const std::string& label, FrameId frame = kLabelled) {
    return check_label_edit(graph_, {frame, label, false});
  }

  place::HandMadeGraph graph_;
};

TEST_F(OperatorEdit, ALabelIsAName) {
  EXPECT_TRUE(set("hall").ok());
  EXPECT_TRUE(set(std::string(64, 'x')).ok());
  for (const std::string& none :
       {std::string(65, 'x'), std::string(), std::string(" "), std::string("\xc2\xa0"), std::string("\xff")}) {
    EXPECT_EQ(set(none).reason(), Reason::BAD_NAME) << none;
    EXPECT_EQ(check_label({kLabelled, none}).reason(), Reason::BAD_NAME) << none;
    EXPECT_TRUE(check_label({kLabelled, none, false}).ok()) << none;
  }
}

TEST_F(OperatorEdit, ALabelThatIsNoLongerValidCanBeRemoved) {
  EXPECT_TRUE(remove(" ").ok());
  EXPECT_EQ(remove("").reason(), Reason::BAD_NAME) << "the frame has no such label";
}

TEST_F(OperatorEdit, OnlyALabelOfTheFrameCanBeRemoved) {
  EXPECT_TRUE(remove("dock").ok());
  EXPECT_EQ(remove("hall").to_string(), "NO_SUCH_LABEL: 1:7 is not labelled 'hall'");
}

TEST_F(OperatorEdit, TheFrameMustExistAndStay) {
  for (const bool present : {true, false}) {
    EXPECT_EQ(check_label_edit(graph_, {{1, 8}, "dock", present}).reason(), Reason::NO_SUCH_FRAME);
    EXPECT_EQ(check_label_edit(graph_, {kDeleted, "dock", present}).to_string(),
              "SESSION_DELETED: 2:0 is being deleted with session 2");
  }
}

TEST_F(OperatorEdit, AFrameHasAtMost64Labels) {
  std::vector<std::string>& labels = graph_.edit_hot(kLabelled).labels;
  while (labels.size() < kMaxLabelsPerFrame - 1) labels.push_back("label " + std::to_string(labels.size()));
  EXPECT_TRUE(set("hall").ok());
  labels.push_back("hall");
  EXPECT_EQ(set("one more").reason(), Reason::BUDGET_EXCEEDED);
  EXPECT_TRUE(set("hall").ok()) << "the frame has it already";
}

TEST_F(OperatorEdit, ASessionIsFrozenOnceAndOpenedOnce) {
  EXPECT_EQ(freezing(graph_, 1, true).or_throw().state, storage::SessionState::kFrozen);
  EXPECT_EQ(freezing(graph_, 1, false).reason(), Reason::WRONG_STATE);
  graph_.edit_session(1).state = storage::SessionState::kFrozen;
  EXPECT_EQ(freezing(graph_, 1, false).or_throw().state, storage::SessionState::kOpen);
  EXPECT_EQ(freezing(graph_, 1, true).reason(), Reason::WRONG_STATE);
  EXPECT_EQ(freezing(graph_, kDeleted.session, true).reason(), Reason::SESSION_DELETED);
  EXPECT_EQ(freezing(graph_, 3, true).status().to_string(), "NO_SUCH_SESSION: no session 3");
}

TEST_F(OperatorEdit, ASessionIsDeletedOnlyByItsUuid) {
  const std::string uuid = graph_.session(1)->header.uuid.to_string();
  EXPECT_EQ(session_to_delete(graph_, 1, uuid).or_throw().number, 1u);
  SessionUuid other;
  other.bytes.fill(9);
  EXPECT_EQ(session_to_delete(graph_, 1, other.to_string()).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(session_to_delete(graph_, 1, "").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(session_to_delete(graph_, 3, uuid).reason(), Reason::NO_SUCH_SESSION);
  EXPECT_TRUE(session_to_delete(graph_, kDeleted.session, graph_.session(2)->header.uuid.to_string()).ok());
}

}  // namespace
}  // namespace relmap::map
