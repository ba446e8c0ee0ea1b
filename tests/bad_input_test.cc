// Bad input of every kind is refused by name and counted; nothing else is lost, and relmapd keeps running.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <thread>

#include "proto/base/crc32c.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "proto/wire/lcm_messages.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/hand_robot.h"
#include "tests/support/map_stub.h"
#include "tests/support/running_daemon.h"
#include "tests/support/small_world.h"

namespace relmap::testing {
namespace {

using ::testing::HasSubstr;

sim::PointsWorldOptions world_options() { return small_world(60, 1000, 60); }

class BadInput : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.data = folder_ / "map";
    options_.lcm = random_lcm_url();
    start();
  }
  // Whatever was done to it.
  void TearDown() override {
    ASSERT_TRUE(daemon_->process().running()) << daemon_->log();
    EXPECT_TRUE(status().storage.ok());
    EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
  }

  void start() {
    daemon_ = std::make_unique<RunningDaemon>(options_);
    client_ = daemon_->client();
  }

  client::DaemonStatus status() const { return client_->status().or_throw(); }
  std::uint64_t not_taken(Reason reason) const {
    const client::ReasonCounts counts = status().not_taken;
    return counts.contains(reason) ? counts.at(reason) : 0;
  }
  // Sends `what` until it is counted under this reason.
  void expect_counted(Reason reason, const std::function<void()>& what) {
    const std::uint64_t before = not_taken(reason);
    EXPECT_TRUE(repeat_until(what, [&] { return not_taken(reason) > before; })) << reason_name(reason);
  }
  void expect_frames(std::uint64_t frames) {
    EXPECT_TRUE(client_->wait_idle().ok());
    EXPECT_EQ(status().frames, frames);
  }

  Keyframe keyframe(std::uint32_t i) const { return world_.keyframe(i); }
  Bytes payload(std::uint32_t i) const { return encode_keyframe(keyframe(i)); }
  SessionUuid uuid() const { return world_.options().uuid; }

  const storage::TemporaryFolder folder_;
  const sim::PointsWorld world_{world_options()};
  DaemonOptions options_;
  std::unique_ptr<RunningDaemon> daemon_;
  std::unique_ptr<client::Client> client_;
};

struct BadKeyframe {
  Reason reason;
  std::function<Bytes(Keyframe)> make;  // out of a good one
};

std::function<Bytes(Keyframe)> with(const std::function<void(Keyframe&)>& change) {
  return [change](Keyframe k) {
    change(k);
    return encode_keyframe(k);
  };
}

