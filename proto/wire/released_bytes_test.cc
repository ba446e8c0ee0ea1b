// Keyframes and LCM messages as releases wrote them (tests/fixtures/wire-VERSION) are read as what they were.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <string>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe.h"
#include "proto/wire/lcm_messages.h"
#include "tests/paths.h"

namespace relmap {
namespace {

SessionUuid released_uuid() { return *SessionUuid::parse("00112233-4455-6677-8899-aabbccddeeff"); }

Keyframe released_keyframe(bool extended) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  Keyframe k;
  k.session.uuid = released_uuid();
  k.session.robot = "cart-1";
  k.session.name = "morning";
  k.session.camera = {400, 256, 192, 0.12, 512, 384};
  k.session.oneway = true;
  k.sequence = 5;
  k.time_us = 1'764'000'000'000'000;
  k.T_odom_frame.t = Vector3(1, 2, 3);
  k.source = MotionSource::kVision;
  k.step_covariance = Matrix6::Identity();
  k.tracks.push_back({{4, 2}, 100.5f, 50.25f, 90.75f, 1});
  k.tracks.push_back({{5, 0}, 10.5f, 20.25f, kNone, 0});
  AppearanceFeature feature{10, 20, kNone, 8, 0.5f, 0, {}};
  for (std::size_t i = 0; i < feature.descriptor.size(); ++i) feature.descriptor[i] = static_cast<std::uint8_t>(i);
  k.appearance.push_back(feature);
  k.picture = {0xff, 0xd8, 0xff, 0xd9};
  if (extended) k.unknown = {{1000, {1, 2, 3}}};
  return k;
}

// What the files of each release hold, by name. Once it is in a release a sample does not change any more.
struct Sample {
  Bytes bytes;                               // as this build writes it
  std::function<Bytes(ByteSpan)> rewritten;  // what was read, written by this build; empty if it cannot be read
};

template <typename Value>
Sample sample_of(const Value& value, Result<Value> (*decode)(ByteSpan)) {
  return {encode_lcm(value), [decode](ByteSpan bytes) {
            const auto read = decode(bytes);
            return read.ok() ? encode_lcm(*read) : Bytes();
          }};
}

Sample sample_of(const Keyframe& keyframe) {
  return {encode_keyframe(keyframe), [](ByteSpan bytes) {
            const auto read = decode_keyframe(bytes);
            return read.ok() ? encode_keyframe(*read) : Bytes();
          }};
}

std::map<std::string, Sample> samples() {
  const SessionUuid session = released_uuid();
  BootId boot;
  boot.fill(6);
  const Bytes payload(2500, 7);
  Acknowledgement ack;
  ack.session = session;
  ack.boot = boot;
  ack.next_sequence = std::uint64_t{1} << 32;
  ack.held = {{5, 6}, {9, 0xffffffff}};
  ack.missing = {{4, 4}};
  ack.incomplete = {{7, 0xdeadbeef, {0, 3}}, {8, 1, {2}}};
  ack.refused = {{2, 3, Reason::NOT_FINITE}};
  ack.credits = 64;
  PoseNews news;
  news.boot = boot;
  news.session = session;
  news.kind = PoseNews::Kind::kClosure;
  news.time_us = 1'764'000'000'000'000;
  news.keyframe = {4, 17};
  news.frame = {3, 120};
  news.T_frame_keyframe.t = Vector3(1, 2, 3);
  news.covariance = Matrix6::Identity();
  news.rate_hz = 2.5;
  DaemonIdentity daemon{boot, {session, 1'764'000'000'000'000}};
  return {{"keyframe-1", sample_of(released_keyframe(false))},
          {"keyframe-2", sample_of(released_keyframe(true))},
          {"keyframe_part_t", sample_of(cut_part(session, 5, payload, crc32c(payload), 1328, 1), decode_lcm_part)},
          {"gap_t", sample_of(Gap{session, 3, 9, Reason::CAPTURE_FAILED}, decode_lcm_gap)},
          {"session_end_t", sample_of(SessionEnd{session, 18}, decode_lcm_end)},
          {"acknowledgement_t", sample_of(ack, decode_lcm_acknowledgement)},
          {"pose_t", sample_of(news, decode_lcm_pose)},
          {"map_identity_t", sample_of(daemon, decode_lcm_map)},
          {"hello_t", sample_of(Hello{session}, decode_lcm_hello)}};
}

TEST(ReleasedBytes, AreReadAsWhatTheyWere) {
  namespace fs = std::filesystem;
  std::size_t read = 0;
  const auto all = samples();
  for (const auto& release : fs::directory_iterator(RELMAP_SOURCE_DIR "/tests/fixtures")) {
    if (!release.path().filename().string().starts_with("wire-")) continue;
    for (const auto& file : fs::directory_iterator(release)) {
      std::ifstream in(file.path(), std::ios::binary);
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      const auto found = all.find(file.path().filename().string());
      ASSERT_NE(found, all.end()) << file.path();
      const Bytes rewritten = found->second.rewritten(as_bytes(text));
      EXPECT_EQ(rewritten, found->second.bytes) << file.path();
      ++read;
    }
  }
  EXPECT_GE(read, all.size()) << "a sample is in no release";
}

}  // namespace
}  // namespace relmap
