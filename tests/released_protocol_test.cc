// Clients and daemons of each release talk to those of today, by the released descriptor sets (proto/relmap/released).
// proto/wire/compatibility_test compares the descriptors, released_bytes_test the bytes of LCM and keyframes,
// storage/migrate/migrate_test opens a map of each released format.
#include "tests/support/released_protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <map>
#include <set>

#include "client/relmap_client.h"
#include "client/server_address.h"
#include "proto/base/crc32c.h"
#include "proto/wire/convert.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/generic_calls.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;

// ---- Bytes

class ReleasedProtocolTest : public ::testing::TestWithParam<std::string> {
 protected:
  ReleasedProtocol old_{ReleasedProtocol::files_of(GetParam())};
};

TEST_P(ReleasedProtocolTest, EveryRequestAndReplyIsReadByteForByte) {
  ASSERT_GE(old_.methods().size(), 25u);
  for (const auto* method : old_.methods())
    for (const auto* type : {method->input_type(), method->output_type()})
      for (int choice = 0; choice < count_choices(*type); ++choice) {
        const auto message = old_.make(*type);
        fill(*message, choice);
        const auto now = make_current(type->full_name());
        ASSERT_TRUE(now->ParseFromString(bytes_of(*message))) << type->full_name();
        EXPECT_FALSE(has_unknown_fields(*now)) << type->full_name();
        EXPECT_EQ(bytes_of(*now), bytes_of(*message)) << type->full_name();
      }
}

// The comparison that the test of the daemon relies on sees what an old client would not.
TEST_P(ReleasedProtocolTest, AReplyThatAnOldClientMisreadsIsSeen) {
  const auto lost_after = [](const std::function<void(google::protobuf::DescriptorProto&)>& change) {
    auto files = ReleasedProtocol::files_of(GetParam());
    for (auto& file : *files.mutable_file())
      for (auto& message : *file.mutable_message_type())
        if (message.name() == "Frame") change(message);
    ReleasedProtocol other(files);
    const auto reply = make_current("relmap.v1.GetFrameReply");
    fill(*reply, 0);
    return other.lost_in(other.type("relmap.v1.GetFrameReply"), bytes_of(*reply));
  };
  EXPECT_EQ(lost_after([](auto&) {}), "");
  // As if today's daemon had a field that the release had not: no old client misses it.
  EXPECT_EQ(lost_after([](auto& frame) { frame.mutable_field()->RemoveLast(); }), "");
  // As if it had been another type, or another number.
  using google::protobuf::FieldDescriptorProto;
  EXPECT_NE(lost_after([](auto& frame) {
              for (auto& field : *frame.mutable_field())
                if (field.name() == "time_us") field.set_type(FieldDescriptorProto::TYPE_FIXED64);
            }),
            "");
}

INSTANTIATE_TEST_SUITE_P(Releases, ReleasedProtocolTest, ::testing::ValuesIn(ReleasedProtocol::versions()));

// ---- An old client and today's daemon

