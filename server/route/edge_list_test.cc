#include "server/route/edge_list.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/route/testing/drawn_map.h"

namespace relmap::route {
namespace {

// Two drives past one corner, with closures between them. Two of the closures are stored with frames of session 2.
class EdgeList : public testing::Test {
 protected:
  EdgeList()
      : map_(R"(
          A--B--C--D
          E--F--G--H
        )") {
    map_.drive("ABCD");
    map_.drive("EFGH");
    within_ = map_.close("AD");
    first_ = map_.close("BF");
    second_ = map_.close("CG");
    for (const SessionNumber number : {1u, 2u}) map_.edit_session(number).header.camera.baseline = 0.1;
  }
  std::vector<EdgeId> list(const EdgeFilter& filter, EdgeId after = {}, std::size_t max_count = 100) const {
    std::vector<EdgeId> ids;
    const Status status = for_each_edge(map_, filter, after, {}, [&](const storage::Edge& edge) {
      ids.push_back(edge.id);
      return ids.size() < max_count;
    });
    EXPECT_TRUE(status.ok()) << status.to_string();
    return ids;
  }
  static EdgeId step(SessionNumber session, std::uint32_t index) { return {{session, index}, 0}; }

  DrawnMap map_;
  EdgeId within_, first_, second_;
};

TEST_F(EdgeList, ListsAllEdgesInOrderOfTheirIds) {
  EXPECT_EQ(list({}), (std::vector<EdgeId>{step(1, 1), step(1, 2), step(1, 3), within_, step(2, 1), first_, step(2, 2),
                                           second_, step(2, 3)}));
}

TEST_F(EdgeList, GoesOnBehindAnEdgeAndEndsWhenTold) {
  EXPECT_EQ(list({}, within_, 2), (std::vector<EdgeId>{step(2, 1), first_}));
  EXPECT_EQ(list({}, step(2, 3)), std::vector<EdgeId>());
}

TEST_F(EdgeList, ASessionHasTheEdgesThatOtherSessionsStore) {
  EdgeFilter filter;
  filter.session = 1;
  EXPECT_EQ(list(filter), (std::vector<EdgeId>{step(1, 1), step(1, 2), step(1, 3), within_, first_, second_}));
  EXPECT_EQ(list(filter, first_), std::vector<EdgeId>{second_});
}

TEST_F(EdgeList, AFrameHasTheEdgesThatEndInIt) {
  EdgeFilter filter;
  filter.frame = map_.id('B');
  EXPECT_EQ(list(filter), (std::vector<EdgeId>{step(1, 1), step(1, 2), first_}));
}

TEST_F(EdgeList, ListsTheStatesAndKindsThatAreAskedFor) {
  EdgeFilter loops;
  loops.kinds = {storage::EdgeKind::kLoop};
  EXPECT_EQ(list(loops), (std::vector<EdgeId>{within_, first_, second_}));
  map_.set_state(first_, storage::EdgeState::kRemoved);
  EdgeFilter removed;
  removed.states = {storage::EdgeState::kRemoved};
  EXPECT_EQ(list(removed), std::vector<EdgeId>{first_});
}

TEST_F(EdgeList, MonoSessionsHaveNoEdges) {
  map_.edit_session(2).header.camera.baseline = 0;
  EXPECT_EQ(list({}), (std::vector<EdgeId>{step(1, 1), step(1, 2), step(1, 3), within_}));
  EdgeFilter filter;
  filter.session = 2;
  EXPECT_EQ(list(filter), std::vector<EdgeId>());
}

TEST_F(EdgeList, ABrokenChainOfOdometryIsDataLoss) {
  map_.editable(map_.id('B')).incoming.clear();
  EXPECT_EQ(for_each_edge(map_, {}, {}, {}, [](const storage::Edge&) { return true; }).reason(), Reason::DATA_LOSS);
}

TEST_F(EdgeList, EndsWithWhatProceedSays) {
  const WorkLimit late{.proceed = [](std::size_t) { return Status(Reason::DEADLINE, "late"); }};
  EXPECT_EQ(for_each_edge(map_, {}, {}, late, [](const storage::Edge&) { return true; }).reason(), Reason::DEADLINE);
}

}  // namespace
}  // namespace relmap::route