std::vector<BadKeyframe> bad_keyframes() {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  return {
      {Reason::NOT_FINITE, with([](Keyframe& k) { k.tracks[0].u_left = kNan; })},
      {Reason::NOT_FINITE, with([](Keyframe& k) { k.T_odom_frame.t.x() = kNan; })},
      {Reason::NOT_FINITE, with([](Keyframe& k) { k.appearance[0].scale = kNan; })},
      {Reason::NOT_FINITE, with([](Keyframe& k) { k.step_covariance(2, 2) = kNan; })},
      {Reason::BAD_ROTATION, with([](Keyframe& k) { k.T_odom_frame.R *= 2; })},
      {Reason::BAD_COVARIANCE, with([](Keyframe& k) { k.step_covariance *= -1; })},
      {Reason::BAD_MOTION, with([](Keyframe& k) { k.T_odom_frame.t.x() = 1e8; })},
      {Reason::IMPLAUSIBLE_CALIBRATION, with([](Keyframe& k) { k.session.camera.f = 0.5; })},
      {Reason::IMPLAUSIBLE_CALIBRATION, with([](Keyframe& k) { k.session.camera.baseline = -0.12; })},
      {Reason::CALIBRATION_CHANGED, with([](Keyframe& k) { k.session.camera.f += 1; })},
      {Reason::BAD_NAME, with([](Keyframe& k) { k.session.robot = "\xff"; })},
      {Reason::OUTSIDE_PICTURE, with([](Keyframe& k) { k.tracks[0].v = 5000; })},
      {Reason::BAD_TRACK, with([](Keyframe& k) { k.tracks[0].track.sequence = k.sequence + 1; })},
      {Reason::BAD_DURATION, with([](Keyframe& k) { k.driven_us = -1; })},
      {Reason::TIME_BACKWARDS, with([](Keyframe& k) { k.time_us -= 60'000'000; })},
      {Reason::BAD_SIZE,
       [](Keyframe k) {  // says that it has 65,535 tracks
         k.tracks.clear();
         k.appearance.clear();
         k.picture.clear();
         Bytes bytes = encode_keyframe(k);
         std::fill_n(bytes.end() - 6, 2, std::uint8_t{0xff});
         return bytes;
       }},
      {Reason::TRUNCATED,
       [](const Keyframe& k) {
         Bytes bytes = encode_keyframe(k);
         bytes.resize(bytes.size() / 2);
         return bytes;
       }},
      {Reason::CORRUPT, [](const Keyframe&) { return Bytes(700, 7); }},
      {Reason::UNKNOWN_PROTOCOL_VERSION,
       [](const Keyframe& k) {
         Bytes bytes = encode_keyframe(k);
         bytes[4] += 8;
         return bytes;
       }},
  };
}

TEST_F(BadInput, KeyframesAreRefusedByNameAndTheOthersTaken) {
  HandRobot robot(options_.lcm, uuid());
  client::ReasonCounts expected;
  std::uint32_t sequence = 0;
  std::uint64_t good = 0;
  for (const BadKeyframe& bad : bad_keyframes()) {
    ASSERT_TRUE(robot.settle(sequence, payload(sequence)));
    ++sequence;
    ++good;
    ASSERT_TRUE(robot.settle(sequence, bad.make(keyframe(sequence)))) << reason_name(bad.reason);
    EXPECT_EQ(robot.refusal(sequence), bad.reason)
        << reason_name(robot.refusal(sequence)) << " for " << reason_name(bad.reason);
    ++expected[bad.reason];
    ++sequence;
  }
  expect_frames(good);
  EXPECT_EQ(status().refused_by_reason, expected);
  EXPECT_EQ(status().refused, sequence - good);
  EXPECT_EQ(client_->sessions().or_throw().front().refused, sequence - good);

  EXPECT_EQ(daemon_->stop(), 0);
  start();
  EXPECT_EQ(status().refused_by_reason, expected) << "a restart forgets no refusal";
  EXPECT_EQ(status().frames, good);
}

TEST_F(BadInput, RefusalsBeforeASessionBeginsAreCountedOnce) {
  HandRobot robot(options_.lcm, uuid());
  for (std::uint32_t i = 0; i < 3; ++i) {
    Keyframe k = keyframe(i);
    k.session.camera.cx = -1e6;
    ASSERT_TRUE(robot.settle(i, encode_keyframe(k)));
    EXPECT_EQ(robot.refusal(i), Reason::IMPLAUSIBLE_CALIBRATION);
  }
  EXPECT_EQ(not_taken(Reason::IMPLAUSIBLE_CALIBRATION), 3u);
  ASSERT_TRUE(robot.settle(3, payload(3))) << "with another calibration it begins";
  expect_frames(1);
  EXPECT_EQ(status().refused_by_reason, (client::ReasonCounts{{Reason::IMPLAUSIBLE_CALIBRATION, 3}}));
  EXPECT_EQ(not_taken(Reason::IMPLAUSIBLE_CALIBRATION), 0u) << "counted once";
}