// A daemon with a drive of two laps, of which nothing is closed but what is asked for.
class OldClient : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    ASSERT_EQ(run_program({built_program("relmap-sim"), "points", "--out", drive_, "--frames", "120",
                           "--frames-per-lap", "80", "--appearance", "140"})
                  .exit_code,
              0);
    {
      // Only what is proposed here is closed; then a daemon that recognises places takes over.
      DaemonOptions options = options_;
      options.more = {"--no-closures"};
      RunningDaemon first(options);
      const Finished streamed = run_program({built_program("relmap-frontend"), "--source", "sim", drive_, "--robot",
                                             "walker", "--server", options_.data, "--spool", "none", "--quiet"});
      ASSERT_EQ(streamed.exit_code, 0) << streamed.standard_error;
      ASSERT_TRUE(first.client()->wait_idle().ok());
      closure_ = first.client()->propose_edge({1, 5}, {1, 85}, /*accept=*/true).or_throw().edge.id;
      ASSERT_EQ(first.stop(), 0) << first.log();
    }
    daemon_ = std::make_unique<RunningDaemon>(options_);
    client_ = daemon_->client();
    ASSERT_TRUE(client_->wait_idle().ok());
    channel_ = grpc::CreateChannel(client::resolve_server(options_.data).or_throw().address,
                                   grpc::InsecureChannelCredentials());
  }

  static std::string escaped(const std::string& bytes) {
    std::string text;
    for (const char byte : bytes) {
      char octal[8];
      std::snprintf(octal, sizeof octal, "\\%03o", static_cast<unsigned char>(byte));
      text += octal;
    }
    return '"' + text + '"';
  }

  // A request of every method, in an order in which all succeed; those of streams to the daemon are several.
  std::vector<std::pair<std::string, std::vector<std::string>>> requests() {
    const Keyframe keyframe = read_keyframes(drive_ + "/keyframes.bin").front();
    const Bytes payload = encode_keyframe(keyframe);
    const std::string uuid = client_->sessions().or_throw().at(0).uuid;
    const std::string uuid_bytes = escaped(uuid_to_wire(*SessionUuid::parse(uuid)));
    const std::string sent = "keyframe { session_uuid: " + escaped(uuid_to_wire(keyframe.session.uuid)) +
                             " sequence: 0 crc32c: " + std::to_string(crc32c(payload)) +
                             " payload: " + escaped({payload.begin(), payload.end()}) + " }";
    const auto frame = [](std::uint32_t index) { return "{ session: 1 index: " + std::to_string(index) + " }"; };
    const std::string closure =
        "edge { frame " + frame(closure_.frame.index) + " ordinal: " + std::to_string(closure_.ordinal) + " }";
    const std::string ends = "a { session: 1 index: 10 } b { session: 1 index: 11 }";
    return {
        {"Ingest/Stream", {"hello { protocol { major: 1 } robot: 'walker' }", sent}},
        {"Ingest/GetAcknowledgement", {"session_uuid: " + escaped(uuid_to_wire(keyframe.session.uuid))}},
        {"Map/Localise", {"view { frame { session: 1 index: 110 } }"}},
        {"Map/MatchImage", {"view { frame { session: 1 index: 110 } } thumbnails: true"}},
        {"Map/FindRoute",
         {"from { frame { session: 1 index: 10 } } to { frame { session: 1 index: 40 } } covariance: true"}},
        {"Map/GetNeighbourhood", {"root { session: 1 index: 10 } landmarks: true"}},
        {"Map/TransformBetween", {ends}},
        {"Map/GetFrame",
         {"frame { session: 1 index: 10 } landmarks: true observations: true appearance: true thumbnail: true"}},
        {"Map/ListSessions", {""}},
        {"Map/ListEdges", {"session: 1"}},
        {"Map/ExplainEdge", {closure + " pictures: true"}},
        {"Map/SetEdgeState", {closure + " state: EDGE_STATE_REMOVED dry_run: true"}},
        {"Map/ProposeEdge", {"a " + frame(20) + " b " + frame(100) + " dry_run: true"}},
        {"Map/SetLabel", {"frame { session: 1 index: 7 } label: 'dock' idempotency_key: 'one'"}},
        {"Map/ImportGraph",
         {"session_uuid: '0123456789abcdef' robot: 'graph' name: 'imported' "
          "frames { odom_from_frame { rotation { w: 1 } translation { } } time_us: 1000000 } "
          "frames { odom_from_frame { rotation { w: 1 } translation { z: 1 } } time_us: 2000000 driven_us: 1000000 }"}},
        {"Map/GetClosureMatrix", {"sessions: 1"}},
        {"Map/FindLabels", {""}},
        {"Map/WatchMap", {""}},
        {"Map/ListRobots", {""}},
        {"Map/GetStatus", {""}},
        {"Map/GetSkeleton", {"level: 2 sessions: 1 candidates: true"}},
        {"Map/Export", {"format: EXPORT_FORMAT_FRAMES sessions: 1 landmarks: true"}},
        {"Admin/Verify", {""}},
        {"Admin/Repair", {""}},
        {"Admin/Backup", {"folder: '" + folder_ / "backup" + "'"}},
        {"Admin/Compact", {""}},
        {"Admin/Reindex", {""}},
        {"Admin/GetStats", {""}},
        {"Admin/ListAudit", {"page_size: 3"}},
        {"Admin/WaitIdle", {""}},
        {"Admin/Commit", {""}},
        {"Admin/SetLogLevel", {"level: 'debug'"}},
        {"Admin/FreezeSession", {"session: 1 frozen: true"}},
        {"Admin/DeleteSession", {"session: 1 uuid: '" + uuid + "'"}},
    };
  }

  GenericReplies call(const google::protobuf::MethodDescriptor& method, const std::vector<std::string>& texts) {
    std::vector<std::string> bytes;
    for (const std::string& text : texts) bytes.push_back(bytes_of(*old_.parse(*method.input_type(), text)));
    // These go on until the client ends them: a welcome and an acknowledgement are enough, the state of storage and
    // that there is no more to tell.
    const bool endless = method.name() == "Stream" || method.name() == "WatchMap";
    return call_generic(channel_, path_of(method), bytes, endless ? 2 : 100000);
  }

  const storage::TemporaryFolder folder_;
  const std::string drive_ = folder_ / "drive";
  const DaemonOptions options_{.data = folder_ / "map", .lcm = "", .more = {"--backup-root", folder_ / ""}};
  ReleasedProtocol old_{ReleasedProtocol::files_of(GetParam())};
  std::unique_ptr<RunningDaemon> daemon_;
  std::unique_ptr<client::Client> client_;
  std::shared_ptr<grpc::Channel> channel_;
  EdgeId closure_;
};

