// An operator edits loop closures with the program. Every proposal, acceptance and removal can be previewed, is listed
// in the answer, is undone by the command that the answer names, and survives a kill of the daemon.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>

#include "server/map/derived.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/source_tree.h"
#include "tests/support/stored_map.h"
#include "tests/support/terminal.h"

namespace relmap::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// A drive of two laps whose places are not recognised automatically.
class Operator : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
    options_.data = folder_ / "map";
    options_.more = {"--no-closures"};
    daemon_ = std::make_unique<RunningDaemon>(options_);
    const Finished made = run_program({built_program("relmap-sim"), "points", "--out", folder_ / "drive", "--frames",
                                       "120", "--frames-per-lap", "80", "--appearance", "140"});
    ASSERT_EQ(made.exit_code, 0) << made.standard_error;
    const Finished ingested = relmap({"ingest", folder_ / "drive"});
    ASSERT_EQ(ingested.exit_code, 0) << ingested.standard_error;
    ASSERT_TRUE(daemon_->client()->wait_idle().ok());
  }

  Finished relmap(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {built_program("relmap"), "--server", options_.data});
    return run_program(arguments);
  }
  // What standard output says.
  std::string edge(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "edge");
    const Finished done = relmap(arguments);
    EXPECT_EQ(done.exit_code, 0) << done.standard_error;
    return done.standard_output;
  }
  // As somebody at a terminal, who answers so.
  Finished relmap_at_terminal(std::vector<std::string> arguments, const std::string& answer,
                              const std::function<void()>& meanwhile = {}) const {
    arguments.insert(arguments.begin(), {built_program("relmap"), "--server", options_.data});
    return run_on_terminal(arguments, answer, meanwhile);
  }
  std::string propose(const std::string& a, const std::string& b) const {
    const std::string said = edge({"propose", a, b});
    return said.substr(0, said.find(": "));
  }
  std::vector<std::string> in_force() const {
    client::EdgeFilter filter;
    filter.kinds = {client::EdgeKind::kLoop};
    filter.states = {client::EdgeState::kAccepted};
    std::vector<std::string> ids;
    for (const client::Edge& closure : daemon_->client()->edges(filter).or_throw())
      ids.push_back(closure.id.to_string());
    return ids;
  }
  // What a program reads is a contract: docs/operations.md names every key of the object.
  static void expect_keys_are_documented(const std::string& object) {
    const std::string document = content_of("docs/operations.md");
    const std::regex key("\"([A-Za-z]+)\":");
    for (std::sregex_iterator at(object.begin(), object.end(), key), end; at != end; ++at)
      EXPECT_THAT(document, HasSubstr("`" + (*at)[1].str() + "`"));
  }
  static std::string contents(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string explain(const std::string& id) const { return relmap({"edges", "--explain", id}).standard_output; }

  const storage::TemporaryFolder folder_;
  DaemonOptions options_;
  std::unique_ptr<RunningDaemon> daemon_;
};

