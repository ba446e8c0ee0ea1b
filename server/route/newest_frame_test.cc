#include "server/route/newest_frame.h"

#include <gtest/gtest.h>

#include <vector>

#include "storage/testing/partial_graph.h"

namespace relmap::route {
namespace {

// A map of which only the sessions are known.
class SessionsOnly final : public storage::PartialGraph {
 public:
  // Adds the next session, of four frames; returns it, to be changed.
  storage::Session& add(const std::string& robot, std::int64_t last_time_us) {
    storage::Session session;
    session.number = static_cast<SessionNumber>(sessions_.size() + 1);
    session.header.robot = robot;
    session.header.camera = {400, 255.5, 191.5, 0.3, 512, 384};
    session.frames = 4;
    session.last = 10 * session.number;
    session.last_time_us = last_time_us;
    return sessions_.emplace_back(session);
  }
  std::shared_ptr<const storage::FrameHot> hot(FrameId) const override { return nullptr; }
  std::vector<storage::Session> all_sessions() const override { return sessions_; }
  std::optional<storage::Session> session(SessionNumber number) const override { return sessions_.at(number - 1); }

 private:
  std::vector<storage::Session> sessions_;
};

TEST(NewestFrame, IsTheLastOneOfTheRobotsLatestSession) {
  SessionsOnly map;
  map.add("mole", 200);
  map.add("mole", 300);
  map.add("mole", 100);
  map.add("vole", 400);
  EXPECT_EQ(newest_frame(map, "mole").or_throw(), (FrameId{2, 20}));
  EXPECT_EQ(newest_frame(map, "vole").or_throw(), (FrameId{4, 40}));
  map.add("mole", 300);
  EXPECT_EQ(newest_frame(map, "mole").or_throw(), (FrameId{5, 50})) << "of equal times the later session counts";
}

TEST(NewestFrame, IsOfAMonoSessionOnlyIfThereIsNoOther) {
  SessionsOnly map;
  map.add("mole", 200).header.camera.baseline = 0;
  EXPECT_EQ(newest_frame(map, "mole").or_throw(), (FrameId{1, 10}));
  map.add("mole", 100);
  EXPECT_EQ(newest_frame(map, "mole").or_throw(), (FrameId{2, 20}));
}

TEST(NewestFrame, IsOfNoSessionThatIsEmptyOrBeingDeleted) {
  SessionsOnly map;
  map.add("mole", 100);
  map.add("mole", 200).frames = 0;
  map.add("mole", 300).state = storage::SessionState::kDeleting;
  EXPECT_EQ(newest_frame(map, "mole").or_throw(), (FrameId{1, 10}));
  EXPECT_EQ(newest_frame(map, "nobody").status().to_string(),
            "NO_SUCH_SESSION: no robot named 'nobody' has sent a frame");
}

}  // namespace
}  // namespace relmap::route
