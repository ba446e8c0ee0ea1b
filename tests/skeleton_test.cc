// The skeleton of a city of known shape, through a daemon: nothing is lost, at no level, between no messages, and for
// no choice of sessions; and laid out it has the city's shape.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "client/skeleton_relaxation.h"
#include "relmap/v1/map.grpc.pb.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/published.h"
#include "tests/support/running_daemon.h"
#include "tests/support/skeleton_city.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

constexpr std::uint32_t kSessions = 6, kFrames = 1500;

class SkeletonOfACity : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = std::make_unique<storage::TemporaryFolder>();
    build_city_folder(city(), map_folder());
    {
      const auto map = open_stored_map(map_folder());
      EXPECT_TRUE(map->digests_hold());
      const auto view = map->view();
      for (SessionNumber session = 1; session <= kSessions; ++session)
        for (std::uint32_t i = 0; i < kFrames; ++i)
          for (const storage::Edge& edge : view->hot({session, i})->edges)
            (edge.kind == storage::EdgeKind::kLoop ? loops() : steps()).push_back(edge);
    }
    daemon() = std::make_unique<RunningDaemon>(DaemonOptions{.data = map_folder(), .lcm = "", .more = {}});
  }
  static void TearDownTestSuite() {
    EXPECT_EQ(daemon()->stop(), 0) << daemon()->log();
    daemon().reset();
    folder().reset();
    loops().clear();
    steps().clear();
  }
  static SkeletonCity city() {
    SkeletonCity city;
    city.frames = kSessions * kFrames;
    city.frames_per_session = kFrames;
    city.streets = 5;
    return city;
  }
  static std::unique_ptr<storage::TemporaryFolder>& folder() {
    static std::unique_ptr<storage::TemporaryFolder> folder;
    return folder;
  }
  static std::string map_folder() { return *folder() / "map"; }
  static std::unique_ptr<RunningDaemon>& daemon() {
    static std::unique_ptr<RunningDaemon> daemon;
    return daemon;
  }
  static std::vector<storage::Edge>& loops() {
    static std::vector<storage::Edge> all;
    return all;
  }
  static std::vector<storage::Edge>& steps() {
    static std::vector<storage::Edge> all;
    return all;
  }
  static std::set<FrameId> points_of(const client::Skeleton& skeleton) {
    std::set<FrameId> all;
    for (const auto& chain : skeleton.chains)
      for (const auto& point : chain.points) all.insert(point.frame);
    return all;
  }

  std::unique_ptr<client::Client> client = daemon()->client();
};

TEST_F(SkeletonOfACity, HasEveryEndAndChainsToWhatItsFramesChainTo) {
  std::map<FrameId, SE3> T_before_frame;
  for (const storage::Edge& edge : steps()) T_before_frame[edge.b] = edge.T_ab;
  for (std::uint32_t level = 0; level < 4; ++level) {
    std::uint64_t done = 0;
    const auto skeleton = client
                              ->skeleton({.level = level, .sessions = {}, .candidates = true},
                                         [&](const client::Skeleton& so_far) {
                                           EXPECT_GT(so_far.frames_done, done);
                                           done = so_far.frames_done;
                                           return Status();
                                         })
                              .or_throw();
    EXPECT_EQ(done, kSessions * kFrames);
    EXPECT_EQ(skeleton.frames, kSessions * kFrames);
    ASSERT_EQ(skeleton.chains.size(), kSessions);
    std::uint64_t alike = 0, frames = 0;
    const std::set<FrameId> points = points_of(skeleton);
    for (const auto& closure : skeleton.closures) {
      alike += closure.alike;
      EXPECT_TRUE(points.contains(closure.a)) << closure.id.to_string();
      EXPECT_TRUE(points.contains(closure.id.frame)) << closure.id.to_string();
    }
    EXPECT_EQ(alike, loops().size());
    for (const auto& chain : skeleton.chains) {
      EXPECT_EQ(chain.points.front().frame.index, 0u);
      EXPECT_EQ(chain.points.back().frame.index, kFrames - 1);
      for (std::size_t i = 1; i < chain.points.size(); ++i) {
        const auto& point = chain.points[i];
        SE3 exact;
        for (std::uint32_t index = chain.points[i - 1].frame.index + 1; index <= point.frame.index; ++index, ++frames)
          exact = exact * T_before_frame.at({chain.session, index});
        EXPECT_LT((exact.t - point.T_before_this.t).norm(), 2e-4 * point.frames);
        EXPECT_LT(so3_log(exact.R.transpose() * point.T_before_this.R).norm(), 1e-3);
        EXPECT_GT(point.translation_variance, 0);
      }
    }
    EXPECT_EQ(frames, kSessions * (kFrames - 1));
    if (level == 3) {
      EXPECT_EQ(points.size(), kSessions * kFrames);
      EXPECT_EQ(skeleton.closures.size(), loops().size());
    } else {
      EXPECT_LT(points.size(), kSessions * kFrames / 2);
    }
  }
}

TEST_F(SkeletonOfACity, WithoutCandidatesHasWhatIsInForce) {
  const auto skeleton = client->skeleton({.level = 3}).or_throw();
  const auto in_force = std::count_if(loops().begin(), loops().end(), [](const storage::Edge& edge) {
    return edge.state == storage::EdgeState::kAccepted;
  });
  EXPECT_LT(static_cast<std::size_t>(in_force), loops().size());
  EXPECT_EQ(skeleton.closures.size(), static_cast<std::size_t>(in_force));
  for (const auto& closure : skeleton.closures) EXPECT_EQ(closure.state, client::EdgeState::kAccepted);
}

