#include "proto/wire/lcm_messages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <random>
#include <string>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "relmap_lcm/acknowledgement_t.hpp"
#include "relmap_lcm/gap_t.hpp"
#include "relmap_lcm/hello_t.hpp"
#include "relmap_lcm/keyframe_part_t.hpp"
#include "relmap_lcm/map_identity_t.hpp"
#include "relmap_lcm/missing_parts_t.hpp"
#include "relmap_lcm/pose_t.hpp"
#include "relmap_lcm/refusal_t.hpp"
#include "relmap_lcm/sequence_range_t.hpp"
#include "relmap_lcm/session_end_t.hpp"
#include "relmap_lcm/status_t.hpp"
#include "tests/paths.h"

namespace relmap {
namespace {

KeyframePart sample_part() {
  const Bytes payload(2500, 7);
  SessionUuid session;
  session.bytes.fill(5);
  return cut_part(session, 0xfffffffe, payload, crc32c(payload), 1400, 1);
}

Acknowledgement sample_acknowledgement() {
  Acknowledgement ack;
  ack.session.bytes.fill(5);
  ack.boot.fill(6);
  ack.next_sequence = std::uint64_t{1} << 32;
  ack.held = {{5, 6}, {9, 0xffffffff}};
  ack.missing = {{4, 4}};
  ack.incomplete = {{7, 0xdeadbeef, {0, 3}}, {8, 1, {2}}};
  ack.refused = {{2, 3, Reason::NOT_FINITE}};
  ack.credits = 64;
  return ack;
}

PoseNews sample_news() {
  PoseNews news;
  news.boot.fill(6);
  news.session.bytes.fill(5);
  news.kind = PoseNews::Kind::kClosure;
  news.time_us = -7;
  news.keyframe = {4, 0xffffffff};
  news.frame = {3, 120};
  news.T_frame_keyframe = SE3::exp((Vector6() << 1, 2, 3, 0.1, -0.2, 0.3).finished());
  news.T_frame_keyframe.t = Vector3(1, 2, 3);
  news.covariance = KeyframeSampler(1).covariance();
  news.rate_hz = 2.5;
  return news;
}

TEST(LcmMessages, PartsComeBackAsTheyWere) {
  const KeyframePart part = sample_part();
  const auto back = decode_lcm_part(encode_lcm(part));
  ASSERT_TRUE(back.ok()) << back.status().to_string();
  EXPECT_TRUE(check_part(*back).ok());
  EXPECT_EQ(back->sequence, part.sequence);
  EXPECT_EQ(back->data, part.data);
  // Other programs decode it with the published type.
  relmap_lcm::keyframe_part_t generated;
  const Bytes bytes = encode_lcm(part);
  ASSERT_EQ(generated.decode(bytes.data(), 0, static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  EXPECT_EQ(generated.sequence, 0xfffffffe);
  EXPECT_EQ(generated.protocol_major, kProtocolMajor);
}

TEST(LcmMessages, AcknowledgementsComeBackAsTheyWere) {
  const Acknowledgement ack = sample_acknowledgement();
  const auto back = decode_lcm_acknowledgement(encode_lcm(ack));
  ASSERT_TRUE(back.ok()) << back.status().to_string();
  EXPECT_EQ(back->session, ack.session);
  EXPECT_EQ(back->boot, ack.boot);
  EXPECT_EQ(back->next_sequence, ack.next_sequence);
  EXPECT_EQ(back->held, ack.held);
  EXPECT_EQ(back->missing, ack.missing);
  ASSERT_EQ(back->incomplete.size(), 2u);
  EXPECT_EQ(back->incomplete[0].payload_crc, 0xdeadbeef);
  EXPECT_EQ(back->incomplete[0].parts, ack.incomplete[0].parts);
  ASSERT_EQ(back->refused.size(), 1u);
  EXPECT_EQ(back->refused[0].reason, Reason::NOT_FINITE);
  EXPECT_EQ(back->credits, 64u);
}

TEST(LcmMessages, TheLargestAcknowledgementStaysBelowFourThousandBytes) {
  Acknowledgement ack = sample_acknowledgement();
  ack.held.resize(kMaxAckRanges);
  ack.missing.resize(kMaxAckRanges);
  ack.incomplete.assign(kMaxAckIncomplete, {1, 2, std::vector<std::uint32_t>(kMaxAckParts / kMaxAckIncomplete)});
  ack.refused.resize(kMaxAckRefused);
  const Bytes bytes = encode_lcm(ack);
  EXPECT_TRUE(decode_lcm_acknowledgement(bytes).ok());
  EXPECT_LE(bytes.size(), 4000u);
}

TEST(LcmMessages, GapsComeBackAsTheyWere) {
  Gap gap{{}, 3, 0xffffffff, Reason::CAPTURE_FAILED};
  gap.session.bytes.fill(5);
  const auto back = decode_lcm_gap(encode_lcm(gap));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->from, 3u);
  EXPECT_EQ(back->to, 0xffffffffu);
  EXPECT_EQ(back->reason, Reason::CAPTURE_FAILED);
}

TEST(LcmMessages, MapsComeBackAsTheyWere) {
  DaemonIdentity daemon{{1, 2, 3}, {{}, 1'764'000'000'000'000}};
  daemon.map.uuid.bytes.fill(5);
  const Bytes bytes = encode_lcm(daemon);
  const auto back = decode_lcm_map(bytes);
  ASSERT_TRUE(back.ok()) << back.status().to_string();
  EXPECT_EQ(back->boot, daemon.boot);
  EXPECT_EQ(back->map, daemon.map);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode_lcm_map(ByteSpan(bytes.data(), size)).ok()) << size;
}

TEST(LcmMessages, PosesComeBackAsTheyWere) {
  const PoseNews news = sample_news();
  const auto back = decode_lcm_pose(encode_lcm(news));
  ASSERT_TRUE(back.ok()) << back.status().to_string();
  EXPECT_EQ(back->boot, news.boot);
  EXPECT_EQ(back->session, news.session);
  EXPECT_EQ(back->kind, news.kind);
  EXPECT_EQ(back->time_us, news.time_us);
  EXPECT_EQ(back->keyframe, news.keyframe);
  EXPECT_EQ(back->frame, news.frame);
  EXPECT_LT((back->T_frame_keyframe.R - news.T_frame_keyframe.R).norm(), 1e-13);
  EXPECT_EQ(back->T_frame_keyframe.t, news.T_frame_keyframe.t);
  EXPECT_EQ(back->covariance, news.covariance);
  EXPECT_EQ(back->rate_hz, 2.5);
  PoseNews slow_down;  // no frame, so no covariance either
  slow_down.kind = PoseNews::Kind::kSlowDown;
  EXPECT_TRUE(decode_lcm_pose(encode_lcm(slow_down)).ok());
}

TEST(LcmMessages, TheEndOfASessionKeepsItsMeaning) {
  const SessionEnd end{SessionUuid::random(), std::uint64_t{1} << 32};
  const auto back = decode_lcm_end(encode_lcm(end));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->session, end.session);
  EXPECT_EQ(back->next_sequence, end.next_sequence);
  EXPECT_EQ(decode_lcm_end(encode_lcm(SessionEnd{end.session, (std::uint64_t{1} << 32) + 1})).reason(),
            Reason::CORRUPT);
  EXPECT_EQ(decode_lcm_end(encode_lcm(Gap{end.session, 0, 1, Reason::DROPPED_BY_ROBOT})).reason(), Reason::CORRUPT);
  PoseNews ended = sample_news();
  ended.kind = PoseNews::Kind::kEnded;
  EXPECT_EQ(decode_lcm_pose(encode_lcm(ended))->kind, PoseNews::Kind::kEnded);
}

TEST(LcmMessages, ImpossiblePosesAreRefused) {
  PoseNews news = sample_news();
  news.kind = static_cast<PoseNews::Kind>(7);
  EXPECT_EQ(decode_lcm_pose(encode_lcm(news)).reason(), Reason::CORRUPT);
  news = sample_news();
  news.rate_hz = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(decode_lcm_pose(encode_lcm(news)).reason(), Reason::CORRUPT);
  news = sample_news();
  news.covariance(0, 0) = -1;
  EXPECT_EQ(decode_lcm_pose(encode_lcm(news)).reason(), Reason::BAD_COVARIANCE);
  news = sample_news();
  news.T_frame_keyframe.t.x() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(decode_lcm_pose(encode_lcm(news)).ok());
}

TEST(LcmMessages, EveryCutAndEveryFlippedBitIsSurvivedAndCutsAreRefused) {
  const Bytes part = encode_lcm(sample_part()), ack = encode_lcm(sample_acknowledgement());
  const Bytes pose = encode_lcm(sample_news());
  for (std::size_t size = 0; size < pose.size(); ++size)
    EXPECT_FALSE(decode_lcm_pose(ByteSpan(pose).first(size)).ok()) << size;
  for (std::size_t bit = 0; bit < 8 * pose.size(); ++bit) {
    Bytes flipped = pose;
    flipped[bit / 8] ^= static_cast<std::uint8_t>(1 << (bit % 8));
    const auto decoded = decode_lcm_pose(flipped);
    EXPECT_TRUE(!decoded.ok() || (decoded->T_frame_keyframe.t.allFinite() && decoded->covariance.allFinite())) << bit;
  }
  for (std::size_t size = 0; size < part.size(); ++size)
    EXPECT_FALSE(decode_lcm_part(ByteSpan(part).first(size)).ok()) << size;
  for (std::size_t size = 0; size < ack.size(); ++size)
    EXPECT_FALSE(decode_lcm_acknowledgement(ByteSpan(ack).first(size)).ok()) << size;
  for (std::size_t bit = 0; bit < 8 * ack.size(); ++bit) {
    Bytes flipped = ack;
    flipped[bit / 8] ^= static_cast<std::uint8_t>(1 << (bit % 8));
    (void)decode_lcm_acknowledgement(flipped);
    Bytes flipped_part = part;
    flipped_part[bit / 8] ^= static_cast<std::uint8_t>(1 << (bit % 8));
    const auto decoded = decode_lcm_part(flipped_part);
    // Bytes 10 and 11 are the minor version, which only adds.
    if (decoded.ok() && bit / 8 != 10 && bit / 8 != 11) {
      EXPECT_EQ(check_part(*decoded).reason(), Reason::CORRUPT) << bit;
    }
  }
  Bytes longer = part;
  longer.push_back(0);
  EXPECT_EQ(decode_lcm_part(longer).reason(), Reason::CORRUPT);
}

TEST(LcmMessages, AnotherMajorVersionIsRefusedWithItsReason) {
  Bytes part = encode_lcm(sample_part());
  part[9] = kProtocolMajor + 1;
  EXPECT_EQ(decode_lcm_part(part).reason(), Reason::UNKNOWN_PROTOCOL_VERSION);
}

TEST(LcmMessages, StatusAndPoseAreOfThePublishedTypes) {
  DaemonStatus status;
  status.version = "1.2";
  status.keyframes = 7;
  status.reason = Reason::READ_ONLY;
  Bytes bytes = encode_lcm(status);
  relmap_lcm::status_t decoded;
  ASSERT_GT(decoded.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
  EXPECT_EQ(decoded.version, "1.2");
  EXPECT_EQ(decoded.reason, static_cast<int>(Reason::READ_ONLY));

  bytes = encode_lcm(sample_news());
  relmap_lcm::pose_t pose;
  ASSERT_GT(pose.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
  EXPECT_EQ(pose.frame_index, 120);
  EXPECT_EQ(pose.translation[2], 3);
}

// Robots in the field use these types. Adding, renaming or moving a field changes a type's hash, and receivers with the
// old hash drop the messages. New fields therefore go into a new type on a new channel.
TEST(LcmMessages, TypesNeverChange) {
  struct Type {
    std::int64_t now;
    std::uint64_t published;
  };
  const std::map<std::string, Type> types{
      {"acknowledgement_t", {relmap_lcm::acknowledgement_t::getHash(), 0xdf7109cd21f7794b}},
      {"gap_t", {relmap_lcm::gap_t::getHash(), 0x79c545a17bfa3a57}},
      {"hello_t", {relmap_lcm::hello_t::getHash(), 0x6ae6ac896d758cb9}},
      {"keyframe_part_t", {relmap_lcm::keyframe_part_t::getHash(), 0xa8530df339b83381}},
      {"map_identity_t", {relmap_lcm::map_identity_t::getHash(), 0xa177169b81556559}},
      {"missing_parts_t", {relmap_lcm::missing_parts_t::getHash(), 0xdf14aa697be59a38}},
      {"pose_t", {relmap_lcm::pose_t::getHash(), 0x8cbd97d95ad8c7f8}},
      {"refusal_t", {relmap_lcm::refusal_t::getHash(), 0x4fb184ddf4c961b7}},
      {"sequence_range_t", {relmap_lcm::sequence_range_t::getHash(), 0x1781ce19f8a84c58}},
      {"session_end_t", {relmap_lcm::session_end_t::getHash(), 0x80e8a76c2ac15d16}},
      {"status_t", {relmap_lcm::status_t::getHash(), 0xd539e3ad85dcb8c1}}};
  for (const auto& [name, type] : types) EXPECT_EQ(static_cast<std::uint64_t>(type.now), type.published) << name;
  for (const auto& file : std::filesystem::directory_iterator(RELMAP_SOURCE_DIR "/proto/lcm"))
    if (file.path().extension() == ".lcm") {
      EXPECT_TRUE(types.contains(file.path().stem())) << file.path().stem() << " is published, and may change unseen";
    }
}

}  // namespace
}  // namespace relmap