TEST_F(Operator, ProposesAcceptsAndWithdrawsAndSeesTheEffectInADryRun) {
  const std::string dry = edge({"propose", "1:5", "1:85", "--dry-run"});
  EXPECT_THAT(dry, HasSubstr("would be: candidate, LONE"));
  EXPECT_THAT(relmap({"edges", "--loops"}).standard_output, Not(HasSubstr("candidate"))) << "a dry run changes nothing";

  const Finished proposed = relmap({"edge", "propose", "1:85", "1:5"});
  ASSERT_EQ(proposed.exit_code, 0) << proposed.standard_error;
  const std::string id = proposed.standard_output.substr(0, proposed.standard_output.find(':', 3));
  EXPECT_THAT(proposed.standard_output, HasSubstr(id + ": candidate, LONE (no other closure agrees with it yet)"));
  EXPECT_THAT(proposed.standard_output, HasSubstr("not there"));
  EXPECT_THAT(proposed.standard_error, HasSubstr("relmap edge remove " + id));
  const Finished again = relmap({"edge", "propose", "1:5", "1:85"});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.standard_error, HasSubstr("WRONG_STATE: closure " + id));

  EXPECT_THAT(edge({"accept", id, "--dry-run"}), HasSubstr("would be: accepted, ACCEPTED_BY_OPERATOR"));
  EXPECT_THAT(explain(id), HasSubstr("candidate, LONE"));
  const std::string accepted = edge({"accept", id, "--note", "I was there"});
  EXPECT_THAT(accepted, HasSubstr("accepted, ACCEPTED_BY_OPERATOR (an operator put it into force)"));
  EXPECT_THAT(accepted, HasSubstr("edge comes"));
  EXPECT_THAT(explain(id), HasSubstr("ACCEPTED_BY_OPERATOR (an operator put it into force): I was there"));
  EXPECT_LE(daemon_->client()->transform_between({1, 0}, {1, 90}).or_throw().edges, 20u);

  // The journal has it.
  daemon_->process().kill();
  daemon_ = std::make_unique<RunningDaemon>(options_);
  EXPECT_THAT(explain(id), HasSubstr("accepted, ACCEPTED_BY_OPERATOR"));

  EXPECT_THAT(edge({"withdraw", id}), HasSubstr("candidate, LONE"));
  EXPECT_THAT(edge({"remove", id}), HasSubstr("removed, REMOVED_BY_OPERATOR"));
  EXPECT_THAT(edge({"restore", id}), HasSubstr("candidate, LONE"));
  const Finished twice = relmap({"edge", "restore", id});
  EXPECT_EQ(twice.exit_code, 1);
  EXPECT_THAT(twice.standard_error, HasSubstr("WRONG_STATE: " + id));

  const Finished other = relmap({"--json", "edge", "propose", "1:7", "1:88", "--accept"});
  EXPECT_EQ(other.exit_code, 0) << other.standard_error;
  EXPECT_THAT(other.standard_output, HasSubstr(R"("reason":"REASON_ACCEPTED_BY_OPERATOR")"));
  EXPECT_THAT(other.standard_output, HasSubstr(R"("effect":{"closures":[)"));

  EXPECT_EQ(daemon_->stop(), 0);
  const Finished verified = run_program({built_program("relmap-admin"), "verify", options_.data});
  EXPECT_EQ(verified.exit_code, 0) << verified.standard_output << verified.standard_error;
  EXPECT_THAT(map::derived_differences(*open_stored_map(options_.data)), IsEmpty());
}

