// What the log of events tells of records, and that it tells all that the map is. deletion_test.cc follows it while
// sessions are deleted.
#include "server/map/event_teller.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "server/map/deletion.h"
#include "server/map/edge_edit.h"
#include "server/map/testing/two_laps.h"
#include "storage/events/event_block.h"
#include "storage/maintenance/verify.h"
#include "storage/testing/event_follower.h"
#include "storage/testing/fault_engine.h"
#include "storage/testing/forgetful_files.h"

namespace relmap::map {
namespace {

using storage::Event;

constexpr std::int64_t kTime = 1'700'000'000'000'000;

storage::Submission by(const std::string& author) { return {kTime, author}; }

// The bytes of the events that records brought about, without those of commits.
Bytes bytes_of(const std::vector<Event>& events) {
  storage::EventBlock block;
  for (const Event& event : events)
    if (event.at.ordinal != storage::kMovedOrdinal) block.add(event);
  return block.events.take();
}

class Telling : public TwoLaps {
 protected:
  std::shared_ptr<const storage::EngineSnapshot> committed() {
    EXPECT_TRUE(drive_.map().commit().ok());
    return drive_.map().view()->committed();
  }
  // The events since the last call.
  std::vector<Event> told() {
    const std::size_t before = follower_.events().size();
    follower_.follow(*committed());
    return {follower_.events().begin() + static_cast<std::ptrdiff_t>(before), follower_.events().end()};
  }
  template <typename Content>
  static std::vector<Content> all_of(const std::vector<Event>& events) {
    std::vector<Content> found;
    for (const Event& event : events)
      if (const auto* content = std::get_if<Content>(&event.content)) found.push_back(*content);
    return found;
  }
  void expect_told_all() { EXPECT_EQ(follower_.map(), storage::ToldMap::of(drive_.map())); }