TEST_F(SkeletonOfACity, ShowsTheChosenSessions) {
  const auto whole = client->skeleton({.level = 3}).or_throw();
  for (std::uint32_t choice = 1; choice < 1u << kSessions; choice += 5) {
    client::SkeletonOptions options{.level = 3};
    for (SessionNumber session = 1; session <= kSessions; ++session)
      if ((choice >> (session - 1)) & 1) options.sessions.push_back(session);
    const auto chosen = [&](SessionNumber session) { return ((choice >> (session - 1)) & 1) != 0; };
    const auto skeleton = client->skeleton(options).or_throw();
    EXPECT_EQ(skeleton.points(), options.sessions.size() * kFrames);
    for (const auto& chain : skeleton.chains) EXPECT_TRUE(chosen(chain.session));
    const auto expected = std::count_if(whole.closures.begin(), whole.closures.end(), [&](const auto& closure) {
      return chosen(closure.a.session) && chosen(closure.id.frame.session);
    });
    EXPECT_EQ(skeleton.closures.size(), static_cast<std::size_t>(expected));
  }
  EXPECT_EQ(client->skeleton({.level = 1, .sessions = {77}}).reason(), Reason::NO_SUCH_SESSION);
  EXPECT_EQ(client->skeleton({.level = 4}).reason(), Reason::INVALID_ARGUMENT);
}

// A stream that is left after any message goes on with the next.
TEST_F(SkeletonOfACity, IsTheSameHoweverOftenItsStreamBreaks) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(16 << 20);
  const auto stub = v1::Map::NewStub(
      grpc::CreateCustomChannel("unix:" + map_folder() + "/socket", grpc::InsecureChannelCredentials(), arguments));
  v1::GetSkeletonRequest request;
  request.set_level(3);
  std::vector<std::string> whole, broken;
  const auto take = [](v1::GetSkeletonReply& reply) {
    reply.clear_resume_token();
    return reply.SerializeAsString();
  };
  {
    grpc::ClientContext context;
    const auto stream = stub->GetSkeleton(&context, request);
    for (v1::GetSkeletonReply reply; stream->Read(&reply);) {
      EXPECT_LT(reply.ByteSizeLong(), 320u << 10);
      whole.push_back(take(reply));
    }
    ASSERT_TRUE(stream->Finish().ok());
  }
  ASSERT_GT(whole.size(), 1u);
  for (bool going = true; going && broken.size() <= whole.size();) {
    grpc::ClientContext context;
    const auto stream = stub->GetSkeleton(&context, request);
    v1::GetSkeletonReply reply;
    going = stream->Read(&reply);
    if (going && reply.frames_done() == reply.frames_total()) going = false;
    if (reply.resume_token().empty()) break;
    request.set_resume_token(reply.resume_token());
    broken.push_back(take(reply));
    context.TryCancel();
    (void)stream->Finish();
  }
  EXPECT_TRUE(broken == whole);
  const auto expect_refused = [&](const v1::GetSkeletonRequest& asked) {
    grpc::ClientContext context;
    const auto stream = stub->GetSkeleton(&context, asked);
    v1::GetSkeletonReply reply;
    EXPECT_FALSE(stream->Read(&reply));
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  };
  // The token is that of another question.
  v1::GetSkeletonRequest other = request;
  other.set_level(2);
  expect_refused(other);
  other = request;
  other.set_candidates(true);
  expect_refused(other);
  other = request;
  other.add_sessions(1);
  expect_refused(other);
  request.set_resume_token("not one");
  expect_refused(request);
}

// docs/figures.md publishes the sizes of a million frames; the same city, smaller, takes about as much for a frame.
TEST_F(SkeletonOfACity, IsAsSmallAsPublished) {
  const auto stub =
      v1::Map::NewStub(grpc::CreateChannel("unix:" + map_folder() + "/socket", grpc::InsecureChannelCredentials()));
  const std::string kFigures = "docs/figures.md";
  const std::map<std::uint32_t, double> published = {
      {0, published_figure(kFigures, "the same at level 0, 2 and 3 \\| ([0-9.]+), ")},
      {1, published_figure(kFigures, "of all messages \\| ([0-9.]+) MB")},
      {2, published_figure(kFigures, "the same at level 0, 2 and 3 \\| [0-9.]+, ([0-9.]+), ")}};
  for (const auto& [level, megabytes] : published) {
    v1::GetSkeletonRequest request;
    request.set_level(level);
    grpc::ClientContext context;
    const auto stream = stub->GetSkeleton(&context, request);
    std::size_t bytes = 0;
    for (v1::GetSkeletonReply reply; stream->Read(&reply);) bytes += reply.ByteSizeLong();
    ASSERT_TRUE(stream->Finish().ok());
    expect_at_most(static_cast<double>(bytes) / (kSessions * kFrames), megabytes,
                   "bytes for a frame at level " + std::to_string(level));
  }
}

TEST_F(SkeletonOfACity, LaidOutHasTheCitysShape) {
  for (const std::uint32_t level : {0u, 1u, 2u}) {
    const auto skeleton = client->skeleton({.level = level}).or_throw();
    const auto relaxed = client::relax_skeleton(skeleton, {.root = FrameId{1, 0}}).or_throw();
    const auto& part = relaxed.parts.front();
    EXPECT_GT(part.places.size(), 100u);
    std::map<SessionNumber, std::vector<SE3>> ways;
    for (SessionNumber session = 1; session <= kSessions; ++session) ways[session] = true_way(city(), session);
    const SE3 T_world_root = ways.at(1)[0];
    std::vector<double> errors;
    for (const auto& place : part.places)
      errors.push_back(
          (T_world_root * place.T_root_frame.t - ways.at(place.frame.session)[place.frame.index].t).norm());
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 1.5) << "metres, of a city of 400 m, at level " << level;
  }
}

}  // namespace
}  // namespace relmap::testing
