#include "tests/support/bench_figures.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "tests/support/process.h"

namespace relmap::testing {

namespace {

// Moves `at` beyond the number.
double read_number(const char*& at) {
  constexpr char kNull[] = "null";
  if (std::strncmp(at, kNull, sizeof kNull - 1) == 0) {
    at += sizeof kNull - 1;
    return std::numeric_limits<double>::quiet_NaN();
  }
  char* end = nullptr;
  const double number = std::strtod(at, &end);
  at = end;
  return number;
}

}  // namespace

BenchFigures::BenchFigures(const std::vector<std::string>& arguments, std::chrono::milliseconds patience) {
  std::vector<std::string> command{built_program("relmap-bench")};
  command.insert(command.end(), arguments.begin(), arguments.end());
  command.push_back("--json");
  const Finished done = run_program(command, patience);
  if (done.exit_code != 0) throw std::runtime_error("relmap-bench: " + done.standard_error);
  json_ = done.standard_output;
  std::printf("%s%s", done.standard_error.c_str(), json_.c_str());
}

const char* BenchFigures::find(const std::string& key) const {
  const std::string label = "\"" + key + "\": ";
  const std::size_t at = json_.find(label);
  if (at == std::string::npos) throw std::runtime_error("no figure " + key);
  return json_.c_str() + at + label.size();
}

double BenchFigures::operator[](const std::string& key) const {
  const char* at = find(key);
  return read_number(at);
}

std::vector<double> BenchFigures::series(const std::string& key) const {
  std::vector<double> numbers;
  for (const char* at = find(key); *at == '[' || *at == ',';) {
    at += std::strspn(at, "[, ");
    numbers.push_back(read_number(at));
  }
  return numbers;
}

}  // namespace relmap::testing
