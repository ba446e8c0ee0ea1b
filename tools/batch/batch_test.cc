// Batches of shell scripts that stand in for front-ends.
#include "tools/batch/batch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "proto/base/names.h"
#include "tools/batch/again.h"
#include "tools/batch/batch_progress.h"
#include "tools/batch/batch_report.h"

namespace relmap::batch {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

class BatchTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "relmap_batch_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    options_.program = path("front-end");
    options_.server = "127.0.0.1:1";
    options_.summaries = path("summaries");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  // A front-end whose recording stands in $path.
  void write_front_end(const std::string& body) {
    std::ofstream(path("front-end")) << "#!/bin/sh\npath=$3\n" << body;
    std::filesystem::permissions(path("front-end"), std::filesystem::perms::owner_all);
  }
  std::vector<Sequence> recordings(const std::vector<std::string>& names) {
    std::vector<std::string> paths;
    for (const std::string& name : names) {
      std::filesystem::create_directories(path(name));
      paths.push_back(path(name));
    }
    return sequences_of(paths, options_.recordings, {}).or_throw();
  }
  bool run(
      Batch& batch, const std::function<bool()>& stop = [] { return false; }) {
    return batch.run(stop, [](const auto&) {});
  }

  std::string folder_;
  BatchOptions options_;
};

const std::string kDone =
    "echo '{\"pairs\": 5, \"of\": 10, \"keyframes\": 2, \"settled\": 1}'\n"
    "echo '{\"pairs\": 10, \"lost\": 1, \"keyframes\": 4, \"metric_share\": 0.750, \"refused\": {\"BAD_TRACK\": 2}, "
    "\"unreadable\": {\"NOT_A_PICTURE\": 1}}'\n";

