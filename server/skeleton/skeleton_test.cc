#include "server/skeleton/skeleton.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "server/skeleton/level.h"
#include "storage/engine/memory_engine.h"

namespace relmap::skeleton {
namespace {

using storage::Edge;
using storage::EdgeState;
using storage::FrameHot;

// A map of three sessions: 1 drives a winding way, 2 a straight one that is interrupted, guessed at and carried, 4 is
// of one camera; 3 drives again where 1 was, with closures to it.
class SkeletonTest : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFrames = 700;

  void SetUp() override {
    engine = storage::make_memory_engine();
    map = storage::Map::open(engine, engine->acquire().value(), budget).value();
    for (const SessionNumber number : {1u, 2u, 3u, 4u}) {
      storage::Session session;
      session.number = number;
      session.header.uuid.bytes[0] = static_cast<std::uint8_t>(number);
      session.header.camera = {400, 256, 192, number == 4 ? 0 : 0.12, 512, 384};
      map->add_session(session);
    }
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      add({1, i}, winding(i), i > 0);
      const bool guess = i >= 300 && i < 310, carried = i >= 400 && i < 403;
      FrameHot& straight = add({2, 10 + i}, {Matrix3::Identity(), {0, 0, 1}}, i > 0 && i != 200);
      if (i > 0 && i != 200) {
        straight.edges[0].kind = guess ? storage::EdgeKind::kPrior : storage::EdgeKind::kOdometry;
        if (guess) straight.edges[0].support = 0;
        if (carried) straight.edges[0].carried_by.push_back({{3, 1}, 1});
        if (i == 500) {
          straight.edges[0].source = MotionSource::kUnsensed;
          straight.edges[0].support = 0;
        }
      }
      if (i % 3 == 0) add({4, i}, {}, false);
    }
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      FrameHot& again = add({3, i}, winding(i), i > 0);
      if (i % 2 == 0) close(again, {3, i}, {1, (i * 7) % kFrames}, 1, EdgeState::kAccepted);
      if (i % 50 == 0) close(again, {3, i}, {1, i}, 2, EdgeState::kCandidate);
      if (i % 200 == 0) close(again, {3, i}, {2, 10 + i}, 3, EdgeState::kAccepted);
    }
    map->state().keyframes = 3 * kFrames;
    ASSERT_TRUE(map->commit().ok());
    view = map->view();
  }
  SE3 winding(std::uint32_t i) {
    return {so3_exp({0, i % 100 < 30 ? 0.05 : 0, 0.001}), {noise(0.02), noise(0.02), 1 + noise(0.1)}};
  }
  double noise(double sigma) { return std::normal_distribution<double>(0, sigma)(rng); }
  FrameHot& add(FrameId id, const SE3& step, bool joined) {
    FrameHot hot;
    hot.present = true;
    hot.time_us = std::int64_t{id.session} * 1'000'000'000 + id.index * 400'123LL;
    if (joined) {
      Edge edge;
      edge.id = {id, 0};
      edge.a = {id.session, id.index - 1};
      edge.b = id;
      edge.support = 100;
      edge.T_ab = step;
      edge.covariance.diagonal() << 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6;
      hot.edges.push_back(edge);
    }
    map->add_frame(id, std::move(hot), {}, {});
    storage::Session& session = map->edit_session(id.session);
    if (session.frames++ == 0) session.first = id.index;
    session.last = id.index;
    return map->edit_hot(id);
  }
  void close(FrameHot& hot, FrameId b, FrameId a, std::uint32_t ordinal, EdgeState state) {
    Edge edge;
    edge.id = {b, ordinal};
    edge.a = a;
    edge.b = b;
    edge.kind = storage::EdgeKind::kLoop;
    edge.state = state;
    edge.verification = storage::Verification::kStereo;
    edge.T_ab.t = {noise(1), noise(1), noise(1)};
    edge.covariance.diagonal().setConstant(1e-3 + 1e-3 * std::abs(noise(1)));
    edge.inliers = static_cast<std::uint16_t>(b.index % 97);
    hot.edges.push_back(edge);
  }

  struct Told {
    std::vector<Chain> chains;
    std::vector<Closure> closures;
    std::size_t pages = 0;
    std::set<FrameId> points() const {
      std::set<FrameId> all;
      for (const Chain& chain : chains)
        for (const Point& point : chain.points) all.insert({chain.session, point.index});
      return all;
    }
  };
  std::unique_ptr<SkeletonReader> reader(const SkeletonOptions& options, const Suspicion& suspicion = {}) const {
    return SkeletonReader::open(view, options, suspicion, {}).or_throw();
  }
  // `resumed`: every page is read by another reader.
  Told read(const SkeletonOptions& options, bool resumed = false, const Suspicion& suspicion = {}) const {
    Told told;
    auto from = reader(options, suspicion);
    std::uint64_t done = 0;
    for (;;) {
      auto page = from->next().or_throw();
      if (!page) break;
      ++told.pages;
      EXPECT_GT(page->end.frames_done, done);
      done = page->end.frames_done;
      for (const Chain& chain : page->chains) {
        EXPECT_FALSE(chain.points.empty());
        // A chain that goes on in the next page begins there with a copy of its last point.
        if (&chain == page->chains.data() && !told.chains.empty() && told.chains.back().session == chain.session &&
            told.chains.back().points.back().index == chain.points.front().index)
          told.chains.back().points.insert(told.chains.back().points.end(), chain.points.begin() + 1,
                                           chain.points.end());
        else
          told.chains.push_back(chain);
      }
      told.closures.insert(told.closures.end(), page->closures.begin(), page->closures.end());
      if (!resumed) continue;
      from = reader(options, suspicion);
      from->resume(*Position::parse(page->end.to_string()));
    }
    EXPECT_EQ(done, from->frames_total());
    return told;
  }
  static void expect_same(const Told& a, const Told& b) {
    ASSERT_EQ(a.chains.size(), b.chains.size());
    for (std::size_t i = 0; i < a.chains.size(); ++i) {
      ASSERT_EQ(a.chains[i].points.size(), b.chains[i].points.size());
      for (std::size_t k = 0; k < a.chains[i].points.size(); ++k) {
        const Point &p = a.chains[i].points[k], &q = b.chains[i].points[k];
        EXPECT_EQ(p.index, q.index);
        EXPECT_EQ(p.time_us, q.time_us);
        EXPECT_EQ(p.frames, q.frames);
        EXPECT_EQ(p.T_before_this, q.T_before_this);
        EXPECT_EQ(p.translation_variance, q.translation_variance);
      }
    }
    ASSERT_EQ(a.closures.size(), b.closures.size());
    for (std::size_t i = 0; i < a.closures.size(); ++i) EXPECT_EQ(a.closures[i].digest.id, b.closures[i].digest.id);
  }

  std::mt19937 rng{1};
  std::shared_ptr<storage::Engine> engine;
  std::shared_ptr<storage::Budget> budget = std::make_shared<storage::Budget>(std::size_t{256} << 20);
  std::unique_ptr<storage::Map> map;
  std::shared_ptr<const storage::MapView> view;
};