TEST_F(Operator, IsAskedBeforeAgreeingClosuresAreRemoved) {
  std::vector<std::string> ids;
  for (const int at : {5, 8, 11}) ids.push_back(propose("1:" + std::to_string(at), "1:" + std::to_string(80 + at)));
  ASSERT_EQ(in_force(), ids);

  for (const std::vector<std::string>& how :
       std::vector<std::vector<std::string>>{{"edge", "remove", ids[0]}, {"--json", "edge", "remove", ids[0]}}) {
    const Finished refused = relmap(how);
    EXPECT_EQ(refused.exit_code, 1) << "nobody can be asked";
    if (how.front() == "--json")
      EXPECT_THAT(refused.standard_output, ::testing::StartsWith(R"({"error":{"reason":"NOT_CONFIRMED","message":")"));
    else
      EXPECT_EQ(refused.standard_output, "");
    EXPECT_THAT(refused.standard_error, ::testing::StartsWith("NOT_CONFIRMED: 2 closures that agree with " + ids[0] +
                                                              " would go with it: " + ids[1] + " " + ids[2]));
  }
  for (const std::string answer : {"n\n", "\n", "\x04"}) {
    const Finished no = relmap_at_terminal({"edge", "remove", ids[0]}, answer);
    EXPECT_EQ(no.exit_code, 1);
    EXPECT_EQ(no.standard_output, "");
    for (const std::string& id : ids) EXPECT_THAT(no.standard_error, HasSubstr(id)) << "what goes is shown";
    EXPECT_THAT(no.standard_error, HasSubstr("NOT_CONFIRMED: nothing is changed"));
  }
  EXPECT_EQ(in_force(), ids);

  const Finished dry = relmap({"edge", "remove", ids[0], "--dry-run"});
  EXPECT_EQ(dry.exit_code, 0) << dry.standard_error;
  for (const std::string& id : ids) EXPECT_THAT(dry.standard_output, HasSubstr(id));
  EXPECT_THAT(edge({"remove", ids[1], "--only-this", "--dry-run"}), HasSubstr("would be: removed, REMOVED_ALONE"));
  EXPECT_EQ(in_force(), ids);

  const Finished yes = relmap_at_terminal({"edge", "remove", ids[0]}, "y\n");
  EXPECT_EQ(yes.exit_code, 0) << yes.standard_error;
  EXPECT_THAT(yes.standard_output, HasSubstr(ids[0] + ": removed, REMOVED_BY_OPERATOR"));
  EXPECT_THAT(in_force(), IsEmpty());
  const std::string all = ids[0] + ' ' + ids[1] + ' ' + ids[2] + '\n';
  EXPECT_THAT(edge({"restore", ids[0], "--dry-run"}), HasSubstr("would come into force: " + all));
  const std::string restored = edge({"restore", ids[0]});
  EXPECT_THAT(restored, HasSubstr("came into force: " + all));
  EXPECT_THAT(restored, HasSubstr("edges of the graph since: " + ids[0] + '\n')) << "the others are too near to it";
  EXPECT_EQ(in_force(), ids);
  edge({"remove", ids[0], "--yes"});
  EXPECT_THAT(in_force(), IsEmpty());
  edge({"restore", ids[0]});
}

// Another closure came into force while the operator looked at what would be removed.
TEST_F(Operator, RemovesOnlyWhatWasShown) {
  std::vector<std::string> ids;
  for (const int at : {5, 8}) ids.push_back(propose("1:" + std::to_string(at), "1:" + std::to_string(80 + at)));
  const auto one_more = [&](int at) {
    ids.push_back(propose("1:" + std::to_string(at), "1:" + std::to_string(80 + at)));
    ASSERT_EQ(in_force(), ids);
  };
  const Finished yes = relmap_at_terminal({"edge", "remove", ids[0]}, "y\n", [&] { one_more(11); });
  EXPECT_EQ(yes.exit_code, 1);
  EXPECT_EQ(yes.standard_output, "");
  EXPECT_THAT(yes.standard_error, HasSubstr("WRONG_STATE: the map has changed since the removal of " + ids[0] +
                                            " was shown: 2 closures would have gone then, 3 closures now"));
  EXPECT_EQ(in_force(), ids);

  const auto number = [&] {
    const std::string said = relmap({"edge", "remove", ids[0], "--dry-run"}).standard_error;
    const std::size_t at = said.find(" --shown ");
    EXPECT_NE(at, std::string::npos) << said;
    return said.substr(at + 9, said.find('\n', at) - at - 9);
  };
  const std::string shown = number();
  one_more(14);
  const Finished refused = relmap({"edge", "remove", ids[0], "--shown", shown});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.standard_error, HasSubstr("3 closures would have gone then, 4 closures now"));
  EXPECT_EQ(in_force(), ids);
  EXPECT_EQ(relmap({"edge", "remove", ids[0], "--shown", shown, "--yes"}).exit_code, 2) << "one or the other";
  const Finished removed = relmap({"edge", "remove", ids[0], "--shown", number()});
  EXPECT_EQ(removed.exit_code, 0) << removed.standard_error;
  EXPECT_THAT(in_force(), IsEmpty());
}

