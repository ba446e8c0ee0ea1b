#include "frontend/publishing/grpc/grpc_transport.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "frontend/publishing/grpc/testing/fake_ingest.h"
#include "frontend/publishing/publisher.h"
#include "proto/keyframe/keyframe_samples.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::publishing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

SessionHeader header() {
  SessionHeader session = KeyframeSampler(1).keyframe().session;
  session.uuid.bytes.fill(7);
  return session;
}

Keyframe keyframe(std::uint32_t sequence) {
  Keyframe k = KeyframeSampler(sequence + 1).keyframe();
  k.session = header();
  k.sequence = sequence;
  k.time_us = 1'700'000'000'000'000 + sequence * 100'000LL;
  for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, sequence);
  const AppearanceFeature f = k.appearance[0];
  k.appearance.assign(400, f);  // more than fits a part over LCM
  return k;
}

grpc::Status daemon_error(grpc::StatusCode code, Reason reason, const std::string& message) {
  v1::Error error;
  error.set_reason(to_wire(reason));
  error.set_message(message);
  return {code, message, error.SerializeAsString()};
}

template <typename Condition>
bool eventually(Condition condition, milliseconds limit = seconds(60)) {
  for (const auto end = steady_clock::now() + limit; steady_clock::now() < end;
       std::this_thread::sleep_for(milliseconds(5)))
    if (condition()) return true;
  return false;
}

class GrpcTransportTest : public testing::Test {
 protected:
  GrpcTransportTest() {
    options_.in_memory = true;
    daemon_.start(1);
  }

  std::unique_ptr<GrpcTransport> transport(const std::string& server, GrpcTransportOptions options = {}) {
    auto opened = GrpcTransport::open(server, "cart", options);
    EXPECT_TRUE(opened.ok()) << opened.status().to_string();
    return std::move(*opened);
  }
  std::unique_ptr<Publisher> publisher(const std::string& server, GrpcTransportOptions options = {}) {
    auto started = Publisher::start(options_, header(), transport(server, options));
    EXPECT_TRUE(started.ok()) << started.status().to_string();
    return std::move(*started);
  }
  std::unique_ptr<Publisher> publisher() { return publisher(daemon_.address()); }
  static void push(Publisher& publisher, std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t s = first; s <= last; ++s) ASSERT_TRUE(publisher.push(keyframe(s)).ok());
  }
  static PublishSummary finish(Publisher& publisher) { return publisher.finish(steady_clock::now() + seconds(60)); }
  void write_endpoint(const std::string& boot) const {
    std::ofstream(folder_ / "endpoint") << "address " << daemon_.address() << "\npid 1\nboot " << boot << "\n";
  }
  std::string folder() const { return folder_ / ""; }

  storage::TemporaryFolder folder_;
  FakeIngest daemon_;
  PublisherOptions options_;
};

TEST_F(GrpcTransportTest, SettlesAllWithinItsCredits) {
  daemon_.manners.credits = 3;
  const auto started = publisher();
  push(*started, 0, 40);
  const PublishSummary summary = finish(*started);
  EXPECT_TRUE(summary.all_settled());
  EXPECT_EQ(summary.settled, 41u);
  EXPECT_EQ(summary.sent, 41u);
  EXPECT_EQ(summary.resent + summary.parts_resent, 0u);
  EXPECT_TRUE(started->trouble().ok()) << started->trouble().to_string();
  const auto held = daemon_.lock();
  EXPECT_EQ(daemon_.settled.size(), 41u);
  EXPECT_EQ(daemon_.beyond_credits, 0u);
  EXPECT_EQ(daemon_.bad_payloads, 0u);
  EXPECT_EQ(daemon_.robots, std::vector<std::string>{"cart"});
}

