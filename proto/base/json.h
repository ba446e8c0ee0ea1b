// Writes a JSON object member by member.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace relmap {

// Members keep the order in which they are added. Invalid UTF-8 in texts is replaced by U+FFFD. Whole numbers are
// written without a decimal point, others with as few digits as identify the value. NaN and infinity are written as
// null.
class Json {
 public:
  Json& add(std::string_view key, std::string_view text);
  Json& add(std::string_view key, const char* text) { return add(key, std::string_view(text)); }
  Json& add(std::string_view key, std::same_as<bool> auto value) { return put(key, value ? "true" : "false"); }
  template <std::integral Number>
  requires(!std::same_as<Number, bool>) Json& add(std::string_view key, Number value) {
    return put(key, std::to_string(value));
  }
  Json& add(std::string_view key, double value);
  // Rounds the value to `digits` decimal places. Adds null for nullopt.
  Json& add(std::string_view key, std::optional<double> value, int digits);
  // Adds null for nullopt.
  template <typename Value>
  Json& add(std::string_view key, const std::optional<Value>& value) {
    return value ? add(key, *value) : add_null(key);
  }
  Json& add(std::string_view key, const Json& object) { return put(key, object.text()); }
  Json& add(std::string_view key, const std::vector<Json>& objects);
  Json& add(std::string_view key, const std::vector<std::string>& texts);
  Json& add(std::string_view key, const std::vector<double>& numbers);
  Json& add(std::string_view key, const std::vector<double>& numbers, int digits);  // rounded to `digits` places
  Json& add_null(std::string_view key) { return put(key, "null"); }
  // Adds a value that is JSON already.
  Json& add_json(std::string_view key, std::string_view json) { return put(key, json); }
  // Appends all members of `other`.
  Json& merge(const Json& other);

  std::string text() const;        // on one line
  std::string text_lines() const;  // for people to read: one line a member, with a newline at the end

  // Returns `text` as a JSON string, quoted and escaped.
  static std::string quoted(std::string_view text);

 private:
  Json& put(std::string_view key, std::string_view value);

  std::vector<std::string> members_;
};

}  // namespace relmap