TEST_F(BadInput, DamagedPartsAreCountedAndAskedForAgain) {
  HandRobot robot(options_.lcm, uuid());
  ASSERT_TRUE(robot.settle(0, payload(0)));
  const Bytes next = payload(1);
  const KeyframePart good = robot.part(1, next, 1);

  KeyframePart flipped = good;
  flipped.data[100] ^= 1;
  expect_counted(Reason::CORRUPT, [&] { robot.say(flipped); });
  KeyframePart header = good;
  header.offset += 1;
  expect_counted(Reason::CORRUPT, [&] { robot.say(header); });
  KeyframePart cut = robot.part(1, next, good.parts - 1);
  cut.data.resize(cut.data.size() / 2);
  cut.part_crc = part_checksum(cut);
  expect_counted(Reason::TRUNCATED, [&] { robot.say(cut); });
  KeyframePart huge = good;
  huge.total_bytes = 1 << 30;
  huge.part_crc = part_checksum(huge);
  expect_counted(Reason::BAD_SIZE, [&] { robot.say(huge); });
  Bytes message = encode_lcm(good);
  message.resize(message.size() / 2);
  expect_counted(Reason::CORRUPT, [&] { robot.say_bytes(kKeyframeChannel, message); });
  expect_counted(Reason::CORRUPT, [&] { robot.say_bytes(kGapChannel, Bytes(10, 1)); });

  // Valid parts of a payload that does not match its checksum.
  Bytes other = next;
  other[200] ^= 1;
  expect_counted(Reason::CORRUPT, [&] {
    for (std::uint32_t i = 0; i < good.parts; ++i) {
      KeyframePart part = robot.part(1, other, i);
      part.payload_crc = crc32c(next);
      part.part_crc = part_checksum(part);
      robot.say(part);
    }
  });

  ASSERT_TRUE(robot.settle(1, next));
  expect_frames(2);
  EXPECT_EQ(status().refused, 0u);
  EXPECT_GT(status().ingest_parts_corrupt, 0u);
}

TEST_F(BadInput, RepeatsChangeNothingAndConflictsAreRefused) {
  HandRobot robot(options_.lcm, uuid());
  for (std::uint32_t i = 0; i < 3; ++i) ASSERT_TRUE(robot.settle(i, payload(i)));
  EXPECT_TRUE(repeat_until([&] { robot.say_payload(1, payload(1)); }, [&] { return status().ingest_repeats > 0; }));

  Keyframe other = keyframe(1);
  other.tracks[0].v += 1;
  const Bytes conflict = encode_keyframe(other);
  expect_counted(Reason::SEQUENCE_CONFLICT, [&] { robot.say_payload(1, conflict); });
  EXPECT_TRUE(robot.until([&] { robot.say_payload(1, conflict); },
                          [&](const Acknowledgement& ack) {
                            return std::any_of(ack.refused.begin(), ack.refused.end(), [&](const Refused& r) {
                              return r.sequence == 1 && r.payload_crc == crc32c(conflict) &&
                                     r.reason == Reason::SEQUENCE_CONFLICT;
                            });
                          }));

  expect_frames(3);
  MapStub map(daemon_->address());
  v1::GetFrameRequest request;
  *request.mutable_frame() = to_wire(FrameId{1, 1});
  EXPECT_EQ(map.ask(&v1::Map::Stub::GetFrame, request).or_throw().frame().payload_crc32c(), crc32c(payload(1)));
}

