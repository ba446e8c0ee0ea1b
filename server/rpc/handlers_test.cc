#include "server/rpc/handlers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <utility>

#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/map.pb.h"
#include "relmap/v1/status.pb.h"
#include "server/rpc/messages.h"
#include "server/rpc/route_request.h"
#include "server/rpc/testing/served_map.h"
#include "storage/graph/binding.h"

namespace relmap::rpc {
namespace {

using testing::HasSubstr;

class Handlers : public testing::Test {
 protected:
  template <typename Request, typename Reply, typename... Parts>
  Result<Reply> ask(Result<Reply> (*handler)(const Request&, const Deadline&, Parts...), const Request& request) {
    return call(*map_.core, handler, request, deadline_);
  }
  static v1::FrameId wire(FrameId id) { return to_wire(id); }

  // The view of frame i of the circuit as a query.
  v1::View view_of(const sim::PointsWorld& world, std::uint32_t i, bool camera = true) const {
    v1::View view;
    const Keyframe keyframe = world.keyframe(i);
    *view.mutable_features() = to_wire(keyframe.appearance);
    if (camera) *view.mutable_camera() = to_wire(keyframe.session.camera);
    return view;
  }
  // Another drive along the same circuit, with the same points and other noise.
  sim::PointsWorld again() const {
    sim::PointsWorldOptions options = ServedMap::circuit_options();
    options.noise_seed = 5;
    return sim::PointsWorld(options);
  }

  std::vector<v1::RouteStep> steps_of(const v1::FindRouteRequest& request, v1::RouteSummary* summary = nullptr) {
    std::vector<v1::RouteStep> steps;
    auto stream = call(*map_.core, find_route, request, deadline_).or_throw();
    for (bool first = true;; first = false) {
      auto message = stream().or_throw();
      if (!message) break;
      EXPECT_EQ(message->has_summary(), first);
      if (summary && first) *summary = message->summary();
      steps.insert(steps.end(), message->steps().begin(), message->steps().end());
    }
    return steps;
  }

