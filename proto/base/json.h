// Text of a JSON object, written member by member.
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace relmap {

// Members stand in the order in which they are added. Texts are UTF-8; what is not is replaced by U+FFFD. Numbers that
// are whole are written as such, others with the fewest digits that tell them from all others; what is no number (NaN,
// infinity) is null.
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
  // Rounded to so many digits behind the point; null where there is no value.
  Json& add(std::string_view key, std::optional<double> value, int digits);
  Json& add(std::string_view key, const Json& object) { return put(key, object.text()); }
  Json& add(std::string_view key, const std::vector<Json>& objects);
  Json& add(std::string_view key, const std::vector<std::string>& texts);
  Json& add(std::string_view key, const std::vector<double>& numbers);
  Json& add_null(std::string_view key) { return put(key, "null"); }
  // All members of the other, behind those that are there.
  Json& merge(const Json& other);

  std::string text() const;        // on one line
  std::string text_lines() const;  // for people to read: each member on a line of its own, with a newline at the end

  // A text with its quotes.
  static std::string quoted(std::string_view text);

 private:
  Json& put(std::string_view key, std::string_view value);

  std::vector<std::string> members_;
};

}  // namespace relmap