TEST_F(SkeletonTest, AtTheLastLevelEveryFrameIsAPointAndEveryClosureIsTold) {
  const Told told = read({.level = 3, .candidates = true});
  EXPECT_EQ(told.points().size(), 3u * kFrames);
  EXPECT_EQ(told.closures.size(), kFrames / 2 + kFrames / 50 + 4);
  ASSERT_EQ(told.chains.size(), 5u) << "session 2 is interrupted twice";
  EXPECT_EQ(told.chains[1].points.size(), 200u);
  EXPECT_EQ(told.chains[2].points.size(), 300u);
  EXPECT_EQ(told.chains[3].points.size(), 200u);
  for (const Chain& chain : told.chains)
    for (std::size_t i = 1; i < chain.points.size(); ++i) EXPECT_EQ(chain.points[i].frames, 1u);
}

// What is stored of a step is exact to 2^-15 of it.
TEST_F(SkeletonTest, AContractedStepIsThatOfTheChainOfItsFrames) {
  const Told all = read({.level = 3});
  std::map<FrameId, Point> steps;
  for (const Chain& chain : all.chains)
    for (const Point& point : chain.points) steps[{chain.session, point.index}] = point;
  for (const std::uint32_t level : {0u, 1u, 2u}) {
    const Told told = read({.level = level});
    std::uint64_t frames = 0;
    for (const Chain& chain : told.chains) {
      ++frames;
      for (std::size_t i = 1; i < chain.points.size(); ++i) {
        const Point& point = chain.points[i];
        SE3 T, exact;
        std::uint32_t count = 0;
        double length = 0;
        bool unmeasured = false, carried = false;
        for (std::uint32_t index = chain.points[i - 1].index + 1; index <= point.index; ++index, ++count) {
          const Point& step = steps.at({chain.session, index});
          T = T * step.T_before_this;
          exact = exact * view->hot({chain.session, index})->edges[0].T_ab;
          length += step.T_before_this.t.norm();
          unmeasured = unmeasured || step.unmeasured;
          carried = carried || step.carried;
        }
        EXPECT_EQ(point.frames, count);
        EXPECT_LT((point.T_before_this.t - T.t).norm(), 1e-9);
        EXPECT_LT((point.T_before_this.t - exact.t).norm(), 2e-4 * length);
        EXPECT_LT(so3_log(exact.R.transpose() * point.T_before_this.R).norm(), 1e-3);
        EXPECT_EQ(point.unmeasured, unmeasured);
        EXPECT_EQ(point.carried, carried);
        frames += count;
      }
    }
    EXPECT_EQ(frames, 3u * kFrames);
  }
}