TEST_F(GrpcTransportTest, BrokenStreamsAreOpenedAgain) {
  daemon_.manners.breaks = 3;
  const auto started = publisher();
  push(*started, 0, 40);
  EXPECT_TRUE(finish(*started).all_settled());
  const auto held = daemon_.lock();
  EXPECT_EQ(daemon_.robots.size(), 4u);
  EXPECT_EQ(daemon_.settled.size(), 41u);
  EXPECT_EQ(daemon_.bad_payloads, 0u);
}

TEST_F(GrpcTransportTest, ADaemonRestartedElsewhereIsFoundAndGetsWhatItLost) {
  write_endpoint(daemon_.boot_text());
  const auto started = publisher(folder());
  push(*started, 0, 19);
  ASSERT_TRUE(eventually([&] { return started->progress().settled == 20; }));
  daemon_.stop();
  EXPECT_TRUE(eventually([&] { return started->trouble().reason() == Reason::UNREACHABLE; }));
  for (std::uint32_t s = 15; s < 20; ++s) daemon_.settled.erase(s);
  daemon_.start(2);
  write_endpoint(daemon_.boot_text());
  push(*started, 20, 24);
  const PublishSummary summary = finish(*started);
  EXPECT_TRUE(summary.all_settled());
  EXPECT_EQ(summary.restarts_seen, 1u);
  EXPECT_EQ(summary.settled, 25u);
  const auto held = daemon_.lock();
  EXPECT_EQ(daemon_.settled.size(), 25u);
}

TEST_F(GrpcTransportTest, AnotherDaemonInItsPlaceGetsNothing) {
  write_endpoint("b007");
  const auto started = publisher(folder());
  push(*started, 0, 0);
  EXPECT_TRUE(eventually([&] { return started->trouble().message().find("is gone") != std::string::npos; }));
  EXPECT_EQ(started->trouble().reason(), Reason::UNREACHABLE);
  {
    const auto held = daemon_.lock();
    EXPECT_TRUE(daemon_.order.empty());
  }
  write_endpoint(daemon_.boot_text());
  EXPECT_TRUE(finish(*started).all_settled());
}

TEST_F(GrpcTransportTest, RefusedKeyframesAreCounted) {
  daemon_.manners.refused = {3};
  const auto started = publisher();
  push(*started, 0, 9);
  const PublishSummary summary = finish(*started);
  EXPECT_TRUE(summary.all_settled());
  EXPECT_EQ(summary.refused, (std::map<Reason, std::uint64_t>{{Reason::NOT_FINITE, 1}}));
}

TEST_F(GrpcTransportTest, SaysWhyAStreamWasRefusedAndTriesAgain) {
  daemon_.manners.refusal = daemon_error(grpc::StatusCode::UNAVAILABLE, Reason::READ_ONLY, "the disk is full");
  const auto started = publisher();
  push(*started, 0, 4);
  EXPECT_TRUE(eventually([&] { return started->trouble().reason() == Reason::READ_ONLY; }));
  EXPECT_NE(started->trouble().message().find("the disk is full"), std::string::npos);
  {
    const auto held = daemon_.lock();
    daemon_.manners.refusal = {};
  }
  EXPECT_TRUE(finish(*started).all_settled());
  EXPECT_TRUE(started->trouble().ok());
}

TEST_F(GrpcTransportTest, AnotherProtocolIsNamed) {
  daemon_.manners.protocol = 2;
  const auto started = publisher();
  push(*started, 0, 0);
  EXPECT_TRUE(eventually([&] { return started->trouble().reason() == Reason::UNKNOWN_PROTOCOL_VERSION; }));
  const auto held = daemon_.lock();
  EXPECT_TRUE(daemon_.order.empty());
}

