// The table of docs/metrics.md, and the metrics that PromQL expressions use.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace relmap::testing {

struct DocumentedMetric {
  bool is_histogram = false;
  std::set<std::string> labels;
};
// By name. Rows look like "| name, name | type | label: value, value | meaning |" or "... | label, label | ...".
std::map<std::string, DocumentedMetric> documented_metrics(const std::string& markdown);

// What an expression uses: metrics with the labels that it selects by, and the labels that it groups by.
struct UsedMetrics {
  std::map<std::string, std::set<std::string>> metrics;
  std::set<std::string> grouped_by;
};
UsedMetrics metrics_in(const std::string& promql);

// What an expression, and a text with "{{label}}" or "$labels.label" for each of its series, uses and the table does
// not have: "relmap_nix", "relmap_ready{component}". Prometheus gives each series the labels `job` and `instance`.
std::vector<std::string> undocumented(const std::map<std::string, DocumentedMetric>& table, const std::string& promql,
                                      const std::string& text);

}  // namespace relmap::testing
