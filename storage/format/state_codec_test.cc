#include "storage/format/state_codec.h"

#include <gtest/gtest.h>

#include "storage/format/sealed.h"
#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

template <typename Decode>
void expect_refused_when_damaged(Bytes bytes, Decode decode) {
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(decode(ByteSpan(bytes).first(size)).ok());
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    EXPECT_FALSE(decode(bytes).ok()) << bit;
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
  }
}

TEST(StateCodec, GivesBackSessions) {
  RandomFrames random(1);
  for (int i = 0; i < 100; ++i) {
    const Session session = random.session(3);
    const Bytes bytes = encode_session(session);
    const auto decoded = decode_session(bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.status().to_string();
    EXPECT_EQ(encode_session(*decoded), bytes);
    EXPECT_EQ(decoded->number, 3u);
    EXPECT_EQ(decoded->header.uuid, session.header.uuid);
    EXPECT_EQ(decoded->display_name, session.display_name);
    EXPECT_EQ(decoded->next_sequence, session.next_sequence);
    EXPECT_EQ(decoded->refused, session.refused);
    EXPECT_EQ(decoded->given_up, session.given_up);
    EXPECT_EQ(decoded->state, session.state);
    EXPECT_EQ(decoded->before_frozen, session.before_frozen);
    EXPECT_EQ(decoded->deleted_by, session.deleted_by);
    EXPECT_EQ(decoded->header.unknown, session.header.unknown);
    EXPECT_EQ(decoded->unknown, session.unknown);
  }
  expect_refused_when_damaged(encode_session(random.session(1)), decode_session);
}

TEST(StateCodec, GivesBackSkippedSequencesAndPendingFrames) {
  RandomFrames random(2);
  for (int i = 0; i < 100; ++i) {
    const Skipped skipped = random.skipped();
    EXPECT_EQ(decode_skipped(encode_skipped(skipped)).or_throw(), skipped);
  }
  expect_refused_when_damaged(encode_skipped(random.skipped()), decode_skipped);
  EXPECT_EQ(decode_pending(encode_pending(0x8000000000000001)).or_throw(), 0x8000000000000001);
  expect_refused_when_damaged(encode_pending(5), decode_pending);
}

TEST(StateCodec, GivesBackTheMapState) {
  MapState state;
  state.applied_sequence = 12;
  state.lookups = {{5, 6}};
  for (std::size_t i = 0; i < state.refused.size(); ++i) state.refused[i] = i * i;
  state.keyframes = 1;
  state.gaps = 2;
  state.closures_accepted = 3;
  state.closures_candidate = 4;
  state.closures_quarantined = 8;
  state.closures_removed = 5;
  state.numerical_failures = 6;
  state.vocabulary_crc = 7;
  state.unknown = {{1000, {1, 2, 3}}};
  state.identity = {Uuid::random(), 1'764'000'000'000'000};
  state.digests_commit = 9;
  state.digests_made = {10, {3, 4}, 200};
  const auto decoded = decode_state(encode_state(state));
  ASSERT_TRUE(decoded.ok()) << decoded.status().to_string();
  EXPECT_EQ(decoded->applied_sequence, 12u);
  EXPECT_EQ(decoded->pending, state.pending);
  EXPECT_EQ(decoded->lookups, state.lookups);
  EXPECT_EQ(decoded->idle_records, 0u);
  EXPECT_EQ(decoded->unknown, state.unknown);
  EXPECT_EQ(decoded->identity, state.identity);
  EXPECT_EQ(decoded->digests_commit, 9u);
  EXPECT_EQ(decoded->digests_made, state.digests_made);
  state.idle_records = 7;
  EXPECT_EQ(decode_state(encode_state(state))->idle_records, 7u);
  EXPECT_EQ(decoded->refused, state.refused);
  EXPECT_EQ(decoded->keyframes, 1u);
  EXPECT_EQ(decoded->gaps, 2u);
  EXPECT_EQ(decoded->closures_accepted, 3u);
  EXPECT_EQ(decoded->closures_candidate, 4u);
  EXPECT_EQ(decoded->closures_quarantined, 8u);
  EXPECT_EQ(decoded->closures_removed, 5u);
  EXPECT_EQ(decoded->numerical_failures, 6u);
  EXPECT_EQ(decoded->vocabulary_crc, 7u);
  expect_refused_when_damaged(encode_state(state), decode_state);
}

// Records of map format 2 have no extensions, and what follows the facts only where it says something.
TEST(StateCodec, ReadsWhatFormat2Wrote) {
  const auto without_end = [](const Bytes& sealed, std::size_t end) {
    constexpr std::size_t kHead = 8, kCrc = 4;
    return Bytes(sealed.begin() + kHead, sealed.end() - static_cast<std::ptrdiff_t>(kCrc + end));
  };
  Session session = RandomFrames(3).session(3);
  session.state = SessionState::kFrozen;
  session.before_frozen = SessionState::kOpen;
  session.unknown = session.header.unknown = {};
  const Bytes now = encode_session(session);
  EXPECT_EQ(encode_session(decode_session(seal(1, 3, without_end(now, 4))).or_throw()), now);
  session.state = SessionState::kOpen;
  EXPECT_EQ(encode_session(decode_session(seal(1, 2, without_end(now, 5))).or_throw()), encode_session(session));

  MapState state;
  state.keyframes = 9;
  state.idle_records = 5;
  const Bytes all = encode_state(state);
  EXPECT_EQ(encode_state(decode_state(seal(2, 3, without_end(all, 2))).or_throw()), all);
  state.idle_records = 0;
  EXPECT_EQ(encode_state(decode_state(seal(2, 2, without_end(all, 6))).or_throw()), encode_state(state));
}

}  // namespace
}  // namespace relmap::storage