TEST_F(Operator, RemovesOneClosureAndKeepsThoseThatAgreeWithIt) {
  std::vector<std::string> ids;
  for (const int at : {5, 8, 11}) ids.push_back(propose("1:" + std::to_string(at), "1:" + std::to_string(80 + at)));
  ASSERT_EQ(in_force(), ids);
  const Finished removed = relmap({"edge", "remove", ids[1], "--only-this", "--note", "a mirror"});
  ASSERT_EQ(removed.exit_code, 0) << removed.standard_error;
  EXPECT_THAT(removed.standard_output, HasSubstr(ids[1] + ": removed, REMOVED_ALONE"));
  EXPECT_THAT(removed.standard_error, HasSubstr("relmap edge restore " + ids[1]));
  const std::vector<std::string> others{ids[0], ids[2]};
  EXPECT_EQ(in_force(), others);

  // The journal has it, and what agrees with it later does not bring it back.
  daemon_->process().kill();
  daemon_ = std::make_unique<RunningDaemon>(options_);
  EXPECT_EQ(in_force(), others);
  EXPECT_THAT(explain(ids[1]), HasSubstr("REMOVED_ALONE (an operator took out this one alone, without those that "
                                         "agree with it): a mirror"));
  const std::string later = propose("1:14", "1:94");
  EXPECT_EQ(in_force(), (std::vector<std::string>{ids[0], ids[2], later}));

  const Finished restored = relmap({"edge", "restore", ids[1]});
  EXPECT_EQ(restored.exit_code, 0) << restored.standard_error;
  EXPECT_THAT(restored.standard_error, HasSubstr("relmap edge remove " + ids[1] + " --only-this"));
  EXPECT_EQ(in_force(), (std::vector<std::string>{ids[0], ids[1], ids[2], later}));
  EXPECT_EQ(daemon_->stop(), 0);
  EXPECT_THAT(map::derived_differences(*open_stored_map(options_.data)), IsEmpty());
}

TEST_F(Operator, IsToldWhyGeometryFindsNothing) {
  const Finished elsewhere = relmap({"edge", "propose", "1:5", "1:60"});
  EXPECT_EQ(elsewhere.exit_code, 1);
  EXPECT_THAT(elsewhere.standard_error, HasSubstr("TOO_FEW_INLIERS: 1:60 at 1:5: "));
  EXPECT_THAT(elsewhere.standard_error, HasSubstr("; 1:5 at 1:60: TOO_FEW_INLIERS: "));
  // Neither follows the other at once: it is the time between them that counts.
  const std::string recent = relmap({"edge", "propose", "1:50", "1:73"}).standard_error;
  EXPECT_THAT(recent, HasSubstr("INVALID_ARGUMENT: 1:50 was seen "));
  EXPECT_THAT(recent, HasSubstr(" s before 1:73 in one drive: within 20 odometry edges, or within 10 s and 1000 edges, "
                                "its own motion says"));
  EXPECT_THAT(relmap({"edge", "propose", "1:5", "1:5"}).standard_error, HasSubstr("both are 1:5"));
  EXPECT_THAT(relmap({"edge", "propose", "1:5", "1:500"}).standard_error, HasSubstr("NO_SUCH_FRAME"));
  EXPECT_EQ(relmap({"edge", "propose", "1:5"}).exit_code, 2);
  EXPECT_EQ(relmap({"edge", "accept", "kitchen"}).exit_code, 2);
  EXPECT_THAT(relmap({"edge", "accept", "1:5/0"}).standard_error, HasSubstr("ODOMETRY_EDGE"));
  EXPECT_THAT(relmap({"edge", "accept", "1:5/3", "--dry-run"}).standard_error, HasSubstr("NO_SUCH_EDGE"));
}