TEST_F(SkeletonTest, PointsAreFewAndAreThereWhereAnythingJoins) {
  for (const std::uint32_t level : {0u, 1u, 2u}) {
    const Told told = read({.level = level});
    const std::set<FrameId> points = told.points();
    std::set<FrameId> must;
    for (const Closure& closure : told.closures) must.insert({closure.digest.id.frame, closure.digest.a});
    for (const FrameId end : {FrameId{1, 0}, {1, kFrames - 1}, {2, 10}, {2, 9 + kFrames}, {3, 0}, {3, kFrames - 1}})
      must.insert(end);
    for (const std::uint32_t i : {199u, 200u, 299u, 309u, 399u, 402u, 499u, 500u}) must.insert({2, 10 + i});
    for (const FrameId id : must) EXPECT_TRUE(points.contains(id)) << id.to_string() << " at level " << level;
    const std::size_t chunks = 3 * (kFrames / storage::kFramesPerChunk + 2);
    EXPECT_LE(points.size(), must.size() + chunks * storage::kFramesPerChunk / stride(level)) << level;
    for (const Chain& chain : told.chains)
      for (const Point& point : chain.points) {
        if (chain.session != 2) continue;
        const std::uint32_t i = point.index - 10;
        EXPECT_TRUE(!point.unmeasured || (i >= 300 && i < 310)) << i;
        EXPECT_TRUE(!point.carried || (i >= 400 && i < 403)) << i;
      }
  }
  EXPECT_LT(read({.level = 1}).points().size(), read({.level = 2}).points().size());
}

// An error of a rotation moves what is behind it in proportion to the distance.
TEST_F(SkeletonTest, VariancesGrowWithTheLever) {
  const Told told = read({.level = 0, .sessions = {2}});
  for (const Chain& chain : told.chains)
    for (std::size_t i = 1; i < chain.points.size(); ++i) {
      const Point& point = chain.points[i];
      double expected = 0;
      for (std::uint32_t k = 0; k < point.frames; ++k) expected += 3e-4 + 2.0 / 3 * 3e-6 * k * k;  // metres to the end
      EXPECT_NEAR(point.translation_variance, expected, 0.01 * expected);
      EXPECT_NEAR(point.rotation_variance, 3e-6 * point.frames, 3e-8 * point.frames);
    }
}

TEST_F(SkeletonTest, PagesAndReadersThatResumeLoseNothing) {
  for (const std::uint32_t level : {0u, 1u, 2u, 3u}) {
    const Told whole = read({.level = level, .candidates = true});
    EXPECT_EQ(whole.pages, 1u);
    const Told paged = read({.level = level, .candidates = true, .page_bytes = 300});
    EXPECT_GT(paged.pages, 10u);
    expect_same(whole, paged);
    expect_same(whole, read({.level = level, .candidates = true, .page_bytes = 300}, true));
  }
}

