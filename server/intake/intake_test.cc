// Keyframes that are wrong in every way, and sinks that are slow, broken or behind.
#include "server/intake/intake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "proto/base/clock.h"
#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "server/intake/testing/fake_sink.h"

namespace relmap::intake {
namespace {

using std::chrono::milliseconds;

class IntakeTest : public testing::Test {
 protected:
  IntakeTest() { restart(); }

  void restart(IntakeOptions options = {}) {
    ++boot_[0];
    intake_ = std::make_unique<Intake>(sink_, budget_, boot_, std::move(options), [] {});
  }

  Keyframe keyframe(std::uint32_t sequence) const {
    Keyframe k = KeyframeSampler(4).keyframe();
    k.session.uuid = uuid_;
    k.sequence = sequence;
    k.time_us = 1'700'000'000'000'000 + sequence * 100'000LL;
    for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, sequence);
    return k;
  }
  void send_bytes(std::uint32_t sequence, const Bytes& payload) {
    const std::uint32_t crc = crc32c(payload);
    for (std::uint32_t i = 0; i < count_parts(payload.size(), 600); ++i)
      intake_->take_part(cut_part(uuid_, sequence, payload, crc, 600, i), now_);
  }
  void send(const Keyframe& k) { send_bytes(k.sequence, encode_keyframe(k)); }
  void send(std::uint32_t sequence) { send(keyframe(sequence)); }

  // Everything durable, and the acknowledgement after it.
  Acknowledgement settle() {
    sink_.sync();
    return acknowledge();
  }
  Acknowledgement acknowledge() {
    now_ += milliseconds(300);
    (void)intake_->poll(now_);
    return *intake_->acknowledgement(uuid_);
  }
  std::uint64_t refused(Reason reason) const { return intake_->stats(now_).keyframes_refused[index_of(reason)]; }
  std::uint64_t part_refused(Reason reason) const { return intake_->stats(now_).parts_refused[index_of(reason)]; }
  template <typename Record>
  std::vector<Record> journalled() const {
    std::vector<Record> all;
    for (const storage::JournalRecord& r : sink_.journal())
      if (const auto* record = std::get_if<Record>(&r)) all.push_back(*record);
    return all;
  }