  storage::EventFollower follower_;
};

TEST_F(Telling, FramesComeWithTheirMotionAndThoseThatMoveLater) {
  const std::vector<Event> events = told();
  expect_told_all();
  const auto frames = all_of<storage::FrameAddedEvent>(events);
  ASSERT_EQ(frames.size(), 90u);
  EXPECT_FALSE(frames[0].T_previous_frame);
  for (std::uint32_t i = 1; i < 90; ++i) {
    ASSERT_TRUE(frames[i].T_previous_frame);
    const SE3 error =
        frames[i].T_previous_frame->inverse() * world_.T_world_frame(i - 1).inverse() * world_.T_world_frame(i);
    if (i != kBlind) {
      EXPECT_LT(error.t.norm(), 0.5) << i;
    }
  }
  EXPECT_EQ(frames[kBlind].source, MotionSource::kUnsensed);
  EXPECT_TRUE(all_of<storage::FramesMovedEvent>(events).empty()) << "all were added in the same commit";
  propose(62);
  propose(64);
  const auto moved = all_of<storage::FramesMovedEvent>(told());
  ASSERT_EQ(moved.size(), 1u);
  EXPECT_TRUE(storage::within({kDriveSession, 64}, moved[0].ranges) ||
              storage::within({kDriveSession, 63}, moved[0].ranges));
}

TEST_F(Telling, ClosuresAreToldWheneverTheirStateOrReasonChanges) {
  (void)told();
  propose(62);
  auto changes = all_of<storage::ClosureEvent>(told());
  ASSERT_EQ(changes.size(), 1u);
  EXPECT_EQ(changes[0].state, storage::EdgeState::kCandidate);
  EXPECT_EQ(changes[0].a, (FrameId{kDriveSession, 2}));
  propose(64);
  changes = all_of<storage::ClosureEvent>(told());
  ASSERT_EQ(changes.size(), 2u) << "the first comes into force with the second";
  for (const storage::ClosureEvent& change : changes) EXPECT_EQ(change.state, storage::EdgeState::kAccepted);
  EXPECT_TRUE(changes[0].carries || changes[1].carries);
  propose_wrongly(66);
  storage::SetEdgeStateRecord removal = edit_record(closure(62).id, EdgeAction::kRemove, "a mirror");
  removal.submitted = by("ann");
  drive_.apply(removal);
  const auto events = told();
  for (const Event& event : events) {
    if (event.at.sequence + 1 == drive_.map().state().applied_sequence || event.at.ordinal == storage::kMovedOrdinal)
      continue;
    EXPECT_EQ(event.submitted, by("ann"));
    EXPECT_EQ(event.note, "a mirror");
  }
  EXPECT_GE(all_of<storage::ClosureEvent>(events).size(), 2u);
  expect_told_all();
}

TEST_F(Telling, LabelsSessionsGapsAndRefusals) {
  (void)told();
  const FrameId frame{kDriveSession, 7};
  const auto label = [&](const std::string& name, bool present, const std::string& author) {
    storage::SetLabelRecord edit{frame, name, present};
    edit.submitted = by(author);
    drive_.apply(edit);
  };
  label("kitchen", true, "ann");
  label("kitchen", true, "ann");
  label("dock", true, "bob");
  label("kitchen", false, "bob");
  drive_.apply(storage::GapRecord{kDriveSession, 90, 94, Reason::DROPPED_BY_ROBOT});
  drive_.apply(storage::GapRecord{kDriveSession, 90, 94, Reason::DROPPED_BY_ROBOT});
  drive_.apply(storage::RefusalRecord{kDriveSession, 95, 17, Reason::CORRUPT});
  drive_.apply(storage::SetSessionStateRecord{kDriveSession, storage::SessionState::kFrozen});
  const auto events = told();
  expect_told_all();
  const auto labels = all_of<storage::LabelsEvent>(events);
  ASSERT_EQ(labels.size(), 3u) << "a label that is there already is no event";
  EXPECT_THAT(labels[1].labels, ::testing::ElementsAre("dock", "kitchen"));
  EXPECT_THAT(labels[2].labels, ::testing::ElementsAre("dock"));
  EXPECT_EQ(events[2].submitted, by("bob"));
  const auto skipped = all_of<storage::SkippedEvent>(events);
  ASSERT_EQ(skipped.size(), 2u);
  EXPECT_EQ(skipped[0].skipped, (storage::Skipped{90, 94, 0, false, Reason::DROPPED_BY_ROBOT}));
  EXPECT_EQ(skipped[1].skipped, (storage::Skipped{95, 95, 17, true, Reason::CORRUPT}));
  ASSERT_EQ(all_of<storage::SessionEvent>(events).size(), 1u);
  EXPECT_EQ(all_of<storage::SessionEvent>(events)[0].state, storage::SessionState::kFrozen);

  drive_.apply(storage::SetSessionStateRecord{kDriveSession, storage::SessionState::kOpen});
  drive_.apply(storage::SetSessionStateRecord{kDriveSession, storage::SessionState::kEnded});
  drive_.apply(storage::SetSessionStateRecord{kDriveSession, storage::SessionState::kEnded});
  EXPECT_EQ(all_of<storage::SessionEvent>(told()).size(), 2u);
  expect_told_all();
}

TEST_F(Telling, TheHistoryOfAClosureSaysWhenAndByWhomAndTheHashDoesNot) {
  storage::ClosureProposalRecord first = *true_closure(drive_.map(), world_, 62, kLap);
  first.submitted = {kTime, ""};
  drive_.apply(first);
  propose(64);
  const storage::MapHash anonymous = storage::hash_map(drive_.map());
  ASSERT_EQ(closure(62).history.size(), 2u);
  EXPECT_EQ(closure(62).history[0].time_us, kTime);
  EXPECT_EQ(closure(62).history[1].time_us, 0) << "the other proposal did not say when";
  storage::Edge& edge = *drive_.map().edit_hot({kDriveSession, 62}).edge(closure(62).id);
  edge.history[1].author = "ann";
  edge.history[1].time_us = kTime + 5;
  drive_.map().publish();
  EXPECT_EQ(storage::hash_map(drive_.map()), anonymous);
  const auto snapshot = committed();
  EXPECT_TRUE(storage::verify(*snapshot, {}, {}, {}).or_throw().findings == 0);
  EXPECT_EQ(closure(62).history[0].time_us, kTime) << "as it was read from disk";
  EXPECT_EQ(closure(62).history[1].author, "ann");
  EXPECT_EQ(closure(62).history[1].time_us, kTime + 5);
}

TEST_F(Telling, WhoDeletesASessionIsToldWithAllThatGoes) {
  for (const std::uint32_t query : {62u, 64u}) propose(query);
  (void)told();
  const storage::MapHash hash = [&] {
    drive_.apply(storage::SetSessionStateRecord{kDriveSession, storage::SessionState::kDeleting, {}, {}, by("ann")});
    return storage::hash_map(drive_.map());
  }();
  EXPECT_EQ(drive_.map().session(kDriveSession)->deleted_by, "ann");
  drive_.map().edit_session(kDriveSession).deleted_by = "somebody else";
  drive_.map().publish();
  EXPECT_EQ(storage::hash_map(drive_.map()), hash) << "it is not part of what the map is";
  drive_.map().edit_session(kDriveSession).deleted_by = "ann";
  drive_.map().publish();
  (void)told();
  while (auto next = next_deletion(*drive_.map().session(kDriveSession))) {
    EXPECT_EQ(next->submitted, (storage::Submission{0, "ann"}));
    next->submitted.time_us = kTime;
    drive_.apply(*next);
    if (const auto session = drive_.map().session(kDriveSession); !storage::is_deleted(*session)) {
      EXPECT_EQ(session->deleted_by, "ann");
    }
  }
  EXPECT_EQ(drive_.map().session(kDriveSession)->deleted_by, "") << "nothing is left to be told";
  const auto events = told();
  expect_told_all();
  EXPECT_EQ(all_of<storage::SessionDeletedEvent>(events).size(), 1u);
  EXPECT_GE(all_of<storage::FramesRemovedEvent>(events).size(), 2u);
  EXPECT_GE(all_of<storage::ClosureRemovedEvent>(events).size(), 2u);
  for (const Event& event : events)
    if (event.at.ordinal != storage::kMovedOrdinal) {
      EXPECT_EQ(event.submitted, by("ann"));
    }
}

// A map over a disk that loses power. The journal, which a test keeps itself, is applied again from the last commit.
TEST_F(Telling, ACrashAnywhereTellsTheSame) {
  for (const std::uint32_t query : {62u, 64u, 66u}) propose(query);
  propose_wrongly(70);
  storage::SetEdgeStateRecord removal = edit_record(closure(62).id, EdgeAction::kRemove, "a mirror");
  removal.submitted = by("ann");
  drive_.apply(removal);
  drive_.apply(storage::SetLabelRecord{{kDriveSession, 7}, "kitchen", true});
  drive_.apply(storage::IdleWorkRecord{5000});
  const Bytes undisturbed = [&] {
    (void)told();
    return bytes_of(follower_.events());
  }();
  const std::vector<storage::JournalRecord> journal = drive_.journal();

  const auto disk = storage::ForgetfulFiles::create(5);
  const auto faults = std::make_shared<storage::Faults>();
  auto engine = storage::open_fault_engine(disk, faults).or_throw();
  auto again = std::make_unique<PointsDrive>(engine);
  std::size_t next = 0;
  for (std::size_t r = 0; r < journal.size(); ++r) {
    again->apply(journal[r]);
    if (r % 7 == 3) {
      if (r % 3 == 0) faults->commits = 1;
      const bool written = again->map().commit().ok();
      EXPECT_EQ(written, r % 3 != 0);
      if (written) next = r + 1;
    }
    if (r % 11 != 10) continue;
    again.reset();
    engine.reset();
    disk->restart();
    engine = storage::open_fault_engine(disk, faults).or_throw();
    again = std::make_unique<PointsDrive>(engine);
    ASSERT_EQ(again->map().state().applied_sequence, next);
    for (std::size_t lost = next; lost <= r; ++lost) again->apply(journal[lost]);
  }
  ASSERT_TRUE(again->map().commit().ok());
  storage::EventFollower follower;
  follower.follow(*engine->snapshot());
  EXPECT_EQ(bytes_of(follower.events()), undisturbed);
  EXPECT_EQ(follower.map(), storage::ToldMap::of(drive_.map()));
  EXPECT_EQ(follower.map(), storage::ToldMap::of(again->map()));
}

}  // namespace
}  // namespace relmap::map