TEST_F(SkeletonTest, OnlyChosenSessionsAreTold) {
  const std::vector<std::vector<SessionNumber>> choices{{1}, {2}, {3}, {1, 3}, {3, 2}, {1, 2, 3}};
  for (const auto& sessions : choices) {
    const std::set<SessionNumber> chosen(sessions.begin(), sessions.end());
    const Told told = read({.level = 1, .sessions = sessions, .page_bytes = 3000}, true);
    std::set<SessionNumber> seen;
    for (const Chain& chain : told.chains) seen.insert(chain.session);
    EXPECT_EQ(seen, chosen);
    for (const Closure& closure : told.closures)
      EXPECT_TRUE(chosen.contains(closure.digest.a.session) && chosen.contains(closure.digest.id.frame.session));
    EXPECT_EQ(told.closures.empty(), !chosen.contains(3) || chosen.size() == 1);
  }
  EXPECT_EQ(SkeletonReader::open(view, {.sessions = {4}}, {}, {}).reason(), Reason::NOT_STEREO);
  EXPECT_EQ(SkeletonReader::open(view, {.sessions = {9}}, {}, {}).reason(), Reason::NO_SUCH_SESSION);
  EXPECT_EQ(SkeletonReader::open(view, {.level = 4}, {}, {}).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(SkeletonTest, OfClosuresThatAreAlikeTheMostCertainAndTheMostSuspiciousAreTold) {
  const Told all = read({.level = 3});
  const Suspicion suspicion = [](const storage::ClosureDigest& closure) { return closure.inliers == 96 ? 0.9 : 0.1; };
  for (const std::uint32_t level : {0u, 1u, 2u}) {
    const Told told = read({.level = level}, false, suspicion);
    std::uint64_t count = 0;
    std::set<EdgeId> ids;
    for (const Closure& closure : told.closures) {
      count += closure.alike;
      EXPECT_TRUE(ids.insert(closure.digest.id).second);
    }
    EXPECT_EQ(count, all.closures.size()) << "all are counted";
    if (level < 2) {
      EXPECT_LT(told.closures.size(), all.closures.size());
    }
    // Beside a suspicious one that is not told, one that joins the same stretches is.
    const std::uint32_t stretch = closure_stretch(level);
    for (const Closure& closure : all.closures) {
      if (closure.digest.inliers != 96) continue;
      EXPECT_TRUE(std::any_of(told.closures.begin(), told.closures.end(), [&](const Closure& other) {
        return other.suspicion > 0.5 && other.digest.a.session == closure.digest.a.session &&
               other.digest.a.index / stretch == closure.digest.a.index / stretch &&
               storage::chunk_id(other.digest.id.frame) == storage::chunk_id(closure.digest.id.frame);
      })) << closure.digest.id.to_string();
    }
  }
}

TEST_F(SkeletonTest, EndsWhenItIsToldTo) {
  const auto stop = [](std::size_t) { return Status(Reason::DEADLINE, "it took too long"); };
  EXPECT_EQ(SkeletonReader::open(view, {}, {}, stop).or_throw()->next().reason(), Reason::DEADLINE);
}

TEST_F(SkeletonTest, OfAMapWithoutFramesThereIsNoPage) {
  const auto empty = storage::make_memory_engine();
  const auto other = storage::Map::open(empty, empty->acquire().value(), budget).value();
  const auto none = SkeletonReader::open(other->view(), {}, {}, {}).or_throw();
  EXPECT_FALSE(none->next().or_throw().has_value());
  EXPECT_EQ(none->frames_total(), 0u);
}

TEST(SkeletonPosition, IsReadAsItWasWritten) {
  const auto position = Position::parse(Position{{7, 1234}, 99}.to_string());
  ASSERT_TRUE(position);
  EXPECT_EQ(position->last, (FrameId{7, 1234}));
  EXPECT_EQ(position->frames_done, 99u);
  for (const char* text : {"", "7", "7:1", "7:x:3", "7:1:", "7:1:3x", "a:1:3"})
    EXPECT_FALSE(Position::parse(text)) << text;
}

}  // namespace
}  // namespace relmap::skeleton
