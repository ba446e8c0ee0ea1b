#include "tools/bench/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <ostream>
#include <stdexcept>

#include "proto/base/json.h"

namespace relmap::bench {

namespace {

std::string text(double value) {
  if (!std::isfinite(value)) return "null";
  char buffer[32];
  const bool whole = value == std::floor(value) && std::abs(value) < 1e15;
  std::snprintf(buffer, sizeof buffer, whole ? "%.0f" : "%.6g", value);
  return buffer;
}

}  // namespace

void Report::add(std::string key, double value, std::string meaning) {
  rows_.push_back({std::move(key), value, {}, std::move(meaning)});
}
void Report::add(std::string key, std::vector<double> values, std::string meaning) {
  const double median = quantile(values, 0.5);
  rows_.push_back({std::move(key), median, std::move(values), std::move(meaning)});
}

double Report::value(const std::string& key) const {
  for (const Row& row : rows_)
    if (row.key == key) return row.value;
  throw std::out_of_range("no figure " + key);
}

void Report::print_json(std::ostream& out) const {
  Json json;
  for (const Row& row : rows_) {
    if (row.series.empty())
      json.add(row.key, row.value);
    else
      json.add(row.key, row.series);
  }
  out << json.text_lines();
}

void Report::print_table(std::ostream& out) const {
  std::size_t width = 0;
  for (const Row& row : rows_) width = std::max(width, row.key.size());
  for (const Row& row : rows_) {
    const std::string value = text(row.value);
    out << row.key << std::string(width + 2 - row.key.size(), ' ')
        << std::string(12 - std::min<std::size_t>(12, value.size()), ' ') << value << "  " << row.meaning << '\n';
  }
}

double mean(const std::vector<double>& samples) {
  if (samples.empty()) return 0;
  return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
}

double deviation(const std::vector<double>& samples) {
  if (samples.size() < 2) return 0;
  const double middle = mean(samples);
  double sum = 0;
  for (const double sample : samples) sum += (sample - middle) * (sample - middle);
  return std::sqrt(sum / static_cast<double>(samples.size() - 1));
}

}  // namespace relmap::bench
