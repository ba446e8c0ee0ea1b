#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontend/vision/encoded_picture.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "server/place/testing/hand_made_graph.h"
#include "server/rpc/evidence_messages.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/testing/served_map.h"

namespace relmap::rpc {
namespace {

using testing::HasSubstr;
using testing::Not;

map::MapperOptions without_recognition() {
  map::MapperOptions options;
  options.closures = false;
  return options;
}

// The only closures are those that a test proposes.
class EvidenceHandlers : public testing::Test {
 protected:
  Result<v1::ExplainEdgeReply> explain(const v1::EdgeId& edge, bool pictures = false) {
    v1::ExplainEdgeRequest request;
    *request.mutable_edge() = edge;
    request.set_pictures(pictures);
    return call(*map_.core, explain_edge, request, deadline_);
  }
  v1::Edge propose(FrameId a, FrameId b, bool accept = false) {
    v1::ProposeEdgeRequest request;
    *request.mutable_a() = to_wire(a);
    *request.mutable_b() = to_wire(b);
    request.set_accept(accept);
    return call(*map_.core, propose_edge, request, deadline_).or_throw().edge();
  }
  v1::Edge set(const v1::EdgeId& edge, v1::EdgeState state, bool decided = false) {
    v1::SetEdgeStateRequest request;
    *request.mutable_edge() = edge;
    request.set_state(state);
    request.set_decided(decided);
    return call(*map_.core, set_edge_state, request, deadline_).or_throw().edge();
  }
  // A closure that nothing but its record tells of.
  v1::Edge record(FrameId a, FrameId b, const SE3& T_ab, storage::Verification verification) {
    storage::ClosureProposalRecord proposal;
    proposal.query = b;
    proposal.match = a;
    proposal.T_match_query = T_ab;
    proposal.covariance = 1e-4 * Matrix6::Identity();
    proposal.verification = verification;
    proposal.inliers = 90;
    proposal.spread = 0.4F;
    proposal.probability = 0.99F;
    map_.mapper->submit_and_wait(proposal).or_throw();
    map_.settle();
    const auto hot = map_.mapper->view()->hot(b);
    return edge_message(hot->edges.back(), hot->time_us);
  }
  SE3 truth(FrameId a, FrameId b) const {
    return map_.circuit.T_world_frame(a.index).inverse() * map_.circuit.T_world_frame(b.index);
  }
  static bool has(const v1::Suspicion& suspicion, v1::DoubtKind kind) {
    return std::any_of(suspicion.doubts().begin(), suspicion.doubts().end(),
                       [&](const v1::Doubt& doubt) { return doubt.kind() == kind; });
  }

