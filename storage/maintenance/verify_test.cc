#include "storage/maintenance/verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "storage/format/digest_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/maintenance/stored_hash.h"
#include "storage/maintenance/stored_sessions.h"
#include "storage/maintenance/testing/driven_map.h"
#include "storage/testing/digest_oracle.h"

namespace relmap::storage {
namespace {

using ::testing::IsEmpty;

class Verify : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    sound() = make_memory_engine();
    drive_map(sound());
  }
  static void TearDownTestSuite() { sound().reset(); }
  static std::shared_ptr<Engine>& sound() {
    static std::shared_ptr<Engine> engine;
    return engine;
  }

  // A copy of the sound map, to be changed by hand.
  void SetUp() override {
    engine = make_memory_engine();
    std::vector<Put> puts;
    ASSERT_TRUE(sound()
                    ->snapshot()
                    ->scan("",
                           [&](std::string_view key, ByteSpan value) {
                             puts.push_back({std::string(key), Bytes(value.begin(), value.end())});
                             return true;
                           })
                    .ok());
    const auto epoch = engine->acquire().or_throw();
    // Parts know the number of the commit that wrote them: there must have been as many.
    for (std::uint64_t n = 0; n < sound()->snapshot()->commit_number(); ++n)
      ASSERT_TRUE(engine->commit(epoch, sound()->applied_sequence(), puts, {}).ok());
  }
  template <typename Change>
  void change(Change edit) {
    const auto map = open_map(engine);
    edit(*map);
    ASSERT_TRUE(map->commit().ok());
  }
  Verified found() { return verified(*engine->snapshot()); }

  std::shared_ptr<Engine> engine;
};

TEST_F(Verify, NothingIsFoundInASoundMap) {
  const Verified sound = found();
  EXPECT_THAT(sound.findings, IsEmpty());
  EXPECT_TRUE(sound.summary.complete);
  EXPECT_EQ(sound.summary.sessions, 1u);
  EXPECT_EQ(sound.summary.frames, kDrivenFrames);
  EXPECT_EQ(sound.summary.features, kDrivenFeatures * kDrivenFrames);
  EXPECT_GT(sound.summary.edges, kDrivenFrames);
  EXPECT_GT(sound.summary.observations, sound.summary.landmarks);
  EXPECT_GT(open_map(engine)->state().closures_accepted, 0u);
}

// What a later version writes under keys of its own.
TEST_F(Verify, KeysOfALaterVersionAreNoFindings) {
  const std::vector<Put> puts{{"x", {1}}, {"zone/1", {2}}, {"\xff", {3}}};
  ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), puts, {}).ok());
  EXPECT_THAT(found().findings, IsEmpty());
  const MapHash hash = hash_map(*open_map(engine));
  EXPECT_EQ(hash, hash_map(*open_map(sound())));
  EXPECT_EQ(hash_stored(*engine->snapshot(), {}).or_throw(), hash);
}

TEST_F(Verify, TheHashOfWhatIsStoredIsThatOfTheMapAndNamesDamage) {
  const MapHash hash = hash_map(*open_map(engine));
  std::uint64_t last = 0;
  EXPECT_EQ(hash_stored(*engine->snapshot(),
                        [&](std::uint64_t done, std::uint64_t total) {
                          EXPECT_EQ(total, kDrivenFrames);
                          last = done;
                          return Status();
                        })
                .or_throw(),
            hash);
  EXPECT_GT(last, 100U);
  EXPECT_EQ(hash_stored(*engine->snapshot(), [](auto, auto) { return Status(Reason::DEADLINE, "stopped"); }).reason(),
            Reason::DEADLINE);
  for (const Part part : {Part::kHot, Part::kWarm, Part::kCold}) {
    const std::vector<Put> puts{{keys::frame(part, {map::kDriveSession, 149}), {1, 2, 3}}};
    ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), puts, {}).ok());
    EXPECT_EQ(hash_stored(*engine->snapshot(), {}).reason(), Reason::DATA_LOSS);
    SetUp();
  }
}

// A frame whose landmarks, edges and observations give every check something to find.
constexpr FrameId kFrame{map::kDriveSession, 130};

EdgeId some_closure(const Graph& graph) {
  for (std::uint32_t i = kDrivenLap; i < kDrivenFrames; ++i)
    for (const Edge& edge : graph.hot({map::kDriveSession, i})->edges)
      if (edge.kind == EdgeKind::kLoop && edge.state == EdgeState::kAccepted && !edge.consistent_with.empty())
        return edge.id;
  ADD_FAILURE() << "no closure agrees with another";
  return {};
}