  SessionUuid uuid_ = *SessionUuid::parse("11111111-2222-3333-4444-555555555555");
  BootId boot_{};
  SteadyTime now_{std::chrono::hours(1)};
  FakeSink sink_;
  storage::Budget budget_{std::size_t{64} << 20};
  std::unique_ptr<Intake> intake_;
};

TEST_F(IntakeTest, AcknowledgesOnlyWhatIsDurable) {
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  Acknowledgement ack = acknowledge();
  EXPECT_EQ(ack.next_sequence, 0u);
  EXPECT_EQ(ack.held, (std::vector<SequenceRange>{{0, 2}}));
  sink_.sync(2);
  ack = acknowledge();
  EXPECT_EQ(ack.next_sequence, 2u);
  EXPECT_EQ(ack.held, (std::vector<SequenceRange>{{2, 2}}));
  EXPECT_EQ(ack.boot, boot_);
  EXPECT_EQ(settle().next_sequence, 3u);
}

TEST_F(IntakeTest, KeyframesAreJournalledInOrderWhateverTheOrderOfArrival) {
  for (const std::uint32_t s : {3, 1, 2}) send(s);
  Acknowledgement ack = acknowledge();
  EXPECT_EQ(sink_.queued(), 0u);
  EXPECT_EQ(ack.missing, (std::vector<SequenceRange>{{0, 0}}));
  EXPECT_EQ(ack.held, (std::vector<SequenceRange>{{1, 3}}));
  send(0);
  EXPECT_EQ(settle().next_sequence, 4u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, IncompleteKeyframesAreAskedForByPart) {
  const Bytes payload = encode_keyframe(keyframe(0));
  intake_->take_part(cut_part(uuid_, 0, payload, crc32c(payload), 600, 1), now_);
  const Acknowledgement ack = acknowledge();
  ASSERT_EQ(ack.incomplete.size(), 1u);
  EXPECT_EQ(ack.incomplete[0].parts.front(), 0u);
  EXPECT_EQ(ack.incomplete[0].parts.size(), count_parts(payload.size(), 600) - 1);
  EXPECT_TRUE(ack.missing.empty());
}

// A robot's front-end may be upgraded or downgraded in the middle of a session. Unknown extensions of its header are no
// other calibration, and the session keeps those of its first keyframe.
TEST_F(IntakeTest, UnknownExtensionsOfAHeaderDoNotInterruptASession) {
  const Extensions unknown[] = {{}, {{1000, {1, 2}}}, {{1000, {3}}, {2000, {}}}, {}};
  for (const std::uint32_t begun : {0U, 1U}) {
    if (begun > 0) uuid_.bytes[0] ^= 0x40;
    for (std::uint32_t s = 0; s < 4; ++s) {
      Keyframe k = keyframe(s);
      k.session.unknown = unknown[(s + begun) % 4];
      k.session.raw = (s + begun) % 2 == 1 ? std::optional(sample_raw_calibration()) : std::nullopt;
      k.unknown = unknown[s];
      send(k);
    }
    EXPECT_EQ(settle().next_sequence, 4U);
    EXPECT_TRUE(acknowledge().refused.empty());
  }
  const auto sessions = sink_.view()->sessions();
  ASSERT_EQ(sessions.size(), 2U);
  EXPECT_EQ(sessions[0].header.unknown, unknown[0]);
  EXPECT_EQ(sessions[1].header.unknown, unknown[1]);
  EXPECT_EQ(sessions[0].header.raw, std::nullopt);
  EXPECT_EQ(sessions[1].header.raw, sample_raw_calibration());
  const auto keyframes = journalled<storage::KeyframeRecord>();
  ASSERT_EQ(keyframes.size(), 8U);
  for (std::size_t i = 0; i < keyframes.size(); ++i)
    EXPECT_EQ(decode_keyframe(keyframes[i].payload)->unknown, unknown[i % 4]);
}

TEST_F(IntakeTest, TheRawCalibrationOfASessionMayNotChange) {
  Keyframe k = keyframe(0);
  k.session.raw = sample_raw_calibration(1);
  send(k);
  k = keyframe(1);
  k.session.raw = sample_raw_calibration(2);
  send(k);
  const Acknowledgement ack = settle();
  ASSERT_EQ(ack.refused.size(), 1u);
  EXPECT_EQ(ack.refused[0].sequence, 1u);
  EXPECT_EQ(ack.refused[0].reason, Reason::CALIBRATION_CHANGED);
}

TEST_F(IntakeTest, BadKeyframesAreRefusedOnceAndOthersGoOn) {
  send(0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::pair<Reason, std::function<void(Keyframe&)>>> cases = {
      {Reason::NOT_FINITE, [&](Keyframe& k) { k.T_odom_frame.t.z() = nan; }},
      {Reason::BAD_SIZE, [](Keyframe& k) { k.appearance[0].scale = 0; }},
      {Reason::TIME_BACKWARDS, [](Keyframe& k) { k.time_us = 1'700'000'000'000'000; }},
      {Reason::IMPLAUSIBLE_CALIBRATION, [](Keyframe& k) { k.session.camera.f = 1; }},
      {Reason::CALIBRATION_CHANGED, [](Keyframe& k) { k.session.camera.f += 1; }},
      {Reason::BAD_NAME, [](Keyframe& k) { k.session.robot = "another"; }},
      {Reason::BAD_TRACK, [](Keyframe& k) { k.tracks[0].track.sequence = 100; }},
      {Reason::OUTSIDE_PICTURE, [](Keyframe& k) { k.tracks[0].u_left = 5000; }},
      {Reason::BAD_DURATION, [](Keyframe& k) { k.driven_us = -1; }},
  };
  std::uint32_t sequence = 1;
  for (auto& [reason, spoil] : cases) {
    Keyframe k = keyframe(sequence++);
    spoil(k);
    send(k);
  }
  send(sequence);
  const Acknowledgement ack = settle();
  EXPECT_EQ(ack.next_sequence, sequence + 1);
  ASSERT_EQ(ack.refused.size(), cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) {
    EXPECT_EQ(ack.refused[i].reason, cases[i].first) << reason_name(ack.refused[i].reason);
    EXPECT_EQ(ack.refused[i].sequence, i + 1);
    EXPECT_EQ(refused(cases[i].first), 1u);
  }
  EXPECT_EQ(journalled<storage::RefusalRecord>().size(), cases.size());
  EXPECT_EQ(journalled<storage::KeyframeRecord>().size(), 2u);
}

TEST_F(IntakeTest, BytesThatAreNoKeyframeAreRefusedForGood) {
  send(0);
  send_bytes(1, Bytes(2000, 0xee));
  Bytes cut = encode_keyframe(keyframe(2));
  cut.resize(cut.size() / 2);
  send_bytes(2, cut);
  send_bytes(3, encode_keyframe(keyframe(9)));  // the envelope says 3
  const Acknowledgement ack = settle();
  EXPECT_EQ(ack.next_sequence, 4u);
  ASSERT_EQ(ack.refused.size(), 3u);
  EXPECT_EQ(ack.refused[1].reason, Reason::TRUNCATED);
  EXPECT_EQ(ack.refused[2].reason, Reason::CORRUPT);
}

TEST_F(IntakeTest, RefusalsAreJournalledBeforeTheyAreAcknowledged) {
  send(0);
  EXPECT_EQ(settle().next_sequence, 1u);
  Keyframe bad = keyframe(1);
  bad.driven_us = -1;
  send(bad);
  EXPECT_TRUE(acknowledge().refused.empty());
  EXPECT_EQ(settle().refused.size(), 1u);
}

TEST_F(IntakeTest, DamagedPartsAreCountedAndChangeNothing) {
  const Bytes payload = encode_keyframe(keyframe(0));
  KeyframePart part = cut_part(uuid_, 0, payload, crc32c(payload), 600, 0);
  part.data[5] ^= 1;
  intake_->take_part(part, now_);
  part = cut_part(uuid_, 0, payload, crc32c(payload), 600, 1);
  part.data.pop_back();
  part.part_crc = part_checksum(part);
  intake_->take_part(part, now_);
  EXPECT_EQ(part_refused(Reason::CORRUPT), 1u);
  EXPECT_EQ(part_refused(Reason::BAD_SIZE), 1u);
  EXPECT_EQ(intake_->stats(now_).sessions, 0u);
  send(0);
  EXPECT_EQ(settle().next_sequence, 1u);
}

TEST_F(IntakeTest, RepeatsChangeNothingAndAreAcknowledgedAtOnce) {
  send(0);
  settle();
  now_ += milliseconds(10);
  send(0);
  const auto acks = intake_->poll(now_);
  ASSERT_EQ(acks.size(), 1u);
  EXPECT_EQ(acks[0].next_sequence, 1u);
  EXPECT_EQ(journalled<storage::KeyframeRecord>().size(), 1u);
  EXPECT_GT(intake_->stats(now_).repeated_parts, 0u);
}

TEST_F(IntakeTest, ConflictsAreRefusedAndSettleNothing) {
  for (std::uint32_t s = 0; s < 2; ++s) send(s);
  settle();
  Keyframe other = keyframe(1);
  other.standing_us += 1;
  for (int i = 0; i < 3; ++i) send(other);
  Acknowledgement ack = settle();
  EXPECT_EQ(ack.next_sequence, 2u);
  ASSERT_EQ(ack.refused.size(), 1u);
  EXPECT_EQ(ack.refused[0].reason, Reason::SEQUENCE_CONFLICT);
  EXPECT_EQ(ack.refused[0].payload_crc, crc32c(encode_keyframe(other)));
  EXPECT_EQ(refused(Reason::SEQUENCE_CONFLICT), 1u);
  EXPECT_EQ(sink_.journal().size(), 2u);
  // Also a conflict with a keyframe that waits for its turn, and, after a restart, with one that only the map knows.
  send(3);
  Keyframe other3 = keyframe(3);
  other3.standing_us += 1;
  send(other3);
  EXPECT_EQ(refused(Reason::SEQUENCE_CONFLICT), 2u);
  restart();
  send(other);
  EXPECT_EQ(refused(Reason::SEQUENCE_CONFLICT), 1u);
}

TEST_F(IntakeTest, GapsAreJournalledExceptForSequencesThatCame) {
  send(0);
  send(4);
  EXPECT_TRUE(intake_->take_gap({uuid_, 1, 6, Reason::MAP_RESTORED}, now_).ok());
  send(7);
  EXPECT_EQ(acknowledge().next_sequence, 0u);
  EXPECT_EQ(settle().next_sequence, 8u);
  const auto gaps = journalled<storage::GapRecord>();
  ASSERT_EQ(gaps.size(), 2u);
  EXPECT_EQ(gaps[0].to, 3u);
  EXPECT_EQ(gaps[0].reason, Reason::MAP_RESTORED);
  EXPECT_EQ(gaps[1].from, 5u);
  EXPECT_EQ(journalled<storage::KeyframeRecord>().size(), 3u);
  send(2);
  EXPECT_GT(part_refused(Reason::SEQUENCE_SETTLED), 0u);
  EXPECT_EQ(intake_->stats(now_).sequences_given_up, 5u);
}

TEST_F(IntakeTest, InvalidGapsAreRefused) {
  EXPECT_TRUE(intake_->take_gap({uuid_, 3, 1, Reason::DROPPED_BY_ROBOT}, now_).ok());
  EXPECT_TRUE(intake_->take_gap({uuid_, 0, 1, Reason::NOT_FINITE}, now_).ok());
  EXPECT_TRUE(intake_->take_gap({uuid_, 0, 0xffffffff, Reason::DROPPED_BY_ROBOT}, now_).ok());
  const IngestStats stats = intake_->stats(now_);
  EXPECT_EQ(stats.messages_refused[index_of(Reason::INVALID_ARGUMENT)], 2u);
  EXPECT_EQ(stats.messages_refused[index_of(Reason::BAD_SIZE)], 1u);
}

TEST_F(IntakeTest, SequencesBeyondTheWindowWait) {
  send(kIntakeWindow);
  EXPECT_GT(part_refused(Reason::SEQUENCE_TOO_FAR), 0u);
  EXPECT_TRUE(acknowledge().missing.empty());
  send(kIntakeWindow - 1);
  EXPECT_EQ(acknowledge().missing, (std::vector<SequenceRange>{{0, kIntakeWindow - 2}}));
}

// A session begins when its number is durable. Nobody waits for that.
TEST_F(IntakeTest, OthersGoOnWhileASessionBegins) {
  const SessionUuid slow = uuid_;
  sink_.begin_slowly = true;
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  EXPECT_EQ(acknowledge().next_sequence, 0u);
  EXPECT_EQ(acknowledge().held, (std::vector<SequenceRange>{{0, 2}})) << "they need not be sent again";
  EXPECT_TRUE(intake_->begun().empty());
  EXPECT_TRUE(intake_->take_events().empty());

  sink_.begin_slowly = false;
  uuid_.bytes[0] ^= 0x40;
  send(0);
  EXPECT_EQ(settle().next_sequence, 1u);
  uuid_ = slow;
  EXPECT_EQ(acknowledge().next_sequence, 0u);
  (void)intake_->take_events();

  sink_.let_begin();
  (void)acknowledge();
  EXPECT_TRUE(intake_->begun().contains(slow));
  const auto events = intake_->take_events();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, RobotEvent::Kind::kHeard);
  EXPECT_EQ(events[0].uuid, slow);
  EXPECT_EQ(settle().next_sequence, 3u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, ASessionThatIsRefusedItsBeginningIsTriedAgain) {
  sink_.begin_slowly = true;
  sink_.refuse_begin = Status(Reason::DISK_FULL, "no room");
  for (std::uint32_t s = 0; s < 2; ++s) send(s);
  sink_.let_begin();
  EXPECT_EQ(acknowledge().credits, 0u) << "the disk takes nothing";
  sink_.refuse_begin = Status();
  EXPECT_EQ(acknowledge().credits, 0u) << "it is tried again, and has not succeeded yet";
  sink_.let_begin();
  EXPECT_EQ(settle().next_sequence, 0u);
  EXPECT_EQ(settle().next_sequence, 2u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, RefusalsBeforeASessionBeginsAreCountedSeparately) {
  const auto waiting = [&] {
    return intake_->stats(now_).refused_before_begin[index_of(Reason::IMPLAUSIBLE_CALIBRATION)];
  };
  for (std::uint32_t s = 0; s < 2; ++s) {
    Keyframe k = keyframe(s);
    k.session.camera.cx = -1e6;
    send(k);
  }
  EXPECT_EQ(settle().next_sequence, 2u);
  EXPECT_EQ(waiting(), 2u);
  EXPECT_TRUE(journalled<storage::RefusalRecord>().empty());
  send(2);
  EXPECT_EQ(settle().next_sequence, 3u);
  EXPECT_EQ(waiting(), 0u);
  EXPECT_EQ(journalled<storage::RefusalRecord>().size(), 2u);
}

TEST_F(IntakeTest, SessionThatBeginsWithRefusalsKeepsThemInTheJournal) {
  Keyframe bad = keyframe(0);
  bad.session.camera.f = 0.01;
  send(bad);
  EXPECT_TRUE(intake_->take_gap({uuid_, 1, 2, Reason::CAPTURE_FAILED}, now_).ok());
  Acknowledgement ack = settle();
  EXPECT_EQ(ack.next_sequence, 3u);
  EXPECT_EQ(ack.refused.size(), 1u);
  EXPECT_TRUE(sink_.journal().empty());  // there is no session yet
  send(3);
  EXPECT_EQ(settle().next_sequence, 4u);
  EXPECT_EQ(journalled<storage::RefusalRecord>().size(), 1u);
  EXPECT_EQ(journalled<storage::GapRecord>().size(), 1u);
  EXPECT_EQ(refused(Reason::IMPLAUSIBLE_CALIBRATION), 1u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, ARestartContinuesFromWhatTheMapKnows) {
  send(0);
  Keyframe bad = keyframe(1);
  bad.driven_us = -1;
  send(bad);
  EXPECT_TRUE(intake_->take_gap({uuid_, 2, 3, Reason::CAPTURE_FAILED}, now_).ok());
  settle();
  restart();
  EXPECT_EQ(intake_->acknowledgement(uuid_)->next_sequence, 4u);
  EXPECT_EQ(intake_->acknowledgement(uuid_)->refused.size(), 1u);
  send(0);    // repeats
  send(bad);  // of a refusal as well
  EXPECT_EQ(refused(Reason::BAD_DURATION), 0u);
  Keyframe late = keyframe(4);
  late.time_us = keyframe(0).time_us;
  send(late);
  send(5);
  EXPECT_EQ(settle().next_sequence, 6u);
  EXPECT_EQ(refused(Reason::TIME_BACKWARDS), 1u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, KnowsRepeatsThatTheMapDoesNotShowYet) {
  sink_.freeze_view();
  for (std::uint32_t s = 0; s < 500; ++s) {
    send(s);
    settle();
  }
  Keyframe other = keyframe(3);
  other.standing_us += 1;
  send(other);
  send(3);
  EXPECT_EQ(refused(Reason::SEQUENCE_CONFLICT), 1u);
  EXPECT_EQ(part_refused(Reason::SEQUENCE_SETTLED), 0u);
  EXPECT_EQ(journalled<storage::KeyframeRecord>().size(), 500u);
}

TEST_F(IntakeTest, FullQueueIsTriedAgain) {
  sink_.capacity = 1;
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  EXPECT_EQ(intake_->stats(now_).blocked.reason(), Reason::BUDGET_EXCEEDED);
  EXPECT_LE(intake_->next_due(now_), now_ + milliseconds(20));
  for (int i = 0; i < 3; ++i) settle();
  EXPECT_EQ(settle().next_sequence, 3u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, JournalThatFailsIsNotAcknowledgedAndAskedForAgain) {
  send(0);
  settle();
  for (std::uint32_t s = 1; s < 4; ++s) send(s);
  sink_.fail({Reason::IO_ERROR, "the disk is full"});
  EXPECT_EQ(acknowledge().next_sequence, 1u);
  EXPECT_TRUE(acknowledge().held.empty());
  for (std::uint32_t s = 1; s < 4; ++s) send(s);
  EXPECT_EQ(settle().next_sequence, 4u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, RefusalsBeforeTheSessionBeganAreJournalledDespiteFailures) {
  Keyframe bad = keyframe(0);
  bad.session.camera.f = 1;
  send(bad);
  EXPECT_EQ(acknowledge().next_sequence, 1u);
  for (int failures = 0; failures < 3; ++failures) {
    send(1);
    EXPECT_EQ(sink_.queued(), 2u) << "the refusal and the keyframe";
    sink_.fail({Reason::DISK_FULL, "the disk is full"});
    EXPECT_EQ(acknowledge().next_sequence, 1u);
  }
  send(1);
  EXPECT_EQ(settle().next_sequence, 2u);
  EXPECT_EQ(journalled<storage::RefusalRecord>().size(), 1u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, WithAFullDiskKeyframesWaitAndNothingIsSettled) {
  send(0);
  settle();
  sink_.refuse_submit = {Reason::DISK_FULL, "the disk is full"};
  for (std::uint32_t s = 1; s < 4; ++s) send(s);
  const Acknowledgement ack = acknowledge();
  EXPECT_EQ(ack.credits, 0u);
  EXPECT_EQ(ack.next_sequence, 1u);
  EXPECT_EQ(ack.held, (std::vector<SequenceRange>{{1, 3}})) << "the robot need not send them again";
  EXPECT_TRUE(ack.refused.empty());
  EXPECT_EQ(intake_->stats(now_).blocked.reason(), Reason::DISK_FULL);
  EXPECT_GT(intake_->next_due(now_), now_ + milliseconds(20)) << "a disk is not asked fifty times a second";
  sink_.refuse_submit = {};
  acknowledge();
  const Acknowledgement after = settle();
  EXPECT_EQ(after.next_sequence, 4u);
  EXPECT_GT(after.credits, 0u);
}

// The journal may have recovered before poll() learns of the failure.
TEST_F(IntakeTest, KeyframesAfterAFailureDoNotOvertakeEarlierOnes) {
  send(0);
  settle();
  send(1);
  sink_.fail({Reason::IO_ERROR, "the disk fails"});
  send(2);
  sink_.sync();
  for (std::uint32_t s = 1; s < 3; ++s) send(s);
  acknowledge();
  EXPECT_EQ(settle().next_sequence, 3u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, ReadOnlySinkGivesNoCreditsAndSaysWhy) {
  sink_.refuse_submit = {Reason::READ_ONLY, "the journal is damaged"};
  send(0);
  EXPECT_EQ(settle().credits, 0u);
  EXPECT_EQ(intake_->stats(now_).blocked.reason(), Reason::READ_ONLY);
  sink_.refuse_submit = {};
  acknowledge();
  EXPECT_EQ(settle().next_sequence, 1u);
}

TEST_F(IntakeTest, AcknowledgesRegularlyWhileTheRobotIsActive) {
  send(0);
  sink_.sync();
  std::size_t said = 0;
  for (int i = 0; i < 1000; ++i) said += intake_->poll(now_ += milliseconds(10)).size();
  EXPECT_GE(said, 48u);  // 10 Hz for 5 s, and no more
  EXPECT_LE(said, 53u);
}

TEST_F(IntakeTest, SilentSessionsMakeRoomForOthers) {
  IntakeOptions options;
  options.max_sessions = 2;
  restart(options);
  for (std::uint8_t n = 1; n <= 4; ++n) {
    now_ += milliseconds(1);
    uuid_.bytes.fill(n);
    send(0);
    if (n <= 2) settle();
  }
  // 1 and 2 were settled and went; 3 and 4 are under way and stay.
  EXPECT_EQ(intake_->stats(now_).sessions, 2u);
  uuid_.bytes.fill(5);
  send(0);
  EXPECT_GT(part_refused(Reason::BUDGET_EXCEEDED), 0u);
}

// A gap ahead of what has come takes no memory, is never settled, and would hold a place for good.
TEST_F(IntakeTest, ARobotThatHoldsManyPlacesMakesRoomForOneThatHoldsFewer) {
  IntakeOptions options;
  options.max_sessions = 8;
  restart(options);
  const auto send_from = [&](std::uint8_t session, const std::string& robot) {
    now_ += milliseconds(1);
    uuid_.bytes.fill(session);
    Keyframe k = keyframe(0);
    k.session.robot = robot;
    const Bytes payload = encode_keyframe(k);
    EXPECT_TRUE(intake_->take_payload(uuid_, 0, crc32c(payload), payload, now_, {robot}).ok());
    sink_.sync();
    (void)intake_->poll(now_);
    EXPECT_TRUE(intake_->take_gap({uuid_, 5, 6, Reason::DROPPED_BY_ROBOT}, now_, {robot}).ok());
    return intake_->begun().contains(uuid_);
  };
  for (std::uint8_t session = 1; session <= 6; ++session) EXPECT_TRUE(send_from(session, "hog"));
  EXPECT_FALSE(send_from(9, "hog")) << "the last quarter is for others";
  for (std::uint8_t session = 11; session <= 14; ++session) EXPECT_TRUE(send_from(session, "cart"));
  EXPECT_FALSE(send_from(15, "cart")) << "it has as many";
  EXPECT_TRUE(send_from(21, "trolley"));
  EXPECT_EQ(intake_->stats(now_).sessions, 8u);
  std::map<std::string, int> places;
  for (const auto& [session, owner] : intake_->begun()) ++places[owner.robot];
  EXPECT_EQ(places["trolley"], 1);
  EXPECT_LE(std::abs(places["hog"] - places["cart"]), 1);
}

// By the memory of what waits for an earlier keyframe, too, a robot is one, however many sessions it sends.
TEST_F(IntakeTest, TheRobotThatHoldsMostMemoryLosesSome) {
  restart({});
  const auto wait_for_an_earlier_one = [&](std::uint8_t session, const std::string& robot, std::uint32_t sequences) {
    uuid_.bytes.fill(session);
    for (std::uint32_t s = 1; s <= sequences; ++s) {
      Keyframe k = keyframe(s);
      k.session.robot = robot;
      const Bytes payload = encode_keyframe(k);
      EXPECT_TRUE(intake_->take_payload(uuid_, s, crc32c(payload), payload, now_, {robot}).ok());
    }
  };
  wait_for_an_earlier_one(100, "cart", 12);
  const std::size_t carts = budget_.used(storage::Share::kReassembly);
  const std::size_t others = budget_.allowance(storage::Share::kReassembly) - 4 * carts;
  budget_.charge(storage::Share::kReassembly, others);  // so that the two have room for four times the cart's
  // Sessions of another robot, each of which holds less than the cart's, until there is no room for more.
  for (std::uint8_t session = 1; session <= 90 && intake_->stats(now_).evicted == 0; ++session)
    wait_for_an_earlier_one(session, "hog", 8);
  EXPECT_GT(intake_->stats(now_).evicted, 0u);
  uuid_.bytes.fill(100);
  EXPECT_EQ(acknowledge().held, (std::vector<SequenceRange>{{1, 12}}));
  budget_.release(storage::Share::kReassembly, others);
}

TEST_F(IntakeTest, SessionsOfOneRobotShareItsCredits) {
  restart({});
  const auto credits_of = [&](std::uint8_t session) {
    uuid_.bytes.fill(session);
    return acknowledge().credits;
  };
  const auto begin = [&](std::uint8_t session, const std::string& robot) {
    uuid_.bytes.fill(session);
    Keyframe k = keyframe(0);
    k.session.robot = robot;
    const Bytes payload = encode_keyframe(k);
    EXPECT_TRUE(intake_->take_payload(uuid_, 0, crc32c(payload), payload, now_, {robot}).ok());
    settle();
  };
  sink_.capacity = 8;  // of 256 kB each
  begin(1, "cart");
  for (std::uint8_t session = 11; session <= 14; ++session) begin(session, "hog");
  const std::uint32_t few = credits_of(11), many = credits_of(1);
  EXPECT_GE(few, 1u);
  EXPECT_NEAR(many, 4 * few, 4);
}

// A hello may be one of long ago that anyone sends again.
TEST_F(IntakeTest, AnAnnouncementKeepsNoSessionFromFallingSilent) {
  Keyframe k = keyframe(0);
  k.session.robot = "cart";
  const Bytes payload = encode_keyframe(k);
  EXPECT_TRUE(intake_->take_payload(uuid_, 0, crc32c(payload), payload, now_, {"cart"}).ok());
  settle();
  const auto stop = now_ + std::chrono::seconds(70);
  for (; now_ < stop; now_ += std::chrono::seconds(1)) {
    EXPECT_TRUE(intake_->claim(uuid_, now_, {"cart"}).ok());
    (void)intake_->poll(now_);
  }
  EXPECT_EQ(intake_->stats(now_).sessions, 0u);
  ASSERT_EQ(intake_->robots(now_).size(), 1u);
  EXPECT_TRUE(intake_->robots(now_)[0].silent);
}

TEST_F(IntakeTest, WholePayloadsAreCheckedAndAcknowledgedLikePartsOfThem) {
  const Bytes payload = encode_keyframe(keyframe(0));
  EXPECT_TRUE(intake_->take_payload(uuid_, 0, crc32c(payload), payload, now_).ok());
  EXPECT_TRUE(intake_->take_payload(uuid_, 1, crc32c(payload) ^ 1, payload, now_).ok());
  EXPECT_TRUE(intake_->take_payload(uuid_, 1, 0, Bytes(kMaxKeyframeBytes + 1), now_).ok());
  EXPECT_EQ(settle().next_sequence, 1u);
  EXPECT_EQ(part_refused(Reason::CORRUPT), 1u);
  EXPECT_EQ(part_refused(Reason::BAD_SIZE), 1u);
  SessionUuid unknown;
  unknown.bytes.fill(8);
  EXPECT_EQ(intake_->acknowledgement(unknown).reason(), Reason::NO_SUCH_SESSION);
}

TEST_F(IntakeTest, ASilentRobotHoldsNoMemory) {
  send(0);
  settle();
  for (std::uint32_t s = 2; s < 6; ++s) send(s);  // 1 never comes
  const Bytes payload = encode_keyframe(keyframe(7));
  intake_->take_part(cut_part(uuid_, 7, payload, crc32c(payload), 600, 0), now_);
  EXPECT_GT(budget_.used(storage::Share::kReassembly), 0u);
  now_ += std::chrono::seconds(59);
  (void)intake_->poll(now_);
  EXPECT_EQ(acknowledge().held, (std::vector<SequenceRange>{{2, 5}}));
  now_ += std::chrono::seconds(1);
  (void)intake_->poll(now_);
  EXPECT_EQ(budget_.used(storage::Share::kReassembly), 0u);
  EXPECT_EQ(intake_->stats(now_).sessions, 0u);

  for (std::uint32_t s = 1; s < 6; ++s) send(s);  // it was only asleep
  EXPECT_EQ(settle().next_sequence, 6u);
}

TEST_F(IntakeTest, SessionsThatNeverBeginLockNobodyOut) {
  for (std::uint32_t i = 0; i < 3000; ++i) {
    SessionUuid stranger;
    std::memcpy(stranger.bytes.data(), &i, sizeof i);
    stranger.bytes[15] = 1;
    EXPECT_TRUE(intake_->take_gap({stranger, 0, 5, Reason::DROPPED_BY_ROBOT}, now_).ok());
    now_ += milliseconds(1);
  }
  EXPECT_LE(intake_->stats(now_).sessions, 1024u);
  send(0);
  EXPECT_EQ(settle().next_sequence, 1u);
}

TEST_F(IntakeTest, TheLastPossibleSequenceHasASuccessor) {
  EXPECT_TRUE(intake_->take_gap({uuid_, 0xfffffff0, 0xffffffff, Reason::DROPPED_BY_ROBOT}, now_).ok());
  EXPECT_EQ(intake_->stats(now_).messages_refused[index_of(Reason::INVALID_ARGUMENT)], 1u);
}

TEST_F(IntakeTest, OnlyRobotsOnTheListAreTaken) {
  IntakeOptions options;
  options.robots = {"friend"};
  restart(options);
  send(0);
  EXPECT_EQ(settle().refused.at(0).reason, Reason::NOT_ALLOWED);
  EXPECT_TRUE(sink_.journal().empty()) << "no session begins with it";
  uuid_.bytes[0] ^= 1;
  Keyframe k = keyframe(0);
  k.session.robot = "friend";
  send(k);
  EXPECT_TRUE(settle().refused.empty());
  EXPECT_EQ(journalled<storage::KeyframeRecord>().size(), 1u);
}

TEST_F(IntakeTest, LimitsChangeWhileItRuns) {
  send(0);
  EXPECT_TRUE(settle().refused.empty());
  intake_->limit({0, 0, {"somebody else"}});
  send(1);
  EXPECT_EQ(settle().refused.back().reason, Reason::NOT_ALLOWED);
  intake_->limit({});
  send(2);
  EXPECT_EQ(settle().next_sequence, 3u);
  EXPECT_EQ(journalled<storage::KeyframeRecord>().size(), 2u);
}

TEST_F(IntakeTest, FrozenAndDeletedSessionsRefuseKeyframes) {
  send(0);
  settle();
  sink_.set_state(1, storage::SessionState::kFrozen);
  send(1);
  EXPECT_EQ(settle().refused.back().reason, Reason::SESSION_FROZEN);
  sink_.set_state(1, storage::SessionState::kOpen);
  send(2);
  EXPECT_EQ(settle().next_sequence, 3u);
  EXPECT_EQ(journalled<storage::KeyframeRecord>().size(), 2u);
  sink_.set_state(1, storage::SessionState::kDeleting);
  send(3);
  EXPECT_EQ(settle().refused.back().reason, Reason::SESSION_DELETED);
  restart();
  send(4);
  EXPECT_EQ(settle().refused.back().reason, Reason::SESSION_DELETED);
  // Another version of a keyframe that was in the map is refused with the same reason.
  Keyframe corrected = keyframe(2);
  corrected.standing_us += 1;
  send(corrected);
  const auto refused = settle().refused;
  EXPECT_TRUE(std::any_of(refused.begin(), refused.end(),
                          [](const Refused& r) { return r.sequence == 2 && r.reason == Reason::SESSION_DELETED; }));
  const auto robots = intake_->robots(now_);
  ASSERT_EQ(robots.size(), 1u);
  EXPECT_FALSE(robots[0].not_taken.contains(Reason::SEQUENCE_CONFLICT));
  EXPECT_TRUE(robots[0].not_taken.contains(Reason::SESSION_DELETED));
  // A keyframe that was in the map is refused, too, and not treated as settled.
  sink_.remove_frame({1, 0});
  restart();
  send(0);
  const Acknowledgement ack = settle();
  ASSERT_FALSE(ack.refused.empty());
  EXPECT_EQ(ack.refused.front().sequence, 0u);
  EXPECT_EQ(ack.refused.front().reason, Reason::SESSION_DELETED);
}

// A robot with everything settled sends nothing, and must be told all the same.
TEST_F(IntakeTest, ARobotIsToldAtOnceThatItsSessionTakesNothing) {
  send(0);
  EXPECT_TRUE(settle().refused.empty());
  for (const auto& [state, reason] : {std::pair{storage::SessionState::kFrozen, Reason::SESSION_FROZEN},
                                      std::pair{storage::SessionState::kDeleting, Reason::SESSION_DELETED}}) {
    sink_.set_state(1, state);
    const Acknowledgement ack = settle();
    ASSERT_EQ(ack.refused.size(), 1u);
    EXPECT_EQ(ack.refused[0].sequence, kWholeSession);
    EXPECT_EQ(ack.refused[0].reason, reason);
  }
  sink_.set_state(1, storage::SessionState::kOpen);
  EXPECT_TRUE(settle().refused.empty());
}

TEST_F(IntakeTest, ASessionEndsWhenAllOfItIsSettledAndAKeyframeOpensItAgain) {
  const auto ended = [&] {
    std::size_t count = 0;
    for (const PoseNews& news : intake_->take_news())
      count += news.kind == PoseNews::Kind::kEnded && news.session == uuid_;
    return count;
  };
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  EXPECT_TRUE(intake_->take_end({uuid_, 3}, now_).ok());
  settle();
  EXPECT_EQ(ended(), 0u) << "not all was settled when it was said";
  EXPECT_TRUE(intake_->take_end({uuid_, 2}, now_).ok());
  settle();
  EXPECT_EQ(ended(), 0u) << "there is more than it knows";
  EXPECT_TRUE(intake_->take_end({uuid_, 3}, now_).ok());
  EXPECT_EQ(ended(), 0u) << "not durable";
  settle();
  EXPECT_EQ(ended(), 1u);
  EXPECT_TRUE(intake_->take_end({uuid_, 3}, now_).ok());
  EXPECT_EQ(ended(), 1u) << "the robot may not have heard";
  restart();
  EXPECT_TRUE(intake_->take_end({uuid_, 3}, now_).ok());
  EXPECT_EQ(ended(), 1u);
  EXPECT_EQ(journalled<storage::SetSessionStateRecord>().size(), 1u);
  send(3);
  EXPECT_EQ(settle().next_sequence, 4u);
  EXPECT_EQ(sink_.view()->session(1)->state, storage::SessionState::kOpen);
  EXPECT_TRUE(intake_->take_end({uuid_, 4}, now_).ok());
  settle();
  EXPECT_EQ(ended(), 1u);
  EXPECT_EQ(journalled<storage::SetSessionStateRecord>().size(), 2u);
}

TEST_F(IntakeTest, ARobotAboveItsRateIsHeldBackToldSoAndLosesNothing) {
  IntakeOptions options;
  options.max_keyframes_per_s = 10;
  restart(options);
  // 20 a second, without regard to credits; what is not taken is sent again.
  std::uint32_t settled = 0, slowed = 0, resumed = 0;
  double rate = 0;
  const auto hear = [&] {
    for (const PoseNews& news : intake_->take_news()) {
      slowed += news.kind == PoseNews::Kind::kSlowDown;
      resumed += news.kind == PoseNews::Kind::kResume;
      if (news.kind == PoseNews::Kind::kSlowDown) rate = news.rate_hz;
    }
  };
  for (int tick = 0; tick < 400; ++tick) {
    now_ += milliseconds(50);
    for (std::uint32_t s = settled; s < settled + 4; ++s) send(s);
    sink_.sync();
    (void)intake_->poll(now_);
    const Acknowledgement ack = *intake_->acknowledgement(uuid_);
    settled = static_cast<std::uint32_t>(ack.next_sequence);
    EXPECT_TRUE(ack.refused.empty());
    hear();
  }
  EXPECT_NEAR(settled, kIntakeWindow + 20 * 10, 4);
  EXPECT_GT(part_refused(Reason::RATE_LIMITED), 0u);
  EXPECT_EQ(rate, 10);
  EXPECT_GE(slowed, 2u) << "it may not have heard";
  EXPECT_EQ(intake_->robots(now_).at(0).limit_hz, 10);
  for (int tick = 0; tick < 200; ++tick) {
    (void)intake_->poll(now_ += milliseconds(50));
    hear();
  }
  EXPECT_EQ(resumed, 1u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, SessionsGetRoomInTurn) {
  sink_.capacity = 2;
  std::vector<SessionUuid> sessions;
  for (std::uint8_t n = 1; n <= 4; ++n) {
    uuid_.bytes.fill(n);
    sessions.push_back(uuid_);
    for (std::uint32_t s = 0; s < 20; ++s) send(s);
  }
  for (int round = 0; round < 20; ++round) settle();
  for (const SessionUuid& session : sessions) EXPECT_GE(intake_->acknowledgement(session)->next_sequence, 4u);
}

// The room that appears goes to those who wait, not to whoever sends at the moment, and to each of them alike.
TEST_F(IntakeTest, WhoSendsMuchDoesNotTakeTheRoomForWhichOthersWait) {
  sink_.capacity = 2;
  const SessionUuid much = uuid_;
  for (std::uint32_t s = 0; s < 20; ++s) send(s);
  uuid_.bytes.fill(7);
  const SessionUuid little = uuid_;
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  (void)intake_->poll(now_);
  for (const RobotStats& robot : intake_->robots(now_)) EXPECT_EQ(robot.blocked, Reason::BUDGET_EXCEEDED);
  uuid_ = much;
  for (std::uint32_t s = 20; s < 28; ++s) {
    sink_.sync(1);
    send(s);  // at once, before any poll
  }
  (void)intake_->poll(now_);
  EXPECT_EQ(intake_->acknowledgement(little)->next_sequence, 3u);
  EXPECT_EQ(intake_->acknowledgement(much)->next_sequence, 5u);
  for (int round = 0; round < 20; ++round) settle();
  EXPECT_EQ(intake_->acknowledgement(much)->next_sequence, 28u);
  for (const RobotStats& robot : intake_->robots(now_)) EXPECT_EQ(robot.blocked, Reason::OK);
  EXPECT_TRUE(sink_.faults.empty());
}

// The map has as many sessions as its memory allows.
TEST_F(IntakeTest, ASessionThatCannotBeginKeepsNobodyWaiting) {
  const SessionUuid begun = uuid_;
  send(0);
  settle();
  sink_.refuse_begin = Status(Reason::BUDGET_EXCEEDED, "too many sessions");
  uuid_.bytes.fill(7);
  const SessionUuid waits = uuid_;
  send(0);
  EXPECT_EQ(intake_->stats(now_).blocked.reason(), Reason::BUDGET_EXCEEDED);
  uuid_ = begun;
  send(1);
  EXPECT_EQ(settle().next_sequence, 2u);
  sink_.refuse_begin = {};
  settle();
  uuid_ = waits;
  EXPECT_EQ(settle().next_sequence, 1u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, WhoHasNothingToSubmitDoesNotWaitForRoom) {
  sink_.capacity = 1;
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  uuid_.bytes.fill(7);
  send(1);  // 0 has not come
  for (const RobotStats& robot : intake_->robots(now_))
    EXPECT_EQ(robot.blocked, robot.uuid == uuid_ ? Reason::OK : Reason::BUDGET_EXCEEDED);
}

TEST_F(IntakeTest, ReportsTheStateOfEachRobot) {
  for (const std::uint32_t s : {0, 1, 5}) send(s);
  const Bytes payload = encode_keyframe(keyframe(3));
  intake_->take_part(cut_part(uuid_, 3, payload, crc32c(payload), 600, 0), now_);
  Keyframe bad = keyframe(2);
  bad.driven_us = -1;
  send(bad);
  settle();
  const RobotStats robot = intake_->robots(now_).at(0);
  EXPECT_EQ(robot.uuid, uuid_);
  EXPECT_EQ(robot.session, 1u);
  EXPECT_EQ(robot.robot, keyframe(0).session.robot);
  EXPECT_EQ(robot.next_sequence, 3u);
  EXPECT_EQ(robot.seen_end, 6u);
  EXPECT_EQ(robot.missing, 1u);  // 4
  EXPECT_EQ(robot.incomplete, 1u);
  EXPECT_EQ(robot.pending, 1u);
  EXPECT_EQ(robot.refused.at(Reason::BAD_DURATION), 1u);
  EXPECT_NEAR(robot.keyframes_per_s, 0.2, 1e-9);
  EXPECT_GT(robot.bytes_per_s, 0);
  EXPECT_EQ(robot.lag_us, -1) << "its stamps are years old";
  ASSERT_EQ(intake_->begun().size(), 1u);
  EXPECT_EQ(intake_->begun().begin()->first, uuid_);
}

TEST_F(IntakeTest, CountsKeyframesOfWhichPartsAreMissingNow) {
  for (const std::uint32_t s : {0, 1, 5}) send(s);  // 5 is whole, and waits for 2 to 4
  settle();
  EXPECT_EQ(intake_->robots(now_).at(0).pending, 1u);
  EXPECT_EQ(intake_->stats(now_).incomplete, 0u);
  const auto send_some = [&](std::uint32_t sequence, std::uint32_t first_part, bool all) {
    const Bytes payload = encode_keyframe(keyframe(sequence));
    const std::uint32_t end = all ? count_parts(payload.size(), 600) : first_part + 1;
    for (std::uint32_t i = first_part; i < end; ++i)
      intake_->take_part(cut_part(uuid_, sequence, payload, crc32c(payload), 600, i), now_);
  };
  send_some(2, 0, false);
  send_some(3, 0, false);
  const SessionUuid first = uuid_;
  uuid_.bytes[0] ^= 1;
  send_some(0, 0, false);
  EXPECT_EQ(intake_->stats(now_).incomplete, 3u);
  uuid_ = first;
  send_some(2, 1, true);
  EXPECT_EQ(intake_->stats(now_).incomplete, 2u);
}

TEST_F(IntakeTest, CountsSessionsThatWereHeardInTheLastMinute) {
  send(0);
  settle();
  const SessionUuid first = uuid_;
  const SteadyTime heard = now_ - milliseconds(300);
  EXPECT_EQ(intake_->stats(now_).heard, 1u);
  (void)intake_->poll(heard + std::chrono::seconds(30));
  now_ = heard + std::chrono::seconds(30);
  uuid_.bytes[0] ^= 1;
  send(0);
  EXPECT_EQ(intake_->stats(now_).heard, 2u);
  now_ = heard + std::chrono::seconds(61);
  EXPECT_EQ(intake_->stats(now_).sessions, 2u) << "the first is forgotten at the next poll()";
  EXPECT_EQ(intake_->stats(now_).heard, 1u);

  // A session that is asked about was not heard from.
  settle();
  ASSERT_EQ(intake_->stats(now_).sessions, 1u);
  ASSERT_TRUE(intake_->acknowledgement(first).ok());
  EXPECT_EQ(intake_->stats(now_).sessions, 2u);
  EXPECT_EQ(intake_->stats(now_).heard, 1u);
}

TEST_F(IntakeTest, CountsASessionThatMadeRoomForAnotherAsHeard) {
  IntakeOptions options;
  options.max_sessions = 1;
  restart(options);
  send(0);
  settle();
  uuid_.bytes[0] ^= 1;
  send(0);
  EXPECT_EQ(intake_->stats(now_).sessions, 1u);
  EXPECT_EQ(intake_->stats(now_).heard, 2u);
}

// A robot that was killed stays in the list for a while, where an operator may look for it; one that ended does not.
TEST_F(IntakeTest, ARobotThatFallsSilentWithoutAnEndIsListedForTenMinutes) {
  const auto listed = [&] {
    (void)intake_->poll(now_);
    return intake_->robots(now_);
  };
  const SessionUuid killed = uuid_;
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  settle();
  const SteadyTime heard = now_ - milliseconds(300);
  uuid_.bytes[0] ^= 1;
  send(0);
  settle();
  EXPECT_TRUE(intake_->take_end({uuid_, 1}, now_).ok());
  settle();
  uuid_.bytes[0] ^= 2;
  Keyframe bad = keyframe(0);
  bad.driven_us = -1;
  send(bad);  // its session never begins
  settle();
  std::vector<RobotStats> robots = listed();
  EXPECT_EQ(robots.size(), 3u);
  EXPECT_TRUE(std::none_of(robots.begin(), robots.end(), [](const RobotStats& r) { return r.silent; }));

  now_ = heard + std::chrono::seconds(70);
  robots = listed();
  ASSERT_EQ(robots.size(), 1u);
  EXPECT_EQ(robots[0].uuid, killed);
  EXPECT_TRUE(robots[0].silent);
  EXPECT_EQ(robots[0].robot, keyframe(0).session.robot);
  EXPECT_EQ(robots[0].session, 1u);
  EXPECT_EQ(robots[0].next_sequence, 3u);
  EXPECT_EQ(robots[0].silent_us, 70'000'000);
  EXPECT_EQ(robots[0].keyframes_per_s, 0);
  EXPECT_EQ(intake_->stats(now_).sessions, 0u) << "it holds nothing";
  now_ = heard + std::chrono::seconds(599);
  EXPECT_EQ(listed().size(), 1u);
  now_ = heard + std::chrono::seconds(600);
  EXPECT_EQ(listed().size(), 0u);

  // If it returns before, it is a robot like any other.
  uuid_ = killed;
  send(3);
  settle();
  now_ += std::chrono::seconds(120);
  EXPECT_TRUE(listed().at(0).silent);
  send(4);
  settle();
  ASSERT_EQ(listed().size(), 1u);
  EXPECT_FALSE(listed().at(0).silent);
}

TEST(SilentRobot, HasLeftOnceItsSessionHasEndedOrIsBeingDeleted) {
  using storage::SessionState;
  RobotStats robot;
  storage::Session session;
  for (const SessionState state :
       {SessionState::kOpen, SessionState::kEnded, SessionState::kFrozen, SessionState::kDeleting}) {
    session.state = state;
    robot.silent = true;
    const bool gone = state == SessionState::kEnded || state == SessionState::kDeleting;
    EXPECT_EQ(has_left(robot, session), gone) << static_cast<int>(state);
    robot.silent = false;
    EXPECT_FALSE(has_left(robot, session)) << static_cast<int>(state) << ": it sends again";
  }
  robot.silent = true;
  EXPECT_FALSE(has_left(robot, std::nullopt)) << "the map has no such session";
}

TEST_F(IntakeTest, SilentRobotsAreRememberedWithinBounds) {
  IntakeOptions options;
  options.max_sessions = 4;
  restart(options);
  for (std::uint8_t n = 1; n <= 20; ++n) {
    uuid_.bytes.fill(n);
    send(0);
    settle();
    EXPECT_LE(intake_->robots(now_).size(), 8u);
  }
  EXPECT_EQ(intake_->robots(now_).size(), 8u);
}

TEST_F(IntakeTest, TwoRobotsOfOneNameDifferFromOneThatWasRestarted) {
  const SessionUuid first = uuid_;
  SessionUuid second = uuid_;
  second.bytes[0] ^= 1;
  const auto hear = [&](const SessionUuid& session, std::uint32_t sequence) {
    uuid_ = session;
    send(sequence);
    settle();
  };
  const auto namesakes = [&](const SessionUuid& session) {
    for (const RobotStats& robot : intake_->robots(now_))
      if (robot.uuid == session) return robot.same_name;
    return std::vector<SessionUuid>();
  };
  const auto told = [&] {
    std::size_t count = 0;
    for (const RobotEvent& event : intake_->take_events()) count += event.kind == RobotEvent::Kind::kSameName;
    return count;
  };
  hear(first, 0);
  hear(second, 0);  // the first may have been killed and begun anew without its spool
  EXPECT_TRUE(namesakes(first).empty());
  EXPECT_TRUE(namesakes(second).empty());
  hear(first, 1);
  EXPECT_EQ(namesakes(first), std::vector<SessionUuid>{second});
  EXPECT_EQ(namesakes(second), std::vector<SessionUuid>{first});
  now_ += std::chrono::seconds(1);
  settle();
  EXPECT_EQ(told(), 2u);
  hear(second, 1);
  now_ += std::chrono::seconds(1);
  settle();
  EXPECT_EQ(told(), 0u) << "once";
  // Another name, or an end, resolves it.
  uuid_.bytes[0] ^= 2;
  Keyframe other = keyframe(0);
  other.session.robot = "another";
  send(other);
  settle();
  EXPECT_TRUE(namesakes(uuid_).empty());
  // Recordings that name no robot may be ingested side by side.
  std::vector<SessionUuid> recordings(2, uuid_);
  for (std::uint32_t s = 0; s < 2; ++s)
    for (std::uint8_t n = 0; n < 2; ++n) {
      recordings[n].bytes[1] = n + 1;
      uuid_ = recordings[n];
      Keyframe recorded = keyframe(s);
      recorded.session.robot = "batch";
      send(recorded);
      settle();
    }
  for (const SessionUuid& recording : recordings) EXPECT_TRUE(namesakes(recording).empty());
  hear(first, 2);
  hear(second, 2);
  EXPECT_FALSE(namesakes(second).empty());
  uuid_ = first;
  EXPECT_TRUE(intake_->take_end({first, 3}, now_).ok());
  settle();
  EXPECT_TRUE(namesakes(second).empty());
}

TEST_F(IntakeTest, ReportsToTheLogWhoIsHeardAndWhoFellSilent) {
  const auto kinds = [&] {
    std::vector<RobotEvent::Kind> all;
    for (const RobotEvent& event : intake_->take_events()) {
      EXPECT_EQ(event.uuid, uuid_);
      EXPECT_EQ(event.session, 1u);
      EXPECT_EQ(event.robot, keyframe(0).session.robot);
      all.push_back(event.kind);
    }
    return all;
  };
  using Kinds = std::vector<RobotEvent::Kind>;
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  settle();
  EXPECT_EQ(kinds(), Kinds{RobotEvent::Kind::kHeard});
  now_ += std::chrono::seconds(70);
  (void)intake_->poll(now_);
  EXPECT_EQ(kinds(), Kinds{RobotEvent::Kind::kSilent});
  send(3);
  settle();
  EXPECT_EQ(kinds(), Kinds{RobotEvent::Kind::kHeard}) << "it is back";
  EXPECT_TRUE(intake_->take_end({uuid_, 4}, now_).ok());
  settle();
  now_ += std::chrono::seconds(70);
  (void)intake_->poll(now_);
  EXPECT_EQ(kinds(), Kinds{}) << "it has ended";
}

// Complete keyframes whose predecessor never comes must not lock others out.
TEST_F(IntakeTest, TheSessionWithMostWaitingKeyframesGivesWay) {
  const auto large = [&](std::uint32_t sequence) {
    Keyframe k = keyframe(sequence);
    k.picture = Bytes(40'000, 0xff);
    k.picture[1] = 0xd8;
    return k;
  };
  const SessionUuid robot = uuid_;
  for (std::uint8_t n = 1; n <= 3; ++n) {
    uuid_.bytes.fill(n);
    for (std::uint32_t s = 1; s < kIntakeWindow; ++s) send(large(s));
  }
  EXPECT_GT(intake_->stats(now_).evicted, 0u);
  EXPECT_LE(budget_.used(storage::Share::kReassembly), budget_.allowance(storage::Share::kReassembly));
  uuid_ = robot;
  for (std::uint32_t s = 0; s < 10; ++s) send(large(s));
  EXPECT_EQ(settle().next_sequence, 10u);
  // Only the dropped keyframe is missing again.
  uuid_.bytes.fill(2);
  send(large(0));
  const Acknowledgement ack = settle();
  EXPECT_GT(ack.next_sequence, 10u);
  EXPECT_EQ(ack.missing.back().to, kIntakeWindow - 1);
}

// Sessions stay for good, so nobody may begin them without end; what is refused is not settled, and comes again.
TEST_F(IntakeTest, NewSessionsAreLimitedByRobot) {
  IntakeOptions options;
  options.max_new_sessions_per_min = 5;
  restart(options);
  const auto begin = [&](const Sender& sender, const std::string& robot) {
    Keyframe k = keyframe(0);
    k.session.uuid = SessionUuid::random();
    k.session.robot = robot;
    const Bytes payload = encode_keyframe(k);
    EXPECT_TRUE(intake_->take_payload(k.session.uuid, 0, crc32c(payload), payload, now_, sender).ok());
  };
  const auto begun = [&] { return sink_.view()->sessions().size(); };
  for (int i = 0; i < 20; ++i) begin({"flood"}, "flood");
  EXPECT_EQ(begun(), 5u);
  EXPECT_EQ(intake_->stats(now_).parts_refused[index_of(Reason::RATE_LIMITED)], 15u);
  begin({"cart"}, "cart");
  EXPECT_EQ(begun(), 6u) << "another robot's sessions are its own";
  now_ += std::chrono::seconds(24);
  for (int i = 0; i < 20; ++i) begin({"flood"}, "flood");
  EXPECT_EQ(begun(), 8u) << "two in 24 s";
  for (int i = 0; i < 100; ++i) begin({{}, true}, "robot " + std::to_string(i));
  EXPECT_EQ(begun(), 58u) << "who proves nothing is one of many";
  for (int i = 0; i < 100; ++i) begin({{}, false, "ipv4:10.0.0.1"}, "robot " + std::to_string(i));
  EXPECT_EQ(begun(), 108u) << "nor is one address without proof";
  begin({{}, false, "ipv4:10.0.0.2"}, "cart");
  EXPECT_EQ(begun(), 109u) << "another address is another's";
  for (int i = 0; i < 100; ++i) begin({}, "robot " + std::to_string(i));
  EXPECT_EQ(begun(), 209u) << "operators know what they do";
}

TEST_F(IntakeTest, TimesFarAheadOfTheServerAreRefusedByName) {
  Keyframe late = keyframe(0);
  late.time_us = now_us() + 23 * 3600 * 1'000'000LL;  // a clock in another time zone
  send(late);
  EXPECT_EQ(settle().next_sequence, 1u);
  EXPECT_TRUE(acknowledge().refused.empty());
  uuid_.bytes[0] ^= 1;
  Keyframe far = keyframe(0);
  far.time_us = now_us() + 25 * 3600 * 1'000'000LL;
  send(far);
  send(1);
  settle();
  const Acknowledgement ack = acknowledge();
  EXPECT_EQ(ack.next_sequence, 2u) << "what follows is taken";
  ASSERT_EQ(ack.refused.size(), 1u);
  EXPECT_EQ(ack.refused[0].reason, Reason::TIME_AHEAD);
}

// Whoever looks for a robot that is refused from its start looks for its name.
TEST_F(IntakeTest, ARobotOfWhichEverythingIsRefusedIsListedByItsName) {
  Keyframe far = keyframe(0);
  far.time_us = now_us() + 25 * 3600 * 1'000'000LL;
  send(far);
  settle();
  const auto listed = [&](const SessionUuid& uuid) {
    for (const RobotStats& robot : intake_->robots(now_))
      if (robot.uuid == uuid) return robot;
    return RobotStats();
  };
  EXPECT_EQ(listed(uuid_).session, 0u);
  EXPECT_EQ(listed(uuid_).refused, (std::map<Reason, std::uint64_t>{{Reason::TIME_AHEAD, 1}}));
  EXPECT_EQ(listed(uuid_).robot, far.session.robot) << "as its keyframe says";
  EXPECT_EQ(listed(uuid_).name, far.session.name);

  Keyframe other = keyframe(0);
  other.session.uuid = SessionUuid::random();
  other.session.robot = "cart";
  const Bytes payload = encode_keyframe(other);
  (void)intake_->take_payload(other.session.uuid, 0, crc32c(payload), payload, now_, {"anna"});
  EXPECT_EQ(listed(other.session.uuid).refused, (std::map<Reason, std::uint64_t>{{Reason::NOT_ALLOWED, 1}}));
  EXPECT_EQ(listed(other.session.uuid).robot, "anna") << "who it has proved to be counts";

  Keyframe unnameable = keyframe(0);
  unnameable.session.uuid = SessionUuid::random();
  unnameable.session.robot = "a\x1b[2J";
  const Bytes bytes = encode_keyframe(unnameable);
  (void)intake_->take_payload(unnameable.session.uuid, 0, crc32c(bytes), bytes, now_);
  EXPECT_EQ(listed(unnameable.session.uuid).robot, "") << "what may be no name is shown nowhere";
}

// What anyone has sent of a session is no hindrance to the robot itself, nor can it speak for the robot.
TEST_F(IntakeTest, NobodySpeaksForARobotThatProvesWhoItIs) {
  const std::string robot = keyframe(0).session.robot;
  IntakeOptions options;
  options.proving = {robot};
  restart(options);
  const Sender anyone{{}, true}, own{robot};
  const Bytes payload = encode_keyframe(keyframe(0)), other = encode_keyframe(keyframe(1));
  (void)intake_->take_gap({uuid_, 0, 5, Reason::DROPPED_BY_ROBOT}, now_, anyone);
  EXPECT_TRUE(intake_->take_payload(uuid_, 0, crc32c(payload), payload, now_, anyone).ok());
  EXPECT_EQ(sink_.view()->sessions().size(), 0u);
  EXPECT_TRUE(intake_->take_payload(uuid_, 0, crc32c(payload), payload, now_, own).ok());
  EXPECT_EQ(settle().next_sequence, 1u) << "the gap is forgotten";
  EXPECT_EQ(intake_->take_gap({uuid_, 1, 5, Reason::DROPPED_BY_ROBOT}, now_, anyone).reason(), Reason::NOT_ALLOWED);
  EXPECT_EQ(intake_->take_end({uuid_, 1}, now_, anyone).reason(), Reason::NOT_ALLOWED);
  EXPECT_EQ(intake_->take_payload(uuid_, 1, crc32c(other), other, now_, anyone).reason(), Reason::NOT_ALLOWED);
  // Before it has begun, too: what the robot has said first counts.
  uuid_.bytes[0] ^= 1;
  EXPECT_TRUE(intake_->take_gap({uuid_, 0, 0, Reason::DROPPED_BY_ROBOT}, now_, own).ok());
  EXPECT_EQ(intake_->take_gap({uuid_, 1, 5, Reason::DROPPED_BY_ROBOT}, now_, anyone).reason(), Reason::NOT_ALLOWED);
  // A robot that need not prove itself is as free as ever.
  Keyframe free = keyframe(0);
  free.session.robot = "old";
  free.session.uuid = SessionUuid::random();
  const Bytes bytes = encode_keyframe(free);
  EXPECT_TRUE(intake_->take_payload(free.session.uuid, 0, crc32c(bytes), bytes, now_, anyone).ok());
  EXPECT_EQ(sink_.view()->sessions().size(), 2u);
}

// After a restart, what another robot sends while the session is read of the map must not make it look as if it had not
// begun: then it would be the other's, and what is settled would be settled again.
TEST_F(IntakeTest, ASessionStaysItsRobotsWhateverOthersSendWhileTheMapIsRead) {
  const Sender own{keyframe(0).session.robot}, thief{"thief"};
  for (std::uint32_t s = 0; s < 3; ++s) send(s);
  settle();
  restart();
  const auto steals = [&](std::uint32_t sequence) {
    const Bytes payload = encode_keyframe(keyframe(sequence));
    return intake_->take_payload(uuid_, sequence, crc32c(payload), payload, now_, thief);
  };
  const auto of_session = intake_->question(uuid_, 0, own);
  ASSERT_TRUE(of_session && !of_session->sequence);
  intake_->know(*of_session, answer(sink_, *of_session));
  const auto of_sequence = intake_->question(uuid_, 0, own);
  ASSERT_TRUE(of_sequence && of_sequence->sequence);
  const MapAnswer late = answer(sink_, *of_sequence);
  EXPECT_EQ(steals(3).reason(), Reason::NOT_ALLOWED);
  // Meanwhile the session has been taken in, and was silent until it was let go of.
  send(0);
  now_ += std::chrono::minutes(2);
  (void)intake_->poll(now_);
  ASSERT_EQ(intake_->stats(now_).sessions, 0u);
  intake_->know(*of_sequence, late);
  EXPECT_EQ(steals(3).reason(), Reason::NOT_ALLOWED);
  EXPECT_EQ(intake_->take_gap({uuid_, 3, 9, Reason::DROPPED_BY_ROBOT}, now_, thief).reason(), Reason::NOT_ALLOWED);
  EXPECT_EQ(intake_->stats(now_).sessions, 0u) << "who is refused takes no place";
  const Bytes next = encode_keyframe(keyframe(3));
  EXPECT_TRUE(intake_->take_payload(uuid_, 3, crc32c(next), next, now_, own).ok());
  EXPECT_EQ(settle().next_sequence, 4u);
  EXPECT_TRUE(sink_.faults.empty());
}

TEST_F(IntakeTest, ASessionThatTheMapDoesNotShowYetIsNotTakenForANewOne) {
  send(0);
  sink_.sync();
  sink_.freeze_view();
  uuid_.bytes[0] ^= 1;
  send(0);
  sink_.sync();
  restart();
  send(1);
  EXPECT_EQ(part_refused(Reason::BUDGET_EXCEEDED), count_parts(encode_keyframe(keyframe(1)).size(), 600));
  EXPECT_EQ(intake_->acknowledgement(uuid_).reason(), Reason::BUDGET_EXCEEDED);
  sink_.thaw_view();
  send(1);
  EXPECT_EQ(settle().next_sequence, 2u);
}

// What a robot has announced is its own until it sends, whatever another robot of the fleet does meanwhile.
TEST_F(IntakeTest, AnAnnouncedSessionStaysItsRobots) {
  IntakeOptions options;
  options.max_sessions = 16;
  restart(options);
  const Sender cart{"cart"}, thief{"thief"};
  EXPECT_TRUE(intake_->claim(uuid_, now_, cart).ok());
  EXPECT_EQ(intake_->robot_of(uuid_), "cart");
  const auto gap = [&](const SessionUuid& session, const Sender& from) {
    return intake_->take_gap({session, 0, 5, Reason::DROPPED_BY_ROBOT}, now_, from);
  };
  for (int i = 0; i < 100; ++i) {
    now_ += milliseconds(1);
    EXPECT_TRUE(gap(SessionUuid::random(), thief).ok());
  }
  EXPECT_EQ(gap(uuid_, thief).reason(), Reason::NOT_ALLOWED) << "others made room for themselves";
  for (int s = 0; s < 100; ++s) {
    now_ += std::chrono::seconds(1);
    EXPECT_TRUE(intake_->claim(uuid_, now_, cart).ok());
    (void)intake_->poll(now_);
    ASSERT_EQ(intake_->claim(uuid_, now_, thief).reason(), Reason::NOT_ALLOWED) << "after " << s << " s";
  }
  now_ += std::chrono::seconds(61);
  (void)intake_->poll(now_);
  EXPECT_EQ(intake_->stats(now_).sessions, 0u) << "nobody announces it any more";
  EXPECT_EQ(intake_->robot_of(uuid_), "");
}

TEST_F(IntakeTest, TheFirstWhoProvesToBeItsRobotHasASessionThatHasNotBegun) {
  const Sender cart{"cart"}, thief{"thief"}, anyone{{}, true}, operators{};
  for (const Sender& unproved : {operators, anyone}) {
    uuid_ = SessionUuid::random();
    EXPECT_TRUE(intake_->take_gap({uuid_, 0, 5, Reason::DROPPED_BY_ROBOT}, now_, unproved).ok());
    EXPECT_EQ(intake_->robot_of(uuid_), "");
    EXPECT_TRUE(intake_->claim(uuid_, now_, cart).ok());
    EXPECT_EQ(intake_->robot_of(uuid_), "cart");
    EXPECT_EQ(intake_->claim(uuid_, now_, thief).reason(), Reason::NOT_ALLOWED);
  }
}

// What somebody else began is over before the robot's own begins: it is not taken for its beginning.
TEST_F(IntakeTest, WhatBeginsIsNotTakenForTheBeginningOfAnothers) {
  sink_.begin_slowly = true;
  const Sender cart{"cart"}, anyone{{}, true};
  const auto sends = [&](const std::string& robot, const Sender& from) {
    Keyframe k = keyframe(0);
    k.session.robot = robot;
    const Bytes payload = encode_keyframe(k);
    return intake_->take_payload(uuid_, 0, crc32c(payload), payload, now_, from);
  };
  EXPECT_TRUE(sends("bob", anyone).ok());
  EXPECT_TRUE(sends("cart", cart).ok());
  EXPECT_EQ(part_refused(Reason::BUDGET_EXCEEDED), 1u) << "until that has begun";
  sink_.let_begin();
  acknowledge();
  settle();
  EXPECT_EQ(sends("cart", cart).reason(), Reason::NOT_ALLOWED) << "it is bob's";
  const auto records = journalled<storage::KeyframeRecord>();
  ASSERT_EQ(records.size(), 1u);
  EXPECT_EQ(decode_keyframe(records[0].payload)->session.robot, "bob");
}

TEST_F(IntakeTest, NothingIsReadForARobotThatMayNotSendToTheSession) {
  send(0);
  settle();
  restart();
  const Sender thief{"thief"};
  const auto of_session = intake_->question(uuid_, 0, thief);
  ASSERT_TRUE(of_session);
  intake_->know(*of_session, answer(sink_, *of_session));
  EXPECT_FALSE(intake_->question(uuid_, 0, thief));
  EXPECT_TRUE(intake_->question(uuid_, 0, {keyframe(0).session.robot}));
}

}  // namespace
}  // namespace relmap::intake
