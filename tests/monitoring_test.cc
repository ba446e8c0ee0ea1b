// tools/ops: Prometheus can use the rules and the example of a configuration, the alerts fire when they should, and
// alerts and dashboard use no metric and no label that docs/metrics.md does not have. promtool is Prometheus' own
// checker.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/metrics_table.h"
#include "tests/support/process.h"
#include "tests/support/source_tree.h"

namespace relmap::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Document = nlohmann::json;

std::string ops(const std::string& file) { return (kSourceTree / "tools/ops" / file).string(); }

void expect_checks(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "promtool");
  const Finished run = run_program(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.standard_output << run.standard_error;
}

struct Panel {
  std::string title, expression, legend;
};
std::vector<Panel> panels() {
  std::vector<Panel> found;
  const Document dashboard = Document::parse(content_of("tools/ops/dashboard.json"));
  for (const Document& panel : dashboard.at("panels"))
    for (const Document& target : panel.value("targets", Document::array()))
      found.push_back({panel.at("title"), target.at("expr"), target.at("legendFormat")});
  return found;
}

// The rules of alerts.yml, each as its expression and all of its text.
struct Rule {
  std::string alert, expression, text;
};
std::vector<Rule> rules() {
  std::string file = content_of("tools/ops/alerts.yml");
  std::vector<Rule> found;
  const std::regex parts(R"(alert: (\w+)\n +expr: (>-\n)?([^]*?)\n +(for|labels): )");
  for (std::size_t at = file.find("- alert: "); at != std::string::npos;) {
    const std::size_t end = file.find("- alert: ", at + 1);
    const std::string rule = file.substr(at, end - at);
    std::smatch match;
    EXPECT_TRUE(std::regex_search(rule, match, parts)) << rule;
    found.push_back({match[1], match[3], rule});
    at = end;
  }
  return found;
}

TEST(Monitoring, PrometheusTakesTheRulesAndTheConfiguration) {
  expect_checks({"check", "rules", ops("alerts.yml")});
  expect_checks({"check", "config", "--syntax-only", ops("prometheus.yml")});
}

TEST(Monitoring, AlertsFireWhenTheyShouldAndOnlyThen) {
  expect_checks({"test", "rules", ops("alerts_test.yml")});
  const std::string tests = content_of("tools/ops/alerts_test.yml");
  for (const Rule& rule : rules()) {
    const std::string fires = "alertname: " + rule.alert + "\n        exp_alerts:\n";
    const std::string stays_silent = "alertname: " + rule.alert + "\n        exp_alerts: []\n";
    EXPECT_NE(tests.find(fires), std::string::npos) << rule.alert;
    EXPECT_NE(tests.find(stays_silent), std::string::npos) << rule.alert;
  }
  EXPECT_GT(rules().size(), 20u);
}

TEST(Monitoring, AlertsUseDocumentedMetrics) {
  const auto table = documented_metrics(content_of("docs/metrics.md"));
  EXPECT_GT(table.size(), 50u);
  for (const Rule& rule : rules())
    EXPECT_THAT(undocumented(table, rule.expression, rule.text), IsEmpty()) << rule.alert;
}

TEST(Dashboard, UsesDocumentedMetrics) {
  const auto table = documented_metrics(content_of("docs/metrics.md"));
  for (const Panel& panel : panels())
    EXPECT_THAT(undocumented(table, panel.expression, panel.legend), IsEmpty()) << panel.title;
  EXPECT_GT(panels().size(), 50u);
}

// As rules of Prometheus, with values for Grafana's variables.
TEST(Dashboard, ExpressionsCanBeParsed) {
  const storage::TemporaryFolder folder;
  std::ofstream file(folder / "rules.yml");
  file << "groups:\n- name: dashboard\n  rules:\n";
  std::size_t number = 0;
  for (const Panel& panel : panels()) {
    std::string expression = std::regex_replace(panel.expression, std::regex(R"(\$__rate_interval)"), "5m");
    expression = std::regex_replace(expression, std::regex(R"(\$instance)"), ".*");
    EXPECT_EQ(expression.find('$'), std::string::npos) << expression;
    file << "  - record: panel_" << number++ << "\n    expr: " << Document(expression).dump() << '\n';
  }
  file.close();
  expect_checks({"check", "rules", folder / "rules.yml"});
}

TEST(Dashboard, IsOneThatGrafanaImports) {
  const Document dashboard = Document::parse(content_of("tools/ops/dashboard.json"));
  EXPECT_GE(dashboard.at("schemaVersion"), 36);  // Grafana 9
  EXPECT_TRUE(dashboard.at("id").is_null());     // Grafana chooses one
  std::vector<std::string> variables, rows;
  for (const Document& variable : dashboard.at("templating").at("list")) variables.push_back(variable.at("name"));
  EXPECT_THAT(variables, ElementsAre("datasource", "instance"));
  std::set<int> ids;
  for (const Document& panel : dashboard.at("panels")) {
    if (panel.at("type") == "row") rows.push_back(panel.at("title"));
    EXPECT_TRUE(ids.insert(panel.at("id").get<int>()).second) << panel.at("title");
    const Document& place = panel.at("gridPos");
    EXPECT_LE(place.at("x").get<int>() + place.at("w").get<int>(), 24) << panel.at("title");
  }
  EXPECT_THAT(
      rows, ElementsAre("Health", "Ingest", "Latency", "Journal and worker", "Map", "Memory", "Disk", "RPC", "Robots"));
}

TEST(MetricsTable, KnowsWhatAnExpressionUses) {
  const auto table = documented_metrics(
      "| name | type | labels | meaning |\n|---|---|---|---|\n| `a_total`, b | counter | reason: X, Y; kind | |\n"
      "| h_seconds | histogram | method, reason | |\n");
  ASSERT_EQ(table.size(), 3u);
  EXPECT_THAT(table.at("a_total").labels, ElementsAre("kind", "reason"));
  const auto missing = [&](const std::string& promql, const std::string& text = "") {
    return undocumented(table, promql, text);
  };
  EXPECT_THAT(
      missing("sum by (instance, reason) (rate(a_total{kind=~\"c_total{x}|d\"}[$__rate_interval])) > 1e6 and b"),
      IsEmpty());
  EXPECT_THAT(missing("histogram_quantile(0.9, sum by (le) (rate(h_seconds_bucket[5m])))", "{{ method }}"), IsEmpty());
  EXPECT_THAT(missing("a_total{method=\"x\"} / c", "{{method}} $labels.kind"),
              ElementsAre("a_total{method}", "c", "label method"));
  EXPECT_THAT(missing("rate(h_seconds[5m]) + a_total_bucket"), ElementsAre("a_total_bucket", "h_seconds"));
  EXPECT_THAT(missing("sum by (le) (b)"), ElementsAre("label le"));
}

}  // namespace
}  // namespace relmap::testing