TEST_F(BadInput, MissingSequencesAndPartsAreAskedForAndWaitedFor) {
  HandRobot robot(options_.lcm, uuid());
  ASSERT_TRUE(robot.settle(0, payload(0)));
  EXPECT_TRUE(robot.until([&] { robot.say_payload(2, payload(2)); },
                          [](const Acknowledgement& ack) {
                            return ack.missing == std::vector<SequenceRange>{{1, 1}} &&
                                   ack.held == std::vector<SequenceRange>{{2, 2}} && ack.next_sequence == 1;
                          }));
  expect_frames(1);
  const auto counts = [&] { return MapStub(daemon_->address()).status().or_throw().ingest(); };
  EXPECT_EQ(counts().robots(), 1u);
  EXPECT_EQ(counts().incomplete(), 0u) << "sequence 2 is whole";
  EXPECT_TRUE(robot.until([&] { robot.say_payload(1, payload(1), 2); },
                          [](const Acknowledgement& ack) {
                            return ack.incomplete.size() == 1 && ack.incomplete[0].sequence == 1 &&
                                   ack.incomplete[0].parts == std::vector<std::uint32_t>{2};
                          }));
  EXPECT_EQ(counts().incomplete(), 1u);
  EXPECT_TRUE(robot.until([&] { robot.say(robot.part(1, payload(1), 2)); },
                          [](const Acknowledgement& ack) { return ack.next_sequence == 3; }));
  expect_counted(Reason::SEQUENCE_TOO_FAR, [&] { robot.say(robot.part(5000, payload(3), 0)); });
  expect_frames(3);
  EXPECT_EQ(status().gaps, 0u);
}