// Two robots send sessions of the same name, which is therefore ambiguous.
TEST_F(Operator, IsAskedWhichSessionOfANameIsMeant) {
  ASSERT_EQ(relmap({"ingest", folder_ / "drive", "--again", "--robot", "anna"}).exit_code, 0);
  const std::string name = daemon_->client()->sessions().or_throw().at(0).name;
  const std::vector<std::vector<std::string>> commands{
      {"session", "delete", name, "--yes"}, {"session", "freeze", name}, {"edges", "--session", name}};
  for (const auto& command : commands) {
    const Finished refused = relmap(command);
    EXPECT_EQ(refused.exit_code, 1) << command[1];
    EXPECT_THAT(refused.standard_error, HasSubstr("INVALID_ARGUMENT: 2 sessions are called '" + name + "': 1 (robot "));
    EXPECT_THAT(refused.standard_error, HasSubstr("2 (robot anna)"));
  }
  EXPECT_EQ(daemon_->client()->sessions().or_throw().size(), 2u);
  EXPECT_THAT(relmap({"session", "freeze", "anna/" + name}).standard_output, HasSubstr("session 2 is frozen"));
  // One that is deleted is not meant.
  ASSERT_EQ(relmap({"session", "delete", "1", "--yes"}).exit_code, 0);
  EXPECT_THAT(relmap({"session", "thaw", name}).standard_output, HasSubstr("session 2 is thawed"));
}

TEST_F(Operator, SeesWhatSpeaksForAClosureAndAgainstIt) {
  std::vector<std::string> ids;
  for (const int at : {5, 8, 11}) ids.push_back(propose("1:" + std::to_string(at), "1:" + std::to_string(80 + at)));
  edge({"accept", ids[0], "--note", "I was there"});

  const Finished said = relmap({"edges", "--explain", ids[0], "--out", folder_ / "pair.svg"});
  ASSERT_EQ(said.exit_code, 0) << said.standard_error;
  for (const char* part : {"  evidence  verified by stereo: ", "  suspicion 0.", "  today     geometry finds ",
                           "  motion    agrees with it", "  agree     2 closures of other frames", "I was there"})
    EXPECT_THAT(said.standard_output, HasSubstr(part));
  const std::string pair = contents(folder_ / "pair.svg");
  for (const char* part : {"<svg ", "1:5<", "1:85<", "no picture: ", " matches agree", "suspicion 0."})
    EXPECT_THAT(pair, HasSubstr(part)) << "points of a simulation come without pictures";
  EXPECT_GT(std::count(pair.begin(), pair.end(), '\n'), 30) << "the points are drawn all the same";
  const Finished json = relmap({"--json", "edges", "--explain", ids[0], "--out", folder_ / "pair.png"});
  EXPECT_EQ(std::count(json.standard_output.begin(), json.standard_output.end(), '\n'), 1) << "one document";
  for (const char* key : {"\"edge\":", "\"suspicion\":", "\"correspondences\":", "\"motion\":", "\"agreements\":"})
    EXPECT_THAT(json.standard_output, HasSubstr(key));
  EXPECT_THAT(contents(folder_ / "pair.png"), ::testing::StartsWith("\x89PNG"));

  // Of the robot's own motion there is no pair of pictures.
  EXPECT_THAT(explain("1:5/0"), HasSubstr("odometry 1:4 -> 1:5"));
  EXPECT_THAT(relmap({"edges", "--explain", "1:5/0", "--out", folder_ / "motion.svg"}).standard_error,
              HasSubstr("ODOMETRY_EDGE"));
  EXPECT_THAT(relmap({"edges", "--explain", ids[0], "--out", folder_ / "pair.gif"}).standard_error,
              HasSubstr("INVALID_ARGUMENT: " + folder_ / "pair.gif" + " ends neither in .svg nor in .png"));
  EXPECT_THAT(relmap({"edges", "--explain", "1:5/7"}).standard_error, HasSubstr("NO_SUCH_EDGE"));
}