struct HandMadeFault {
  std::string name;
  std::string found_as;
  std::function<void(Map&)> make;
  bool oracle = false;  // derived_differences() sees it too
};
void PrintTo(const HandMadeFault& fault, std::ostream* out) { *out << fault.name; }

std::vector<HandMadeFault> hand_made_faults() {
  const double nan = std::nan("");
  const auto edge = [](Map& map) -> Edge& { return *map.edit_hot(kFrame).edge({kFrame, 0}); };
  const auto closure = [](Map& map) -> Edge& {
    const EdgeId id = some_closure(map);
    return *map.edit_hot(id.frame).edge(id);
  };
  const auto landmark = [](Map& map) -> Landmark& {
    auto& all = map.edit_hot(kFrame).landmarks;
    return *std::find_if(all.begin(), all.end(), [](const Landmark& l) { return l.observers.size() > 1; });
  };
  const auto session = [](Map& map) -> Session& { return map.edit_session(map::kDriveSession); };
  return {
      {"IncomingLost", "incoming edges", [](Map& m) { m.edit_hot(kFrame).incoming.clear(); }, true},
      {"IncomingStray", "incoming edges",
       [](Map& m) {
         m.edit_hot(kFrame).incoming.push_back({kFrame, 7});
       },
       true},
      {"ObserverLost", "its observers", [=](Map& m) { landmark(m).observers.pop_back(); }, true},
      {"ObserverStray", "its observers",
       [=](Map& m) {
         landmark(m).observers.push_back({1, 149});
       },
       true},
      {"UnreachedStray", "unreached observers",
       [](Map& m) {
         m.edit_hot(kFrame).unreached.push_back({0, {1, 149}});
       },
       true},
      {"ObserversOutOfOrder", "its observers",
       [=](Map& m) { std::swap(landmark(m).observers.front(), landmark(m).observers.back()); }},
      {"Support", "support", [=](Map& m) { ++edge(m).support; }, true},
      {"SupportOfAClosure", "support", [=](Map& m) { closure(m).support += 3; }, true},
      {"Prior", "prior is", [=](Map& m) { edge(m).prior_active = !edge(m).prior_active; }, true},
      {"Bound", "it binds", [=](Map& m) { ++closure(m).bound; }},
      {"Consistent", "agrees with", [=](Map& m) { closure(m).consistent_with.pop_back(); }},
      {"CarrierStray", "closures carry it", [=](Map& m) { edge(m).carried_by.push_back(some_closure(m)); }, true},
      {"Mirror", "the rotation of", [=](Map& m) { edge(m).T_ab.R.col(0) *= -1; }},
      {"EdgeNan", "is not finite", [=](Map& m) { edge(m).prior_T_ab.t.x() = nan; }},
      {"Odometry", "odometry pose", [=](Map& m) { m.edit_hot(kFrame).T_odom_frame.R(1, 1) = 7; }},
      {"Indefinite", "covariance", [=](Map& m) { edge(m).prior_covariance(2, 2) = -1; }},
      {"LandmarkNan", "is not finite", [=](Map& m) { landmark(m).abr.x() = nan; }},
      {"LandmarkBehind", "inverse depth", [=](Map& m) { landmark(m).abr.z() = 0; }},
      {"ObservationNan", "observations are not finite", [=](Map& m) { m.edit_warm(kFrame).observations[0].v = NAN; }},
      {"ObservationOfNothing", "landmarks that are not there",
       [](Map& m) { m.edit_warm(kFrame).observations[0].landmark.slot = 9999; }},
      {"ObservationByNoClosure", "closures that are not there",
       [](Map& m) {
         m.edit_warm(kFrame).observations[0].origin = {kFrame, 99};
       }},
      {"ClaimToNoLandmark", "claims are to landmarks",
       [=](Map& m) {
         landmark(m).claims.push_back({{{1, 3}, 9999}, some_closure(m)});
       }},
      {"ClaimByNoClosure", "claims are by closures",
       [=](Map& m) {
         landmark(m).claims.push_back({{{1, 3}, 0}, {kFrame, 99}});
       }},
      {"ClaimToAYounger", "not older",
       [=](Map& m) {
         landmark(m).claims.push_back({{{1, 149}, 0}, some_closure(m)});
       }},
      {"EdgeToNothing", "is not there",
       [=](Map& m) {
         closure(m).a = {1, 4000};
       }},
      {"AppearanceCount", "features", [](Map& m) { ++m.edit_hot(kFrame).appearance_count; }},
      {"Features", "its record says", [=](Map& m) { ++session(m).frames; }},
      {"Last", "its record says", [=](Map& m) { --session(m).first_time_us, session(m).first = 1; }},
      {"NextSequence", "missing, and not recorded as skipped", [=](Map& m) { session(m).next_sequence += 5; }},
      {"SkippedTwice", "recorded as skipped",
       [=](Map& m) {
         m.skip(1, {20, 22, 0, false, Reason::DROPPED_BY_ROBOT});
       }},
      {"SkippedOutOfOrder", "not in order",
       [=](Map& m) {
         m.skip(1, {150, 156, 0, false, Reason::DROPPED_BY_ROBOT});
         m.skip(1, {155, 159, 0, false, Reason::DROPPED_BY_ROBOT});
         m.state().gaps = 12;
       }},
      {"SkippedAndExpected", "still expected",
       [=](Map& m) {
         m.skip(1, {150, 159, 0, false, Reason::DROPPED_BY_ROBOT});
         session(m).next_sequence = 155;
         m.state().gaps = 10;
       }},
      {"SkippedUncounted", "sequences refused",
       [=](Map& m) {
         m.skip(1, {150, 159, 0, true, Reason::CORRUPT});
         session(m).refused = 9;
       }},
      {"Pending", "waits for relaxation",
       [](Map& m) {
         m.state().pending.insert({1, 4000});
       }},
      {"Lookups", "waits for its lookup",
       [](Map& m) {
         m.state().lookups.insert({9, 1});
       }},
      {"Keyframes", "keyframes", [](Map& m) { ++m.state().keyframes; }},
      {"Accepted", "accepted closures", [](Map& m) { ++m.state().closures_accepted; }},
      {"Label", "not in the index", [](Map& m) { m.edit_hot(kFrame).labels = {"hall"}; }},
      {"LabelIndex", "does not have it",
       [](Map& m) {
         m.edit_hot({1, 7}).labels.clear();
       }},
  };
}

