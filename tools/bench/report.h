// What a benchmark found: named numbers, printed as a table or as one JSON object. Keys are a contract: scripts and the
// README's figures are read from them, so a key is never renamed or given another unit (which is part of it: _us, _m).
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "proto/base/quantile.h"

namespace relmap::bench {

class Report {
 public:
  void add(std::string key, double value, std::string meaning);
  // One value for each step of something: an array in JSON, its median in the table.
  void add(std::string key, std::vector<double> values, std::string meaning);

  // Not finite: null.
  void print_json(std::ostream& out) const;
  void print_table(std::ostream& out) const;

 private:
  struct Row {
    std::string key;
    double value;
    std::vector<double> series;  // not empty: instead of the value
    std::string meaning;
  };
  std::vector<Row> rows_;
};

double mean(const std::vector<double>& samples);
double deviation(const std::vector<double>& samples);  // standard, of the population they are drawn from

}  // namespace relmap::bench