TEST_F(GrpcTransportTest, MalformedMessagesAreIgnored) {
  std::vector<v1::IngestReply>& said = daemon_.manners.between;
  said.reserve(8);
  said.emplace_back();
  v1::Acknowledgement& far = *said.emplace_back().mutable_acknowledgement();
  far.set_session_uuid(uuid_to_wire(header().uuid));
  far.set_boot_id(std::string(16, '\x01'));
  far.set_next_sequence(std::uint64_t{1} << 40);
  v1::Acknowledgement& ranges = *said.emplace_back().mutable_acknowledgement();
  ranges = far;
  ranges.set_next_sequence(0);
  ranges.add_held()->set_first(4);  // last: 0
  said.emplace_back().mutable_acknowledgement()->set_session_uuid("short");
  said.emplace_back().mutable_localisation()->set_session_uuid(uuid_to_wire(header().uuid));
  said.emplace_back().mutable_pace()->set_rate_hz(-1);
  said.emplace_back().mutable_ended();
  said.emplace_back().mutable_welcome();
  std::atomic<int> news = 0;
  const auto started = publisher();
  started->hear([&](const PoseNews&) { ++news; });
  push(*started, 0, 9);
  EXPECT_TRUE(finish(*started).all_settled());
  EXPECT_EQ(news, 0);
  const auto held = daemon_.lock();
  EXPECT_EQ(daemon_.settled.size(), 10u);
  EXPECT_EQ(daemon_.robots.size(), 1u);
}

TEST_F(GrpcTransportTest, AStreamWithoutAnswersIsClosed) {
  daemon_.manners.silent = true;
  GrpcTransportOptions hasty;
  hasty.silence = milliseconds(200);
  const auto started = publisher(daemon_.address(), hasty);
  push(*started, 0, 9);
  EXPECT_TRUE(eventually([&] { return started->trouble().reason() == Reason::UNREACHABLE; }));
  EXPECT_NE(started->trouble().message().find("does not answer"), std::string::npos);
  EXPECT_FALSE(started->progress().heard);
  {
    const auto held = daemon_.lock();
    daemon_.manners.silent = false;
  }
  EXPECT_TRUE(finish(*started).all_settled());
}

