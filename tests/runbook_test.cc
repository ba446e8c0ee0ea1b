// docs/runbook.md explains every reason and every alert, and nothing else; `relmap-admin explain` prints it, and tools
// lead there where an operator has something to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "proto/base/reason.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/source_tree.h"

namespace relmap::testing {
namespace {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

using Document = nlohmann::json;

Finished admin(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), built_program("relmap-admin"));
  return run_program(arguments);
}

std::vector<Document> explanations(const std::vector<std::string>& names = {}) {
  std::vector<std::string> arguments{"--json", "explain"};
  arguments.insert(arguments.end(), names.begin(), names.end());
  const Finished run = admin(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.standard_error;
  return Document::parse(run.standard_output).at("explanations");
}

// In the order of proto/base/reason.h.
std::vector<std::string> reasons() {
  std::vector<std::string> names;
  for (std::uint32_t number = 0; number < 0x10000; ++number)
    if (is_reason(static_cast<std::uint16_t>(number)))
      names.emplace_back(reason_name(static_cast<Reason>(static_cast<std::uint16_t>(number))));
  return names;
}

// In the order of tools/ops/alerts.yml.
std::vector<std::string> alerts() {
  const std::string file = content_of("tools/ops/alerts.yml");
  const std::regex alert("- alert: ([A-Za-z]+)\n");
  std::vector<std::string> names;
  for (std::sregex_iterator it(file.begin(), file.end(), alert), end; it != end; ++it) names.push_back((*it)[1]);
  return names;
}

std::vector<std::string> explained(const std::string& kind) {
  std::vector<std::string> names;
  for (const Document& explanation : explanations())
    if (explanation.at("kind") == kind) names.push_back(explanation.at("name"));
  return names;
}

TEST(Runbook, ExplainsEachReasonAndEachAlertInTheirOrder) {
  EXPECT_GT(reasons().size(), 100u);
  EXPECT_GT(alerts().size(), 20u);
  EXPECT_THAT(explained("reason"), ElementsAreArray(reasons()));
  EXPECT_THAT(explained("alert"), ElementsAreArray(alerts()));
  for (const Document& explanation : explanations())
    EXPECT_GT(explanation.at("text").get<std::string>().size(), 80u) << explanation.at("name");
}

TEST(Runbook, NamesNoReasonAndNoAlertThatDoesNotExist) {
  std::vector<std::string> known = reasons();
  for (const std::string& alert : alerts()) known.push_back(alert);
  // Files, and what stands for something.
  for (const char* other : {"LOCK", "RESERVE", "NAME", "REASON", "DRIVE", "PID"}) known.emplace_back(other);
  const std::string text = content_of("docs/runbook.md");
  const std::regex name("`(Relmap[A-Za-z]+|[A-Z][A-Z_]{2,})`|\\b(Relmap[A-Z][A-Za-z]+|[A-Z]{2,}_[A-Z_]+)\\b");
  std::size_t named = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), name), end; it != end; ++it, ++named) {
    const std::string found = it->str(1) + it->str(2);
    EXPECT_NE(std::find(known.begin(), known.end(), found), known.end()) << found;
  }
  EXPECT_GT(named, 150u);
}

TEST(Runbook, EachAlertLeadsToItsParagraph) {
  const std::string file = content_of("tools/ops/alerts.yml");
  const std::regex rule("- alert: ([A-Za-z]+)\n[^]*?\n +runbook: relmap-admin explain ([^\n]*)\n");
  std::vector<std::string> known = reasons();
  known.emplace_back("{{ $labels.reason }}");
  std::size_t rules = 0;
  for (std::sregex_iterator it(file.begin(), file.end(), rule), end; it != end; ++it, ++rules) {
    const std::string alert = it->str(1);
    std::string names = it->str(2);
    ASSERT_THAT(names, StartsWith(alert));
    names.erase(0, alert.size());
    const std::regex one("\\{\\{[^}]*\\}\\}|[A-Z_]+");
    for (std::sregex_iterator name(names.begin(), names.end(), one); name != end; ++name)
      EXPECT_NE(std::find(known.begin(), known.end(), name->str()), known.end()) << alert << ": " << name->str();
  }
  EXPECT_EQ(rules, alerts().size());
}

