#include "server/map/watchers.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <vector>

#include "storage/testing/small_graph.h"

namespace relmap::map {
namespace {

TEST(EditAnnouncer, TheFirstWatcherIsToldOfEarlierEdits) {
  EditAnnouncer edits;
  const std::vector<storage::ChunkId> first = {{1, 0}, {1, 1}}, second = {{1, 1}, {2, 0}};
  edits.edited(4, first);
  edits.edited(5, second);
  std::set<storage::ChunkId> heard;
  std::uint64_t last = 0;
  const auto hear = [&](std::uint64_t version, std::span<const storage::ChunkId> chunks) {
    last = version;
    heard.insert(chunks.begin(), chunks.end());
  };
  EXPECT_EQ(5u, edits.watch(hear));
  EXPECT_EQ(5u, last);
  EXPECT_EQ((std::set<storage::ChunkId>{{1, 0}, {1, 1}, {2, 0}}), heard);
  heard.clear();
  edits.watch({});
  edits.edited(6, first);
  edits.watch(hear);
  EXPECT_TRUE(heard.empty()) << "what nobody hears is kept for the first watcher alone";
  edits.edited(7, second);
  EXPECT_EQ(2u, heard.size());
  EXPECT_EQ(7u, last);
}

TEST(ClosureAnnouncer, AWatcherThatThrowsMissesOnlyThatClosure) {
  storage::SmallGraph graph;
  graph.join({1, 0}, {1, 1});
  graph.join({1, 0}, {1, 5}, 1);
  graph.join({1, 1}, {1, 6}, 1);
  ClosureChange change;
  change.lone = {{{1, 5}, 1}};
  change.accepted = {{{1, 6}, 1}};
  ClosureAnnouncer closures;
  closures.announce(graph, change);  // nobody hears it
  std::vector<EdgeId> heard;
  closures.watch([&](const storage::Graph&, const storage::Edge& closure) {
    if (closure.id.frame.index == 5) throw std::runtime_error("the link is down");
    heard.push_back(closure.id);
  });
  closures.announce(graph, change);
  EXPECT_EQ((std::vector<EdgeId>{{{1, 6}, 1}}), heard);
  closures.watch({});
  closures.announce(graph, change);
  EXPECT_EQ(1u, heard.size());
}

}  // namespace
}  // namespace relmap::map