TEST_F(GrpcTransportTest, AnAbsentDaemonIsReportedAndDoesNotDelayTheEnd) {
  const std::string address = daemon_.address();
  daemon_.stop();
  const auto started = publisher(address);
  push(*started, 0, 3);
  EXPECT_TRUE(eventually([&] { return started->trouble().reason() == Reason::UNREACHABLE; }));
  EXPECT_NE(started->trouble().message().find(address), std::string::npos) << started->trouble().to_string();
  EXPECT_EQ(GrpcTransport::open("neither", "cart").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(started->progress().unsettled, 4u);
}

TEST_F(GrpcTransportTest, TheQueueIsBoundedAndHoldsNoDuplicates) {
  auto held = daemon_.lock();  // it says no welcome
  GrpcTransportOptions narrow;
  narrow.waiting_bytes = 10'000;
  const auto opened = transport(daemon_.address(), narrow);
  const Bytes payload(4'000);
  for (std::uint32_t s = 0; s < 100; ++s)
    opened->send(cut_part(header().uuid, s / 25, payload, 1, kMaxKeyframeBytes, 0));
  held.unlock();
  EXPECT_TRUE(eventually([&] {
    const auto again = daemon_.lock();
    return daemon_.order.size() == 2;
  }));
  opened->send(cut_part(header().uuid, 3, payload, 1, kMaxKeyframeBytes, 0));
  EXPECT_TRUE(eventually([&] {
    const auto again = daemon_.lock();
    return daemon_.order == std::vector<std::uint32_t>{0, 1, 3};
  }));
}

TEST_F(GrpcTransportTest, NewsAreTheSameAsOverLcm) {
  const std::string uuid = uuid_to_wire(header().uuid);
  std::vector<v1::IngestReply>& said = daemon_.manners.between;
  for (int i = 0; i < 3; ++i) {
    v1::Localisation& place = *said.emplace_back().mutable_localisation();
    place.set_session_uuid(uuid);
    place.set_session(4);
    place.set_sequence(11);
    *place.mutable_frame() = to_wire(FrameId{2, 30});
    *place.mutable_frame_from_keyframe() = to_wire(SE3{Matrix3::Identity(), {1, 2, 3}});
    *place.mutable_covariance() = to_wire(Matrix6(Matrix6::Identity()));
    place.set_candidate(i == 0);
    place.set_withdrawn(i == 2);
  }
  for (const double rate : {2.5, 0.0}) {
    v1::Pace& pace = *said.emplace_back().mutable_pace();
    pace.set_session_uuid(uuid);
    pace.set_rate_hz(rate);
  }
  std::mutex mutex;
  std::vector<PoseNews> heard;
  const auto started = publisher();
  started->hear([&](const PoseNews& news) {
    const std::lock_guard lock(mutex);
    heard.push_back(news);
  });
  push(*started, 0, 0);
  EXPECT_TRUE(finish(*started).all_settled());
  started->hear({});
  ASSERT_GE(heard.size(), 5u);
  using Kind = PoseNews::Kind;
  const Kind kinds[] = {Kind::kLocalised, Kind::kClosure, Kind::kClosureOut, Kind::kSlowDown, Kind::kResume};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(heard[i].kind, kinds[i]);
  EXPECT_EQ(heard[1].keyframe, (FrameId{4, 11}));
  EXPECT_EQ(heard[1].frame, (FrameId{2, 30}));
  EXPECT_EQ(heard[1].T_frame_keyframe.t, Vector3(1, 2, 3));
  EXPECT_EQ(heard[1].boot[0], 1);
  EXPECT_EQ(heard[3].rate_hz, 2.5);
}

TEST_F(GrpcTransportTest, TheEndOfASessionIsSentUntilItIsConfirmed) {
  daemon_.manners.deaf_to_ends = 2;
  const auto started = publisher();
  push(*started, 0, 9);
  EXPECT_TRUE(finish(*started).all_settled());
  const auto begin = steady_clock::now();
  EXPECT_TRUE(started->end_session(begin + seconds(60)));
  EXPECT_GE(steady_clock::now() - begin, milliseconds(400));
  {
    const auto held = daemon_.lock();
    EXPECT_EQ(daemon_.ends, std::vector<std::uint64_t>(3, 10));
  }
  daemon_.manners.deaf_to_ends = 1000;
  const auto again = publisher();
  push(*again, 0, 9);
  EXPECT_TRUE(finish(*again).all_settled());
  EXPECT_FALSE(again->end_session(steady_clock::now() + milliseconds(300)));
}

TEST_F(GrpcTransportTest, ARepeatedRunSendsOnlyWhatTheDaemonLacks) {
  {
    const auto first = publisher();
    push(*first, 0, 99);
    EXPECT_TRUE(finish(*first).all_settled());
  }
  const std::map<std::uint32_t, std::uint32_t> known = daemon_.settled;
  daemon_.order.clear();
  const auto second = publisher();
  push(*second, 0, 0);
  ASSERT_TRUE(eventually([&] { return second->progress().settled == 1; }));
  push(*second, 1, 119);
  const PublishSummary summary = finish(*second);
  EXPECT_TRUE(summary.all_settled());
  EXPECT_EQ(summary.settled, 120u);
  EXPECT_TRUE(summary.refused.empty());
  const auto held = daemon_.lock();
  EXPECT_EQ(daemon_.settled.size(), 120u);
  for (const auto& [sequence, crc] : known) EXPECT_EQ(daemon_.settled.at(sequence), crc);
  for (const std::uint32_t sequence : daemon_.order) EXPECT_TRUE(sequence == 0 || sequence >= 100) << sequence;
}

TEST_F(GrpcTransportTest, ARepeatedRunWithOtherKeyframesIsStopped) {
  for (std::uint32_t s = 0; s < 10; ++s) daemon_.settled[s] = 1;  // CRCs of another recording
  const auto started = publisher();
  push(*started, 0, 0);
  ASSERT_TRUE(eventually([&] { return started->progress().settled == 1; }));
  EXPECT_EQ(started->push(keyframe(1)).reason(), Reason::SEQUENCE_CONFLICT);
}

TEST_F(GrpcTransportTest, ADaemonOfAnotherMapGetsNothing) {
  options_.in_memory = false;  // a live robot's
  options_.live = true;
  options_.spool = folder_ / "spool";
  daemon_.manners.map = {Uuid::random(), 1};
  write_endpoint(daemon_.boot_text());
  auto started = publisher(folder());
  push(*started, 0, 9);
  ASSERT_TRUE(eventually([&] { return started->progress().settled == 10; }));
  daemon_.stop();
  const auto ours = daemon_.settled;
  const MapIdentity map = daemon_.manners.map;

  push(*started, 10, 14);
  daemon_.settled.clear();
  daemon_.order.clear();
  daemon_.manners.map.uuid = Uuid::random();
  daemon_.start(2);
  write_endpoint(daemon_.boot_text());
  ASSERT_TRUE(eventually([&] { return started->trouble().reason() == Reason::WRONG_MAP; }));
  push(*started, 15, 19);
  EXPECT_EQ(started->finish(steady_clock::now() + milliseconds(500)).unsettled, 10u);
  EXPECT_FALSE(started->end_session(steady_clock::now() + milliseconds(500)));
  started.reset();
  started = publisher(folder());  // nor by the next process
  EXPECT_EQ(started->await_map(steady_clock::now() + seconds(60)).reason(), Reason::WRONG_MAP);
  EXPECT_EQ(started->finish(steady_clock::now() + milliseconds(500)).unsettled, 20u);  // as far as it has heard
  {
    const auto held = daemon_.lock();
    EXPECT_TRUE(daemon_.order.empty());
    EXPECT_TRUE(daemon_.ends.empty());
  }
  daemon_.stop();
  daemon_.settled = ours;
  daemon_.manners.map = map;
  daemon_.start(3);
  write_endpoint(daemon_.boot_text());
  EXPECT_TRUE(eventually([&] { return started->trouble().ok(); }));
  EXPECT_TRUE(finish(*started).all_settled());
  const auto held = daemon_.lock();
  EXPECT_EQ(daemon_.settled.size(), 20u);
}

TEST_F(GrpcTransportTest, ARecordingMustBeginAnewInAnotherMap) {
  options_.in_memory = false;
  options_.recording = "drive";
  options_.spool = folder_ / "spool";
  daemon_.manners.map = {Uuid::random(), 1};
  {
    const auto first = publisher();
    push(*first, 0, 9);
    EXPECT_TRUE(finish(*first).all_settled());
  }
  daemon_.stop();
  daemon_.settled.clear();
  daemon_.manners.map.epoch = 2;  // restored
  daemon_.start(2);
  {
    const auto second = publisher();
    EXPECT_EQ(second->await_map(steady_clock::now() + seconds(60)).reason(), Reason::MAP_RESTORED);
    EXPECT_EQ(second->push(keyframe(10)).reason(), Reason::MAP_RESTORED);
    EXPECT_EQ(second->finish(steady_clock::now() + seconds(60)).session.reason(), Reason::MAP_RESTORED);
  }
  options_.begin_anew = true;
  const auto third = publisher();
  EXPECT_TRUE(third->await_map(steady_clock::now() + seconds(60)).ok());
  EXPECT_EQ(third->next_sequence(), 0u);
  EXPECT_EQ(third->session().uuid, header().uuid);
  push(*third, 0, 12);
  EXPECT_TRUE(finish(*third).all_settled());
  const auto held = daemon_.lock();
  EXPECT_EQ(daemon_.settled.size(), 13u);
}

}  // namespace
}  // namespace relmap::publishing