TEST(Explain, PrintsParagraphsWrappedAndWithoutMarks) {
  const Finished run = admin({"explain", "disk_full", "RELMAPDOWN", "DATA_LOSS"});
  EXPECT_EQ(run.exit_code, 0) << run.standard_error;
  const std::string& text = run.standard_output;
  EXPECT_THAT(text, StartsWith("DISK_FULL\n\n"));
  EXPECT_LT(text.find("\n\nRelmapDown\n\n"), text.find("\n\nDATA_LOSS\n\n"));
  EXPECT_THAT(text, HasSubstr("\n    runuser -u relmap -- relmap-admin repair /var/lib/relmap/map\n"));
  EXPECT_THAT(text, Not(HasSubstr("`")));
  EXPECT_THAT(text, Not(HasSubstr("###")));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const bool code = line.starts_with("    ");
    EXPECT_TRUE(code || line.size() <= 80) << line;
  }
}

TEST(Explain, WithoutNamesTellsWhereToLookFirstAndListsAll) {
  const std::string text = admin({"explain"}).standard_output;
  EXPECT_THAT(text, StartsWith("Where to look first\n\n    systemctl status relmapd\n"));
  std::vector<std::string> known = reasons();
  for (const std::string& alert : alerts()) known.push_back(alert);
  for (const std::string& name : known)
    EXPECT_TRUE(std::regex_search(text, std::regex("(^|[ \n])" + name + "($|[ \n])"))) << name;
  EXPECT_THAT(text, HasSubstr("\nThe daemon and its disk\n"));
}

TEST(Explain, SaysWhatMayHaveBeenMeant) {
  const Finished run = admin({"explain", "READ_ONLY", "disk_ful"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.standard_output, "");
  EXPECT_THAT(run.standard_error, StartsWith("INVALID_ARGUMENT: there is neither a reason nor an alert 'disk_ful'; did "
                                             "you mean DISK_FULL?\n"));
  EXPECT_THAT(admin({"explain", "relmapdwon"}).standard_error, HasSubstr("did you mean RelmapDown?"));
  EXPECT_THAT(admin({"explain", "tuesday"}).standard_error, HasSubstr("relmap-admin explain lists all"));
}

TEST(Explain, AsJsonGivesTheText) {
  const std::vector<Document> found = explanations({"lone", "relmapdown"});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].at("name"), "LONE");
  EXPECT_EQ(found[0].at("kind"), "reason");
  EXPECT_EQ(found[0].at("group"), "Why a loop closure is in its state");
  EXPECT_THAT(found[0].at("text").get<std::string>(), StartsWith("### LONE\n\nThe closure is a candidate"));
  EXPECT_EQ(found[1].at("kind"), "alert");
}

// An empty folder, which no daemon serves.
class Advice : public ::testing::Test {
 protected:
  Finished status(std::vector<std::string> options) const {
    std::vector<std::string> arguments{built_program("relmap"), "--server", folder_ / ""};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_program(arguments);
  }
  const storage::TemporaryFolder folder_;
};

TEST_F(Advice, StandsBehindWhatAnOperatorHasToSettle) {
  const std::string advice = "\nrelmap-admin explain UNREACHABLE tells what to do\n";
  EXPECT_THAT(admin({"--server", folder_ / "", "stats"}).standard_error, HasSubstr(advice));
  EXPECT_THAT(status({"status"}).standard_error, HasSubstr(advice));
}

TEST_F(Advice, IsNotForScriptsNorForMistakes) {
  EXPECT_THAT(admin({"--json", "--server", folder_ / "", "stats"}).standard_error, Not(HasSubstr("explain")));
  EXPECT_THAT(admin({"stats", folder_ / "nowhere"}).standard_error, Not(HasSubstr("explain")));
  EXPECT_THAT(status({"--json", "status"}).standard_error, Not(HasSubstr("explain")));
}

}  // namespace
}  // namespace relmap::testing