// Changes stored digests by hand, in a commit that says that they are right.
TEST_F(Verify, DigestsThatDoNotFollowFromTheFramesAreNamedAndMadeAnew) {
  const DigestsByChunk sound_digests = digests_of_frames(*open_map(engine)->view());
  const ChunkId first{1, 0}, second{1, 1}, last{1, 2}, none{1, 7};
  const auto record = [&](ChunkId id) { return *engine->snapshot()->get(keys::digests(id)).or_throw(); };
  ChunkDigest digests;
  ASSERT_TRUE(decode_digests(record(first), first, digests).ok());
  digests.frames.at(5).time_us += 1;
  digests.frames.erase(digests.frames.begin() + 9);
  Bytes damaged = record(second);
  damaged[40] ^= 1;
  MapState state = *load_sessions(*engine->snapshot()).state;
  ASSERT_EQ(state.digests_commit, engine->snapshot()->commit_number());
  ++state.digests_commit;
  ChunkDigest stray = digests;
  stray.id = none;
  const std::vector<Put> puts{{keys::digests(first), digest_bytes(digests)},
                              {keys::digests(second), damaged},
                              {keys::digests(none), digest_bytes(stray)},
                              {keys::map_state(), encode_state(state)}};
  const std::vector<std::string> deletes{keys::digests(last)};
  ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), puts, deletes).ok());

  const Verified broken = found();
  EXPECT_EQ(broken.findings.size(), 5u) << ::testing::PrintToString(broken.findings);
  for (const char* what : {"digest of frame 1:5:", "digest of frame 1:9:", "digests of chunk 1:1: CORRUPT",
                           "digests of chunk 1:2: missing", "digests of chunk 1:7: there is no such chunk"})
    EXPECT_TRUE(broken.names(what)) << what << " in " << ::testing::PrintToString(broken.findings);
  std::vector<std::string> told;
  const auto repaired =
      repair(engine, "/nonexistent", {}, [&](const Finding& finding) { told.push_back(finding.what); }, {});
  ASSERT_TRUE(repaired.ok()) << repaired.status().to_string();
  EXPECT_TRUE(repaired->changed);
  EXPECT_EQ(repaired->rebuilt, 5u);
  EXPECT_EQ(repaired->remaining, 0u);
  EXPECT_EQ(told, broken.findings);
  EXPECT_THAT(found().findings, IsEmpty());
  EXPECT_TRUE(open_map(engine)->digests_hold());
  EXPECT_EQ(digests_visited(*open_map(engine)->view()), sound_digests);
}

