#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "server/place/picture_cache.h"
#include "storage/testing/partial_graph.h"

namespace relmap::place {
namespace {

// Frames without a picture, which the cache remembers like those with one. Counts who asks for what they saw.
class CountingGraph final : public storage::PartialGraph {
 public:
  std::shared_ptr<const storage::FrameHot> hot(FrameId) const override { return nullptr; }
  std::shared_ptr<const storage::FrameCold> cold(FrameId frame) const override {
    ++reads[frame.index];
    while (reads_begin < wait_for) std::this_thread::yield();
    if (failures_left.fetch_sub(1) > 0) throw StatusError({Reason::VIEW_EXPIRED, "memory is short"});
    return nullptr;
  }

  static constexpr std::uint32_t kFrames = 40;
  mutable std::atomic<int> reads[kFrames] = {};
  mutable std::atomic<int> failures_left = 0;
  std::atomic<int> reads_begin = 0, wait_for = 0;  // until so many threads are about to ask
};

constexpr int kThreads = 4;

TEST(PictureCacheThreads, APictureThatSeveralThreadsWantIsReadByOne) {
  CountingGraph graph;
  PictureCache cache;
  graph.wait_for = kThreads;
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t)
      threads.emplace_back([&] {
        ++graph.reads_begin;
        EXPECT_EQ(cache.find(graph, {1, 0}), nullptr);
      });
  }
  EXPECT_EQ(graph.reads[0], 1);
}

TEST(PictureCacheThreads, ThreadsReadDifferentPicturesAtTheSameTime) {
  CountingGraph graph;
  PictureCache cache;
  std::vector<std::jthread> threads;
  for (int t = 0; t < kThreads; ++t)
    threads.emplace_back([&, t] {
      for (std::uint32_t i = 0; i < 2000; ++i)
        (void)cache.find(graph, {1, (i * 7 + static_cast<std::uint32_t>(t) * 11) % CountingGraph::kFrames});
    });
  threads.clear();
  for (const auto& reads : graph.reads) EXPECT_EQ(reads, 1) << "all of them fit into the cache";
}

TEST(PictureCacheThreads, WhereAReadFailsTheNextWhoWantsThePictureReadsIt) {
  CountingGraph graph;
  PictureCache cache;
  graph.failures_left = 2;
  graph.wait_for = kThreads;
  std::atomic<int> failed = 0, found = 0;
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t)
      threads.emplace_back([&] {
        ++graph.reads_begin;
        try {
          (void)cache.find(graph, {1, 0});
          ++found;
        } catch (const StatusError&) {
          ++failed;
        }
      });
  }
  EXPECT_EQ(failed, 2);
  EXPECT_EQ(found, kThreads - 2);
  EXPECT_EQ(graph.reads[0], 3);
}

}  // namespace
}  // namespace relmap::place
