// Tests the client against a daemon whose answers the test sets.
#include "client/relmap_client.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>
#include <stop_token>
#include <thread>

#include "client/channel.h"
#include "client/server_address.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.grpc.pb.h"

namespace relmap::client {
namespace {

grpc::Status refusal(Reason reason, const std::string& message) {
  v1::Error error;
  error.set_reason(to_wire(reason));
  error.set_message(message);
  return {grpc::StatusCode::NOT_FOUND, message, error.SerializeAsString()};
}

class FakeMap final : public v1::Map::Service {
 public:
  std::set<std::string> peers;  // that asked for the status

  grpc::Status GetStatus(grpc::ServerContext* context, const v1::GetStatusRequest*,
                         v1::GetStatusReply* reply) override {
    peers.insert(context->peer());
    reply->set_boot_id("boot-1");
    reply->set_frames(7);
    auto* refused = reply->add_refused_by_reason();
    refused->set_reason(v1::REASON_TIME_BACKWARDS);
    refused->set_count(3);
    reply->set_storage_reason(v1::REASON_READ_ONLY);
    reply->set_storage_message("disk full");
    return grpc::Status::OK;
  }
  // Until its caller gives up.
  grpc::Status FindLabels(grpc::ServerContext* context, const v1::FindLabelsRequest*, v1::FindLabelsReply*) override {
    ++waiting;
    while (!context->IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return grpc::Status::CANCELLED;
  }
  std::atomic<int> waiting{0};

  grpc::Status Localise(grpc::ServerContext*, const v1::LocaliseRequest* request, v1::LocaliseReply* reply) override {
    if (request->view().calibration_case() == v1::View::CALIBRATION_NOT_SET)
      return refusal(Reason::NO_CALIBRATION, "which camera?");
    *reply->mutable_frame() = to_wire(FrameId{1, 5});
    *reply->mutable_frame_from_view() = to_wire(SE3{Matrix3::Identity(), {1, 2, 3}});
    reply->set_inliers(44);
    return grpc::Status::OK;
  }
  grpc::Status MatchImage(grpc::ServerContext*, const v1::MatchImageRequest* request,
                          v1::MatchImageReply* reply) override {
    EXPECT_EQ(request->max_verified(), 5u);
    v1::PlaceMatch& confirmed = *reply->add_places();
    *confirmed.mutable_frame() = request->view().frame();
    confirmed.set_verification(v1::VERIFICATION_PNP);
    *confirmed.mutable_frame_from_view() = to_wire(SE3{Matrix3::Identity(), {1, 2, 3}});
    confirmed.set_estimated_focal_length(812);
    if (request->thumbnails()) confirmed.set_thumbnail("jpeg");
    v1::PlaceMatch& other = *reply->add_places();
    other.set_reason(v1::REASON_POOR_SPREAD);
    other.set_message("in a corner");
    return grpc::Status::OK;
  }
  // Two pages of one session each.
  grpc::Status ListSessions(grpc::ServerContext*, const v1::ListSessionsRequest* request,
                            v1::ListSessionsReply* reply) override {
    const bool first = request->page_token().empty();
    v1::Session& session = *reply->add_sessions();
    session.set_number(first ? 1 : 2);
    session.set_name(first ? "morning" : "evening");
    *session.mutable_camera() = to_wire(StereoCamera{400, 256, 192, 0.12, 512, 384});
    if (first) reply->set_next_page_token("more");
    return grpc::Status::OK;
  }
  grpc::Status FindRoute(grpc::ServerContext*, const v1::FindRouteRequest* request,
                         grpc::ServerWriter<v1::FindRouteReply>* stream) override {
    if (request->to().label() == "nowhere") return refusal(Reason::NO_SUCH_LABEL, "nowhere");
    v1::FindRouteReply reply;
    if (request->to().label() == "two ways") {
      EXPECT_EQ(request->alternatives(), 2u);
      for (const std::uint32_t route : {0u, 1u, 1u, 2u}) {
        reply.Clear();
        reply.set_route(route);
        reply.mutable_summary()->set_distance_m(10 + route);
        reply.mutable_summary()->set_shared(0.25 * route);
        *reply.add_steps()->mutable_frame() = to_wire(FrameId{1, route});
        stream->Write(reply);
      }
      return grpc::Status::OK;
    }
    if (request->to().label() == "out of order") {
      reply.set_route(2);
      stream->Write(reply);
      return grpc::Status::OK;
    }
    const bool resumed = request->resume_token() == "2 steps";
    if (!resumed) reply.mutable_summary()->set_distance_m(12.5);
    for (std::uint32_t i = resumed ? 2 : 0; i < 3; ++i) {
      v1::RouteStep& step = *reply.add_steps();
      *step.mutable_frame() = to_wire(FrameId{1, i});
      if (i < 2) {
        *step.mutable_edge() = to_wire(EdgeId{{1, i + 1}, 0});
        step.set_kind(v1::EDGE_KIND_ODOMETRY);
        *step.mutable_to_next() = to_wire(SE3());
      }
      if (i == 1) {  // in two messages, and sometimes the second is lost
        reply.set_resume_token("2 steps");
        stream->Write(reply);
        reply.Clear();
        if (request->to().label() == "far away") return {grpc::StatusCode::UNAVAILABLE, "gone"};
      }
    }
    stream->Write(reply);
    return grpc::Status::OK;
  }
  // Pages of two edges, without end.
  grpc::Status ListEdges(grpc::ServerContext*, const v1::ListEdgesRequest* request,
                         v1::ListEdgesReply* reply) override {
    edges_asked = *request;
    const int page = request->page_token().empty() ? 0 : std::stoi(request->page_token());
    for (int i = 0; i < 2; ++i) {
      v1::Edge& edge = *reply->add_edges();
      *edge.mutable_id() = to_wire(EdgeId{{1, static_cast<std::uint32_t>(2 * page + i)}, 1});
      *edge.mutable_a_from_b() = to_wire(SE3());
      edge.set_kind(v1::EDGE_KIND_LOOP);
      edge.set_state(v1::EDGE_STATE_ACCEPTED);
      edge.set_time_us(5);
      edge.mutable_suspicion()->set_value(0.5);
      edge.mutable_suspicion()->set_remark("accepted by an operator");
      v1::Doubt& doubt = *edge.mutable_suspicion()->add_doubts();
      doubt.set_kind(v1::DOUBT_KIND_TENSION);
      doubt.set_weight(0.25);
      v1::EdgeEvent& event = *edge.add_history();
      event.set_state(v1::EDGE_STATE_ACCEPTED);
      event.set_time_us(77);
      event.set_author("anna");
    }
    reply->set_next_page_token(std::to_string(page + 1));
    return grpc::Status::OK;
  }
  v1::ListEdgesRequest edges_asked;

  grpc::Status ExplainEdge(grpc::ServerContext*, const v1::ExplainEdgeRequest* request,
                           v1::ExplainEdgeReply* reply) override {
    if (request->edge().ordinal() == 0) return refusal(Reason::ODOMETRY_EDGE, "the robot's own motion");
    *reply->mutable_edge()->mutable_id() = request->edge();
    *reply->mutable_edge()->mutable_a_from_b() = to_wire(SE3());
    reply->mutable_edge()->set_kind(v1::EDGE_KIND_LOOP);
    reply->mutable_edge()->set_state(v1::EDGE_STATE_ACCEPTED);
    if (request->pictures()) {
      reply->mutable_picture_a()->set_data("jpeg");
      reply->mutable_picture_a()->set_width(320);
      reply->mutable_picture_a()->set_scale(0.5);
      reply->mutable_picture_b()->set_reason(v1::REASON_UNSUPPORTED);
      reply->mutable_picture_b()->set_message("dropped");
    }
    v1::Correspondence& match = *reply->add_correspondences();
    match.set_u(1);
    match.set_frame_v(4);
    match.set_inlier(true);
    match.set_residual(0.5);
    *match.mutable_seen_in() = to_wire(FrameId{1, 3});
    reply->mutable_motion()->set_verdict(v1::REASON_CONTRADICTS_MOTION);
    reply->mutable_motion()->set_sigmas_apart(7);
    reply->add_agreements()->set_agrees(true);
    reply->mutable_agreements(0)->set_state(v1::EDGE_STATE_ACCEPTED);
    return grpc::Status::OK;
  }
  // Two pages of one cell each.
  grpc::Status GetNeighbourhood(grpc::ServerContext*, const v1::GetNeighbourhoodRequest* request,
                                v1::GetNeighbourhoodReply* reply) override {
    if (request->root().session() != 1) return refusal(Reason::NO_SUCH_FRAME, "no such frame");
    for (std::uint32_t i = 0; i < request->max_frames(); ++i) {
      v1::NeighbourhoodFrame& frame = *reply->add_frames();
      *frame.mutable_frame() = to_wire(FrameId{1, request->root().index() + i});
      *frame.mutable_root_from_frame() = to_wire(SE3{Matrix3::Identity(), {0, 0, 1.0 * i}});
      frame.set_distance_m(i);
    }
    v1::Edge& edge = *reply->add_edges();
    *edge.mutable_id() = to_wire(EdgeId{{1, 6}, 0});
    *edge.mutable_a_from_b() = to_wire(SE3());
    edge.set_kind(v1::EDGE_KIND_ODOMETRY);
    edge.set_state(v1::EDGE_STATE_ACCEPTED);
    reply->set_cut(request->max_metres() == 20 && request->max_edges() == 7);
    return grpc::Status::OK;
  }
  grpc::Status GetClosureMatrix(grpc::ServerContext*, const v1::GetClosureMatrixRequest* request,
                                v1::GetClosureMatrixReply* reply) override {
    v1::ClosureMatrixCell& cell = *reply->add_cells();
    cell.set_session_a(request->sessions(0));
    cell.set_session_b(9);
    cell.set_accepted(4);
    if (request->page_token().empty()) {
      *cell.mutable_most_suspicious() = to_wire(EdgeId{{9, 1}, 1});
      reply->set_next_page_token("more");
    }
    return grpc::Status::OK;
  }

  // Breaks after each piece, so that it has to be resumed for each.
  grpc::Status Export(grpc::ServerContext*, const v1::ExportRequest* request,
                      grpc::ServerWriter<v1::ExportReply>* stream) override {
    const int piece = request->resume_token().empty() ? 0 : std::stoi(request->resume_token());
    if (piece == 5) return grpc::Status::OK;
    v1::ExportReply reply;
    reply.set_session(1);
    if (request->format() == v1::EXPORT_FORMAT_FRAMES) {
      v1::ExportedFrame& frame = *reply.add_frames();
      *frame.mutable_id() = to_wire(FrameId{1, static_cast<std::uint32_t>(piece)});
      frame.set_time_us(1000 + piece);
      for (int i = 0; request->landmarks() && i < piece; ++i) {
        for (const float coordinate : {1.F, 2.F, 3.F + static_cast<float>(i)}) frame.add_landmarks(coordinate);
        if (request->sessions(0) != 13) frame.add_observers(4);
      }
    } else {
      reply.set_data("piece " + std::to_string(piece) + "\n");
      if (piece == 2) {
        v1::Edge& step = *reply.add_unmeasured();
        *step.mutable_id() = to_wire(EdgeId{{1, 2}, 0});
        *step.mutable_a_from_b() = to_wire(SE3());
        step.set_kind(v1::EDGE_KIND_PRIOR);
        step.set_state(v1::EDGE_STATE_ACCEPTED);
        step.set_source(v1::MOTION_SOURCE_CONSTANT_VELOCITY);
        step.set_unmeasured(true);
      }
    }
    reply.set_resume_token(std::to_string(piece + 1));
    stream->Write(reply);
    return {grpc::StatusCode::UNAVAILABLE, "gone"};
  }
};

class ClientTest : public ::testing::Test {
 protected:
  ClientTest() : folder_(std::filesystem::temp_directory_path() / ("relmap_client_" + std::to_string(::getpid()))) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&map_);
    server_ = builder.BuildAndStart();
    std::filesystem::create_directories(folder_);
  }
  ~ClientTest() override {
    server_->Shutdown();
    std::filesystem::remove_all(folder_);
  }

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  void write_endpoint(const std::string& at, const std::string& boot_id) const {
    std::ofstream(folder_ / "endpoint") << "address " << at << "\npid 1\nboot " << boot_id << "\nlater words\n";
  }
  std::unique_ptr<Client> client(ClientOptions options = {}) const {
    auto connected = Client::connect(address(), std::move(options));
    EXPECT_TRUE(connected.ok()) << connected.status().to_string();
    return std::move(connected).value();
  }