TEST_F(BatchTest, NamesAndUuidsDependOnTheRecordingAlone) {
  const auto sequences = recordings({"a/06", "b/06", "c/07"});
  EXPECT_EQ(sequences[0].session, "a/06");
  EXPECT_EQ(recordings({"c/07"})[0].session, "c/07");
  EXPECT_EQ(recordings({"c/07"})[0].uuid, sequences[2].uuid);
  const std::string umlauts = recordings({"c/" + std::string(63, 'x') + "äöü"})[0].session;
  EXPECT_TRUE(check_name("session", umlauts).ok()) << umlauts;
  EXPECT_TRUE(umlauts.ends_with("xäöü"));
  EXPECT_NE(sequences[0].uuid, sequences[1].uuid);
  RecordingOptions other = options_.recordings;
  other.robot = kUsualRobot;
  other.source = "kitti";
  EXPECT_EQ(uuid_of(sequences[0], other), sequences[0].uuid) << "said or not";
  other.robot = "another";
  EXPECT_NE(uuid_of(sequences[0], other), sequences[0].uuid);
  other.again = true;
  EXPECT_NE(sequences_of({path("c/07")}, other, {})->at(0).uuid, sequences_of({path("c/07")}, other, {})->at(0).uuid);
  EXPECT_EQ(sequences_of({path("c/07"), path("c/../c/07")}, {}, {}).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(BatchTest, APathThatIsNotThereFailsAndTheOthersGoOn) {
  write_front_end("echo $path >> " + path("begun") + "\n" + kDone);
  std::ofstream(path("broken.log")) << "\xed\xa1\xda\x01";
  std::filesystem::create_directories(path("good"));
  const auto list = [](const std::string&) -> Result<std::vector<LoggedSession>> {
    return {Reason::CORRUPT, "no log"};
  };
  const std::vector<std::string> paths{path("nowhere"), path("broken.log"), path("good")};
  Batch batch(options_, sequences_of(paths, {}, {.log = list}).or_throw(), {});
  EXPECT_TRUE(run(batch));
  EXPECT_EQ(batch.tasks()[0].failure.reason(), Reason::NO_SUCH_FILE);
  EXPECT_THAT(batch.tasks()[0].failure.message(), HasSubstr("nowhere"));
  EXPECT_EQ(batch.tasks()[1].failure.reason(), Reason::CORRUPT);
  EXPECT_EQ(batch.tasks()[2].stage, Stage::kDone);
  EXPECT_EQ(batch.tasks()[0].starts + batch.tasks()[1].starts, 0);
}

TEST_F(BatchTest, ALogGivesASessionForEachThatWasRecorded) {
  std::ofstream(path("lcmlog-2026-11-21.00")) << "\xed\xa1\xda\x01 and so on";
  const auto list = [](const std::string&) -> Result<std::vector<LoggedSession>> {
    return std::vector<LoggedSession>{{*SessionUuid::parse("11111111-2222-3333-4444-555555555555"), "morning", 0, 9},
                                      {*SessionUuid::parse("21111111-2222-3333-4444-555555555555"), "noon", 0, 99}};
  };
  const auto sequences = sequences_of({path("lcmlog-2026-11-21.00")}, {}, {.log = list}).or_throw();
  ASSERT_EQ(sequences.size(), 2u);
  EXPECT_EQ(sequences[1].session, "noon");
  EXPECT_EQ(sequences[1].uuid.to_string(), "21111111-2222-3333-4444-555555555555");
  Batch batch(options_, sequences, {});
  const std::vector<std::string> command = batch.command(sequences[1]);
  EXPECT_THAT(command, Contains("--as-recorded"));
  EXPECT_THAT(command, Contains(sequences[1].recorded));
  EXPECT_EQ(std::count(command.begin(), command.end(), "--uuid"), 0) << "the one of the recording";
}

TEST_F(BatchTest, PhotographsOfSeveralCamerasGiveASessionForEach) {
  std::filesystem::create_directories(path("a/photos"));
  RecordingOptions mono = options_.recordings;
  mono.mono = true;
  const auto two = [](const std::string&, const RecordingOptions&) -> Result<PhotographFolder> {
    return PhotographFolder{{{"640x480", 11}, {"4000x3000-26mm", 12}}, {"north"}, {"x.heic"}};
  };
  const auto one = [](const std::string&, const RecordingOptions&) -> Result<PhotographFolder> {
    return PhotographFolder{{{"640x480", 11}}};
  };
  const auto sequences = sequences_of({path("a/photos")}, mono, {.photographs = two}).or_throw();
  ASSERT_EQ(sequences.size(), 2u);
  EXPECT_EQ(sequences[1].session, "a/photos 4000x3000-26mm");
  EXPECT_THAT(sequences[1].folders_passed_over, ElementsAre("north"));
  EXPECT_THAT(sequences[1].files_passed_over, ElementsAre("x.heic"));
  EXPECT_NE(sequences[0].uuid, sequences[1].uuid);
  options_.recordings = mono;
  EXPECT_THAT(Batch(options_, sequences, {}).command(sequences[1]), Contains("4000x3000-26mm"));
  const auto before = sequences_of({path("a/photos")}, mono, {.photographs = one}).or_throw();
  ASSERT_EQ(before.size(), 1u);
  EXPECT_EQ(before[0].session, "a/photos");
  EXPECT_EQ(before[0].uuid, sequences[0].uuid) << "before pictures of another camera were put beside them";
  const auto none = [](const std::string&, const RecordingOptions&) -> Result<PhotographFolder> {
    return {Reason::NO_SUCH_FILE, "no picture"};
  };
  EXPECT_EQ(sequences_of({path("a/photos")}, mono, {.photographs = none})->size(), 1u) << "its front-end says why";
}

TEST_F(BatchTest, AddedPhotographsAreNotCountedAsInTheMap) {
  write_front_end(kDone);  // takes ten pictures in and cannot read another
  auto sequences = recordings({"1", "2"});
  for (Sequence& sequence : sequences) sequence.pictures = 11;
  Batch first(options_, sequences, {});
  run(first);
  std::vector<client::Session> known(2);
  for (std::size_t i = 0; i < 2; ++i) {
    known[i].uuid = sequences[i].uuid.to_string();
    known[i].state = client::SessionState::kEnded;
    known[i].number = static_cast<std::uint32_t>(i + 1);
  }
  sequences[1].pictures = 12;
  Batch batch(options_, sequences, known);
  run(batch);
  EXPECT_EQ(batch.tasks()[0].stage, Stage::kWasThere);
  EXPECT_EQ(batch.tasks()[1].stage, Stage::kFailed);
  EXPECT_EQ(batch.tasks()[1].failure.reason(), Reason::SEQUENCE_CONFLICT);
  EXPECT_THAT(batch.tasks()[1].failure.message(),
              AllOf(HasSubstr("session 2"), HasSubstr("11 pictures"), HasSubstr("12 now"), HasSubstr("--again")));
}

RecordingIdentity drive(std::uint64_t pairs) {
  return {"pairs from 5 us on, the first picture of checksum 0a", pairs, "c" + std::to_string(pairs),
          "focal length 100 px"};
}

TEST(RecordingIdentity, ChangesAreDescribed) {
  EXPECT_EQ(change_text(drive(10), drive(10), false), "");
  EXPECT_EQ(change_text(drive(1200), drive(1500), false), "is made of 1,200 pairs, and there are 1,500 now");
  EXPECT_EQ(change_text(drive(12), drive(1), true), "is made of 12 pictures, and there is 1 now");
  RecordingIdentity other = drive(51);
  other.fingerprint = "pairs from 7 us on";
  EXPECT_EQ(change_text(drive(1200), other, false),
            "is made of another recording of 1,200 pairs than the one of 51 that is there now");
  EXPECT_EQ(change_text(drive(1200), other, true), "is made of 1,200 pictures, and there are 51 now")
      << "a photograph that was put before all others";
  RecordingIdentity exchanged = drive(12);
  exchanged.contents = "d";
  EXPECT_EQ(change_text(drive(12), exchanged, false),
            "is made of 12 pairs, some of which are others now (by name, size or time)");
  RecordingIdentity corrected = drive(13);
  corrected.calibration = "focal length 101 px";
  EXPECT_EQ(
      change_text(drive(12), corrected, false),
      "is made of 12 pairs, and there are 13 now, and is made with another calibration (focal length 100 px) than "
      "the one that is there now (focal length 101 px)");
  RecordingIdentity keyframes{"keyframes of session 1", 5, "c", ""}, more{"keyframes of session 1", 6, "d", ""};
  EXPECT_EQ(change_text(keyframes, more, false), "is made of 5 keyframes, and there are 6 now");
}

class ChangedRecording : public BatchTest {
 protected:
  void SetUp() override {
    BatchTest::SetUp();
    sequences_ = recordings({"1"});
    sequences_[0].recording = drive(10);
    write_front_end(kDrive);
  }
  client::Session session(client::SessionState state) const {
    client::Session session;
    session.uuid = sequences_[0].uuid.to_string();
    session.state = state;
    session.number = 4;
    session.frames = 4;
    return session;
  }
  // Once more, with what the map has by then.
  Task later(client::SessionState state) {
    Batch batch(options_, sequences_, {session(state)});
    run(batch);
    EXPECT_TRUE(batch.not_kept().ok()) << batch.not_kept().to_string();
    return batch.tasks()[0];
  }
  void take_in() {
    Batch batch(options_, sequences_, {});
    run(batch);
    EXPECT_EQ(batch.tasks()[0].stage, Stage::kDone) << batch.tasks()[0].failure.to_string();
  }
  void expect_refused(const Task& task, const std::string& why) const {
    EXPECT_EQ(task.stage, Stage::kFailed);
    EXPECT_EQ(task.starts, 0);
    EXPECT_EQ(task.failure.reason(), Reason::SEQUENCE_CONFLICT);
    EXPECT_THAT(task.failure.message(),
                AllOf(HasSubstr("session 4 " + why), HasSubstr("--again"), HasSubstr("relmap session delete 4")));
  }

  // As it says what drive(10) is.
  const std::string kDrive =
      "echo '{\"pairs\": 10, \"keyframes\": 4, \"metric_share\": 1, \"recording\": {\"fingerprint\": \"pairs from 5 us "
      "on, the first picture of checksum 0a\", \"count\": 10, \"contents\": \"c10\", \"calibration\": \"focal length "
      "100 "
      "px\"}}'\n";
  std::vector<Sequence> sequences_;
};

TEST_F(ChangedRecording, IsRefusedWhateverBecameOfItsSession) {
  take_in();
  using State = client::SessionState;
  for (const State state : {State::kEnded, State::kFrozen}) EXPECT_EQ(later(state).stage, Stage::kWasThere);
  sequences_[0].recording = drive(15);
  for (const State state : {State::kOpen, State::kEnded, State::kFrozen})
    expect_refused(later(state), "is made of 10 pairs, and there are 15 now");
  sequences_[0].recording = drive(7);
  expect_refused(later(State::kEnded), "is made of 10 pairs, and there are 7 now");
  sequences_[0].recording = drive(10);
  sequences_[0].recording->calibration = "corrected";
  expect_refused(later(State::kEnded), "is made with another calibration");
  sequences_[0].recording = drive(10);
  EXPECT_EQ(later(State::kEnded).stage, Stage::kWasThere) << "put back";
}

TEST_F(ChangedRecording, IsRefusedThoughItsSessionWasInterrupted) {
  write_front_end("kill -9 $$\n");
  Batch broken(options_, sequences_, {});
  run(broken);
  ASSERT_EQ(broken.tasks()[0].stage, Stage::kFailed);
  write_front_end(kDrive);
  // Unchanged it goes on, and what it is made of is not forgotten meanwhile.
  sequences_[0].recording = drive(15);
  expect_refused(later(client::SessionState::kOpen), "is made of 10 pairs, and there are 15 now");
  sequences_[0].recording = drive(10);
  EXPECT_EQ(later(client::SessionState::kOpen).stage, Stage::kDone);
  // In a map that has nothing of it, it begins with what it is.
  sequences_[0].recording = drive(15);
  Batch batch(options_, sequences_, {});
  run(batch);
  EXPECT_EQ(batch.tasks()[0].stage, Stage::kDone);
}

TEST_F(ChangedRecording, OfASessionOfAnOlderVersionIsNoticedByTheDaemonAlone) {
  write_front_end("kill -9 $$\n");
  EXPECT_EQ(later(client::SessionState::kOpen).stage, Stage::kFailed);
  write_front_end(kDrive);
  sequences_[0].recording = drive(15);
  EXPECT_EQ(later(client::SessionState::kOpen).stage, Stage::kDone);
}

TEST_F(ChangedRecording, ThatCannotBeReadIsNotCountedAsInTheMap) {
  take_in();
  sequences_[0].recording.reset();
  sequences_[0].unlisted = {Reason::NO_SUCH_FILE, "1 holds no pictures"};
  const Task gone = later(client::SessionState::kEnded);
  EXPECT_EQ(gone.stage, Stage::kFailed);
  EXPECT_EQ(gone.failure.reason(), Reason::NO_SUCH_FILE);
  EXPECT_THAT(gone.failure.message(), AllOf(HasSubstr("holds no pictures"), HasSubstr("session 4")));
}

TEST_F(ChangedRecording, OfAnOlderVersionOrAnotherMapIsNotKnownToBeOne) {
  const auto state = client::SessionState::kEnded;
  EXPECT_EQ(later(state).stage, Stage::kWasThere) << "nothing was kept";
  std::filesystem::create_directories(options_.summaries);
  const std::string kept = options_.summaries + "/" + sequences_[0].uuid.to_string() + ".json";
  std::ofstream(kept) << "{\"pairs\": 3, \"keyframes\": 4, \"metric_share\": 1}";
  options_.map = "11111111-2222-3333-4444-555555555555";
  EXPECT_EQ(later(state).stage, Stage::kWasThere) << "nothing was kept of what it was made of";
  EXPECT_EQ(later(state).summary.pairs, 3u) << "kept by an older version for all maps";
  take_in();
  sequences_[0].recording = drive(15);
  expect_refused(later(state), "is made of 10 pairs");
  options_.map = "21111111-2222-3333-4444-555555555555";
  EXPECT_EQ(later(state).stage, Stage::kWasThere) << "in that map it may be of 15";
}

TEST_F(ChangedRecording, IsInTheMapOnceAgainHasTakenItIn) {
  take_in();
  const Sequence own = sequences_[0];
  sequences_[0].recording = drive(15);
  options_.recordings.again = true;
  sequences_[0].uuid = SessionUuid::random();
  std::string fifteen = kDrive;
  fifteen.replace(fifteen.find("\"count\": 10"), 11, "\"count\": 15").replace(fifteen.find("c10"), 3, "c15");
  write_front_end(fifteen);
  take_in();
  client::Session other = session(client::SessionState::kEnded);
  other.number = 5;
  // The command without --again finds it there, though its own session is made of something else or deleted.
  options_.recordings.again = false;
  sequences_[0].uuid = own.uuid;
  for (const std::vector<client::Session>& known :
       {std::vector<client::Session>{session(client::SessionState::kEnded), other}, {other}}) {
    Batch batch(options_, sequences_, known);
    run(batch);
    EXPECT_EQ(batch.tasks()[0].stage, Stage::kWasThere) << batch.tasks()[0].failure.to_string();
    EXPECT_EQ(report_rows(batch.tasks(), known, {})[0].session, 5u);
  }
  // A change is one since then, whether there is an older session or not.
  sequences_[0].recording = drive(16);
  for (const std::vector<client::Session>& known :
       {std::vector<client::Session>{session(client::SessionState::kEnded), other}, {other}}) {
    Batch changed(options_, sequences_, known);
    run(changed);
    EXPECT_EQ(changed.tasks()[0].failure.reason(), Reason::SEQUENCE_CONFLICT);
    EXPECT_THAT(
        changed.tasks()[0].failure.message(),
        AllOf(HasSubstr("session 5 is made of 15 pairs, and there are 16 now"), HasSubstr("relmap session delete 5")));
  }
  // As it was at first it is in the map, too.
  sequences_[0].recording = drive(10);
  Batch first(options_, sequences_, {session(client::SessionState::kEnded), other});
  run(first);
  EXPECT_EQ(first.tasks()[0].stage, Stage::kWasThere);
}

TEST_F(ChangedRecording, OfAnInterruptedAgainBecomesAnotherSession) {
  options_.recordings.again = true;
  const AgainRecord record(path("state"), "map", options_.recordings, sequences_);
  const auto never = [](const SessionUuid&, const Sequence&) { return false; };
  const SessionUuid first = sequences_[0].uuid;
  ASSERT_TRUE(record.take_up(sequences_, never).ok());
  sequences_[0].uuid = SessionUuid::random();
  ASSERT_TRUE(record.take_up(sequences_, never).ok());
  EXPECT_EQ(sequences_[0].uuid, first);
  const SessionUuid second = sequences_[0].uuid = SessionUuid::random();
  ASSERT_TRUE(record
                  .take_up(sequences_,
                           [&](const SessionUuid& uuid, const Sequence& sequence) {
                             EXPECT_EQ(uuid, first);
                             return sequence.path == sequences_[0].path;
                           })
                  .ok());
  EXPECT_EQ(sequences_[0].uuid, second);
  sequences_[0].uuid = SessionUuid::random();
  ASSERT_TRUE(record.take_up(sequences_, never).ok());
  EXPECT_EQ(sequences_[0].uuid, second) << "with which it goes on";
  // Photographs of another camera came into its folder.
  std::vector<Sequence> two{sequences_[0], sequences_[0]};
  two[1].camera = "640x480";
  const SessionUuid of_other = two[1].uuid = SessionUuid::random();
  two[0].uuid = SessionUuid::random();
  ASSERT_TRUE(AgainRecord(path("state"), "map", options_.recordings, two).take_up(two, never).ok());
  EXPECT_EQ(two[0].uuid, second);
  EXPECT_EQ(two[1].uuid, of_other);
  ASSERT_TRUE(record.forget(sequences_[0]).ok());
  const SessionUuid third = sequences_[0].uuid = SessionUuid::random();
  ASSERT_TRUE(record.take_up(sequences_, never).ok());
  EXPECT_EQ(sequences_[0].uuid, third);
}

TEST_F(ChangedRecording, FailsAlsoIfOnlyTheDaemonNoticesIt) {
  write_front_end(
      "echo '{\"keyframes\": 2, \"metric_share\": 1, \"unsettled\": 0, \"refused\": {\"SEQUENCE_CONFLICT\": 2}}'; exit "
      "3\n");
  const Task task = later(client::SessionState::kOpen);
  EXPECT_EQ(task.stage, Stage::kFailed);
  EXPECT_EQ(task.failure.reason(), Reason::SEQUENCE_CONFLICT);
  EXPECT_THAT(task.failure.message(), AllOf(HasSubstr("refused 2 keyframes"), HasSubstr("--again")));
}

TEST_F(BatchTest, PartsOfOneSessionAreSentInOrder) {
  write_front_end("echo $path >> " + path("order") + "\nsleep 0.2\n" + kDone);
  std::vector<Sequence> parts(3);
  for (std::uint32_t i = 0; i < 3; ++i) {
    parts[i].path = "log." + std::to_string(2 - i);  // the last part is given first
    parts[i].recorded = "11111111-2222-3333-4444-555555555555";
    parts[i].uuid = *SessionUuid::parse(parts[i].recorded);
    parts[i].first = 100 * (2 - i);
    parts[i].last = parts[i].first + 99;
  }
  std::vector<client::Session> known(1);
  known[0].uuid = parts[0].recorded;
  known[0].state = client::SessionState::kEnded;
  known[0].next_sequence = 100;  // log.0 is there
  options_.jobs = 3;
  Batch batch(options_, parts, known);
  EXPECT_TRUE(run(batch));
  std::ifstream order(path("order"));
  std::string first, second, third;
  order >> first >> second >> third;
  EXPECT_EQ(first, "log.1");
  EXPECT_EQ(second, "log.2");
  EXPECT_EQ(third, "");
  EXPECT_EQ(batch.tasks()[2].stage, Stage::kWasThere);
}

TEST_F(BatchTest, RunsAtMostTheGivenNumberAtATime) {
  write_front_end("touch \"$path/running\"; ls " + folder_ + "/*/running | wc -l >> " + path("counts") +
                  "\nsleep 0.1\n" + kDone + "rm \"$path/running\"\n");
  options_.jobs = 2;
  Batch batch(options_, recordings({"1", "2", "3", "4", "5"}), {});
  std::ostringstream said;
  {
    BatchProgress progress(said, false);
    EXPECT_TRUE(batch.run([] { return false; }, [&](const auto& tasks) { progress.show(tasks); }));
  }
  std::ifstream counts(path("counts"));
  int max_running = 0, runs = 0;
  for (int n; counts >> n; ++runs) max_running = std::max(max_running, n);
  EXPECT_EQ(runs, 5);
  EXPECT_EQ(max_running, 2);
  for (const Task& task : batch.tasks()) {
    EXPECT_EQ(task.stage, Stage::kDone) << task.failure.to_string();
    EXPECT_EQ(task.summary.pairs, 10u);
    EXPECT_EQ(task.progress.of, 10u);
    EXPECT_EQ(*task.summary.metric_share, 0.75);
  }
  EXPECT_THAT(said.str(), HasSubstr("/3: 10 pairs, 4 keyframes, 2 of them refused\n"));
  EXPECT_EQ(extent_of(batch.tasks()).share, 1);
  EXPECT_EQ(extent_of(batch.tasks()).pairs, 50u);
}

TEST_F(BatchTest, EndedSessionsAreLeftOutAndOpenOnesContinued) {
  write_front_end(kDone);
  const auto sequences = recordings({"1", "2", "3"});
  Batch first(options_, {sequences[0]}, {});
  run(first);
  std::vector<client::Session> known(3);
  known[2].uuid = sequences[2].uuid.to_string();
  known[2].state = client::SessionState::kDeleting;  // for the daemon to refuse
  known[0].uuid = sequences[0].uuid.to_string();
  known[0].state = client::SessionState::kEnded;
  known[0].number = 7;
  known[0].frames = 4;
  known[1].uuid = sequences[1].uuid.to_string();
  known[1].refused = 2;
  Batch batch(options_, sequences, known);
  run(batch);
  EXPECT_EQ(batch.tasks()[0].stage, Stage::kWasThere);
  EXPECT_EQ(batch.tasks()[0].starts, 0);
  EXPECT_EQ(batch.tasks()[0].summary.pairs, 10u) << "kept from the run before";
  EXPECT_EQ(batch.tasks()[1].stage, Stage::kDone);
  EXPECT_EQ(batch.tasks()[2].stage, Stage::kDone);

  std::vector<client::Session> frozen = known;
  for (client::Session& session : frozen) session.state = client::SessionState::kFrozen;
  frozen[0].number = 6;
  frozen[0].frames = 3;  // a fourth was in the map that the summary is of
  frozen[1].frames = 2;
  frozen[1].refused = 2;
  frozen[2].uuid.clear();
  Batch after(options_, sequences, frozen);
  EXPECT_EQ(after.tasks()[0].failure.reason(), Reason::SESSION_FROZEN);
  EXPECT_THAT(after.tasks()[0].failure.message(), AllOf(HasSubstr("session 6"), HasSubstr("--again")));
  EXPECT_EQ(after.tasks()[1].stage, Stage::kWasThere);
  std::filesystem::remove_all(options_.summaries);
  Batch unknown(options_, sequences, frozen);
  run(unknown);
  EXPECT_EQ(unknown.tasks()[1].failure.reason(), Reason::SESSION_FROZEN) << "nothing tells that it has ended";
  EXPECT_EQ(unknown.tasks()[1].starts, 0) << "what it refuses would be settled";

  std::vector<client::Edge> loops(3);
  for (client::Edge& loop : loops) loop.b = {7, 3};
  const auto rows = report_rows(batch.tasks(), known, loops);
  EXPECT_EQ(rows[0].loops, 3u);
  EXPECT_EQ(rows[0].keyframes, 4u);
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_report(rows, console);
  EXPECT_THAT(out.str(), HasSubstr("75.0 %"));
  EXPECT_THAT(out.str(), HasSubstr("2 BAD_TRACK; pictures: 1 NOT_A_PICTURE"));
  EXPECT_THAT(report_json(rows, 2), HasSubstr("\"state\":\"was there\""));
}

TEST_F(BatchTest, AFailureIsReportedAndTheOthersGoOn) {
  write_front_end(
      "case $path in\n"
      "*/bad) echo 'no relmapd' >&2; echo 'relmap-frontend: NOT_STEREO: the eyes are exchanged' >&2; exit 1;;\n"
      "*/unsettled) echo '{\"keyframes\": 5, \"metric_share\": 1, \"unsettled\": 3, \"refused\": "
      "{\"BAD_TRACK\": 1}}'; exit 3;;\n"
      "*/frozen) echo '{\"keyframes\": 5, \"metric_share\": 1, \"unsettled\": 0, \"refused\": "
      "{\"SESSION_FROZEN\": 2}}'; exit 3;;\n"
      "*/deleted) echo '{\"keyframes\": 5, \"metric_share\": 1, \"unsettled\": 0, \"refused\": "
      "{\"SESSION_DELETED\": 1}}'; exit 0;;\n"
      "*/silent) echo '{\"pairs\": 1, \"trouble\": \"nobody answers\"}'; exit 3;;\n"
      "*/crash) kill -9 $$;;\n"
      "esac\n" +
      kDone);
  Batch batch(options_, recordings({"bad", "silent", "crash", "good", "unsettled", "frozen", "deleted"}), {});
  EXPECT_TRUE(run(batch));
  EXPECT_EQ(batch.tasks()[0].failure.reason(), Reason::NOT_STEREO);
  EXPECT_EQ(batch.tasks()[0].failure.message(), "the eyes are exchanged");
  EXPECT_EQ(batch.tasks()[1].failure.reason(), Reason::UNREACHABLE);
  EXPECT_EQ(batch.tasks()[1].failure.message(), "nobody answers");
  EXPECT_EQ(batch.tasks()[2].failure.reason(), Reason::INTERNAL);
  EXPECT_EQ(batch.tasks()[2].starts, 2) << "it may have been out of memory";
  EXPECT_EQ(batch.tasks()[3].stage, Stage::kDone);
  EXPECT_EQ(batch.tasks()[4].failure.reason(), Reason::UNREACHABLE);
  EXPECT_EQ(batch.tasks()[5].failure.reason(), Reason::SESSION_FROZEN);
  EXPECT_THAT(batch.tasks()[5].failure.message(), HasSubstr("refused 2 keyframes"));
  EXPECT_EQ(batch.tasks()[6].failure.reason(), Reason::SESSION_DELETED) << "though its front-end was content";
  EXPECT_THAT(batch.tasks()[6].failure.message(), HasSubstr("--again"));
}

TEST_F(BatchTest, AnUntrustedRecordingIsInTheMapAndReported) {
  write_front_end(
      "case $path in\n"
      "*/doubtful) echo '{\"pairs\": 51, \"keyframes\": 4, \"metric_share\": 1, \"trusted\": false, \"expected\": 51, "
      "\"seen\": 10, \"measured\": 10, \"measured_share\": 0.196, \"missing\": {\"count\": 41, \"first\": []}, "
      "\"findings\": [{\"reason\": \"OUT_OF_FOCUS\", \"message\": \"the left eye: 5 px\"}]}'; exit 5;;\n"
      "*/mono) echo '{\"keyframes\": 4, \"metric_share\": null, \"measured_share\": null, \"trusted\": true}'; exit "
      "0;;\n"
      "*/nothing) exit 5;;\n"
      "esac\n" +
      kDone);
  Batch batch(options_, recordings({"good", "doubtful", "nothing", "mono"}), {});
  EXPECT_TRUE(run(batch));
  EXPECT_FALSE(batch.tasks()[0].untrusted());
  EXPECT_EQ(batch.tasks()[1].stage, Stage::kDone);
  EXPECT_TRUE(batch.tasks()[1].untrusted());
  EXPECT_EQ(batch.tasks()[2].stage, Stage::kFailed) << "it did not say what of";
  EXPECT_FALSE(batch.tasks()[3].summary.measured_share) << "there were no pairs";
  const auto rows = report_rows(batch.tasks(), {}, {});
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_report(rows, console);
  EXPECT_TRUE(out.str().starts_with("NOT TO BE TRUSTED: ")) << out.str();
  EXPECT_THAT(out.str(), HasSubstr("19.6 % measured (10 of 51 pairs, 41 pictures are missing); OUT_OF_FOCUS"));
  const std::string json = report_json(rows, 2);
  EXPECT_THAT(json, HasSubstr("\"untrusted\":1"));
  EXPECT_THAT(json, HasSubstr("\"findings\":[{\"reason\":\"OUT_OF_FOCUS\",\"message\":\"the left eye: 5 px\"}]"));
  // What the map says of a calibration.
  client::Session contradicted;
  contradicted.uuid = batch.tasks()[0].sequence.uuid.to_string();
  contradicted.number = 4;
  const auto doubted = report_rows(batch.tasks(), {contradicted}, {}, {{4, "r", "good", {1}, 5, "it fits 9 % longer"}});
  EXPECT_TRUE(doubted[0].untrusted());
  out.str("");
  print_report(doubted, console);
  EXPECT_THAT(out.str(), HasSubstr("good; WRONG_CALIBRATION: it fits 9 % longer"));
  EXPECT_THAT(report_json(doubted, 2), HasSubstr("\"calibration_in_doubt\":\"it fits 9 % longer\""));
  // Another daemon does not know of it; the same one has withdrawn it.
  const SummaryStore store(options_.summaries, "map");
  const auto doubt_by = [&](const std::string& boot, std::vector<ReportRow> told) {
    EXPECT_TRUE(keep_doubts(store, boot, told).ok());
    return told[0].doubt;
  };
  const auto silent = report_rows(batch.tasks(), {contradicted}, {});
  EXPECT_EQ(doubt_by("first", silent), "");
  EXPECT_EQ(doubt_by("first", doubted), "it fits 9 % longer");
  EXPECT_EQ(doubt_by("second", silent), "it fits 9 % longer");
  EXPECT_EQ(doubt_by("", silent), "") << "nobody could be asked";
  EXPECT_EQ(doubt_by("second", doubted), "it fits 9 % longer");
  EXPECT_EQ(doubt_by("second", silent), "");
  EXPECT_EQ(doubt_by("third", silent), "");
  // A later run still knows.
  client::Session there;
  there.uuid = batch.tasks()[1].sequence.uuid.to_string();
  there.state = client::SessionState::kEnded;
  Batch later(options_, recordings({"doubtful"}), {there});
  EXPECT_EQ(later.tasks()[0].stage, Stage::kWasThere);
  EXPECT_TRUE(later.tasks()[0].untrusted());
}

// The front-end says in its last words what its summary says of the eyes.
TEST_F(BatchTest, RefusedEyesAreNamedOnceInTheTable) {
  write_front_end(
      "case $path in\n"
      "*/askew) echo '{\"keyframes\": 0, \"metric_share\": null, \"trusted\": false, \"findings\": [{\"reason\": "
      "\"ROWS_APART\", \"message\": "
      "\"3.1 rows apart\"}, {\"reason\": \"OUT_OF_FOCUS\", \"message\": \"the left eye: 5 px\"}]}'\n"
      "echo 'relmap-frontend: ROWS_APART: 3.1 rows apart; what helps: calibrate anew' >&2; exit 1;;\n"
      "esac\n" +
      kDone);
  Batch batch(options_, recordings({"askew"}), {});
  EXPECT_TRUE(run(batch));
  ASSERT_EQ(batch.tasks()[0].failure.reason(), Reason::ROWS_APART);
  ASSERT_EQ(batch.tasks()[0].summary.findings.size(), 2u);
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_report(report_rows(batch.tasks(), {}, {}), console);
  EXPECT_THAT(out.str(), HasSubstr("  eyes: OUT_OF_FOCUS: the left eye: 5 px; ROWS_APART: 3.1 rows apart; what helps"));
  EXPECT_EQ(out.str().find("ROWS_APART"), out.str().rfind("ROWS_APART")) << out.str();
}

TEST_F(BatchTest, WhatTheDaemonRefusedIsLostAndWhatTheRecordingLacksIsNot) {
  write_front_end(
      "case $path in\n"
      "*/refused) echo '{\"pairs\": 50, \"keyframes\": 50, \"metric_share\": 1, \"refused\": {\"BAD_TRACK\": 2, "
      "\"NOT_FINITE\": 1}}'; exit 3;;\n"
      "*/gaps) echo '{\"pairs\": 50, \"keyframes\": 50, \"metric_share\": 1, \"gaps\": 5, \"refused\": {}}'; exit 3;;\n"
      "esac\nexit 1\n");
  const auto sequences = recordings({"refused", "gaps"});
  Batch batch(options_, sequences, {});
  run(batch);
  client::Session session;
  session.uuid = sequences[0].uuid.to_string();
  session.state = client::SessionState::kEnded;
  session.number = 1;
  session.frames = 47;
  session.refused = 3;
  auto rows = report_rows(batch.tasks(), {session}, {});
  EXPECT_EQ(batch.tasks()[1].stage, Stage::kDone);
  EXPECT_EQ(rows[0].lost(), 3u);
  EXPECT_EQ(rows[1].lost(), 0u);
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_report(rows, console);
  EXPECT_THAT(out.str(), HasSubstr("NOT ALL IN THE MAP: "));
  EXPECT_THAT(out.str(), HasSubstr("/refused: 3 of 50 keyframes were refused: 2 BAD_TRACK, 1 NOT_FINITE\n"));
  EXPECT_THAT(out.str(), HasSubstr("the recording lacks 5 keyframes"));
  const std::string json = report_json(rows, 1);
  EXPECT_THAT(json, HasSubstr("\"keyframes_refused\":3"));
  EXPECT_THAT(json, HasSubstr("\"incomplete\":1"));
  // It is not there the next time either, whoever asks.
  options_.summaries = path("of another user");
  Batch again(options_, sequences, {session});
  rows = report_rows(again.tasks(), {session}, {});
  EXPECT_EQ(again.tasks()[0].stage, Stage::kWasThere);
  EXPECT_EQ(rows[0].lost(), 3u);
}

// Too few to make it doubtful, but somebody may look for them.
TEST_F(BatchTest, MissingPicturesAreReportedInTheTextToo) {
  write_front_end(
      "echo '{\"pairs\": 50, \"keyframes\": 20, \"metric_share\": 1, \"trusted\": true, \"missing\": {\"count\": 2, "
      "\"first\": [\"'$path'/image_1/000007.png\", \"'$path'/image_1/000009.png\"]}}'\n");
  const auto sequences = recordings({"drive"});
  Batch batch(options_, sequences, {});
  run(batch);
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_report(report_rows(batch.tasks(), {}, {}), console);
  EXPECT_THAT(out.str(), HasSubstr(sequences[0].session +
                                   ": 2 pictures are missing, the first: image_1/000007.png, image_1/000009.png\n"));
}

TEST_F(BatchTest, PicturesThatWereLeftOutAreNamed) {
  std::string left_out;
  for (int i = 0; i < 5; ++i)
    left_out += std::string(i > 0 ? ", " : "") + "{\"reason\": \"NOT_A_PICTURE\", \"message\": \"'$path'/" +
                std::to_string(i) + ".jpg: neither PNG nor JPEG\"}";
  write_front_end(
      "echo '{\"pairs\": 7, \"keyframes\": 7, \"metric_share\": null, \"unreadable\": {\"NOT_A_PICTURE\": 5}, "
      "\"left_out\": [" +
      left_out + "]}'\n");
  const auto sequences = recordings({"photos"});
  Batch batch(options_, sequences, {});
  run(batch);
  const auto rows = report_rows(batch.tasks(), {}, {});
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_report(rows, console);
  EXPECT_THAT(out.str(), HasSubstr("/photos: left out:\n  0.jpg: neither PNG nor JPEG (NOT_A_PICTURE)\n  1.jpg"));
  EXPECT_THAT(out.str(), HasSubstr("  and 2 more (--json lists all)\n"));
  EXPECT_EQ(out.str().find("3.jpg"), std::string::npos);
  EXPECT_EQ(out.str().find("0.0 %"), std::string::npos) << "nothing was measured: " << out.str();
  for (int i = 0; i < 5; ++i)
    EXPECT_THAT(report_json(rows, 1), HasSubstr("/photos/" + std::to_string(i) + ".jpg: neither"));
}

TEST_F(BatchTest, AFailedRecordingHasNoFigures) {
  write_front_end(
      "echo '{\"pairs\": 12345, \"keyframes\": 7, \"metric_share\": 0.875, \"expected\": 20000, \"measured\": 12000, "
      "\"measured_share\": 0.6125, \"error\": null}'; echo 'relmap-frontend: TOO_FEW_FEATURES: dark' >&2; exit 1\n");
  Batch batch(options_, recordings({"dark"}), {});
  run(batch);
  const auto rows = report_rows(batch.tasks(), {}, {});
  std::ostringstream out, err;
  terminal::Console console(out, err);
  print_report(rows, console);
  EXPECT_THAT(out.str(), HasSubstr("TOO_FEW_FEATURES: dark"));
  for (const char* figure : {"12345", "61.2", "61.3", "87.5"}) EXPECT_EQ(out.str().find(figure), std::string::npos);
  EXPECT_EQ(report_json(rows, 1).find("_share"), std::string::npos);
}

TEST_F(BatchTest, AFileOfKeyframesHasItsRecordedName) {
  std::ofstream(path("k.bin")) << "keyframes";
  const auto list = [](const std::string& path, const RecordingOptions& options) -> Result<ListedRecording> {
    EXPECT_EQ(options.source, "auto");
    ListedRecording listed{drive(3), "cart", "morning"};
    if (path.ends_with("pictures")) listed.robot.clear(), listed.session.clear();
    return listed;
  };
  std::filesystem::create_directories(path("of the simulator"));
  std::filesystem::create_directories(path("pictures"));
  const auto sequences = sequences_of({path("k.bin"), path("of the simulator"), path("pictures")}, options_.recordings,
                                      {.recording = list})
                             .or_throw();
  EXPECT_EQ(sequences[0].session, "morning");
  EXPECT_EQ(sequences[0].recording, drive(3));
  EXPECT_THAT(sequences[1].session, HasSubstr("/of the simulator")) << "a folder is a data set, and has its name";
  const auto robot = [](const std::vector<std::string>& command) {
    return *(std::find(command.begin(), command.end(), "--robot") + 1);
  };
  Batch batch(options_, sequences, {});
  EXPECT_EQ(robot(batch.command(sequences[0])), "cart");
  EXPECT_THAT(batch.command(sequences[0]), Contains("morning"));
  EXPECT_EQ(robot(batch.command(sequences[1])), kUsualRobot);
  EXPECT_EQ(robot(batch.command(sequences[2])), kUsualRobot);
  options_.recordings.robot = "truck";
  EXPECT_EQ(robot(Batch(options_, sequences, {}).command(sequences[0])), "truck");
}

TEST_F(BatchTest, AProgramThatIsNotThereIsNamed) {
  options_.program = path("nothing");
  Batch batch(options_, recordings({"1"}), {});
  EXPECT_TRUE(run(batch));
  EXPECT_EQ(batch.tasks()[0].failure.reason(), Reason::NO_SUCH_FILE);
  EXPECT_THAT(batch.tasks()[0].failure.message(), HasSubstr(path("nothing")));
}

TEST_F(BatchTest, AnInterruptEndsFrontEndsAndStartsNoMore) {
  write_front_end("trap 'exit 4' TERM\necho '{\"pairs\": 1}'\nwhile :; do sleep 0.02; done\n");
  Batch batch(options_, recordings({"1", "2"}), {});
  bool seen = false;
  EXPECT_FALSE(batch.run([&] { return seen; },
                         [&](const std::vector<Task>& tasks) { seen = seen || tasks[0].progress.pairs > 0; }));
  EXPECT_EQ(batch.tasks()[0].stage, Stage::kWaiting);
  EXPECT_EQ(batch.tasks()[1].starts, 0);
}

}  // namespace
}  // namespace relmap::batch
