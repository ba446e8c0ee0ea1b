#include "client/event_json.h"

#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include "relmap/v1/watch.pb.h"

namespace relmap::client {
namespace {

void expect_reads_back(const v1::MapEvent& event) {
  v1::MapEvent read;
  const std::string json = event_json(event);
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(json, &read).ok()) << json;
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(read, event)) << json;
}

TEST(EventJson, TellsOfASessionWhatTheEventCarries) {
  v1::MapEvent event;
  event.mutable_session_changed()->set_number(3);
  event.mutable_session_changed()->set_uuid("u");
  event.mutable_session_changed()->set_robot("cart \"A\"");
  event.mutable_session_changed()->set_name("morning");
  event.set_resume_token("token");
  event.set_journal_sequence(7);
  expect_reads_back(event);
  const std::string json = event_json(event);
  EXPECT_EQ(
      json.find("{\"sessionChanged\":{\"number\":3,\"uuid\":\"u\",\"robot\":\"cart \\\"A\\\"\",\"name\":\"morning\","
                "\"state\":\"SESSION_STATE_OPEN\"},"),
      0u)
      << json;
  EXPECT_EQ(json.find("frames"), std::string::npos) << json;
  for (const char* around : {"\"resumeToken\":\"token\"", "\"journalSequence\":\"7\"", "\"note\":\"\""})
    EXPECT_NE(json.find(around), std::string::npos) << around << " in " << json;
}

TEST(EventJson, TellsOfAClosureWhatTheEventCarriesAndItsZeros) {
  v1::MapEvent event;
  v1::Edge& edge = *event.mutable_edge_changed();
  edge.mutable_id()->mutable_frame()->set_session(3);
  edge.mutable_id()->set_ordinal(1);
  edge.set_state(v1::EDGE_STATE_REMOVED);
  edge.mutable_a_from_b()->mutable_translation()->set_x(0.5);
  expect_reads_back(event);
  const std::string json = event_json(event);
  for (const char* carried : {"\"carries\":false", "\"inliers\":0", "\"probability\":0", "\"spread\":0",
                              "\"state\":\"EDGE_STATE_REMOVED\"", "\"aFromB\":{"})
    EXPECT_NE(json.find(carried), std::string::npos) << carried << " in " << json;
  for (const char* other : {"support", "bound", "drivenS", "history", "unmeasured"})
    EXPECT_EQ(json.find(other), std::string::npos) << other << " in " << json;
}

TEST(EventJson, OfOtherEventsIsWhole) {
  v1::MapEvent event;
  event.mutable_skipped()->set_session(3);
  expect_reads_back(event);
  EXPECT_NE(event_json(event).find("\"refused\":false"), std::string::npos);
}

}  // namespace
}  // namespace relmap::client