  ServedMap map_{RpcLimits(), without_recognition()};
  Deadline deadline_;
};

constexpr FrameId kBefore{1, 4}, kAgain{1, 44};  // one lap apart

TEST_F(EvidenceHandlers, ACandidateIsExplained) {
  const v1::Edge proposed = propose(kBefore, kAgain);
  const auto reply = explain(proposed.id()).or_throw();
  EXPECT_EQ(reply.edge().state(), v1::EDGE_STATE_CANDIDATE);
  EXPECT_EQ(reply.edge().history_size(), 1);
  EXPECT_TRUE(has(reply.edge().suspicion(), v1::DOUBT_KIND_LONELY));
  EXPECT_GT(reply.edge().suspicion().value(), 0);
  EXPECT_EQ(reply.edge().time_us(), map_.mapper->view()->hot(kAgain)->time_us);
  EXPECT_EQ(reply.correspondences_reason(), v1::REASON_OK) << reply.correspondences_message();
  EXPECT_EQ(reply.motion().verdict(), v1::REASON_OK) << reply.motion().message();
  EXPECT_EQ(reply.motion().edges(), kAgain.index - proposed.a().index());
  EXPECT_EQ(reply.agreements_size(), 0);
  EXPECT_EQ(reply.map_version(), map_.mapper->view()->version());
  EXPECT_FALSE(reply.has_picture_a()) << "nobody asked for it";
}

TEST_F(EvidenceHandlers, CorrespondencesLieInBothFramesWhereTheirPointsProject) {
  const v1::Edge proposed = propose(kBefore, kAgain);
  const FrameId a = from_wire(proposed.a()).or_throw(), b = from_wire(proposed.b()).or_throw();
  const auto reply = explain(proposed.id()).or_throw();
  const StereoCamera camera = map_.circuit.options().camera;
  // What the frame saw, by the pixel where it saw it.
  std::map<std::pair<float, float>, sim::PointId> seen;
  const Keyframe keyframe = map_.circuit.keyframe(b.index);
  const auto points = map_.circuit.landmarks(b.index);
  for (const AppearanceFeature& feature : keyframe.appearance)
    if (feature.track >= 0) seen[{feature.u, feature.v}] = points[static_cast<std::size_t>(feature.track)];
  int inliers = 0, known = 0, near = 0, within_residual = 0;
  bool first_part = true;
  for (const v1::Correspondence& c : reply.correspondences()) {
    EXPECT_TRUE(first_part || !c.inlier()) << "the inliers come first";
    first_part = c.inlier();
    inliers += c.inlier();
    const auto point = seen.find({c.u(), c.v()});
    if (!c.inlier() || point == seen.end()) continue;
    ++known;
    const Vector3 in_a = map_.circuit.T_world_frame(a.index).inverse() * map_.circuit.point(point->second);
    const Vector2 at = camera.project(in_a).head<2>();
    near += (at - Vector2(c.frame_u(), c.frame_v())).norm() < 4;  // the world's pixels have a noise of 1
    within_residual += c.has_residual() && c.residual() < 8;
  }
  EXPECT_GE(inliers, 20);
  EXPECT_NEAR(inliers, static_cast<double>(proposed.inliers()), 0.3 * proposed.inliers());
  EXPECT_GE(known, 10);
  EXPECT_GE(near, known * 0.9);
  EXPECT_GE(within_residual, known * 0.9);
}

TEST_F(EvidenceHandlers, AnAcceptedClosureNamesThoseThatAgree) {
  const v1::Edge first = propose(kBefore, kAgain), second = propose({1, 6}, {1, 46});
  const auto reply = explain(second.id()).or_throw();
  EXPECT_EQ(reply.edge().state(), v1::EDGE_STATE_ACCEPTED);
  ASSERT_EQ(reply.agreements_size(), 1);
  EXPECT_EQ(reply.agreements(0).edge().SerializeAsString(), first.id().SerializeAsString());
  EXPECT_TRUE(reply.agreements(0).agrees());
  EXPECT_EQ(reply.agreements(0).state(), v1::EDGE_STATE_ACCEPTED);
  EXPECT_LT(reply.edge().suspicion().value(), explain(propose({1, 2}, {1, 42}).id())->edge().suspicion().value() + 1);
  EXPECT_EQ(reply.motion().verdict(), v1::REASON_OK);

  const v1::Edge removed = set(second.id(), v1::EDGE_STATE_REMOVED);
  const auto after = explain(removed.id()).or_throw();
  EXPECT_EQ(after.edge().state(), v1::EDGE_STATE_REMOVED);
  EXPECT_EQ(after.correspondences_reason(), v1::REASON_OK) << "its pictures are what they were";
}

TEST_F(EvidenceHandlers, AWrongClosureIsContradicted) {
  propose(kBefore, kAgain);
  propose({1, 6}, {1, 46});
  // Good figures, but another place of the circuit.
  v1::Edge planted = record({1, 20}, {1, 47}, truth({1, 7}, {1, 47}), storage::Verification::kStereo);
  EXPECT_EQ(planted.state(), v1::EDGE_STATE_CANDIDATE);
  planted = set(planted.id(), v1::EDGE_STATE_ACCEPTED, /*decided=*/true);
  ASSERT_EQ(planted.state(), v1::EDGE_STATE_ACCEPTED);
  const auto reply = explain(planted.id()).or_throw();
  EXPECT_EQ(reply.motion().verdict(), v1::REASON_CONTRADICTS_MOTION) << reply.motion().message();
  EXPECT_GT(reply.motion().sigmas_apart(), 4.1);
  EXPECT_GT(reply.edge().suspicion().value(), 0.7);
  EXPECT_TRUE(has(reply.edge().suspicion(), v1::DOUBT_KIND_CONTRADICTION));
  EXPECT_THAT(reply.edge().suspicion().remark(), HasSubstr("operator"));
  EXPECT_NE(reply.correspondences_reason(), v1::REASON_OK) << "the pictures show two places";
  EXPECT_NE(reply.correspondences_message(), "");

  set(planted.id(), v1::EDGE_STATE_CANDIDATE);
  const v1::Edge withdrawn = explain(planted.id()).or_throw().edge();
  EXPECT_NE(withdrawn.state(), v1::EDGE_STATE_ACCEPTED);
  EXPECT_THAT(withdrawn.suspicion().remark(), Not(HasSubstr("operator"))) << "he has withdrawn it";
  EXPECT_TRUE(has(withdrawn.suspicion(), v1::DOUBT_KIND_CONTRADICTION));
}

TEST_F(EvidenceHandlers, TheVerdictOfTheMotionIsOfNowAndTheDoubtsAreOfWhenTheClosureWasJudged) {
  const v1::Edge judged = propose(kBefore, kAgain);
  ASSERT_EQ(explain(judged.id())->motion().verdict(), v1::REASON_OK);
  // Two metres off, and put into force all the same: the way between the ends goes through it from now on.
  SE3 off = truth({1, 6}, {1, 43});
  off.t.x() += 2;
  const v1::Edge planted = record({1, 6}, {1, 43}, off, storage::Verification::kStereo);
  ASSERT_EQ(set(planted.id(), v1::EDGE_STATE_ACCEPTED, /*decided=*/true).state(), v1::EDGE_STATE_ACCEPTED);
  const auto now = explain(judged.id()).or_throw();
  EXPECT_EQ(now.motion().verdict(), v1::REASON_CONTRADICTS_MOTION) << now.motion().message();
  EXPECT_GT(now.motion().metres_apart(), 1);
  for (const v1::Doubt& doubt : now.edge().suspicion().doubts())
    EXPECT_THAT(doubt.message(), Not(HasSubstr("own motion contradicts it"))) << "it did not then";
}

TEST_F(EvidenceHandlers, SaysWhyThereAreNoCorrespondences) {
  const v1::Edge imported = record(kBefore, kAgain, truth(kBefore, kAgain), storage::Verification::kImported);
  const auto of_imported = explain(imported.id()).or_throw();
  EXPECT_EQ(of_imported.correspondences_reason(), v1::REASON_UNSUPPORTED);
  EXPECT_THAT(of_imported.correspondences_message(), HasSubstr("imported"));
  EXPECT_THAT(of_imported.edge().suspicion().remark(), HasSubstr("imported"));
  EXPECT_EQ(of_imported.motion().verdict(), v1::REASON_OK);

  const v1::Edge bridge = record({1, 3}, {1, 43}, truth({1, 3}, {1, 43}), storage::Verification::kCompounded);
  const auto of_bridge = explain(bridge.id()).or_throw();
  EXPECT_EQ(of_bridge.correspondences_reason(), v1::REASON_UNSUPPORTED);
  EXPECT_THAT(of_bridge.correspondences_message(), HasSubstr("deleted session"));
}

TEST_F(EvidenceHandlers, RefusesWhatIsNoClosure) {
  EXPECT_EQ(call(*map_.core, explain_edge, v1::ExplainEdgeRequest(), deadline_).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(explain(to_wire(EdgeId{{1, 7}, 0})).reason(), Reason::ODOMETRY_EDGE);
  EXPECT_EQ(explain(to_wire(EdgeId{{1, 7}, 9})).reason(), Reason::NO_SUCH_EDGE);
  EXPECT_EQ(explain(to_wire(EdgeId{{9, 7}, 1})).reason(), Reason::NO_SUCH_EDGE);
}

TEST_F(EvidenceHandlers, EndsAtItsDeadline) {
  const v1::Edge proposed = propose(kBefore, kAgain);
  v1::ExplainEdgeRequest request;
  *request.mutable_edge() = proposed.id();
  Deadline late;
  late.at = std::chrono::steady_clock::now() - std::chrono::seconds(1);
  EXPECT_EQ(call(*map_.core, explain_edge, request, late).reason(), Reason::DEADLINE);
}

TEST_F(EvidenceHandlers, AFrameWithoutAPictureSaysSo) {
  const v1::Edge proposed = propose(kBefore, kAgain);
  const auto reply = explain(proposed.id(), /*pictures=*/true).or_throw();
  for (const v1::FramePicture* picture : {&reply.picture_a(), &reply.picture_b()}) {
    EXPECT_TRUE(picture->data().empty());
    EXPECT_EQ(picture->reason(), v1::REASON_UNSUPPORTED);
    EXPECT_THAT(picture->message(), HasSubstr("sent no picture"));
  }
  EXPECT_FALSE(reply.has_runner_up());
}

TEST_F(EvidenceHandlers, TheKeptPictureIsToldWhole) {
  Keyframe keyframe = map_.circuit.keyframe(0);
  keyframe.session.uuid.bytes[15] = 77;
  keyframe.session.name = "with pictures";
  vision::Image picture(keyframe.session.camera.width / 2, keyframe.session.camera.height / 2);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) picture.row(y)[x] = static_cast<std::uint8_t>(x ^ y);
  keyframe.picture = vision::encode_picture(picture);
  ASSERT_FALSE(keyframe.picture.empty());
  const SessionNumber session = map_.mapper->begin_session(keyframe.session).or_throw();
  map_.submit(session, keyframe);
  map_.settle();
  v1::GetFrameRequest request;
  *request.mutable_frame() = to_wire(FrameId{session, 0});
  EXPECT_FALSE(call(*map_.core, get_frame, request, deadline_)->frame().has_picture());
  request.set_picture(true);
  const v1::FramePicture told = call(*map_.core, get_frame, request, deadline_)->frame().picture();
  EXPECT_EQ(Bytes(told.data().begin(), told.data().end()), keyframe.picture);
  EXPECT_EQ(told.reason(), v1::REASON_OK);
  EXPECT_EQ(told.width(), static_cast<std::uint32_t>(picture.width()));
  EXPECT_EQ(told.height(), static_cast<std::uint32_t>(picture.height()));
  EXPECT_EQ(told.scale(), 0.5);
}

TEST_F(EvidenceHandlers, APictureThatIsMissingHasItsReason) {
  place::HandMadeGraph graph;
  graph.add_session(1, kNoCamera);
  graph.add_session(2, place::kStereoCamera);
  graph.add_frame({1, 0});
  graph.add_frame({2, 0});
  graph.edit_hot({2, 0}).appearance_count = 300;
  EXPECT_EQ(picture_message(graph, {1, 0}).reason(), v1::REASON_UNSUPPORTED);
  EXPECT_THAT(picture_message(graph, {1, 0}).message(), HasSubstr("imported"));
  EXPECT_EQ(picture_message(graph, {2, 0}).reason(), v1::REASON_DATA_LOSS);
  EXPECT_EQ(picture_message(graph, {2, 9}).reason(), v1::REASON_NO_SUCH_FRAME);
  graph.edit_cold({2, 0}).picture = Bytes{'n', 'o', ' ', 'p', 'i', 'c', 't', 'u', 'r', 'e'};
  EXPECT_EQ(picture_message(graph, {2, 0}).reason(), v1::REASON_NOT_A_PICTURE);
}

// ---- Correspondences of answers to a view

v1::View seen_again(std::uint32_t i) {
  sim::PointsWorldOptions options = ServedMap::circuit_options();
  options.noise_seed = 5;
  const Keyframe keyframe = sim::PointsWorld(options).keyframe(i);
  v1::View view;
  *view.mutable_features() = to_wire(keyframe.appearance);
  *view.mutable_camera() = to_wire(keyframe.session.camera);
  return view;
}

int count_inliers(const google::protobuf::RepeatedPtrField<v1::Correspondence>& all) {
  return static_cast<int>(
      std::count_if(all.begin(), all.end(), [](const v1::Correspondence& c) { return c.inlier(); }));
}

TEST(AnswersEvidence, LocaliseTellsTheMatchesOnRequest) {
  ServedMap map;
  const Deadline deadline;
  v1::LocaliseRequest request;
  *request.mutable_view() = seen_again(20);
  EXPECT_EQ(call(*map.core, localise, request, deadline)->correspondences_size(), 0);
  request.set_correspondences(true);
  const auto reply = call(*map.core, localise, request, deadline).or_throw();
  EXPECT_EQ(count_inliers(reply.correspondences()), static_cast<int>(reply.inliers()));
  std::set<std::pair<float, float>> asked;
  for (const v1::Feature& feature : request.view().features().features()) asked.insert({feature.u(), feature.v()});
  for (const v1::Correspondence& c : reply.correspondences()) EXPECT_TRUE(asked.contains({c.u(), c.v()}));
}

TEST(AnswersEvidence, MatchImageTellsThoseOfEachPlace) {
  ServedMap map;
  const Deadline deadline;
  v1::MatchImageRequest request;
  *request.mutable_view() = seen_again(25);
  request.set_correspondences(true);
  request.set_max_verified(20);
  const auto reply = call(*map.core, match_image, request, deadline).or_throw();
  ASSERT_GT(reply.places_size(), 0);
  for (const v1::PlaceMatch& place : reply.places()) {
    if (place.reason() == v1::REASON_OK) {
      EXPECT_EQ(count_inliers(place.correspondences()), static_cast<int>(place.inliers()));
    } else if (place.reason() == v1::REASON_TOO_FEW_INLIERS) {
      EXPECT_EQ(count_inliers(place.correspondences()), 0);
    }
    EXPECT_LE(place.correspondences_size(), kMaxCorrespondences);
  }
}

}  // namespace
}  // namespace relmap::rpc
