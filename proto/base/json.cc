#include "proto/base/json.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace relmap {

namespace {

std::string number_of(double value) {
  constexpr double kExact = 1e15;  // whole numbers below it are exact
  if (std::floor(value) == value && std::abs(value) < kExact) return std::to_string(static_cast<std::int64_t>(value));
  return nlohmann::json(value).dump();
}

double rounded(double value, int digits) {
  const double scale = std::pow(10.0, digits);
  return std::round(value * scale) / scale;
}

std::string joined(const std::vector<std::string>& items, const char* separator) {
  std::string text;
  for (const std::string& item : items) {
    if (!text.empty()) text += separator;
    text += item;
  }
  return text;
}

template <typename Items, typename Text>
std::string list_of(const Items& items, const Text& text_of) {
  std::vector<std::string> texts;
  for (const auto& item : items) texts.push_back(text_of(item));
  return '[' + joined(texts, ",") + ']';
}

}  // namespace

std::string Json::quoted(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Json& Json::put(std::string_view key, std::string_view value) {
  members_.push_back(quoted(key) + ':');
  members_.back() += value;
  return *this;
}

Json& Json::add(std::string_view key, std::string_view text) { return put(key, quoted(text)); }

Json& Json::add(std::string_view key, double value) { return put(key, number_of(value)); }

Json& Json::add(std::string_view key, std::optional<double> value, int digits) {
  return value ? add(key, rounded(*value, digits)) : add_null(key);
}

Json& Json::merge(const Json& other) {
  members_.insert(members_.end(), other.members_.begin(), other.members_.end());
  return *this;
}

Json& Json::add(std::string_view key, const std::vector<Json>& objects) {
  return put(key, list_of(objects, [](const Json& object) { return object.text(); }));
}

Json& Json::add(std::string_view key, const std::vector<std::string>& texts) {
  return put(key, list_of(texts, quoted));
}

Json& Json::add(std::string_view key, const std::vector<double>& numbers) {
  return put(key, list_of(numbers, number_of));
}

Json& Json::add(std::string_view key, const std::vector<double>& numbers, int digits) {
  return put(key, list_of(numbers, [digits](double number) { return number_of(rounded(number, digits)); }));
}

std::string Json::text() const { return '{' + joined(members_, ",") + '}'; }

std::string Json::text_lines() const { return "{\n  " + joined(members_, ",\n  ") + "\n}\n"; }

}  // namespace relmap