  FakeMap map_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
  const std::filesystem::path folder_;
};

TEST(Channel, NamesOtherCausesWhereNothingAnswers) {
  const ServerAddress tcp{"map.lab:1", 0, ""}, socket{"unix:/map/socket", 0, ""};
  EXPECT_EQ(other_causes(socket, "", "gone"), "");
  EXPECT_EQ(other_causes(tcp, "", "Socket closed"), ", or it serves TLS, and needs --credentials");
  EXPECT_EQ(other_causes(tcp, "a.pem", "Socket closed"), ", or it and a.pem do not trust each other");
  EXPECT_EQ(
      other_causes(tcp, "a.pem", "Peer name map.lab is not in peer certificate"),
      ", or it and a.pem do not trust each other (relmap-admin credentials ca FOLDER --host HOST adds a name or an "
      "address to the daemon's certificate)");
}

// As another user than the one that runs the daemon.
TEST(ServerAddress, SaysThatAFolderMayNotBeRead) {
  std::string folder = (std::filesystem::temp_directory_path() / "relmap-client-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const auto as_another = [&] {
    std::filesystem::permissions(folder, std::filesystem::perms::none);
    if (geteuid() == 0 && seteuid(65534) != 0) std::abort();
    std::fprintf(stderr, "%s\n", resolve_server(folder + "/map").status().to_string().c_str());
    std::_Exit(0);
  };
  EXPECT_EXIT(as_another(), testing::ExitedWithCode(0), "NOT_ALLOWED: you may not read .*socket_group");
  std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
  std::filesystem::remove(folder);
}

TEST_F(ClientTest, FindsTheDaemonOfADataFolder) {
  write_endpoint(address(), "boot-1");
  EXPECT_TRUE(Client::connect(folder_.string()).ok());
}

TEST_F(ClientTest, IsNotFooledByAnotherDaemonOnTheSamePort) {
  write_endpoint(address(), "boot-0");
  EXPECT_EQ(Client::connect(folder_.string()).status().reason(), Reason::UNREACHABLE);
}

// After a kill the next daemon answers before it has written the file anew.
TEST_F(ClientTest, WaitsForTheFileOfADaemonThatHasJustStarted) {
  write_endpoint(address(), "boot-0");
  std::thread starting([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    write_endpoint(address(), "boot-1");
  });
  const auto connected = Client::connect(folder_.string());
  starting.join();
  EXPECT_TRUE(connected.ok()) << connected.status().to_string();
}

TEST_F(ClientTest, SaysWhyNoDaemonCanBeReached) {
  ClientOptions hasty;
  hasty.connect_timeout = std::chrono::milliseconds(200);
  EXPECT_EQ(Client::connect(folder_.string(), hasty).status().reason(), Reason::UNREACHABLE);
  EXPECT_EQ(Client::connect("127.0.0.1:1", hasty).status().reason(), Reason::UNREACHABLE);
  EXPECT_EQ(Client::connect("no-such-folder", hasty).status().reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(Client::connect("host:99999", hasty).status().reason(), Reason::INVALID_ARGUMENT);
  std::ofstream(folder_ / "endpoint") << "nonsense";
  EXPECT_EQ(Client::connect(folder_.string(), hasty).status().reason(), Reason::CORRUPT);
}

// Both would last for ten minutes otherwise.
TEST_F(ClientTest, EndsWhatItWaitsForOnceItIsToStop) {
  std::stop_source stop;
  ClientOptions options;
  options.connect_timeout = options.deadline = std::chrono::minutes(10);
  options.stop = stop.get_token();
  const auto waiting = client(options);
  // A call of the same connection with another deadline.
  const auto other = waiting->with_deadline(std::chrono::minutes(9));
  Status ended, other_ended, connected;
  std::thread call([&] { ended = waiting->labels().status(); }),
      call_again([&] { other_ended = other->labels().status(); });
  std::thread connecting([&] { connected = Client::connect("127.0.0.1:1", options).status(); });
  while (map_.waiting < 2) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_TRUE(waiting->status().ok());
  stop.request_stop();
  for (std::thread* const thread : {&call, &call_again, &connecting}) thread->join();
  for (const Status& status : {ended, other_ended, connected, waiting->status().status()})
    EXPECT_EQ(status.reason(), Reason::SHUTTING_DOWN) << status.to_string();
}

TEST_F(ClientTest, CallsHaveTheDeadlineThatTheyAreGiven) {
  EXPECT_EQ(client()->with_deadline(std::chrono::milliseconds(50))->labels().reason(), Reason::DEADLINE);
}

TEST_F(ClientTest, ReachesADaemonThatListensEverywhereOverLoopback) {
  write_endpoint("0.0.0.0:5", "b");
  EXPECT_EQ(resolve_server(folder_.string())->address, "localhost:5");
}

TEST_F(ClientTest, PrefersTheSocketOfADataFolder) {
  std::ofstream(folder_ / "endpoint") << "socket /a folder/socket\naddress 0.0.0.0:5\npid 7\nboot b\n";
  const auto where = resolve_server(folder_.string());
  ASSERT_TRUE(where.ok()) << where.status().to_string();
  EXPECT_EQ(where->address, "unix:/a folder/socket");
  EXPECT_TRUE(where->is_socket());
  EXPECT_EQ(where->pid, 7);
  EXPECT_TRUE(resolve_server("unix:/a/socket")->is_socket());
}

TEST_F(ClientTest, CredentialsThatCannotBeUsedAreRefusedByName) {
  ClientOptions options;
  options.credentials = folder_ / "nowhere.pem";
  EXPECT_EQ(Client::connect(address(), options).status().reason(), Reason::NO_SUCH_FILE);
  std::ofstream(folder_ / "empty.pem") << "";
  options.credentials = folder_ / "empty.pem";
  EXPECT_EQ(Client::connect(address(), options).status().reason(), Reason::BAD_CONFIG);
}

TEST_F(ClientTest, ReadsMatchesAndTheReasonsOfOthers) {
  View view;
  view.frame = FrameId{3, 17};
  const auto matches = client()->match_image(view, {.max_verified = 5, .thumbnails = true});
  ASSERT_TRUE(matches.ok()) << matches.status().to_string();
  ASSERT_EQ(matches->places.size(), 2u);
  const PlaceMatch &confirmed = matches->places[0], &other = matches->places[1];
  EXPECT_EQ(confirmed.frame, (FrameId{3, 17}));
  EXPECT_STREQ(name_of(confirmed.verification), "pnp");
  ASSERT_TRUE(confirmed.T_frame_view.has_value());
  EXPECT_EQ(confirmed.T_frame_view->t.z(), 3);
  EXPECT_EQ(confirmed.estimated_focal_length, 812);
  EXPECT_EQ(confirmed.thumbnail, "jpeg");
  EXPECT_TRUE(confirmed.unverified.ok() && matches->nothing_verified.ok());
  EXPECT_EQ(other.unverified.reason(), Reason::POOR_SPREAD);
  EXPECT_FALSE(other.T_frame_view || other.estimated_focal_length);
}

TEST_F(ClientTest, ListsEdgesByAllFiltersAndStopsAtTheLimit) {
  EdgeFilter filter;
  filter.session = 3;
  filter.other_session = 4;
  filter.from_us = 10;
  filter.until_us = 20;
  filter.min_suspicion = 0.25;
  filter.region = Region{{1, 7}, 12, 3.5};
  filter.order = EdgeOrder::kSuspicion;
  filter.limit = 5;
  const auto edges = client()->edges(filter);
  ASSERT_TRUE(edges.ok()) << edges.status().to_string();
  ASSERT_EQ(edges->size(), 5u) << "though there are more";
  EXPECT_EQ(edges->back().id, (EdgeId{{1, 4}, 1}));
  const Edge& edge = edges->front();
  EXPECT_EQ(edge.time_us, 5);
  ASSERT_TRUE(edge.suspicion);
  EXPECT_EQ(edge.suspicion->value, 0.5);
  EXPECT_EQ(edge.suspicion->remark, "accepted by an operator");
  EXPECT_EQ(edge.suspicion->doubts.at(0).kind, DoubtKind::kTension);
  EXPECT_STREQ(name_of(edge.suspicion->doubts.at(0).kind), "under tension");
  EXPECT_EQ(edge.history.at(0).time_us, 77);
  EXPECT_EQ(edge.history.at(0).author, "anna");
  const v1::ListEdgesRequest& asked = map_.edges_asked;
  EXPECT_EQ(asked.other_session(), 4u);
  EXPECT_EQ(asked.from_us(), 10);
  EXPECT_EQ(asked.until_us(), 20);
  EXPECT_EQ(asked.min_suspicion(), 0.25);
  EXPECT_EQ(asked.region().max_metres(), 3.5);
  EXPECT_EQ(asked.order(), v1::EDGE_ORDER_SUSPICION);
  EXPECT_EQ(asked.page_size(), 5u);
}

TEST_F(ClientTest, ReadsWhatIsAroundAFrame) {
  const auto around = client()->neighbourhood({FrameId{1, 5}, 7, 20}, 3);
  ASSERT_TRUE(around.ok());
  ASSERT_EQ(around->frames.size(), 3u);
  EXPECT_EQ(around->frames[2].frame, (FrameId{1, 7}));
  EXPECT_EQ(around->frames[2].T_root_frame.t.z(), 2);
  EXPECT_EQ(around->frames[2].distance_m, 2);
  ASSERT_EQ(around->edges.size(), 1u);
  EXPECT_EQ(around->edges[0].id, (EdgeId{{1, 6}, 0}));
  EXPECT_TRUE(around->cut);
  EXPECT_EQ(client()->neighbourhood({FrameId{2, 5}}).reason(), Reason::NO_SUCH_FRAME);
}

TEST_F(ClientTest, ReadsWhyAClosureIsBelieved) {
  const auto explained = client()->explain_edge({{2, 5}, 1}, true);
  ASSERT_TRUE(explained.ok()) << explained.status().to_string();
  EXPECT_EQ(explained->edge.id, (EdgeId{{2, 5}, 1}));
  ASSERT_TRUE(explained->picture_a && explained->picture_b);
  EXPECT_EQ(explained->picture_a->scale, 0.5);
  EXPECT_TRUE(explained->picture_a->missing.ok());
  EXPECT_EQ(explained->picture_b->missing.to_string(), "UNSUPPORTED: dropped");
  const Correspondence& match = explained->correspondences.at(0);
  EXPECT_EQ(match.in_view.x(), 1);
  EXPECT_EQ(match.in_frame.y(), 4);
  EXPECT_TRUE(match.inlier && match.residual == 0.5 && match.seen_in == (FrameId{1, 3}));
  EXPECT_EQ(explained->motion.verdict, Reason::CONTRADICTS_MOTION);
  EXPECT_EQ(explained->motion.sigmas_apart, 7);
  EXPECT_TRUE(explained->agreements.at(0).agrees);
  EXPECT_FALSE(client()->explain_edge({{2, 5}, 1})->picture_a) << "they were not asked for";
  EXPECT_EQ(client()->explain_edge({{2, 5}, 0}).reason(), Reason::ODOMETRY_EDGE);
}

TEST_F(ClientTest, ReadsTheWholeMatrix) {
  const auto cells = client()->closure_matrix({3});
  ASSERT_TRUE(cells.ok()) << cells.status().to_string();
  ASSERT_EQ(cells->size(), 2u);
  EXPECT_EQ(cells->at(0).most_suspicious, (EdgeId{{9, 1}, 1}));
  EXPECT_FALSE(cells->at(1).most_suspicious);
  EXPECT_EQ(cells->at(1).accepted, 4u);
}

TEST_F(ClientTest, KeepsTheStepsOfAlternativesApart) {
  const auto route = client()->find_route({.from = FrameId{1, 0}, .to = "two ways", .alternatives = 2});
  ASSERT_TRUE(route.ok()) << route.status().to_string();
  EXPECT_EQ(route->steps.size(), 1u);
  EXPECT_EQ(route->distance_m, 10);
  ASSERT_EQ(route->alternatives.size(), 2u);
  EXPECT_EQ(route->alternatives[0].steps.size(), 2u);
  EXPECT_EQ(route->alternatives[1].distance_m, 12);
  EXPECT_EQ(route->alternatives[1].shared, 0.5);
  EXPECT_EQ(client()->find_route({.from = FrameId{1, 0}, .to = "out of order"}).reason(), Reason::CORRUPT);
}

TEST_F(ClientTest, ReadsStatus) {
  const auto status = client()->status();
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(status->frames, 7u);
  EXPECT_EQ(status->refused_by_reason, (ReasonCounts{{Reason::TIME_BACKWARDS, 3}}));
  EXPECT_EQ(status->storage.to_string(), "READ_ONLY: disk full");
}

TEST_F(ClientTest, HasAConnectionOfItsOwn) {
  const auto first = client();
  const auto second = client();
  EXPECT_TRUE(first->status().ok());
  EXPECT_TRUE(second->status().ok());
  EXPECT_EQ(map_.peers.size(), 2u) << "what another client was connected to may be a daemon that is gone";
}

TEST_F(ClientTest, ReturnsTheDaemonsReason) {
  const auto found = client()->localise({});
  EXPECT_EQ(found.status().to_string(), "NO_CALIBRATION: which camera?");
}

TEST_F(ClientTest, RpcsThatTheDaemonDoesNotHaveAreUnimplemented) {
  EXPECT_EQ(client()->wait_idle().reason(), Reason::UNIMPLEMENTED);
}

// gRPC cannot send such text, and would by itself report that the RPC does not exist.
TEST_F(ClientTest, TextThatIsNotUtf8IsRefusedByNameBeforeItIsSent) {
  const auto client = Client::connect(address()).or_throw();
  const std::string bad = "caf\xe9";
  EXPECT_EQ(client->set_label({1, 2}, bad).status().to_string(), "BAD_NAME: label is not UTF-8");
  EXPECT_EQ(client->set_label({1, 2}, bad, false).reason(), Reason::BAD_NAME);
  EXPECT_EQ(client->labels(bad).status().to_string(), "INVALID_ARGUMENT: prefix is not UTF-8");
  EXPECT_EQ(client->labels("", bad).status().to_string(), "INVALID_ARGUMENT: words is not UTF-8");
  EXPECT_EQ(client->edit_edge({{1, 2}, 1}, EdgeAction::kRemove, {.note = bad}).status().to_string(),
            "INVALID_ARGUMENT: note is not UTF-8");
  RouteRequest route{.from = FrameId{1, 2}, .to = bad};  // in a nested message
  EXPECT_EQ(client->find_route(route).status().to_string(), "INVALID_ARGUMENT: label is not UTF-8");
  route.to = FrameId{1, 2};
  route.filter.avoid_labels = {"dock", bad};
  EXPECT_EQ(client->find_route(route).status().to_string(), "INVALID_ARGUMENT: avoid_labels is not UTF-8");
  EXPECT_EQ(client->backup(bad, [](const Progress&) { return true; }).status().to_string(),
            "INVALID_ARGUMENT: folder is not UTF-8");
  GraphPiece piece;
  piece.robot = bad;
  EXPECT_EQ(client->import_graph(piece).status().to_string(), "INVALID_ARGUMENT: robot is not UTF-8");
}

TEST_F(ClientTest, Localises) {
  View view;
  view.left = "jpeg";
  view.camera = SessionNumber{1};
  const auto found = client()->localise(view);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->frame, (FrameId{1, 5}));
  EXPECT_EQ(found->T_frame_view.t, Vector3(1, 2, 3));
  EXPECT_EQ(found->inliers, 44u);
}

TEST_F(ClientTest, ReadsListsToTheirEndAndReportsEachReply) {
  std::vector<std::string> replies;
  ClientOptions options;
  options.on_reply = [&](const std::string& json) { replies.push_back(json); };
  const auto sessions = client(options)->sessions();
  ASSERT_TRUE(sessions.ok());
  ASSERT_EQ(sessions->size(), 2u);
  EXPECT_EQ((*sessions)[1].name, "evening");
  ASSERT_EQ(replies.size(), 2u);
  EXPECT_NE(replies[0].find("\"name\":\"morning\""), std::string::npos) << replies[0];
  EXPECT_NE(replies[0].find("\"nextPageToken\":\"more\""), std::string::npos) << replies[0];
}

TEST_F(ClientTest, ResumesARouteThatBreaks) {
  const auto route = client()->find_route({FrameId{1, 0}, "far away", RouteBy::kTime, false, 0});
  ASSERT_TRUE(route.ok()) << route.status().to_string();
  EXPECT_EQ(route->distance_m, 12.5);
  ASSERT_EQ(route->steps.size(), 3u);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(route->steps[i].frame, (FrameId{1, i}));
}

TEST_F(ClientTest, JoinsTheMessagesOfARoute) {
  const auto route = client()->find_route({FrameId{1, 0}, "kitchen", RouteBy::kTime, false, 0});
  ASSERT_TRUE(route.ok()) << route.status().to_string();
  EXPECT_EQ(route->distance_m, 12.5);
  ASSERT_EQ(route->steps.size(), 3u);
  EXPECT_EQ(route->steps[1].edge, (EdgeId{{1, 2}, 0}));
  EXPECT_FALSE(route->steps[2].edge);
  EXPECT_EQ(client()->find_route({FrameId{1, 0}, "nowhere", RouteBy::kTime, false, 0}).reason(), Reason::NO_SUCH_LABEL);
}

TEST_F(ClientTest, ResumesAnExportThatBreaks) {
  std::string written;
  std::vector<Edge> doubtful;
  const Status status = client()->export_trajectories(ExportFormat::kTum, {}, [&](const TrajectoryPiece& piece) {
    written += piece.bytes;
    doubtful.insert(doubtful.end(), piece.doubtful.begin(), piece.doubtful.end());
    return Status();
  });
  EXPECT_TRUE(status.ok()) << status.to_string();
  EXPECT_EQ(written, "piece 0\npiece 1\npiece 2\npiece 3\npiece 4\n");
  ASSERT_EQ(doubtful.size(), 1u);
  EXPECT_EQ(doubtful[0].id, (EdgeId{{1, 2}, 0}));
  EXPECT_EQ(doubtful[0].source, MotionSource::kConstantVelocity);
  EXPECT_TRUE(doubtful[0].unmeasured);
}

TEST_F(ClientTest, ReadsFramesWithAndWithoutTheirLandmarks) {
  for (const bool landmarks : {false, true}) {
    std::uint32_t next = 0;
    const Status status = client()->export_frames({1}, landmarks, [&](const ExportedFrame& frame) {
      EXPECT_EQ(frame.id, (FrameId{1, next}));
      EXPECT_EQ(frame.time_us, 1000 + next);
      EXPECT_EQ(frame.landmarks.size(), landmarks ? next : 0);
      for (std::size_t i = 0; i < frame.landmarks.size(); ++i) {
        EXPECT_EQ(frame.landmarks[i].point, Eigen::Vector3f(1, 2, 3 + static_cast<float>(i)));
        EXPECT_EQ(frame.landmarks[i].observers, 4u);
      }
      ++next;
      return Status();
    });
    EXPECT_TRUE(status.ok()) << status.to_string();
    EXPECT_EQ(next, 5u);
  }
}

TEST_F(ClientTest, FramesWithAnIncompleteLandmarkAreCorrupt) {
  EXPECT_EQ(client()->export_frames({13}, true, [](const ExportedFrame&) { return Status(); }).reason(),
            Reason::CORRUPT);
}

TEST_F(ClientTest, EndsAnExportIfTheSinkFails) {
  const Status status = client()->export_trajectories(
      ExportFormat::kTum, {}, [&](const TrajectoryPiece&) { return Status(Reason::IO_ERROR, "full"); });
  EXPECT_EQ(status.reason(), Reason::IO_ERROR);
}

}  // namespace
}  // namespace relmap::client