TEST_F(BadInput, DeclaredGapsAreBridgedByPriors) {
  HandRobot robot(options_.lcm, uuid());
  for (std::uint32_t i = 0; i < 2; ++i) ASSERT_TRUE(robot.settle(i, payload(i)));
  expect_counted(Reason::INVALID_ARGUMENT, [&] { robot.say(Gap{uuid(), 9, 3, Reason::DROPPED_BY_ROBOT}); });
  expect_counted(Reason::BAD_SIZE, [&] { robot.say(Gap{uuid(), 2, 4'000'000'000, Reason::DROPPED_BY_ROBOT}); });
  EXPECT_TRUE(robot.until(
      [&] {
        robot.say(Gap{uuid(), 2, 4, Reason::DROPPED_BY_ROBOT});
      },
      [](const Acknowledgement& ack) { return ack.next_sequence == 5; }));
  expect_counted(Reason::SEQUENCE_SETTLED, [&] { robot.say_payload(3, payload(3)); });
  ASSERT_TRUE(robot.settle(5, payload(5)));
  expect_frames(3);
  EXPECT_EQ(status().gaps, 3u);
  EXPECT_EQ(client_->sessions().or_throw().front().given_up, 3u);
  const client::Frame frame = client_->frame({1, 5}).or_throw();
  ASSERT_EQ(frame.edges.size(), 1u);
  EXPECT_EQ(frame.edges[0].kind, client::EdgeKind::kPrior);
  EXPECT_EQ(frame.edges[0].reason, Reason::DECLARED_GAP);
  EXPECT_EQ(frame.edges[0].a, (FrameId{1, 1}));
  EXPECT_TRUE(client_->find_route({.from = FrameId{1, 0}, .to = FrameId{1, 5}}).ok());
}

void put_big_endian(Bytes& bytes, std::uint32_t value, int count) {
  for (int shift = 8 * (count - 1); shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}
// The header of a picture of this size, without any data.
Bytes png_header(std::uint32_t width, std::uint32_t height) {
  Bytes bytes{0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 13, 'I', 'H', 'D', 'R'};
  put_big_endian(bytes, width, 4);
  put_big_endian(bytes, height, 4);
  bytes.insert(bytes.end(), {8, 0, 0, 0, 0});
  put_big_endian(bytes, 0, 4);
  return bytes;
}
Bytes jpeg_header(std::uint32_t width, std::uint32_t height) {
  Bytes bytes{0xff, 0xd8, 0xff, 0xc0, 0, 11, 8};
  put_big_endian(bytes, height, 2);
  put_big_endian(bytes, width, 2);
  bytes.insert(bytes.end(), {1, 1, 0x11, 0});
  return bytes;
}

TEST_F(BadInput, InvalidAndOversizedPicturesAreRefusedBeforeDecoding) {
  HandRobot robot(options_.lcm, uuid());
  for (std::uint32_t i = 0; i < 2; ++i) ASSERT_TRUE(robot.settle(i, payload(i)));
  expect_frames(2);
  const struct {
    Reason reason;
    Bytes picture;
  } kCases[] = {
      {Reason::NOT_A_PICTURE, Bytes(5000, 'x')},
      {Reason::NOT_A_PICTURE, Bytes{}},
      {Reason::PICTURE_TOO_LARGE, png_header(32768, 32768)},
      {Reason::PICTURE_TOO_LARGE, jpeg_header(33000, 33000)},
      {Reason::PICTURE_DAMAGED, png_header(512, 384)},
      {Reason::PICTURE_DAMAGED, jpeg_header(512, 384)},
      {Reason::PICTURE_TOO_LARGE, Bytes(20'000'000, 1)},
  };
  MapStub map(daemon_->address());
  std::map<Reason, std::uint64_t> expected;
  for (const auto& item : kCases) {
    v1::LocaliseRequest request;
    request.mutable_view()->mutable_left()->set_data(item.picture.data(), item.picture.size());
    request.mutable_view()->set_session(1);
    const Reason reason = map.ask(&v1::Map::Stub::Localise, request).reason();
    EXPECT_EQ(reason, item.reason) << reason_name(reason) << " for " << reason_name(item.reason);
    v1::MatchImageRequest match;
    *match.mutable_view() = request.view();
    EXPECT_EQ(map.ask(&v1::Map::Stub::MatchImage, match).reason(), item.reason);
    ++expected[item.reason];
  }
  std::map<Reason, std::uint64_t> counted;
  const v1::GetStatusReply reply = map.status().or_throw();
  for (const v1::MethodCount& method : reply.methods())
    if (method.method() == "Map.Localise")
      for (const auto& failure : method.failures_by_reason())
        counted[reason_from_wire(failure.reason())] = failure.count();
  EXPECT_EQ(counted, expected);
  EXPECT_LT(daemon_->process().peak_resident_bytes(), std::size_t{400} << 20);
}

TEST_F(BadInput, QuestionsWithoutAnAnswerSayWhy) {
  HandRobot robot(options_.lcm, uuid());
  sim::PointsWorldOptions elsewhere_options = world_options();
  elsewhere_options.world_seed = 99;
  elsewhere_options.uuid.bytes[15] = 2;
  const sim::PointsWorld elsewhere(elsewhere_options);
  HandRobot other(options_.lcm, elsewhere_options.uuid);
  for (std::uint32_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(robot.settle(i, payload(i)));
    ASSERT_TRUE(other.settle(i, encode_keyframe(elsewhere.keyframe(i))));
  }
  expect_frames(6);
  const FrameId here{1, 0}, there{2, 2}, nowhere{1, 77}, no_session{9, 0};
  EXPECT_EQ(client_->find_route({.from = here, .to = there}).reason(), Reason::NOT_CONNECTED);
  EXPECT_EQ(client_->transform_between(here, there).reason(), Reason::NOT_CONNECTED);
  EXPECT_EQ(client_->find_route({.from = here, .to = nowhere}).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(client_->transform_between(no_session, here).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(client_->frame(nowhere).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(client_->set_label(nowhere, "kitchen").reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(client_->find_route({.from = here, .to = std::string("kitchen")}).reason(), Reason::NO_SUCH_LABEL);
  EXPECT_EQ(client_->edit_edge({nowhere, 1}, client::EdgeAction::kRemove).reason(), Reason::NO_SUCH_EDGE);
  EXPECT_EQ(client_->edit_edge({{1, 1}, 0}, client::EdgeAction::kRemove).reason(), Reason::ODOMETRY_EDGE);
  EXPECT_EQ(client_->set_label(here, "").reason(), Reason::BAD_NAME);
  EXPECT_EQ(client_->set_label(here, " ").reason(), Reason::BAD_NAME);

  std::uint64_t failures = 0;
  const v1::GetStatusReply reply = MapStub(daemon_->address()).status().or_throw();
  for (const v1::MethodCount& method : reply.methods()) failures += method.failures();
  EXPECT_EQ(failures, 11u) << "each is counted";
}

TEST_F(BadInput, ASecondDaemonOnTheFolderOrThePortFailsByName) {
  const Finished folder = run_program(daemon_arguments(options_));
  EXPECT_EQ(folder.exit_code, 3);
  EXPECT_THAT(folder.standard_error, HasSubstr("FOLDER_LOCKED"));
  EXPECT_THAT(folder.standard_error, HasSubstr("owned by process " + std::to_string(daemon_->process().pid())));
  DaemonOptions same_port{.data = folder_ / "other", .lcm = "", .more = {"--listen", daemon_->address()}};
  std::vector<std::string> arguments = daemon_arguments(same_port);
  arguments.erase(arguments.begin() + 3, arguments.begin() + 5);  // its own --listen
  const Finished port = run_program(arguments);
  EXPECT_EQ(port.exit_code, 4);
  EXPECT_THAT(port.standard_error, HasSubstr("PORT_IN_USE"));
  EXPECT_TRUE(daemon_->client()->status().ok());
}

// Neither is accepted by --check-config and then fails, nor is it partly carried out.
TEST(BadStart, InvalidLcmUrlsAndForeignFoldersAreRefusedByName) {
  const storage::TemporaryFolder folder;
  namespace fs = std::filesystem;
  const auto start = [&](const DaemonOptions& options, bool check) {
    std::vector<std::string> arguments = daemon_arguments(options);
    if (check) arguments.push_back("--check-config");
    return run_program(arguments);
  };
  for (const bool check : {false, true}) {
    const Finished lcm = start({.data = folder / "map", .lcm = "foo", .more = {}}, check);
    EXPECT_EQ(lcm.exit_code, 2) << lcm.standard_error;
    EXPECT_THAT(lcm.standard_error, HasSubstr("BAD_CONFIG: lcm: 'foo' is no LCM URL"));
    EXPECT_EQ(lcm.standard_output, "");
    EXPECT_FALSE(fs::exists(folder / "map"));
  }
  fs::create_directory(folder / "pictures");
  std::ofstream(folder / "pictures/a.jpg") << "a picture";
  for (const bool check : {false, true}) {
    const Finished data = start({.data = folder / "pictures", .lcm = "", .more = {}}, check);
    EXPECT_EQ(data.exit_code, 5) << data.standard_error;
    EXPECT_THAT(data.standard_error, HasSubstr("NOT_A_MAP: "));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "pictures"), fs::directory_iterator()), 1);
  }
  EXPECT_EQ(start({.data = folder / "map", .lcm = random_lcm_url(), .more = {}}, true).exit_code, 0);
}

TEST(NoMulticastRoute, IsReportedWithARemedyWhileQueriesAreAnswered) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make a network without a multicast route";
  const storage::TemporaryFolder folder;
  RunningDaemon daemon({.data = folder / "map", .lcm = random_lcm_url(), .more = {}, .own_network = Multicast::kNone});
  EXPECT_THAT(daemon.log(), HasSubstr("NO_MULTICAST_ROUTE"));
  EXPECT_THAT(daemon.log(), HasSubstr("ip route add 224.0.0.0/4 dev lo"));
  const Finished asked = run_program({"nsenter", "--net=/proc/" + std::to_string(daemon.process().pid()) + "/ns/net",
                                      built_program("relmap"), "--server", folder / "map", "--json", "status"});
  EXPECT_EQ(asked.exit_code, 0) << asked.standard_error;
  EXPECT_THAT(asked.standard_output, HasSubstr("NO_MULTICAST_ROUTE"));
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
}

}  // namespace
}  // namespace relmap::testing
