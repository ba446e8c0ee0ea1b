// The results of a benchmark: named numbers, printed as a table or as one JSON object. Keys are a contract, since
// scripts and README's figures use them: a key is never renamed, and never gets another unit (which is part of it: _us,
// _m).
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

  // The value of a key, or the median of its values. Throws if there is none.
  double value(const std::string& key) const;

  // Values that are not finite are printed as null.
  void print_json(std::ostream& out) const;
  void print_table(std::ostream& out) const;

 private:
  struct Row {
    std::string key;
    double value;
    std::vector<double> series;  // used instead of `value` if not empty
    std::string meaning;
  };
  std::vector<Row> rows_;
};

double mean(const std::vector<double>& samples);
double deviation(const std::vector<double>& samples);  // standard, of the population they are drawn from

}  // namespace relmap::bench
