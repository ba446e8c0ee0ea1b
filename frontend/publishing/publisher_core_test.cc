#include "frontend/publishing/publisher_core.h"

#include <gtest/gtest.h>

#include "frontend/publishing/map_for_test.h"

namespace relmap::publishing {
namespace {

using std::chrono::milliseconds;
using testing_map::map_of;

constexpr std::uint32_t kPart = 1000;

class PublisherCoreTest : public testing::Test {
 protected:
  PublisherCoreTest() { uuid_.bytes.fill(3); }

  void push(std::uint32_t count, std::uint32_t bytes = 10'000) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto sequence = static_cast<std::uint32_t>(core_.next_sequence());
      core_.push(sequence, 100 + sequence, bytes);
    }
  }
  Acknowledgement ack(std::uint64_t next, std::uint32_t credits = 64, std::uint8_t boot = 1) const {
    Acknowledgement a;
    a.session = uuid_;
    a.boot[0] = boot;
    a.next_sequence = next;
    a.credits = credits;
    return a;
  }
  std::vector<std::uint32_t> sent() {
    std::vector<std::uint32_t> all;
    for (const auto& send : core_.poll(now_, kPart)) all.push_back(send.sequence);
    return all;
  }

  SessionUuid uuid_;
  PublisherCore::Time now_{std::chrono::hours(1)};
  PublisherCore core_{[] {
    SessionUuid u;
    u.bytes.fill(3);
    return u;
  }()};
};

TEST_F(PublisherCoreTest, ProbesWithOneKeyframeUntilTheDaemonAnswers) {
  push(10);
  EXPECT_EQ(sent(), std::vector<std::uint32_t>{0});
  EXPECT_TRUE(sent().empty());
  now_ += milliseconds(300);
  EXPECT_EQ(sent(), std::vector<std::uint32_t>{0});
  core_.acknowledge(ack(1), now_);
  EXPECT_EQ(sent().size(), 9u);
  EXPECT_TRUE(core_.heard());
}

TEST_F(PublisherCoreTest, KeepsToItsCredits) {
  push(10);
  core_.acknowledge(ack(0, 4), now_);
  EXPECT_EQ(sent(), (std::vector<std::uint32_t>{0, 1, 2, 3}));
  core_.acknowledge(ack(4, 2), now_);
  EXPECT_EQ(sent(), (std::vector<std::uint32_t>{4, 5}));
  core_.acknowledge(ack(6, 0), now_);
  EXPECT_TRUE(sent().empty());
}

TEST_F(PublisherCoreTest, SendsTheMissingPartsOnly) {
  push(2);
  core_.acknowledge(ack(0), now_);
  EXPECT_EQ(sent().size(), 2u);
  now_ += milliseconds(100);
  Acknowledgement a = ack(0);
  a.incomplete = {{0, 100, {2, 7}}, {1, 999, {1}}};  // the second: another version, not ours
  core_.acknowledge(a, now_);
  const auto sends = core_.poll(now_, kPart);
  ASSERT_EQ(sends.size(), 1u);
  EXPECT_EQ(sends[0].sequence, 0u);
  EXPECT_EQ(sends[0].parts, (std::vector<std::uint32_t>{2, 7}));
  EXPECT_EQ(core_.counts().parts_resent, 2u);
}

TEST_F(PublisherCoreTest, WhatIsStillOnItsWayIsNotSentAgain) {
  push(1);
  core_.acknowledge(ack(0), now_);
  EXPECT_EQ(sent().size(), 1u);
  now_ += milliseconds(5);
  Acknowledgement a = ack(0);
  a.missing = {{0, 0}};
  core_.acknowledge(a, now_);
  EXPECT_TRUE(sent().empty());
  now_ += milliseconds(100);
  core_.acknowledge(a, now_);
  EXPECT_EQ(sent().size(), 1u);
}

TEST_F(PublisherCoreTest, HeldKeyframesAreLeftAlone) {
  push(3);
  core_.acknowledge(ack(0), now_);
  EXPECT_EQ(sent().size(), 3u);
  Acknowledgement a = ack(0);
  a.held = {{1, 2}};
  core_.acknowledge(a, now_);
  now_ += milliseconds(300);
  EXPECT_EQ(sent(), std::vector<std::uint32_t>{0});
  core_.acknowledge(ack(0), now_);  // the daemon could not keep them
  EXPECT_EQ(sent(), (std::vector<std::uint32_t>{1, 2}));
}

TEST_F(PublisherCoreTest, OutdatedAcknowledgementsAreIgnored) {
  push(10);
  core_.acknowledge(ack(0), now_);
  (void)sent();
  core_.acknowledge(ack(8), now_);
  core_.acknowledge(ack(3), now_);
  EXPECT_EQ(core_.unsettled(), 2u);
  Acknowledgement other = ack(10);
  other.session.bytes.fill(4);
  core_.acknowledge(other, now_);
  EXPECT_EQ(core_.unsettled(), 2u);
}

// A daemon settles from memory what it refuses before it has taken a first keyframe, and forgets it after a silence.
TEST_F(PublisherCoreTest, ADaemonThatHasForgottenWhatItSettledGetsItAgain) {
  push(10);
  core_.acknowledge(ack(0), now_);
  (void)sent();
  core_.acknowledge(ack(8), now_);
  now_ += std::chrono::seconds(60);
  core_.acknowledge(ack(0), now_);
  EXPECT_EQ(core_.unsettled(), 2u) << "it may have been overtaken";
  now_ += milliseconds(1000);
  core_.acknowledge(ack(8), now_);  // it was
  now_ += milliseconds(1500);
  core_.acknowledge(ack(0), now_);
  EXPECT_EQ(core_.unsettled(), 2u);
  for (int i = 0; i < 10; ++i) core_.acknowledge(ack(0), now_ += milliseconds(250));
  EXPECT_EQ(core_.unsettled(), 10u);
  EXPECT_EQ(sent().size(), 10u);
  core_.acknowledge(ack(10), now_);
  EXPECT_EQ(core_.unsettled(), 0u);
  EXPECT_EQ(core_.counts().gaps, 0u);
}

TEST_F(PublisherCoreTest, ARestartedDaemonGetsTheKeyframesItLost) {
  push(20);
  core_.acknowledge(ack(0), now_);
  (void)sent();
  core_.acknowledge(ack(10), now_);
  EXPECT_EQ(core_.counts().settled, 10u);
  core_.acknowledge(ack(7, 64, 2), now_);
  EXPECT_EQ(core_.counts().settled, 7u);
  EXPECT_EQ(core_.counts().restarts_seen, 1u);
  EXPECT_EQ(sent().size(), 13u);
  core_.acknowledge(ack(15, 64, 1), now_);  // a late word of the former daemon
  EXPECT_EQ(core_.counts().settled, 7u);
}

TEST_F(PublisherCoreTest, KeepsTheLastSettledGroup) {
  push(300);
  core_.acknowledge(ack(0), now_);
  for (std::uint64_t next = 0; next < 300; next += 50) {
    (void)sent();
    core_.acknowledge(ack(next), now_);
  }
  (void)sent();
  core_.acknowledge(ack(280), now_);
  EXPECT_EQ(core_.keep_from(), 280u - 64u);
}

TEST_F(PublisherCoreTest, CountsRefusalsOnce) {
  push(3);
  core_.acknowledge(ack(0), now_);
  (void)sent();
  Acknowledgement a = ack(2);
  a.refused = {{1, 101, Reason::NOT_FINITE}, {2, 555, Reason::SEQUENCE_CONFLICT}};
  core_.acknowledge(a, now_);
  core_.acknowledge(a, now_);
  EXPECT_EQ(core_.counts().refused, (std::map<Reason, std::uint64_t>{{Reason::NOT_FINITE, 1}}));
}

TEST_F(PublisherCoreTest, ReportsThatTheDaemonAcceptsNothingOfTheSession) {
  push(1);
  sent();
  Acknowledgement a = ack(1);
  a.refused.push_back({kWholeSession, 0, Reason::SESSION_FROZEN});
  core_.acknowledge(a, now_);
  EXPECT_EQ(core_.closed(), Reason::SESSION_FROZEN);
  EXPECT_TRUE(core_.counts().refused.empty()) << "the keyframes were taken in before";
  core_.acknowledge(ack(1), now_);
  EXPECT_EQ(core_.closed(), Reason::OK) << "it was thawed";
}

TEST_F(PublisherCoreTest, AKnownSequenceThatWasNeverSentIsAConflict) {
  push(1);
  core_.acknowledge(ack(5), now_);
  EXPECT_EQ(core_.counts().refused, (std::map<Reason, std::uint64_t>{{Reason::SEQUENCE_CONFLICT, 1}}));
}

TEST_F(PublisherCoreTest, ARepeatedSourceSendsOnlyWhatTheDaemonLacks) {
  PublisherCore again(uuid_, {.repeated = true});
  for (std::uint32_t s = 0; s < 3; ++s) again.push(s, 100 + s, 10'000);
  EXPECT_EQ(again.poll(now_, kPart).size(), 1u);  // the first one asks
  again.acknowledge(ack(5), now_);
  EXPECT_TRUE(again.all_settled());
  for (std::uint32_t s = 3; s < 7; ++s) again.push(s, 100 + s, 10'000);
  const auto sends = again.poll(now_, kPart);
  ASSERT_EQ(sends.size(), 2u);
  EXPECT_EQ(sends[0].sequence, 5u);
  EXPECT_EQ(again.unsettled(), 2u);
  EXPECT_EQ(again.counts().settled, 5u);
  EXPECT_EQ(again.counts().sent, 3u);
  EXPECT_TRUE(again.counts().refused.empty());
  for (std::uint32_t s = 7; s < 200; ++s) again.push(s, s, 10);
  again.acknowledge(ack(200), now_);
  EXPECT_EQ(again.keep_from(), 200u - 64u);
}

TEST_F(PublisherCoreTest, ARepeatedSourceMustGiveTheSameKeyframes) {
  PublisherCore again(uuid_, {.repeated = true});
  again.push(0, 100, 10'000);
  (void)again.poll(now_, kPart);
  again.acknowledge(ack(5), now_);  // said before it came
  EXPECT_TRUE(again.counts().refused.empty());
  Acknowledgement a = ack(5);
  a.refused = {{0, 100, Reason::SEQUENCE_CONFLICT}};
  for (int i = 0; i < 2; ++i) again.acknowledge(a, now_);
  EXPECT_EQ(again.counts().refused, (std::map<Reason, std::uint64_t>{{Reason::SEQUENCE_CONFLICT, 1}}));
}

TEST_F(PublisherCoreTest, GapsOfARepeatedSourceAreSettledToo) {
  PublisherCore again(uuid_, {.repeated = true});
  again.push(0, 100, 10);
  (void)again.poll(now_, kPart);
  again.acknowledge(ack(8), now_);
  again.push(4, 104, 10);
  EXPECT_TRUE(again.all_settled());
  EXPECT_EQ(again.counts().settled, 5u);
  EXPECT_TRUE(again.poll(now_, kPart).empty());
}

TEST_F(PublisherCoreTest, OverALosslessTransportOnlyWhatWasInFlightAtABreakIsSentAgain) {
  PublisherCore core(uuid_, {.lossless = true});
  for (std::uint32_t s = 0; s < 5; ++s) core.push(s, 100 + s, 10'000);
  EXPECT_EQ(core.poll(now_, kPart).size(), 1u);
  now_ += milliseconds(1500);
  EXPECT_TRUE(core.poll(now_, kPart).empty());
  core.broken();
  EXPECT_EQ(core.poll(now_, kPart).size(), 1u);
  core.acknowledge(ack(1), now_);
  EXPECT_EQ(core.poll(now_, kPart).size(), 4u);
  for (int i = 0; i < 5; ++i) {  // a slow line
    core.acknowledge(ack(1), now_ += milliseconds(900));
    EXPECT_TRUE(core.poll(now_, kPart).empty());
  }
  Acknowledgement a = ack(2);
  a.held = {{3, 3}};
  core.acknowledge(a, now_);
  core.broken();
  const auto sends = core.poll(now_, kPart);
  ASSERT_EQ(sends.size(), 2u);
  EXPECT_EQ(sends[0].sequence, 2u);
  EXPECT_EQ(sends[1].sequence, 4u);
  now_ += milliseconds(11'000);
  core.acknowledge(ack(2), now_);
  EXPECT_EQ(core.poll(now_, kPart).size(), 3u);
}

TEST_F(PublisherCoreTest, SkippedSequencesAreGivenUp) {
  push(1);
  ASSERT_TRUE(core_.skipped(4));
  EXPECT_EQ(core_.skipped(4)->from, 1u);
  core_.push(4, 104, 10);
  core_.acknowledge(ack(0), now_);
  const auto sends = core_.poll(now_, kPart);
  ASSERT_EQ(sends.size(), 3u);
  EXPECT_TRUE(sends[1].gap);
  EXPECT_EQ(sends[1].to, 3u);
  EXPECT_EQ(sends[1].reason, Reason::CAPTURE_FAILED);
}

TEST_F(PublisherCoreTest, DropsTheOldestThatTheDaemonDoesNotHoldAndJoinsTheGaps) {
  push(5);
  core_.acknowledge(ack(0), now_);
  (void)sent();
  Acknowledgement a = ack(0);
  a.held = {{0, 0}};
  core_.acknowledge(a, now_);
  for (int i = 0; i < 2; ++i) core_.give_up(*core_.oldest_to_drop());
  EXPECT_EQ(core_.unsettled(), 3u);
  EXPECT_EQ(core_.unsettled_bytes(), 30'000u);
  EXPECT_EQ(core_.counts().gaps, 2u);
  now_ += milliseconds(10);
  const auto sends = core_.poll(now_, kPart);
  ASSERT_EQ(sends.size(), 1u);
  EXPECT_EQ(sends[0].sequence, 1u);
  EXPECT_EQ(sends[0].to, 2u);
}

TEST_F(PublisherCoreTest, LoadedGapsCoverLoadedKeyframes) {
  for (std::uint32_t s = 10; s < 15; ++s) core_.load_keyframe(s, s, 100);
  core_.load_gap({uuid_, 11, 12, Reason::DROPPED_BY_ROBOT});
  core_.load_gap({uuid_, 15, 17, Reason::CAPTURE_FAILED});
  EXPECT_EQ(core_.unsettled(), 3u);
  EXPECT_EQ(core_.next_sequence(), 18u);
  EXPECT_EQ(core_.counts().gaps, 0u);
  core_.acknowledge(ack(18), now_);
  EXPECT_TRUE(core_.all_settled());
  EXPECT_TRUE(core_.counts().refused.empty());
}

TEST_F(PublisherCoreTest, ASessionIsInTheMapOfTheFirstDaemonThatAcknowledgesIt) {
  push(3);
  core_.introduce({{1}, map_of(9)}, now_);
  EXPECT_FALSE(core_.map().known());  // nothing is there yet
  core_.acknowledge(ack(1), now_);
  EXPECT_EQ(core_.map(), map_of(9));
  EXPECT_EQ(sent(), (std::vector<std::uint32_t>{1, 2}));
}

TEST_F(PublisherCoreTest, ADaemonOfAnotherMapIsSentNothingAndNotBelieved) {
  core_.load_map(map_of(9));
  for (std::uint32_t s = 20; s < 25; ++s) core_.load_keyframe(s, s, 10'000);
  core_.introduce({{1}, map_of(8)}, now_);
  core_.acknowledge(ack(0), now_);  // it may have begun the session all the same
  EXPECT_TRUE(sent().empty());
  for (int second = 0; second < 60; ++second) {
    now_ += milliseconds(1000);
    core_.introduce({{1}, map_of(8)}, now_);
    EXPECT_TRUE(sent().empty());
  }
  EXPECT_EQ(core_.map_status(now_).reason(), Reason::WRONG_MAP);
  EXPECT_TRUE(core_.is_other({1}));
  EXPECT_EQ(core_.unsettled(), 5u);
  EXPECT_EQ(core_.counts().gaps, 0u);
  EXPECT_EQ(core_.map(), map_of(9));

  now_ += milliseconds(3100);  // it has gone, and an old daemon, that speaks only when it is spoken to, may have come
  EXPECT_TRUE(core_.map_status(now_).ok());
  EXPECT_EQ(sent(), std::vector<std::uint32_t>{20});

  core_.introduce({{2}, map_of(9)}, now_);
  EXPECT_TRUE(core_.map_status(now_).ok());
  core_.acknowledge(ack(21, 64, 2), now_);
  EXPECT_EQ(sent(), (std::vector<std::uint32_t>{21, 22, 23, 24}));
}

TEST_F(PublisherCoreTest, TheOneOfTwoDaemonsThatHasTheSessionsMapIsUsed) {
  push(1);
  core_.introduce({{1}, map_of(9)}, now_);
  core_.acknowledge(ack(1), now_);
  for (int second = 0; second < 10; ++second) {
    push(1);
    core_.introduce({{2}, map_of(8)}, now_);
    core_.acknowledge(ack(500, 64, 2), now_);
    EXPECT_TRUE(core_.map_status(now_).ok());
    now_ += milliseconds(500);
    core_.introduce({{1}, map_of(9)}, now_);
    EXPECT_EQ(sent().size(), 1u);
    core_.acknowledge(ack(core_.next_sequence()), now_);
    EXPECT_TRUE(core_.all_settled());
    now_ += milliseconds(500);
  }
}

TEST_F(PublisherCoreTest, ADaemonThatNamesNoMapIsBelievedAfterAWhile) {
  core_.load_map(map_of(9));
  push(5);
  EXPECT_TRUE(sent().empty());  // whoever hears the first keyframe would take it in
  core_.acknowledge(ack(0), now_);
  EXPECT_FALSE(core_.heard());
  now_ += milliseconds(2900);
  EXPECT_TRUE(sent().empty());
  now_ += milliseconds(200);
  EXPECT_EQ(sent(), std::vector<std::uint32_t>{0});
  core_.acknowledge(ack(1), now_);
  EXPECT_EQ(sent().size(), 4u);
  EXPECT_EQ(core_.map(), map_of(9));
}

TEST_F(PublisherCoreTest, OverALosslessTransportNothingIsSentBeforeTheMapIsSaid) {
  PublisherCore core(uuid_, {.lossless = true});
  core.load_map(map_of(9));
  core.push(0, 100, 1000);
  now_ += milliseconds(60'000);
  EXPECT_TRUE(core.poll(now_, kPart).empty());
  core.introduce({{1}, {}}, now_);  // an old daemon
  EXPECT_EQ(core.poll(now_, kPart).size(), 1u);
  core.broken();
  now_ += milliseconds(60'000);
  EXPECT_TRUE(core.poll(now_, kPart).empty());
  core.introduce({{2}, map_of(8)}, now_);
  EXPECT_TRUE(core.poll(now_, kPart).empty());
  EXPECT_EQ(core.map_status(now_).reason(), Reason::WRONG_MAP);
}

TEST_F(PublisherCoreTest, ARestoredMapGetsWhatTheSpoolHasAndANamedGapForTheRest) {
  core_.introduce({{1}, map_of(9)}, now_);
  push(200);
  core_.acknowledge(ack(0), now_);
  for (std::uint64_t next = 10; next <= 200; next += 10) {
    (void)sent();
    core_.acknowledge(ack(next), now_);
  }
  ASSERT_TRUE(core_.all_settled());
  ASSERT_EQ(core_.keep_from(), 136u);
  core_.introduce({{2}, map_of(9, 2)}, now_);
  core_.acknowledge(ack(50, 200, 2), now_);  // the backup had fifty
  EXPECT_EQ(core_.map(), map_of(9, 2));
  EXPECT_EQ(core_.counts().lost_in_restores, 86u);
  EXPECT_EQ(core_.counts().gaps, 86u);
  const auto sends = core_.poll(now_, kPart);
  ASSERT_GT(sends.size(), 10u);
  EXPECT_TRUE(sends[0].gap);
  EXPECT_EQ(sends[0].sequence, 50u);
  EXPECT_EQ(sends[0].to, 135u);
  EXPECT_EQ(sends[0].reason, Reason::MAP_RESTORED);
  EXPECT_EQ(sends[1].sequence, 136u);
}

TEST_F(PublisherCoreTest, ARepeatableSourceIsNotContinuedInARestoredMap) {
  PublisherCore core(uuid_, {.repeated = true, .lossless = true});
  core.introduce({{1}, map_of(9)}, now_);
  for (std::uint32_t s = 0; s < 200; ++s) core.push(s, s, 1000);
  core.acknowledge(ack(200), now_);
  core.broken();
  core.introduce({{2}, map_of(9, 2)}, now_);
  core.acknowledge(ack(50, 200, 2), now_);
  EXPECT_EQ(core.map_status(now_).reason(), Reason::MAP_RESTORED);
  EXPECT_TRUE(core.poll(now_, kPart).empty());
  EXPECT_EQ(core.counts().gaps, 0u);
}

}  // namespace
}  // namespace relmap::publishing