TEST_F(Operator, ListsTheMostSuspiciousClosuresAndSeesThemOnASheet) {
  std::vector<std::string> ids;
  for (const int at : {5, 8, 11, 14}) ids.push_back(propose("1:" + std::to_string(at), "1:" + std::to_string(80 + at)));
  const Finished listed = relmap({"edges", "--suspicion", "--limit", "3"});
  ASSERT_EQ(listed.exit_code, 0) << listed.standard_error;
  EXPECT_THAT(listed.standard_output, HasSubstr("suspicion"));
  EXPECT_EQ(std::count(listed.standard_output.begin(), listed.standard_output.end(), '\n'), 4)
      << "heads and 3 closures";
  EXPECT_THAT(relmap({"edges", "--loops", "--near", "1:5", "--within", "1"}).standard_output, HasSubstr(ids[0]));
  EXPECT_THAT(relmap({"edges", "--loops", "--session", "1,1"}).standard_output, HasSubstr(ids[3]));
  EXPECT_THAT(relmap({"edges", "--loops", "--until", "1970-01-02"}).standard_output, Not(HasSubstr(ids[0])));
  EXPECT_THAT(relmap({"edges", "--loops", "--since", "tomorrow"}).standard_error,
              HasSubstr("is no time; write 2026-11-30"));
  EXPECT_THAT(relmap({"edges", "--session", "1,nobody"}).standard_error, HasSubstr("NO_SUCH_SESSION"));

  const Finished drawn = relmap({"edges", "--by", "suspicion", "--limit", "2", "--out", folder_ / "sheet.svg"});
  ASSERT_EQ(drawn.exit_code, 0) << drawn.standard_error;
  const std::string sheet = contents(folder_ / "sheet.svg");
  for (const char* part : {">2 loop closures, the most suspicious first<", ">1. ", ">2. ", "no picture: "})
    EXPECT_THAT(sheet, HasSubstr(part));
  EXPECT_THAT(sheet, Not(HasSubstr(">3. ")));
  EXPECT_THAT(relmap({"edges", "--state", "removed", "--out", folder_ / "none.svg"}).standard_error,
              HasSubstr("EMPTY_MAP: there is no such loop closure to draw"));
}

TEST_F(Operator, DrawsRoutesAndMaps) {
  for (const int at : {5, 8, 11}) propose("1:" + std::to_string(at), "1:" + std::to_string(80 + at));
  ASSERT_EQ(relmap({"label", "1:60", "<b>dock</b>"}).exit_code, 0);
  const Finished route = relmap({"route", "--from", "1:0", "--to", "label:<b>dock</b>", "--alternatives", "2", "--out",
                                 folder_ / "strip.svg", "--stops", "5"});
  ASSERT_EQ(route.exit_code, 0) << route.standard_error;
  const std::string strip = contents(folder_ / "strip.svg");
  for (const char* part : {"From 1:0 to 1:60", "standard deviation of the position", "&lt;b&gt;dock&lt;/b&gt;"})
    EXPECT_THAT(strip, HasSubstr(part));
  EXPECT_THAT(strip, Not(HasSubstr("<b>")));

  const Finished map = relmap({"map", "--tears", "--colour", "uncertainty", "--out", folder_ / "map.svg"});
  ASSERT_EQ(map.exit_code, 0) << map.standard_error;
  EXPECT_THAT(contents(folder_ / "map.svg"), HasSubstr("(one sigma)"));
  EXPECT_THAT(map.standard_error, HasSubstr("no tear: the picture stretches no edge by more than 6 sigmas"));
  const Finished json = relmap({"--json", "map", "--tears", "--out", folder_ / "map.svg"});
  EXPECT_THAT(json.standard_output, HasSubstr("\"keyframes\":"));
  EXPECT_THAT(json.standard_output, HasSubstr("\"tears\":0"));
  expect_keys_are_documented(json.standard_output);
  const Finished times = relmap({"map", "--colour", "time", "--out", folder_ / "map.svg"});
  ASSERT_EQ(times.exit_code, 0) << times.standard_error;
  EXPECT_THAT(contents(folder_ / "map.svg"), HasSubstr("colour: when it was"));
  EXPECT_EQ(relmap({"map", "--colour", "loudness", "--out", folder_ / "map.svg"}).exit_code, 2);
}