  ServedMap map_;
  Deadline deadline_;
};

TEST_F(Handlers, LocaliseFindsAFrameOfTheCircuitInMetres) {
  const sim::PointsWorld robot = again();
  v1::LocaliseRequest request;
  *request.mutable_view() = view_of(robot, 20);
  const auto reply = ask(localise, request);
  ASSERT_TRUE(reply.ok()) << reply.status().to_string();
  ASSERT_EQ(reply->frame().session(), 1u);
  const SE3 truth = map_.circuit.T_world_frame(reply->frame().index()).inverse() * robot.T_world_frame(20);
  const SE3 error = truth.inverse() * from_wire(reply->frame_from_view()).or_throw();
  EXPECT_LT(error.t.norm(), 0.1);
  EXPECT_LT(rotation_angle(error.R), 0.02);
  EXPECT_GE(reply->inliers(), 20u);
  EXPECT_EQ(reply->verification(), v1::VERIFICATION_STEREO);
  EXPECT_EQ(reply->covariance().upper_size(), 21);
}

TEST_F(Handlers, LocaliseTriesAroundThePriorFirst) {
  v1::LocaliseRequest request;
  *request.mutable_view() = view_of(again(), 30);
  *request.mutable_prior() = wire({1, 28});
  const auto reply = ask(localise, request);
  ASSERT_TRUE(reply.ok()) << reply.status().to_string();
  EXPECT_EQ(reply->candidates(), 1u);
  EXPECT_NEAR(reply->frame().index(), 28, 3) << "told from the frame beside it that saw most";
  EXPECT_TRUE(reply->near_prior());
  EXPECT_EQ(reply->probability() + reply->new_place(), 0) << "the map was not searched";

  *request.mutable_prior() = wire(ServedMap::kUnconnected);
  const auto elsewhere = ask(localise, request);
  ASSERT_TRUE(elsewhere.ok()) << elsewhere.status().to_string();
  EXPECT_FALSE(elsewhere->near_prior());
  EXPECT_GT(elsewhere->probability(), 0);
  EXPECT_GT(elsewhere->candidates(), 1u);

  *request.mutable_prior() = wire({1, 5000});
  EXPECT_EQ(ask(localise, request).reason(), Reason::NO_SUCH_FRAME);
}

TEST_F(Handlers, LocaliseSaysWhyItCannot) {
  v1::LocaliseRequest request;
  EXPECT_EQ(ask(localise, request).reason(), Reason::INVALID_ARGUMENT);

  sim::PointsWorldOptions nowhere = ServedMap::circuit_options();
  nowhere.world_seed = 1234;
  *request.mutable_view() = view_of(sim::PointsWorld(nowhere), 3);
  const auto unknown = ask(localise, request);
  // Appearance alone may be deceived by a vocabulary of random words; geometry is not.
  EXPECT_THAT(unknown.reason(), testing::AnyOf(Reason::NEW_PLACE, Reason::TOO_FEW_INLIERS));

  *request.mutable_view() = view_of(map_.circuit, 3, /*camera=*/false);
  EXPECT_EQ(ask(localise, request).reason(), Reason::NO_CALIBRATION);

  request.mutable_view()->set_session(77);
  EXPECT_EQ(ask(localise, request).reason(), Reason::NO_SUCH_SESSION);
  request.mutable_view()->set_session(1);
  EXPECT_TRUE(ask(localise, request).ok());

  request.mutable_view()->mutable_features()->mutable_features()->DeleteSubrange(5, 60);
  request.mutable_view()->mutable_features()->mutable_features(0)->set_u(std::nanf(""));
  EXPECT_EQ(ask(localise, request).reason(), Reason::NOT_FINITE);

  request.mutable_view()->mutable_camera()->set_f(-4);
  EXPECT_EQ(ask(localise, request).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
}

TEST_F(Handlers, InvalidPicturesAreRefusedByName) {
  v1::LocaliseRequest request;
  request.mutable_view()->set_session(1);
  request.mutable_view()->mutable_left()->set_data("GIF89a and so on");
  EXPECT_EQ(ask(localise, request).reason(), Reason::NOT_A_PICTURE);
  request.mutable_view()->mutable_left()->clear_data();
  EXPECT_EQ(ask(localise, request).reason(), Reason::NOT_A_PICTURE);

  // The header of a PNG of 32768 x 32768 pixels.
  const unsigned char gigapixel[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 0, 0, 0, 13, 'I', 'H', 'D', 'R', 0,
                                     0,    128, 0,   0,   0,    128,  0,    0,    8, 0, 0, 0,  0,   0,   0,   0,   0};
  request.mutable_view()->mutable_left()->set_data(gigapixel, sizeof gigapixel);
  EXPECT_EQ(ask(localise, request).reason(), Reason::PICTURE_TOO_LARGE);

  v1::MatchImageRequest match;
  *match.mutable_view() = request.view();
  EXPECT_EQ(ask(match_image, match).reason(), Reason::PICTURE_TOO_LARGE);
}

TEST_F(Handlers, MatchImageGivesProbabilitiesAndSaysWhatWasVerified) {
  v1::MatchImageRequest request;
  *request.mutable_view() = view_of(again(), 25);
  const auto reply = ask(match_image, request);
  ASSERT_TRUE(reply.ok()) << reply.status().to_string();
  ASSERT_GT(reply->places_size(), 0);
  EXPECT_EQ(reply->places(0).verification(), v1::VERIFICATION_STEREO);
  EXPECT_NEAR(reply->places(0).frame().index(), 25, 6);
  double sum = reply->new_place();
  for (const v1::PlaceMatch& place : reply->places()) sum += place.probability();
  EXPECT_LE(sum, 1 + 1e-6);

  request.mutable_view()->clear_camera();
  const auto unverified = ask(match_image, request);
  ASSERT_TRUE(unverified.ok());
  EXPECT_EQ(unverified->places(0).verification(), v1::VERIFICATION_NONE);
  EXPECT_EQ(unverified->places(0).reason(), v1::REASON_NO_CALIBRATION);
  EXPECT_EQ(unverified->reason(), v1::REASON_NO_CALIBRATION);
}

TEST_F(Handlers, MatchImageSaysWhyNothingIsConfirmed) {
  sim::PointsWorldOptions nowhere = ServedMap::circuit_options();
  nowhere.world_seed = 1234;
  v1::MatchImageRequest request;
  *request.mutable_view() = view_of(sim::PointsWorld(nowhere), 3);
  request.set_max_verified(1);
  const auto reply = ask(match_image, request);
  ASSERT_TRUE(reply.ok()) << reply.status().to_string();
  EXPECT_THAT(reply->reason(),
              testing::AnyOf(v1::REASON_NEW_PLACE, v1::REASON_AMBIGUOUS_PLACE, v1::REASON_TOO_FEW_INLIERS));
  EXPECT_NE(reply->message(), "");
  for (int i = 0; i < reply->places_size(); ++i) {
    EXPECT_EQ(reply->places(i).reason(), i == 0 ? v1::REASON_TOO_FEW_INLIERS : v1::REASON_OUT_OF_REACH);
    EXPECT_NE(reply->places(i).message(), "");
  }
}

TEST_F(Handlers, MatchImagePutsWhatGeometryConfirmsFirst) {
  v1::MatchImageRequest request;
  *request.mutable_view() = view_of(again(), 25);
  request.set_max_verified(20);
  const auto reply = ask(match_image, request);
  ASSERT_TRUE(reply.ok());
  bool confirmed = true;
  std::uint32_t inliers = std::numeric_limits<std::uint32_t>::max();
  for (const v1::PlaceMatch& place : reply->places()) {
    const bool verified = place.verification() != v1::VERIFICATION_NONE;
    EXPECT_TRUE(confirmed || !verified);
    confirmed = verified;
    EXPECT_EQ(verified, place.reason() == v1::REASON_OK);
    if (!verified) continue;
    EXPECT_LE(place.inliers(), inliers);
    inliers = place.inliers();
    EXPECT_GT(place.spread(), 0.05);
    EXPECT_EQ(place.estimated_focal_length(), 0) << "the camera was named";
  }
  EXPECT_EQ(reply->reason(), v1::REASON_OK);
}

// Two neighbouring candidates may both be verified in the one frame that saw most of the inliers.
TEST_F(Handlers, MatchImageListsAFrameOnce) {
  v1::MatchImageRequest request;
  request.set_max_verified(20);
  const sim::PointsWorld robot = again();
  for (std::uint32_t i = 0; i < ServedMap::kLap; ++i) {
    *request.mutable_view() = view_of(robot, i);
    const auto reply = ask(match_image, request);
    ASSERT_TRUE(reply.ok()) << reply.status().to_string();
    std::set<std::pair<SessionNumber, std::uint32_t>> listed;
    double sum = reply->new_place();
    for (const v1::PlaceMatch& place : reply->places()) {
      EXPECT_TRUE(listed.insert({place.frame().session(), place.frame().index()}).second)
          << place.frame().index() << " is listed twice as an answer to " << i;
      sum += place.probability();
    }
    EXPECT_LE(sum, 1 + 1e-6);
  }
}

TEST_F(Handlers, AFrameOfAMonoSessionAsksWhichPlacesLookLikeIt) {
  const SessionNumber mono = map_.take_in_with_one_eye(30);
  v1::MatchImageRequest request;
  *request.mutable_view()->mutable_frame() = wire({mono, 25});
  request.set_max_verified(20);
  request.set_thumbnails(true);
  const auto reply = ask(match_image, request);
  ASSERT_TRUE(reply.ok()) << reply.status().to_string();
  ASSERT_GT(reply->places_size(), 0);
  EXPECT_EQ(reply->places(0).frame().session(), 1u) << "which has seen the same, in stereo";
  EXPECT_EQ(reply->places(0).verification(), v1::VERIFICATION_PNP);
  for (const v1::PlaceMatch& place : reply->places())
    EXPECT_FALSE(place.frame().session() == mono && place.frame().index() > 6) << "its own recent past";

  // A stereo robot is recognised in the mono session, without a metric pose and without an edge.
  *request.mutable_view()->mutable_frame() = wire({1, 20});
  const auto other = ask(match_image, request);
  ASSERT_TRUE(other.ok());
  bool seen = false;
  for (const v1::PlaceMatch& place : other->places()) {
    if (place.frame().session() != mono || place.verification() == v1::VERIFICATION_NONE) continue;
    seen = true;
    EXPECT_THAT(place.verification(), testing::AnyOf(v1::VERIFICATION_EPIPOLAR, v1::VERIFICATION_HOMOGRAPHY));
    EXPECT_FALSE(place.has_frame_from_view());
  }
  EXPECT_TRUE(seen);
  v1::ListEdgesRequest edges;
  edges.set_session(mono);
  EXPECT_EQ(ask(list_edges, edges)->edges_size(), 0);

  v1::LocaliseRequest localised;
  *localised.mutable_view()->mutable_frame() = wire({mono, 25});
  const auto where = ask(localise, localised);
  ASSERT_TRUE(where.ok()) << where.status().to_string();
  EXPECT_EQ(where->frame().session(), 1u);
  localised.mutable_view()->set_session(1);
  EXPECT_EQ(ask(localise, localised).reason(), Reason::INVALID_ARGUMENT);
  localised.mutable_view()->clear_session();
  localised.mutable_view()->mutable_frame()->set_index(999);
  EXPECT_EQ(ask(localise, localised).reason(), Reason::NO_SUCH_FRAME);
}

TEST_F(Handlers, RoutesLeadFromAPictureToALabel) {
  v1::SetLabelRequest label;
  *label.mutable_frame() = wire({1, 40});
  label.set_label("dock");
  ASSERT_TRUE(ask(set_label, label).ok());

  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_view() = view_of(again(), 10);
  request.mutable_to()->set_label("dock");
  request.set_by(v1::ROUTE_BY_TIME);
  v1::RouteSummary summary;
  const auto steps = steps_of(request, &summary);
  ASSERT_EQ(steps.size(), summary.steps());
  EXPECT_EQ(steps.front().frame().index(), summary.from_view().frame().index());
  EXPECT_EQ(steps.back().frame().index(), 40u);
  EXPECT_THAT(steps.back().labels(), testing::ElementsAre("dock"));
  EXPECT_FALSE(steps.back().has_edge());
  EXPECT_GT(summary.time_s(), 0);
  EXPECT_NEAR(summary.distance_m(), steps.back().distance_m(), 1e-9);
}

TEST_F(Handlers, RefusedRoutesSayWhy) {
  const auto reason = [&](const v1::FindRouteRequest& request) {
    return call(*map_.core, find_route, request, deadline_).status();
  };
  v1::FindRouteRequest request;
  EXPECT_EQ(reason(request).reason(), Reason::INVALID_ARGUMENT);
  *request.mutable_from()->mutable_frame() = wire(ServedMap::kFirst);
  request.mutable_to()->set_label("nowhere");
  EXPECT_EQ(reason(request).reason(), Reason::NO_SUCH_LABEL);
  *request.mutable_to()->mutable_frame() = wire({1, 4711});
  EXPECT_EQ(reason(request).reason(), Reason::NO_SUCH_FRAME);
  *request.mutable_to()->mutable_frame() = wire(ServedMap::kUnconnected);
  EXPECT_EQ(reason(request).reason(), Reason::NOT_CONNECTED);
  EXPECT_THAT(reason(request).message(), HasSubstr("2 (elsewhere)"));
  *request.mutable_to()->mutable_frame() = wire({1, 30});
  request.set_max_cost(0.5);
  EXPECT_EQ(reason(request).reason(), Reason::COST_LIMIT);
  request.set_max_cost(-1);
  EXPECT_EQ(reason(request).reason(), Reason::INVALID_ARGUMENT);
  request.set_max_cost(0);
  request.set_resume_token("b007b007-999999-1:1,1:2,3");
  EXPECT_EQ(reason(request).reason(), Reason::VIEW_EXPIRED);
  request.set_resume_token("rubbish");
  EXPECT_EQ(reason(request).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(Handlers, RoutesByWeightsAndWithKnownPrecision) {
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = wire({1, 3});
  *request.mutable_to()->mutable_frame() = wire({1, 9});
  v1::RouteSummary by_distance, by_weights;
  steps_of(request, &by_distance);
  EXPECT_EQ(by_distance.cost(), by_distance.distance_m());
  request.mutable_weights()->set_metre(2);
  request.mutable_weights()->set_driven_second(3);
  request.set_covariance(true);
  const auto steps = steps_of(request, &by_weights);
  EXPECT_NEAR(by_weights.cost(), 2 * by_weights.distance_m() + 3 * by_weights.time_s(), 1e-9);

  v1::TransformBetweenRequest between;
  *between.mutable_a() = wire({1, 3});
  *between.mutable_b() = wire({1, 9});
  const auto transform = ask(transform_between, between);
  ASSERT_TRUE(transform.ok());
  EXPECT_EQ(steps.back().start_from_this().SerializeAsString(), transform->a_from_b().SerializeAsString());
  EXPECT_EQ(steps.back().covariance().SerializeAsString(), transform->covariance().SerializeAsString());
  EXPECT_LT((from_wire(steps.front().start_from_this()).or_throw().t).norm(), 1e-12);

  request.set_by(v1::ROUTE_BY_TIME);
  EXPECT_EQ(call(*map_.core, find_route, request, deadline_).reason(), Reason::INVALID_ARGUMENT) << "both";
  request.clear_by();
  request.mutable_weights()->set_metre(-1);
  EXPECT_EQ(call(*map_.core, find_route, request, deadline_).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(Handlers, RoutesHaveAlternativesAtEitherEnd) {
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = wire(ServedMap::kUnconnected);
  *request.add_or_from()->mutable_frame() = wire({1, 30});
  *request.add_or_from()->mutable_frame() = wire({1, 12});
  *request.mutable_to()->mutable_frame() = wire({1, 20});
  *request.add_or_to()->mutable_frame() = wire({1, 10});
  v1::RouteSummary summary;
  steps_of(request, &summary);
  EXPECT_EQ(summary.from().index(), 12u);
  EXPECT_EQ(summary.to().index(), 10u);
  request.add_or_to();
  EXPECT_EQ(call(*map_.core, find_route, request, deadline_).reason(), Reason::INVALID_ARGUMENT)
      << "an end that is none";
}

TEST_F(Handlers, RoutesLeadToTheNewestFrameOfARobot) {
  const storage::Session session = *map_.mapper->view()->session(1);
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = wire({1, 3});
  request.mutable_to()->set_robot(session.header.robot);
  v1::RouteSummary summary;
  steps_of(request, &summary);
  EXPECT_EQ(summary.to().index(), session.last);
  request.mutable_to()->set_robot("nobody");
  EXPECT_EQ(call(*map_.core, find_route, request, deadline_).reason(), Reason::NO_SUCH_SESSION);
}

TEST_F(Handlers, RoutesKeepToTheirFilter) {
  const auto reason = [&](const v1::FindRouteRequest& request) {
    return call(*map_.core, find_route, request, deadline_).reason();
  };
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = wire({1, 3});
  *request.mutable_to()->mutable_frame() = wire({1, 9});
  *request.mutable_filter()->add_avoid_frames() = wire({1, 6});
  const auto passes = [&](std::uint32_t index) {
    const auto steps = steps_of(request);
    return std::any_of(steps.begin(), steps.end(),
                       [&](const v1::RouteStep& step) { return step.frame().index() == index; });
  };
  EXPECT_FALSE(passes(6));
  request.mutable_filter()->clear_avoid_frames();
  EXPECT_TRUE(passes(6)) << "it was the shortest way";
  v1::SetLabelRequest label;
  *label.mutable_frame() = wire({1, 6});
  label.set_label("wet paint");
  ASSERT_TRUE(ask(set_label, label).ok());
  request.mutable_filter()->add_avoid_labels("wet paint");
  EXPECT_FALSE(passes(6));
  request.mutable_filter()->clear_avoid_labels();
  request.mutable_filter()->set_no_long_loops(true);
  request.mutable_filter()->set_suppose_candidates(true);
  EXPECT_TRUE(passes(6));
  for (int i = 0; i < 101; ++i) request.mutable_filter()->add_avoid_labels("wet paint");
  EXPECT_EQ(reason(request), Reason::INVALID_ARGUMENT);
  request.clear_filter();
  for (int i = 0; i < 101; ++i) *request.add_or_to()->mutable_frame() = wire({1, 9});
  EXPECT_EQ(reason(request), Reason::INVALID_ARGUMENT);
  request.clear_or_to();
  *request.mutable_filter()->add_avoid_frames() = wire({1, 4711});
  EXPECT_EQ(reason(request), Reason::NO_SUCH_FRAME);
  request.mutable_filter()->clear_avoid_frames();
  request.mutable_filter()->add_avoid_labels("no such label");
  EXPECT_EQ(reason(request), Reason::NO_SUCH_LABEL);
  request.mutable_filter()->clear_avoid_labels();
  request.mutable_filter()->add_sessions(2);
  EXPECT_EQ(reason(request), Reason::NOT_CONNECTED);
  request.mutable_filter()->add_sessions(1);
  EXPECT_TRUE(call(*map_.core, find_route, request, deadline_).ok());
  request.mutable_filter()->add_sessions(77);
  EXPECT_EQ(reason(request), Reason::NO_SUCH_SESSION);
  request.mutable_filter()->clear_sessions();
  request.mutable_filter()->set_min_support(1'000'000);
  EXPECT_EQ(reason(request), Reason::NOT_CONNECTED);
}

TEST_F(Handlers, OnlySoManySessionsAreNamedInOneRequest) {
  const auto refusal = [&](auto handler, auto request, auto* sessions) {
    for (int i = 0; i < kMaxNamedSessions; ++i) sessions(request)->Add(1);
    EXPECT_TRUE(call(*map_.core, handler, request, deadline_).ok()) << "as many as may be, one of them again and again";
    sessions(request)->Add(1);
    return call(*map_.core, handler, request, deadline_).status();
  };
  v1::FindRouteRequest way;
  *way.mutable_from()->mutable_frame() = wire({1, 3});
  *way.mutable_to()->mutable_frame() = wire({1, 9});
  for (const Status& refused :
       {refusal(
            find_route, way, +[](v1::FindRouteRequest& r) { return r.mutable_filter()->mutable_sessions(); }),
        refusal(
            get_closure_matrix, v1::GetClosureMatrixRequest(),
            +[](v1::GetClosureMatrixRequest& r) { return r.mutable_sessions(); }),
        refusal(
            get_skeleton, v1::GetSkeletonRequest(), +[](v1::GetSkeletonRequest& r) { return r.mutable_sessions(); })}) {
    EXPECT_EQ(refused.reason(), Reason::INVALID_ARGUMENT);
    EXPECT_EQ(refused.message(), "more than 10000 sessions");
  }
}

TEST_F(Handlers, ABrokenRouteStreamResumesWhereItBroke) {
  RpcLimits limits;
  limits.route_steps_per_message = 5;
  Core core(*map_.mapper, map_.core->facts, limits);
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = wire(ServedMap::kFirst);
  *request.mutable_to()->mutable_frame() = wire({1, 20});
  request.mutable_weights()->set_metre(1);
  request.mutable_weights()->set_square_metre_of_variance(10);
  request.set_covariance(true);
  const auto whole = steps_of(request);
  ASSERT_GT(whole.size(), 10u);
  auto broken = call(core, find_route, request, deadline_).or_throw();
  const auto first = broken().or_throw();
  ASSERT_TRUE(first.has_value());
  ASSERT_EQ(first->steps_size(), 5);

  request.set_resume_token(first->resume_token());
  const v1::RouteEnd from = request.from(), to = request.to();
  request.clear_from();  // the token implies it
  request.clear_to();
  auto stream = call(core, find_route, request, deadline_).or_throw();
  const v1::FindRouteRequest rest_of_it = request;

  const std::string token = request.resume_token();
  const std::size_t position = token.rfind('-');
  for (const char* wrong : {"0,4711,1", "0,5", "5", "0,0,1", "0,5,", "0,x,1", "1,5,1", "x,5,1", "0,5,1,1"}) {
    request.set_resume_token(token.substr(0, position + 1) + wrong);
    EXPECT_EQ(call(core, find_route, request, deadline_).reason(), Reason::INVALID_ARGUMENT) << wrong;
  }
  request.set_resume_token(token);
  EXPECT_TRUE(call(core, find_route, request, deadline_).ok());
  EXPECT_EQ(call(*map_.core, find_route, request, deadline_).reason(), Reason::VIEW_EXPIRED) << "it has not found this";
  *request.mutable_from() = from;
  *request.mutable_to() = to;
  EXPECT_TRUE(call(core, find_route, request, deadline_).ok());
  *request.add_or_to() = from;
  EXPECT_EQ(call(core, find_route, request, deadline_).reason(), Reason::INVALID_ARGUMENT) << "other ends";
  request.clear_or_to();
  request.mutable_weights()->set_metre(2);
  EXPECT_EQ(call(core, find_route, request, deadline_).reason(), Reason::INVALID_ARGUMENT) << "another route";

  std::size_t at = 5;
  for (auto rest = stream().or_throw(); rest; rest = stream().or_throw()) {
    EXPECT_FALSE(rest->has_summary());
    for (const v1::RouteStep& step : rest->steps())
      EXPECT_EQ(step.SerializeAsString(), whole[at++].SerializeAsString());
  }
  EXPECT_EQ(at, whole.size());
  EXPECT_TRUE(call(core, find_route, rest_of_it, deadline_).ok()) << "its end may not have arrived";
}

TEST_F(Handlers, AResumedRouteStreamSaysWhatTheUnbrokenOneSaidOfViewsToo) {
  RpcLimits limits;
  limits.route_steps_per_message = 7;
  Core core(*map_.mapper, map_.core->facts, limits);
  const sim::PointsWorld robot = again();
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_view() = view_of(robot, 10);
  *request.mutable_to()->mutable_view() = view_of(robot, 10 + ServedMap::kLap * 9 / 20);
  *request.add_or_to()->mutable_view() = view_of(robot, 12 + ServedMap::kLap * 9 / 20);
  request.set_alternatives(3);
  const auto messages_of = [&](const v1::FindRouteRequest& asked) {
    std::vector<v1::FindRouteReply> messages;
    auto stream = call(core, find_route, asked, deadline_).or_throw();
    while (auto message = stream().or_throw()) messages.push_back(*std::move(message));
    return messages;
  };
  const std::vector<v1::FindRouteReply> messages = messages_of(request);
  ASSERT_FALSE(messages.empty());
  EXPECT_GE(messages.back().route(), 1u) << "there is the other way around";
  for (const v1::FindRouteReply& message : messages) {
    if (!message.has_summary()) continue;
    EXPECT_EQ(message.summary().from_view().frame().SerializeAsString(), message.summary().from().SerializeAsString());
    EXPECT_EQ(message.summary().to_view().frame().SerializeAsString(), message.summary().to().SerializeAsString());
    EXPECT_GE(message.summary().to_view().inliers(), 20u);
  }
  for (const bool with_ends : {true, false})
    for (std::size_t i = 0; i + 1 < messages.size(); ++i) {
      v1::FindRouteRequest rest = request;
      rest.set_resume_token(messages[i].resume_token());
      if (!with_ends) {
        rest.clear_from();
        rest.clear_to();
        rest.clear_or_to();
      }
      const std::vector<v1::FindRouteReply> told = messages_of(rest);
      ASSERT_EQ(told.size(), messages.size() - i - 1);
      for (std::size_t j = 0; j < told.size(); ++j)
        EXPECT_EQ(told[j].SerializeAsString(), messages[i + 1 + j].SerializeAsString());
    }
}

TEST_F(Handlers, RoutesPassCellsWhereThereAreSome) {
  map_.core = std::make_unique<Core>(*map_.mapper, map_.core->facts, RpcLimits{.near_route_steps = 0});
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = wire({1, 3});
  *request.mutable_to()->mutable_frame() = wire({1, 30});
  v1::RouteSummary by_frames, by_cells;
  steps_of(request, &by_frames);
  EXPECT_NE(by_frames.frame_by_frame(), "");
  // The best route by edges, since cells do not contain closures that only bind.
  const std::vector<FrameId> from{{1, 3}}, to{{1, 30}};
  const auto view = map_.mapper->view();
  const route::Route by_edges = route::find_route(*view, from, to).or_throw();
  std::vector<FrameId> expected;
  for (route::RouteWalk walk(*view, by_edges); const auto step = walk.next();) expected.push_back(step->frame);
  map_.core->routes.index = std::make_unique<route::RouteIndex>(
      route::RouteIndexOptions{}, [this] { return map_.mapper->view(); },
      std::make_shared<storage::Budget>(std::size_t{64} << 20));
  map_.core->routes.index->start();
  ASSERT_TRUE(map_.core->routes.index->wait_current(std::chrono::steady_clock::now() + std::chrono::minutes(10)));
  const auto found = steps_of(request, &by_cells);
  EXPECT_EQ(by_cells.frame_by_frame(), "");
  EXPECT_NEAR(by_cells.cost(), by_edges.cost, 1e-9 * by_edges.cost);
  EXPECT_NEAR(by_cells.distance_m(), by_edges.distance_m, 1e-9);
  EXPECT_EQ(by_cells.steps(), found.size());
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_EQ(found[i].frame().SerializeAsString(), wire(expected[i]).SerializeAsString());

  const auto ask_why = [&] {
    v1::RouteSummary summary;
    steps_of(request, &summary);
    return summary.frame_by_frame();
  };
  request.mutable_weights()->set_metre(2);
  EXPECT_THAT(ask_why(), HasSubstr("kinds of cost"));
  request.clear_weights();
  request.mutable_filter()->set_suppose_candidates(true);
  EXPECT_THAT(ask_why(), HasSubstr("supposed"));
  request.clear_filter();
  *request.mutable_filter()->add_avoid_frames() = wire({1, 10});
  EXPECT_EQ(ask_why(), "");
  request.clear_filter();
  *request.mutable_to()->mutable_frame() = wire(ServedMap::kUnconnected);
  const auto alone = call(*map_.core, find_route, request, deadline_);
  EXPECT_EQ(alone.reason(), Reason::NOT_CONNECTED);
  EXPECT_THAT(alone.status().message(), HasSubstr("2 (elsewhere)"));
  // Cells tell that the ends are not connected even for a cost that they do not have.
  request.mutable_weights()->set_metre(2);
  const auto weighed = call(*map_.core, find_route, request, deadline_);
  EXPECT_EQ(weighed.reason(), Reason::NOT_CONNECTED);
  EXPECT_EQ(weighed.status().message(), alone.status().message());

  const auto status = ask(get_status, v1::GetStatusRequest()).or_throw();
  EXPECT_EQ(status.route_cells().missing_because(), "");
  EXPECT_EQ(status.route_cells().weights(), 2u);
  EXPECT_EQ(status.route_cells().chunks(), 2u);
}

TEST_F(Handlers, TransformBetweenFollowsThePath) {
  v1::TransformBetweenRequest request;
  EXPECT_EQ(ask(transform_between, request).reason(), Reason::INVALID_ARGUMENT);
  *request.mutable_a() = wire({1, 3});
  *request.mutable_b() = wire({1, 9});
  const auto reply = ask(transform_between, request);
  ASSERT_TRUE(reply.ok());
  EXPECT_EQ(reply->edges(), 6u);
  const SE3 truth = map_.circuit.T_world_frame(3).inverse() * map_.circuit.T_world_frame(9);
  EXPECT_LT((from_wire(reply->a_from_b()).or_throw().t - truth.t).norm(), 0.1);
  *request.mutable_b() = wire(ServedMap::kUnconnected);
  EXPECT_EQ(ask(transform_between, request).reason(), Reason::NOT_CONNECTED);
}

TEST_F(Handlers, NeighbourhoodIsInTheFrameOfItsRoot) {
  v1::GetNeighbourhoodRequest request;
  *request.mutable_root() = wire({1, 25});
  request.set_max_edges(3);
  request.set_landmarks(true);
  const auto reply = ask(get_neighbourhood, request);
  ASSERT_TRUE(reply.ok());
  ASSERT_GE(reply->frames_size(), 7);
  EXPECT_EQ(reply->frames(0).frame().index(), 25u);
  EXPECT_EQ(from_wire(reply->frames(0).root_from_frame()).or_throw().t.norm(), 0);
  EXPECT_GE(reply->edges_size(), 6);
  EXPECT_GT(reply->frames(0).landmarks_size(), 0);
  request.set_max_metres(-1);
  EXPECT_EQ(ask(get_neighbourhood, request).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(Handlers, AFrameShowsWhatIsAskedFor) {
  v1::GetFrameRequest request;
  *request.mutable_frame() = wire({1, 12});
  const auto bare = ask(get_frame, request);
  ASSERT_TRUE(bare.ok());
  EXPECT_EQ(bare->frame().landmarks_size(), 0);
  EXPECT_EQ(bare->frame().edges(0).kind(), v1::EDGE_KIND_ODOMETRY);
  EXPECT_EQ(bare->frame().appearance_count(), map_.circuit.keyframe(12).appearance.size());
  request.set_landmarks(true);
  request.set_observations(true);
  request.set_appearance(true);
  const auto full = ask(get_frame, request);
  ASSERT_TRUE(full.ok());
  EXPECT_EQ(static_cast<std::uint32_t>(full->frame().landmarks_size()), bare->frame().landmark_count());
  EXPECT_EQ(static_cast<std::uint32_t>(full->frame().observations_size()), bare->frame().observation_count());
  EXPECT_EQ(static_cast<std::uint32_t>(full->frame().appearance().features_size()), bare->frame().appearance_count());
  *request.mutable_frame() = wire({3, 0});
  EXPECT_EQ(ask(get_frame, request).reason(), Reason::NO_SUCH_FRAME);
  request.mutable_frame()->set_session(0);
  EXPECT_EQ(ask(get_frame, request).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(Handlers, SessionsAreListedInPages) {
  v1::ListSessionsRequest request;
  request.set_page_size(1);
  const auto first = ask(list_sessions, request);
  ASSERT_TRUE(first.ok());
  ASSERT_EQ(first->sessions_size(), 1);
  EXPECT_EQ(first->sessions(0).frames(), ServedMap::kFrames);
  EXPECT_EQ(first->sessions(0).next_sequence(), ServedMap::kFrames);
  request.set_page_token(first->next_page_token());
  const auto second = ask(list_sessions, request);
  ASSERT_TRUE(second.ok());
  ASSERT_EQ(second->sessions_size(), 1);
  EXPECT_EQ(second->sessions(0).name(), "elsewhere");
  EXPECT_EQ(second->next_page_token(), "");
  EXPECT_EQ(second->map_version(), first->map_version());
}

TEST_F(Handlers, EdgesAreListedByStateKindAndPlace) {
  v1::ListEdgesRequest request;
  request.add_kinds(v1::EDGE_KIND_ODOMETRY);
  request.set_page_size(30);
  std::vector<EdgeId> all;
  for (;;) {
    const auto page = ask(list_edges, request);
    ASSERT_TRUE(page.ok()) << page.status().to_string();
    for (const v1::Edge& edge : page->edges()) all.push_back(from_wire(edge.id()).or_throw());
    request.set_page_token(page->next_page_token());
    if (page->next_page_token().empty()) break;
    EXPECT_EQ(page->edges_size(), 30);
  }
  EXPECT_EQ(all.size(), ServedMap::kFrames - 1 + ServedMap::kElsewhere - 1);
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end()));

  request.set_session(2);
  EXPECT_EQ(ask(list_edges, request)->edges_size(), static_cast<int>(ServedMap::kElsewhere - 1));
  request.clear_session();
  *request.mutable_frame() = wire({1, 10});
  EXPECT_EQ(ask(list_edges, request)->edges_size(), 2);
  request.clear_kinds();
  request.clear_frame();
  request.add_states(v1::EDGE_STATE_ACCEPTED);
  request.add_kinds(v1::EDGE_KIND_LOOP);
  EXPECT_GT(ask(list_edges, request)->edges_size(), 0);
  request.set_session(9);
  EXPECT_EQ(ask(list_edges, request).reason(), Reason::NO_SUCH_SESSION);
  request.clear_session();
  request.add_kinds(static_cast<v1::EdgeKind>(99));
  EXPECT_EQ(ask(list_edges, request).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(Handlers, ALoopClosureCanBeRemovedButNotTheRobotsMotion) {
  v1::ListEdgesRequest accepted;
  accepted.add_states(v1::EDGE_STATE_ACCEPTED);
  accepted.add_kinds(v1::EDGE_KIND_LOOP);
  const auto before = ask(list_edges, accepted);
  ASSERT_TRUE(before.ok());
  ASSERT_GT(before->edges_size(), 0);

  v1::SetEdgeStateRequest request;
  *request.mutable_edge() = before->edges(0).id();
  request.set_state(v1::EDGE_STATE_REMOVED);
  request.set_idempotency_key("once");
  const auto reply = ask(set_edge_state, request);
  ASSERT_TRUE(reply.ok()) << reply.status().to_string();
  EXPECT_EQ(reply->edge().state(), v1::EDGE_STATE_REMOVED);
  EXPECT_EQ(reply->edge().reason(), v1::REASON_REMOVED_BY_OPERATOR);
  const auto after = ask(list_edges, accepted);
  EXPECT_EQ(after->edges_size(), before->edges_size() - 1 - reply->also_changed_size());

  EXPECT_EQ(ask(set_edge_state, request)->journal_sequence(), reply->journal_sequence());  // the same edit again
  request.clear_idempotency_key();
  EXPECT_EQ(ask(set_edge_state, request).reason(), Reason::WRONG_STATE);
  *request.mutable_edge() = to_wire(EdgeId{{1, 5}, 0});
  EXPECT_EQ(ask(set_edge_state, request).reason(), Reason::ODOMETRY_EDGE);
  *request.mutable_edge() = to_wire(EdgeId{{1, 5}, 99});
  EXPECT_EQ(ask(set_edge_state, request).reason(), Reason::NO_SUCH_EDGE);
}

TEST_F(Handlers, LabelsCanBeSetFoundAndRemoved) {
  v1::SetLabelRequest request;
  *request.mutable_frame() = wire({1, 7});
  request.set_label("dock/1");
  request.set_idempotency_key("k");
  ASSERT_TRUE(ask(set_label, request).ok());
  v1::FindLabelsRequest find;
  find.set_prefix("dock");
  ASSERT_EQ(ask(find_labels, find)->labels_size(), 1);
  EXPECT_EQ(ask(find_labels, find)->labels(0).frames(0).index(), 7u);
  find.clear_prefix();
  find.set_words("1 DO");
  EXPECT_EQ(ask(find_labels, find)->labels_size(), 1);
  find.set_words("ock");
  EXPECT_EQ(ask(find_labels, find)->labels_size(), 0);
  find.clear_words();
  find.set_prefix("DoCK");
  ASSERT_EQ(ask(find_labels, find)->labels_size(), 1);
  find.set_prefix("ock");
  EXPECT_EQ(ask(find_labels, find)->labels_size(), 0);
  find.set_prefix("dock");
  ASSERT_EQ(ask(find_labels, find)->labels_size(), 1);

  request.set_remove(true);
  EXPECT_EQ(ask(set_label, request).reason(), Reason::INVALID_ARGUMENT);  // the key was used for another edit
  request.clear_idempotency_key();
  EXPECT_TRUE(ask(set_label, request).ok());
  EXPECT_EQ(ask(set_label, request).reason(), Reason::NO_SUCH_LABEL);
  EXPECT_EQ(ask(find_labels, find)->labels_size(), 0);
  request.set_label(std::string(65, 'x'));
  EXPECT_EQ(ask(set_label, request).reason(), Reason::BAD_NAME);
  request.set_remove(false);
  for (const std::string& none :
       {std::string(65, 'x'), std::string(), std::string(" "), std::string("\xc2\xa0"), std::string("\xff")}) {
    request.set_label(none);
    EXPECT_EQ(ask(set_label, request).reason(), Reason::BAD_NAME) << none;
  }
}

// Maps may hold labels that were valid when they were set.
TEST_F(Handlers, ALabelThatIsNoLongerValidCanBeRemoved) {
  v1::SetLabelRequest request;
  *request.mutable_frame() = wire({1, 7});
  request.set_label(" ");
  request.set_remove(true);
  EXPECT_EQ(ask(set_label, request).reason(), Reason::BAD_NAME);
  const auto written = map_.mapper->submit_and_wait(storage::SetLabelRecord{{1, 7}, " ", true});
  ASSERT_TRUE(written.ok());
  ASSERT_TRUE(map_.mapper->wait_applied(*written, std::chrono::steady_clock::now() + std::chrono::minutes(10)).ok());
  const auto taken_off = ask(set_label, request);
  ASSERT_TRUE(taken_off.ok()) << taken_off.status().to_string();
  EXPECT_EQ(taken_off->labels_size(), 0);
}

TEST_F(Handlers, StatusCountsTheContentOfTheMap) {
  const auto reply = ask(get_status, v1::GetStatusRequest());
  ASSERT_TRUE(reply.ok());
  EXPECT_EQ(reply->frames(), ServedMap::kFrames + ServedMap::kElsewhere);
  EXPECT_EQ(reply->sessions(), 2u);
  EXPECT_EQ(reply->places(), reply->frames());
  EXPECT_EQ(reply->queued(), 0u);
  EXPECT_EQ(reply->durable_sequence(), reply->applied_sequence());
  EXPECT_GT(reply->loop_closures().accepted(), 0u);
  EXPECT_GT(reply->relaxation().p50_us(), 0);
  EXPECT_EQ(reply->memory_shares_size(), static_cast<int>(storage::kShares));
  EXPECT_EQ(reply->vocabulary_words(), ServedMap::kWords);
}

TEST_F(Handlers, StatusSaysWhyLcmDoesNotRun) {
  map_.core->intake.facts = [] {
    IngestFacts facts;
    facts.lcm = Status(Reason::NO_MULTICAST_ROUTE, "no route");
    facts.not_taken[Reason::CORRUPT] = 3;
    return facts;
  };
  const auto reply = ask(get_status, v1::GetStatusRequest());
  EXPECT_EQ(reply->lcm_reason(), v1::REASON_NO_MULTICAST_ROUTE);
  ASSERT_EQ(reply->ingest().not_taken_size(), 1);
  EXPECT_EQ(reply->ingest().not_taken(0).count(), 3u);
}

TEST_F(Handlers, ExportsTrajectoriesAndResumesWhereAStreamBroke) {
  v1::ExportRequest request;
  EXPECT_EQ(call(*map_.core, export_trajectories, request, deadline_).reason(), Reason::INVALID_ARGUMENT);
  request.set_format(v1::EXPORT_FORMAT_TUM);
  auto stream = call(*map_.core, export_trajectories, request, deadline_).or_throw();
  const auto first = stream().or_throw();
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->session(), 1u);
  EXPECT_THAT(first->data(), HasSubstr("# poses in the frame of keyframe 1:0"));
  EXPECT_EQ(static_cast<std::size_t>(std::count(first->data().begin(), first->data().end(), '\n')),
            3 + ServedMap::kFrames);
  const auto second = stream().or_throw();
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(second->session(), 2u);
  EXPECT_EQ(second->frames_done(), second->frames_total());
  EXPECT_FALSE(stream().or_throw().has_value());

  request.set_resume_token(first->resume_token());
  auto resumed = call(*map_.core, export_trajectories, request, deadline_).or_throw();
  EXPECT_EQ(resumed().or_throw()->SerializeAsString(), second->SerializeAsString());

  request.add_sessions(9);
  EXPECT_EQ(call(*map_.core, export_trajectories, request, deadline_).reason(), Reason::NO_SUCH_SESSION);
}

TEST_F(Handlers, ExportsFramesWithTheLandmarksInForceThatAreBasedInThem) {
  const auto view = map_.mapper->view();
  for (const bool landmarks : {false, true}) {
    v1::ExportRequest request;
    request.set_format(v1::EXPORT_FORMAT_FRAMES);
    request.set_landmarks(landmarks);
    auto stream = call(*map_.core, export_trajectories, request, deadline_).or_throw();
    std::uint32_t frames = 0;
    int points = 0, stored = 0;
    for (auto part = stream().or_throw(); part; part = stream().or_throw()) {
      EXPECT_EQ(part->data(), "");
      for (const v1::ExportedFrame& message : part->frames()) {
        const FrameId id = from_wire(message.id()).or_throw();
        EXPECT_EQ(id.session, part->session());
        const auto hot = view->hot(id);
        ASSERT_TRUE(hot && hot->present) << id.to_string();
        EXPECT_EQ(message.time_us(), hot->time_us);
        ++frames;
        stored += static_cast<int>(hot->landmarks.size());
        ASSERT_EQ(message.landmarks_size(), 3 * message.observers_size());
        points += message.observers_size();
        int next = 0;
        for (std::uint32_t slot = 0; landmarks && slot < hot->landmarks.size(); ++slot) {
          const LandmarkId landmark{id, slot};
          if (hot->landmarks[slot].depth_prior || storage::resolve(*view, landmark) != landmark) continue;
          ASSERT_LT(next, message.observers_size());
          EXPECT_NEAR(message.landmarks(3 * next + 2), 1 / hot->landmarks[slot].abr.z(), 1e-3);
          EXPECT_EQ(message.observers(next++), hot->landmarks[slot].observers.size());
        }
        EXPECT_EQ(next, message.observers_size());
      }
    }
    EXPECT_EQ(frames, ServedMap::kFrames + ServedMap::kElsewhere);
    if (landmarks) {
      EXPECT_GT(points, 0);
      EXPECT_LT(points, stored) << "the second lap has merged some";
    } else {
      EXPECT_EQ(points, 0);
    }
  }
}

TEST_F(Handlers, AnEdgeTellsWhetherItIsMeasured) {
  storage::Edge step = map_.mapper->view()->hot({1, 5})->edges.front();
  EXPECT_FALSE(edge_message(step, 0).unmeasured());
  step.kind = storage::EdgeKind::kPrior;
  step.support = storage::kMinSupport;
  EXPECT_FALSE(edge_message(step, 0).unmeasured()) << "landmarks on both sides tell it";
  step.support = storage::kMinSupport - 1;
  EXPECT_TRUE(edge_message(step, 0).unmeasured());
}

TEST_F(Handlers, AnEdgeTellsWhatWasMeasuredAndWhatItIsNow) {
  storage::Edge step = map_.mapper->view()->hot({1, 5})->edges.front();
  step.prior_T_ab = step.T_ab * SE3::exp((Vector6() << 0.1, 0.2, 0.3, 0.01, 0.02, 0.03).finished());
  step.prior_covariance = 4 * Matrix6::Identity();
  const v1::Edge message = edge_message(step, 0);
  const auto was = from_wire(message.measured().a_from_b()), is = from_wire(message.a_from_b());
  ASSERT_TRUE(was.ok() && is.ok());
  EXPECT_LT((was->t - step.prior_T_ab.t).norm() + (was->R - step.prior_T_ab.R).norm(), 1e-9);
  EXPECT_LT((is->t - step.T_ab.t).norm() + (is->R - step.T_ab.R).norm(), 1e-9);
  EXPECT_EQ(message.measured().covariance().upper(0), 4);
}

TEST_F(Handlers, AMonoSessionHasNeitherEdgesNorATrajectory) {
  v1::ListEdgesRequest edges;
  edges.set_page_size(5000);
  const int before = ask(list_edges, edges)->edges_size();
  const SessionNumber mono = map_.take_in_with_one_eye(12);
  const auto after = ask(list_edges, edges);
  ASSERT_TRUE(after.ok()) << after.status().to_string();
  EXPECT_EQ(after->edges_size(), before);
  edges.set_session(mono);
  EXPECT_EQ(ask(list_edges, edges)->edges_size(), 0);

  v1::ExportRequest request;
  request.set_format(v1::EXPORT_FORMAT_TUM);
  auto stream = call(*map_.core, export_trajectories, request, deadline_).or_throw();
  for (auto part = stream().or_throw(); part; part = stream().or_throw()) EXPECT_NE(part->session(), mono);
  request.add_sessions(mono);
  EXPECT_EQ(call(*map_.core, export_trajectories, request, deadline_).reason(), Reason::NOT_STEREO);
}

TEST_F(Handlers, ADeadlineEndsASearch) {
  deadline_.at = std::chrono::steady_clock::now();
  v1::FindRouteRequest request;
  *request.mutable_from()->mutable_frame() = wire(ServedMap::kFirst);
  *request.mutable_to()->mutable_frame() = wire(ServedMap::kLast);
  EXPECT_EQ(call(*map_.core, find_route, request, deadline_).reason(), Reason::DEADLINE);
  v1::WaitIdleRequest idle;
  EXPECT_EQ(ask(wait_idle, idle).reason(), Reason::DEADLINE);
  deadline_ = {};
  EXPECT_TRUE(ask(wait_idle, idle).ok());
}

// What may move in a session: the estimates of its edges and landmarks.
std::vector<double> estimates_of(const storage::Graph& map, SessionNumber session) {
  std::vector<double> estimates;
  for (std::uint32_t i = 0; i < ServedMap::kFrames; ++i) {
    const auto hot = map.hot({session, i});
    for (const storage::Edge& edge : hot->edges)
      if (edge.kind == storage::EdgeKind::kOdometry)
        estimates.insert(estimates.end(), {edge.T_ab.t.x(), edge.T_ab.t.y()});
    for (const storage::Landmark& landmark : hot->landmarks) estimates.push_back(landmark.abr.x());
  }
  return estimates;
}

TEST_F(Handlers, AnEditThatIsSentAgainAfterARestartIsDoneOnce) {
  v1::FreezeSessionRequest freeze;
  freeze.set_session(1);
  freeze.set_frozen(true);
  freeze.set_idempotency_key("freeze");
  v1::SetLabelRequest label;
  *label.mutable_frame() = to_wire(ServedMap::kFirst);
  label.set_label("dock");
  label.set_idempotency_key("label");
  ASSERT_TRUE(ask(freeze_session, freeze).ok());
  const auto labelled = ask(set_label, label);
  ASSERT_TRUE(labelled.ok());
  map_.restart();

  const std::uint64_t last = map_.engine->last_journal_sequence();
  EXPECT_TRUE(ask(freeze_session, freeze).ok()) << "once more it would be WRONG_STATE";
  EXPECT_EQ(ask(set_label, label)->journal_sequence(), labelled->journal_sequence());
  EXPECT_EQ(map_.engine->last_journal_sequence(), last);
  label.set_label("door");
  EXPECT_EQ(ask(set_label, label).reason(), Reason::INVALID_ARGUMENT) << "the key names another edit";
  label.set_idempotency_key("door");
  EXPECT_TRUE(ask(set_label, label).ok());
}

TEST_F(Handlers, AFrozenSessionDoesNotMoveWhenOthersCloseLoopsToIt) {
  v1::FreezeSessionRequest request;
  request.set_session(1);
  request.set_frozen(true);
  request.set_idempotency_key("once");
  ASSERT_TRUE(ask(freeze_session, request).ok());
  ASSERT_TRUE(ask(freeze_session, request).ok()) << "the same edit again";
  EXPECT_EQ(map_.mapper->view()->session(1)->state, storage::SessionState::kFrozen);
  const std::vector<double> before = estimates_of(*map_.mapper->view(), 1);

  const auto drive = [&](std::uint8_t number) {
    sim::PointsWorldOptions options = ServedMap::circuit_options();
    options.uuid.bytes[15] = number;
    options.noise_seed = number;
    options.session = "again " + std::to_string(number);
    map_.take_in(sim::PointsWorld(options));
    map_.settle();
    std::size_t closures = 0;
    for (std::uint32_t i = 0; i < ServedMap::kFrames; ++i)
      for (const storage::Edge& edge : map_.mapper->view()->hot({number, i})->edges)
        closures += edge.in_graph() && edge.a.session == 1;
    EXPECT_GT(closures, 0u);
  };
  drive(3);
  EXPECT_EQ(estimates_of(*map_.mapper->view(), 1), before);

  v1::ListSessionsRequest list;
  EXPECT_EQ(ask(list_sessions, list)->sessions(0).state(), v1::SESSION_STATE_FROZEN);
  request.set_idempotency_key("again");
  EXPECT_EQ(ask(freeze_session, request).reason(), Reason::WRONG_STATE);
  request.set_session(99);
  EXPECT_EQ(ask(freeze_session, request).reason(), Reason::NO_SUCH_SESSION);

  request.set_session(1);
  request.set_frozen(false);
  request.set_idempotency_key("thaw");
  ASSERT_TRUE(ask(freeze_session, request).ok());
  drive(4);
  EXPECT_NE(estimates_of(*map_.mapper->view(), 1), before);
}

TEST_F(Handlers, ASessionIsDeletedForGood) {
  sim::PointsWorldOptions options = ServedMap::circuit_options();
  options.uuid.bytes[15] = 3;
  options.noise_seed = 3;
  options.session = "again";
  const sim::PointsWorld third(options);
  map_.take_in(third);
  map_.settle();
  v1::SetLabelRequest label;
  *label.mutable_frame() = wire({1, 20});
  label.set_label("dock");
  ASSERT_TRUE(ask(set_label, label).ok());

  v1::DeleteSessionRequest request;
  request.set_session(99);
  EXPECT_EQ(ask(delete_session, request).reason(), Reason::NO_SUCH_SESSION);
  request.set_session(1);
  request.set_uuid(map_.mapper->view()->session(2)->header.uuid.to_string());
  EXPECT_EQ(ask(delete_session, request).reason(), Reason::INVALID_ARGUMENT) << "of another session";
  EXPECT_EQ(map_.mapper->view()->session(1)->frames, ServedMap::kFrames);
  const SessionHeader header = map_.mapper->view()->session(1)->header;
  request.set_uuid(header.uuid.to_string());
  for (int asked = 0; asked < 2; ++asked) {  // asking again only watches the deletion
    auto progress = ask(delete_session, request).or_throw();
    std::uint64_t done = 0;
    while (const auto said = progress().or_throw()) {
      EXPECT_GE(said->done(), done);
      EXPECT_LE(said->done(), said->total());
      done = said->done();
      if (asked == 0) {
        EXPECT_EQ(said->total(), ServedMap::kFrames);
      }
    }
  }
  map_.settle();

  EXPECT_EQ(ask(list_sessions, v1::ListSessionsRequest())->sessions_size(), 2);
  EXPECT_EQ(ask(get_status, v1::GetStatusRequest())->frames(), ServedMap::kFrames + ServedMap::kElsewhere);
  EXPECT_EQ(map_.mapper->begin_session(header).reason(), Reason::SESSION_DELETED);
  v1::FreezeSessionRequest freeze;
  freeze.set_session(1);
  freeze.set_frozen(true);
  EXPECT_EQ(ask(freeze_session, freeze).reason(), Reason::SESSION_DELETED);
  v1::GetFrameRequest frame;
  *frame.mutable_frame() = wire({1, 20});
  EXPECT_EQ(ask(get_frame, frame).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(ask(find_labels, v1::FindLabelsRequest())->labels_size(), 0);

  // Only what is left is recognised.
  v1::LocaliseRequest where;
  *where.mutable_view() = view_of(third, 25);
  const auto found = ask(localise, where);
  ASSERT_TRUE(found.ok()) << found.status().to_string();
  EXPECT_EQ(found->frame().session(), 3u);
  v1::MatchImageRequest match;
  *match.mutable_view() = view_of(again(), 10);
  const v1::MatchImageReply matches = ask(match_image, match).or_throw();
  for (const v1::PlaceMatch& place : matches.places()) EXPECT_NE(place.frame().session(), 1u);
}

TEST_F(Handlers, WithoutAnIntakeThereAreNoRobots) {
  EXPECT_EQ(ask(list_robots, v1::ListRobotsRequest()).reason(), Reason::UNSUPPORTED);
}

}  // namespace
}  // namespace relmap::rpc