TEST_F(Verify, DigestsOfAnEarlierCommitAreNoFinding) {
  const std::vector<std::string> deletes{keys::digests({1, 0})};
  ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), {}, deletes).ok());
  EXPECT_THAT(found().findings, IsEmpty());
}

class VerifyFault : public Verify, public ::testing::WithParamInterface<HandMadeFault> {};

TEST_P(VerifyFault, IsNamedAndRepaired) {
  change(GetParam().make);
  const Verified broken = found();
  EXPECT_TRUE(broken.names(GetParam().found_as)) << ::testing::PrintToString(broken.findings);
  if (GetParam().oracle) {
    EXPECT_FALSE(map::derived_differences(*open_map(engine)->view()).empty());
  }

  const auto repaired = repair(engine, "/nonexistent", {}, {}, {});
  ASSERT_TRUE(repaired.ok()) << repaired.status().to_string();
  EXPECT_TRUE(repaired->changed);
  EXPECT_EQ(repaired->remaining, 0u);
  EXPECT_THAT(found().findings, IsEmpty());
  EXPECT_THAT(map::derived_differences(*open_map(engine)->view()), IsEmpty());
  EXPECT_TRUE(open_map(engine)->digests_hold());
  EXPECT_EQ(digests_visited(*open_map(engine)->view()), digests_of_frames(*open_map(engine)));
  if (GetParam().oracle) {
    EXPECT_EQ(hash_map(*open_map(engine)), hash_map(*open_map(sound())));
  }
}

INSTANTIATE_TEST_SUITE_P(ByHand, VerifyFault, ::testing::ValuesIn(hand_made_faults()),
                         [](const auto& fault) { return fault.param.name; });

TEST_F(Verify, ThatALandmarkIsNotNeededIsAFactThatRepairKeeps) {
  const auto claims = [](const Map& map) {
    const auto hot = map.hot(kFrame);
    return std::count_if(hot->landmarks[0].claims.begin(), hot->landmarks[0].claims.end(),
                         [](const AliasClaim& claim) { return !claim.target.valid(); });
  };
  change([](Map& map) {
    ClosureId closure;
    for (std::uint32_t i = 1; i < kDrivenFrames && !closure.valid(); ++i)
      for (const Edge& edge : map.hot({1, i})->edges)
        if (edge.kind == EdgeKind::kLoop && edge.state == EdgeState::kAccepted) closure = edge.id;
    ASSERT_TRUE(closure.valid());
    auto& of_landmark = map.edit_hot(kFrame).landmarks[0].claims;
    of_landmark.insert(of_landmark.begin(), {{}, closure});
  });
  EXPECT_FALSE(found().names("claims are to")) << "what follows from it is not in step yet";
  const auto repaired = repair(engine, "/nonexistent", {}, {}, {});
  ASSERT_TRUE(repaired.ok()) << repaired.status().to_string();
  EXPECT_EQ(repaired->remaining, 0u);
  EXPECT_EQ(claims(*open_map(engine)), 1);
  EXPECT_THAT(map::derived_differences(*open_map(engine)->view()), IsEmpty());
}

TEST_F(Verify, CarriedByFollowsFromTheClosuresAndIsRebuilt) {
  EdgeId closure;
  change([&](Map& map) {
    closure = some_closure(map);
    map.edit_hot(closure.frame).edge(closure)->carried = {map::kDriveSession, 20, 22};
  });
  EXPECT_TRUE(found().names("closures carry it"));
  ASSERT_EQ(repair(engine, "/nonexistent", {}, {}, {}).or_throw().remaining, 0u);
  const auto map = open_map(engine);
  for (const std::uint32_t index : {21, 22})
    EXPECT_THAT(map->hot({map::kDriveSession, index})->edges.front().carried_by, ::testing::ElementsAre(closure))
        << index;
  EXPECT_THAT(map::derived_differences(*map->view()), IsEmpty());
}