TEST_F(Operator, ReportsOnTheMap) {
  for (const int at : {5, 8, 11}) propose("1:" + std::to_string(at), "1:" + std::to_string(80 + at));
  ASSERT_EQ(relmap({"label", "1:40", "<script>alert(1)</script>"}).exit_code, 0);
  const Finished done = relmap({"report", "--out", folder_ / "report.html", "--suspicious", "2"});
  ASSERT_EQ(done.exit_code, 0) << done.standard_error;
  const std::string page = contents(folder_ / "report.html");
  for (const char* part : {"<!DOCTYPE html>", "Loop closures", "3 in force", "Who edited what", "<svg "})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_THAT(page, HasSubstr("Mean reprojection error of "));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  const Finished json = relmap({"--json", "report", "--out", folder_ / "report.html"});
  EXPECT_THAT(json.standard_output, ::testing::StartsWith("{\"out\":"));
  for (const char* key :
       {"\"bytes\":", "\"findings\":[", "\"tears\":", "\"parts\":1", "\"suspicious\":", "\"shown\":3"})
    EXPECT_THAT(json.standard_output, HasSubstr(key));
  expect_keys_are_documented(json.standard_output);
  const Finished without = relmap({"--json", "report", "--out", folder_ / "report.html", "--suspicious", "0"});
  EXPECT_THAT(without.standard_output, HasSubstr("\"shown\":0"));
  EXPECT_THAT(contents(folder_ / "report.html"), HasSubstr("of those in force")) << "how many are suspicious";
  const Finished undrawn = relmap({"--json", "report", "--out", folder_ / "report.html", "--no-map"});
  ASSERT_EQ(undrawn.exit_code, 0) << undrawn.standard_error;
  for (const char* key : {"\"tears\":", "\"parts\":"}) EXPECT_THAT(undrawn.standard_output, Not(HasSubstr(key)));
  EXPECT_THAT(contents(folder_ / "report.html"), Not(HasSubstr("<h2>The map</h2>")));
  EXPECT_THAT(contents(folder_ / "report.html"), Not(HasSubstr("--no-map")));
  EXPECT_EQ(relmap({"report", "--out", "-"}).standard_output.substr(0, 15), "<!DOCTYPE html>");
  EXPECT_THAT(relmap({"report", "--out", folder_ / "report.txt"}).standard_error, HasSubstr("must end with .html"));
}

TEST_F(Operator, IsToldThatAnAnswerCannotBeWritten) {
  const std::string command = built_program("relmap") + " --server " + options_.data + " sessions >/dev/full";
  const Finished lost = run_program({"/bin/sh", "-c", command});
  EXPECT_EQ(lost.exit_code, 1);
  EXPECT_THAT(lost.standard_error, HasSubstr("IO_ERROR"));
}

TEST_F(Operator, BadLabelsAreRefusedByName) {
  EXPECT_THAT(relmap({"label", "1:5", " "}).standard_error, HasSubstr("BAD_NAME: label is nothing but white space"));
  const std::string bad = "caf\xe9";
  EXPECT_THAT(relmap({"label", "1:5", bad}).standard_error, HasSubstr("BAD_NAME: label is not UTF-8"));
  EXPECT_THAT(relmap({"labels", bad}).standard_error, HasSubstr("INVALID_ARGUMENT: prefix is not UTF-8"));
  EXPECT_THAT(relmap({"labels", "--words", bad}).standard_error, HasSubstr("INVALID_ARGUMENT: words is not UTF-8"));
  EXPECT_THAT(relmap({"route", "--from", "1:5", "--to", bad}).standard_error, HasSubstr(" is not UTF-8"));
  EXPECT_EQ(relmap({"labels"}).standard_output.find("1:5"), std::string::npos) << "none was given";
  const Finished named = relmap({"label", "1:5", "café"});
  EXPECT_EQ(named.exit_code, 0) << named.standard_error;
}

}  // namespace
}  // namespace relmap::testing
