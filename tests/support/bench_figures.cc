#include "tests/support/bench_figures.h"

#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/support/process.h"

namespace relmap::testing {

namespace {

double number_of(const nlohmann::json& value) {
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

}  // namespace

struct BenchFigures::Parsed {
  nlohmann::json json;

  const nlohmann::json& at(const std::string& key) const {
    if (!json.contains(key)) throw std::runtime_error("no figure " + key);
    return json.at(key);
  }
};

BenchFigures::BenchFigures(const std::vector<std::string>& arguments, std::chrono::milliseconds patience) {
  std::vector<std::string> command{built_program("relmap-bench")};
  command.insert(command.end(), arguments.begin(), arguments.end());
  command.push_back("--json");
  const Finished done = run_program(command, patience);
  if (done.exit_code != 0) throw std::runtime_error("relmap-bench: " + done.standard_error);
  std::printf("%s%s", done.standard_error.c_str(), done.standard_output.c_str());
  parsed_ = std::make_shared<const Parsed>(Parsed{nlohmann::json::parse(done.standard_output)});
}

double BenchFigures::operator[](const std::string& key) const { return number_of(parsed_->at(key)); }

std::vector<double> BenchFigures::series(const std::string& key) const {
  std::vector<double> numbers;
  for (const nlohmann::json& value : parsed_->at(key)) numbers.push_back(number_of(value));
  return numbers;
}

}  // namespace relmap::testing