// As the .proto files say.
const std::map<std::string, grpc::StatusCode> kAlwaysRefused{
    {"Admin/Repair", grpc::StatusCode::FAILED_PRECONDITION},
    {"Admin/Reindex", grpc::StatusCode::FAILED_PRECONDITION},
};

TEST_P(OldClient, CallsEveryMethodAndReadsWhatItIsTold) {
  std::set<std::string> called;
  for (const auto& [name, texts] : requests()) {
    const std::string path = "/relmap.v1." + name;
    const auto* method = old_.method(path);
    if (!method) continue;  // of a later release
    called.insert(path);
    const GenericReplies replies = call(*method, texts);
    if (const auto refused = kAlwaysRefused.find(name); refused != kAlwaysRefused.end()) {
      EXPECT_EQ(replies.status.error_code(), refused->second) << path;
      continue;
    }
    const bool endless = replies.status.error_code() == grpc::StatusCode::CANCELLED;
    EXPECT_TRUE(replies.status.ok() || endless) << path << ": " << replies.status.error_message();
    EXPECT_THAT(replies.messages, Not(IsEmpty())) << path;
    for (const std::string& message : replies.messages)
      EXPECT_EQ(old_.lost_in(*method->output_type(), message), "") << path;
  }
  for (const auto* method : old_.methods()) EXPECT_TRUE(called.contains(path_of(*method))) << path_of(*method);
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

TEST_P(OldClient, ReadsTheReasonOfEveryFailure) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> refused{
      {"Ingest/Stream", {"hello { protocol { major: 99 } robot: 'walker' }"}},
      {"Ingest/GetAcknowledgement", {"session_uuid: '0123456789abcdef'"}},
      {"Map/Localise", {"view { left { data: 'no picture' } }"}},
      {"Map/MatchImage", {"view { frame { session: 9 index: 9 } }"}},
      {"Map/FindRoute", {"from { label: 'nowhere' } to { frame { session: 1 index: 4 } }"}},
      {"Map/GetNeighbourhood", {"root { session: 9 index: 9 }"}},
      {"Map/TransformBetween", {"a { session: 1 index: 4 } b { session: 9 index: 9 }"}},
      {"Map/GetFrame", {"frame { session: 9 index: 9 }"}},
      {"Map/ListSessions", {"page_token: 'not one'"}},
      {"Map/ListEdges", {"session: 9"}},
      {"Map/ExplainEdge", {"edge { frame { session: 1 index: 5 } }"}},
      {"Map/SetEdgeState", {"edge { frame { session: 1 index: 5 } } state: EDGE_STATE_REMOVED"}},
      {"Map/ProposeEdge", {"a { session: 1 index: 5 } b { session: 1 index: 5 }"}},
      {"Map/SetLabel", {"frame { session: 1 index: 7 } label: ' '"}},
      {"Map/ImportGraph", {"session_uuid: 'short'"}},
      {"Map/GetClosureMatrix", {"sessions: 9"}},
      {"Map/FindLabels", {"page_token: 'not one'"}},
      {"Map/WatchMap", {"resume_token: 'not one'"}},
      {"Map/GetSkeleton", {"sessions: 9"}},
      {"Map/Export", {"format: EXPORT_FORMAT_TUM sessions: 9"}},
      {"Admin/Repair", {""}},
      {"Admin/Backup", {"folder: 'relative'"}},
      {"Admin/Reindex", {""}},
      {"Admin/ListAudit", {"page_token: 'not one'"}},
      {"Admin/FreezeSession", {"session: 9 frozen: true"}},
      {"Admin/DeleteSession", {"session: 1 uuid: 'of another'"}},
  };
  const auto& type = old_.type("relmap.v1.Error");
  const auto* reason = type.FindFieldByName("reason");
  for (const auto& [name, texts] : refused) {
    const auto* method = old_.method("/relmap.v1." + name);
    if (!method) continue;
    const GenericReplies replies = call(*method, texts);
    EXPECT_FALSE(replies.status.ok()) << name;
    const auto error = old_.make(type);
    ASSERT_TRUE(error->ParseFromString(replies.status.error_details())) << name;
    const int number = error->GetReflection()->GetEnumValue(*error, reason);
    EXPECT_NE(number, 0) << name;
    EXPECT_NE(reason->enum_type()->FindValueByNumber(number), nullptr) << name << ": reason " << number << " is new";
    EXPECT_THAT(replies.status.error_message(), Not(IsEmpty())) << name;
  }
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

INSTANTIATE_TEST_SUITE_P(Releases, OldClient, ::testing::ValuesIn(ReleasedProtocol::versions()));

// ---- Today's client and an old daemon

class OldDaemon : public ::testing::TestWithParam<std::string> {
 protected:
  // Answers every method that the release has with a message in which every field that it has is set.
  std::optional<std::string> answer(const std::string& path, const std::string& request) {
    const auto* method = old_.method(path);
    if (!method) return {};
    called_.insert(path);
    EXPECT_TRUE(old_.make(*method->input_type())->ParseFromString(request)) << path;
    const auto reply = old_.make(*method->output_type());
    fill(*reply, choice_);
    return bytes_of(*reply);
  }

  ReleasedProtocol old_{ReleasedProtocol::files_of(GetParam())};
  std::set<std::string> called_;  // by the server's thread, until it ends
  std::atomic<int> choice_{0};
};

TEST_P(OldDaemon, AnswersEveryCallOfTheClient) {
  const storage::TemporaryFolder folder;
  {
    const GenericServer server(
        folder / "socket", [this](const std::string& path, const std::string& bytes) { return answer(path, bytes); });
    const auto client = client::Client::connect("unix:" + folder / "socket").or_throw();
    const auto expect_ok = [](const char* what, const Status& status) {
      EXPECT_TRUE(status.ok()) << what << ": " << status.to_string();
    };
    const FrameId a{1, 1}, b{1, 2};
    const client::View view{.left = "picture", .right = "", .camera = SessionNumber{1}};
    const auto any = [](const client::Progress&) { return true; };
    const auto status = client->status();
    expect_ok("status", status.status());
    EXPECT_EQ(status->version, "x");
    EXPECT_EQ(status->frames, 1u);
    expect_ok("wait_idle", client->wait_idle());
    const auto found = client->localise(view, a);
    expect_ok("localise", found.status());
    EXPECT_EQ(found->frame, (FrameId{1, 1}));
    expect_ok("match_image", client->match_image(view).status());
    // Every field is set: where a release has alternatives, the answer is one of these.
    const auto route = client->find_route({.from = a, .to = b});
    expect_ok("find_route", route.status());
    EXPECT_EQ(route->alternatives.empty() ? route->steps.size() : route->alternatives.front().steps.size(), 1u);
    expect_ok("transform_between", client->transform_between(a, b).status());
    expect_ok("frame", client->frame(a, true).status());
    expect_ok("robots", client->robots().status());
    const auto sessions = client->sessions();
    expect_ok("sessions", sessions.status());
    ASSERT_EQ(sessions->size(), 1u);
    EXPECT_TRUE(sessions->front().raw);
    const auto edges = client->edges();
    expect_ok("edges", edges.status());
    EXPECT_EQ(edges->size(), 1u);
    if (old_.method("/relmap.v1.Map/ExplainEdge")) {
      const auto explained = client->explain_edge({a, 1}, true);
      expect_ok("explain_edge", explained.status());
      EXPECT_EQ(explained->correspondences.size(), 1u);
      EXPECT_TRUE(explained->picture_a && explained->picture_b && explained->runner_up);
      ASSERT_TRUE(explained->edge.suspicion);
      EXPECT_EQ(explained->edge.suspicion->doubts.size(), 1u);
    }
    if (old_.method("/relmap.v1.Map/GetClosureMatrix")) {
      const auto matrix = client->closure_matrix();
      expect_ok("closure_matrix", matrix.status());
      EXPECT_EQ(matrix->size(), 1u);
    }
    // Made up, its arrays do not have the lengths that belong together, and the client sees that.
    if (old_.method("/relmap.v1.Map/GetSkeleton")) {
      EXPECT_EQ(client->skeleton().reason(), Reason::CORRUPT);
    }
    if (old_.method("/relmap.v1.Admin/ListAudit")) {
      client::AuditFilter one;
      one.limit = 1;
      const auto audit = client->audit(one);
      expect_ok("audit", audit.status());
      EXPECT_EQ(audit->entries.size(), 1u);
    }
    expect_ok("labels", client->labels().status());
    expect_ok("edit_edge", client->edit_edge({a, 1}, client::EdgeAction::kRemove).status());
    expect_ok("propose_edge", client->propose_edge(a, b).status());
    expect_ok("set_label", client->set_label(a, "dock").status());
    client::GraphPiece piece;
    piece.session = SessionUuid::random();
    piece.frames.emplace_back();
    expect_ok("import_graph", client->import_graph(piece).status());
    client::WatchOptions once;
    once.reconnect = false;
    expect_ok("watch", client->watch(once, [](const auto&) { return Status(); }));
    expect_ok("export_trajectories",
              client->export_trajectories(client::ExportFormat::kTum, {}, [](const auto&) { return Status(); }));
    expect_ok("export_frames", client->export_frames({}, true, [](const auto&) { return Status(); }));
    expect_ok("verify", client
                            ->verify(
                                {}, [](const client::Finding&) {}, any)
                            .status());
    const auto backup = client->backup("/backup", any);
    expect_ok("backup", backup.status());
    EXPECT_EQ(backup->folder, "x");
    choice_ = 1;  // of the outcomes of work, that of a compaction
    expect_ok("compact", client->compact(any).status());
    expect_ok("stats", client->stats().status());
    if (old_.method("/relmap.v1.Admin/SetLogLevel"))
      expect_ok("set_log_level", client->set_log_level("debug").status());
    expect_ok("freeze_session", client->freeze_session(1));
    expect_ok("delete_session", client->delete_session(1, "x", any));
    expect_ok("commit", client->commit().status());
  }
  // Those that no client calls: the front-end's own, those of other languages, and those that are always refused.
  const std::set<std::string> elsewhere{"/relmap.v1.Ingest/Stream", "/relmap.v1.Ingest/GetAcknowledgement",
                                        "/relmap.v1.Map/GetNeighbourhood", "/relmap.v1.Admin/Repair",
                                        "/relmap.v1.Admin/Reindex"};
  for (const auto* method : old_.methods())
    EXPECT_TRUE(called_.contains(path_of(*method)) || elsewhere.contains(path_of(*method))) << path_of(*method);
}

// A method that the release did not have is refused by name, and nothing else is lost.
TEST_P(OldDaemon, IsToldFromANewerOneByWhatItDoesNotImplement) {
  const storage::TemporaryFolder folder;
  const GenericServer server(folder / "socket", [](const auto&, const auto&) { return std::nullopt; });
  const auto client = client::Client::connect("unix:" + folder / "socket").or_throw();
  EXPECT_EQ(client->sessions().reason(), Reason::UNIMPLEMENTED);
  EXPECT_EQ(client->find_route({.from = FrameId{1, 1}, .to = FrameId{1, 2}}).reason(), Reason::UNIMPLEMENTED);
}

INSTANTIATE_TEST_SUITE_P(Releases, OldDaemon, ::testing::ValuesIn(ReleasedProtocol::versions()));

}  // namespace
}  // namespace relmap::testing