TEST_F(Verify, AgreesWithTheOracleOnManyFaultsAtOnce) {
  std::mt19937 rng(5);
  for (int round = 0; round < 20; ++round) {
    change([&](Map& map) {
      for (int i = 0; i < 3; ++i) {
        FrameHot& frame = map.edit_hot({1, 1 + static_cast<std::uint32_t>(rng() % (kDrivenFrames - 1))});
        Landmark& landmark = frame.landmarks[rng() % frame.landmarks.size()];
        switch (rng() % 4) {
          case 0:
            frame.incoming.clear();
            break;
          case 1:
            landmark.observers.clear();
            break;
          case 2:
            landmark.observers = {{1, 100}, {1, 120}};
            break;
          default:
            frame.edges[0].support += 1 + static_cast<std::uint32_t>(rng() % 30);
        }
      }
    });
    const auto oracle = map::derived_differences(*open_map(engine)->view());
    const Verified broken = found();
    EXPECT_EQ(broken.findings.empty(), oracle.empty());
    // What the oracle calls wrong is named here too: "KIND of frame|landmark|edge ITEM[: ...]".
    for (const std::string& line : oracle) {
      if (line.starts_with("prior")) continue;  // follows from the support, and is told with it
      const std::size_t item = line.find(' ', line.find(" of ") + 4) + 1;
      EXPECT_TRUE(broken.names(line.substr(item, line.find(": ", item) - item))) << line;
    }
    ASSERT_EQ(repair(engine, "/nonexistent", {}, {}, {}).or_throw().remaining, 0u);
    ASSERT_EQ(hash_map(*open_map(engine)), hash_map(*open_map(sound())));
  }
}

TEST_F(Verify, HoldsNoMoreMemoryThanItMay) {
  VerifyOptions tight;
  tight.memory_bytes = std::size_t{1} << 20;
  EXPECT_THAT(verified(*engine->snapshot(), tight).findings, IsEmpty());
  change([](Map& map) {
    for (std::uint32_t i = 0; i < kDrivenFrames; ++i) map.edit_hot({1, i}).landmarks[0].observers = {{1, 100}};
  });
  const Verified broken = verified(*engine->snapshot(), tight);
  EXPECT_LE(broken.summary.peak_bytes, tight.memory_bytes);
  EXPECT_EQ(broken.findings, found().findings);
}

TEST(VerifyBesideOthers, TakesHalfOfItsShareAtMost) {
  VerifyOptions asked;
  asked.sessions = {2, 3};
  const Budget small(std::size_t{64} << 20), large(std::size_t{64} << 30);
  ASSERT_LT(small.allowance(Share::kReplies), asked.memory_bytes);
  const VerifyOptions tight = beside_others(asked, small, Share::kReplies);
  EXPECT_EQ(tight.memory_bytes, small.allowance(Share::kReplies) / 2);
  EXPECT_EQ(tight.sessions, asked.sessions);
  EXPECT_EQ(beside_others(asked, small, Share::kEngine).memory_bytes, small.allowance(Share::kEngine) / 2);
  EXPECT_EQ(beside_others(asked, large, Share::kReplies).memory_bytes, asked.memory_bytes) << "no more than asked for";
}

TEST_F(Verify, StopsWhenToldTo) {
  std::uint64_t calls = 0;
  const auto summary = verify(*engine->snapshot(), {}, {}, [&](const MaintenanceProgress& progress) {
    EXPECT_EQ(progress.total, kDrivenFrames);
    return ++calls < 2;
  });
  EXPECT_EQ(calls, 2u);
  EXPECT_FALSE(summary.value().complete);
}

TEST_F(Verify, OfOneSessionNamesNothingOfAnother) {
  change([](Map& map) { ++map.edit_hot(kFrame).edges[0].support; });
  VerifyOptions options;
  options.sessions = {2};
  EXPECT_THAT(verified(*engine->snapshot(), options).findings, IsEmpty());
  options.sessions = {map::kDriveSession};
  EXPECT_EQ(verified(*engine->snapshot(), options).findings.size(), 1u);
}

TEST(VerifyJournal, NamesRecordsThatCannotBeDecoded) {
  const auto engine = make_memory_engine();
  const auto epoch = engine->acquire().or_throw();
  std::vector<Bytes> records(3, encode_record(IdleWorkRecord{1}, 0));
  records[1].back() ^= 1;
  ASSERT_TRUE(engine->append(epoch, records).ok());
  std::vector<std::string> findings;
  const auto summary =
      verify_journal(*engine, [&](const Finding& finding) { findings.push_back(finding.what); }, {}).or_throw();
  EXPECT_EQ(summary.journal_records, 3u);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_THAT(findings[0], ::testing::HasSubstr("journal record 2"));
}

}  // namespace
}  // namespace relmap::storage
