#include "tests/support/metrics_table.h"

#include <algorithm>
#include <cctype>
#include <regex>
#include <sstream>

namespace relmap::testing {

namespace {

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, at);) parts.push_back(part);
  return parts;
}

std::set<std::string> names_in(const std::string& text) {
  static const std::regex name("[a-z_][a-z0-9_]*");
  std::set<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), name), end; it != end; ++it) found.insert(it->str());
  return found;
}

bool in_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == ':'; }

// Reads PromQL from left to right: names, and what they are by what follows them.
class Scanner {
 public:
  explicit Scanner(const std::string& text) : text_(text) {}

  UsedMetrics scan() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '"' || c == '\'')
        skip_past(c);
      else if (c == '[')  // a range, for example of $__rate_interval
        skip_past(']');
      else if (c == '{')
        take_matchers();
      else if (std::isdigit(static_cast<unsigned char>(c)))
        (void)name();  // 1e6, 5m
      else if (in_name(c))
        take_name(name());
      else
        ++at_;
    }
    return used_;
  }

 private:
  void skip_past(char end) { at_ = std::min(text_.find(end, at_ + 1), text_.size() - 1) + 1; }
  std::string name() {
    const std::size_t from = at_;
    while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    return text_.substr(from, at_ - from);
  }
  char next() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  void take_name(const std::string& word) {
    static const std::set<std::string> listing{"by", "without", "on", "ignoring", "group_left", "group_right"};
    static const std::set<std::string> operators{"and", "or", "unless", "bool", "offset"};
    if (listing.contains(word)) {
      if (next() != '(') return;
      const std::size_t end = std::min(text_.find(')', at_), text_.size());
      for (const std::string& label : names_in(text_.substr(at_, end - at_))) used_.grouped_by.insert(label);
      at_ = end;
    } else if (!operators.contains(word) && next() != '(' && !is_aggregator()) {
      last_ = word;
      used_.metrics[word];
    }
  }
  // Whether what was read is a word such as sum in "sum by (reason) (...)".
  bool is_aggregator() const {
    static const std::regex grouping("^(by|without)[ (]");
    return std::regex_search(text_.substr(at_, 8), grouping);
  }
  // component="storage", reason=~"IO_ERROR|DATA_LOSS"
  void take_matchers() {
    for (++at_; next() != '}' && at_ < text_.size();) {
      if (text_[at_] == '"')
        skip_past('"');
      else if (in_name(text_[at_]))
        used_.metrics[last_].insert(name());
      else
        ++at_;
    }
  }

  const std::string text_;
  std::size_t at_ = 0;
  std::string last_;
  UsedMetrics used_;
};

// The metric of a series: that of relmap_append_seconds_bucket is relmap_append_seconds.
std::map<std::string, DocumentedMetric>::const_iterator metric_of(const std::map<std::string, DocumentedMetric>& table,
                                                                  const std::string& series) {
  for (const char* part : {"_bucket", "_count", "_sum"})
    if (series.ends_with(part))
      if (const auto found = table.find(series.substr(0, series.size() - std::string(part).size()));
          found != table.end() && found->second.is_histogram)
        return found;
  const auto found = table.find(series);
  return found != table.end() && found->second.is_histogram ? table.end() : found;  // a histogram is no series
}

}  // namespace

std::map<std::string, DocumentedMetric> documented_metrics(const std::string& markdown) {
  std::map<std::string, DocumentedMetric> table;
  for (const std::string& line : split(markdown, '\n')) {
    const std::vector<std::string> cells = split(line, '|');
    if (!line.starts_with("| ") || cells.size() < 5) continue;
    DocumentedMetric metric;
    metric.is_histogram = cells[2].find("histogram") != std::string::npos;
    if (!metric.is_histogram && cells[2].find("gauge") == std::string::npos &&
        cells[2].find("counter") == std::string::npos)
      continue;
    for (const std::string& group : split(cells[3], ';'))
      metric.labels.merge(names_in(group.substr(0, group.find(':'))));
    for (const std::string& name : names_in(cells[1])) table[name] = metric;
  }
  return table;
}

UsedMetrics metrics_in(const std::string& promql) { return Scanner(promql).scan(); }

std::vector<std::string> undocumented(const std::map<std::string, DocumentedMetric>& table, const std::string& promql,
                                      const std::string& text) {
  std::vector<std::string> missing;
  const UsedMetrics used = metrics_in(promql);
  std::set<std::string> all{"job", "instance"};  // that any of the metrics has
  for (const auto& [series, labels] : used.metrics) {
    std::set<std::string> has{"job", "instance"};
    if (series != "up") {  // Prometheus' own
      const auto metric = metric_of(table, series);
      if (metric == table.end()) {
        missing.push_back(series);
        continue;
      }
      has.insert(metric->second.labels.begin(), metric->second.labels.end());
      if (series.ends_with("_bucket")) has.insert("le");
    }
    for (const std::string& label : labels)
      if (!has.contains(label)) missing.push_back(series + "{" + label + "}");
    all.insert(has.begin(), has.end());
  }
  std::set<std::string> told = used.grouped_by;
  static const std::regex label(R"(\{\{ ?([a-z_]+) ?\}\}|\$labels\.([a-z_]+))");
  for (std::sregex_iterator it(text.begin(), text.end(), label), end; it != end; ++it)
    told.insert(it->str(1) + it->str(2));
  for (const std::string& one : told)
    if (!all.contains(one)) missing.push_back("label " + one);
  return missing;
}

}  // namespace relmap::testing
