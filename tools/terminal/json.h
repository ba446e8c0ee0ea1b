// A JSON object, written key by key.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace relmap::terminal {

class Json {
 public:
  Json& add(std::string_view key, std::string_view text);  // UTF-8
  Json& add(std::string_view key, const char* text) { return add(key, std::string_view(text)); }
  Json& add(std::string_view key, std::same_as<bool> auto value) { return put(key, value ? "true" : "false"); }
  Json& add(std::string_view key, std::unsigned_integral auto value) requires(!std::same_as<decltype(value), bool>) {
    return put(key, std::to_string(value));
  }
  Json& add(std::string_view key, double value);
  Json& add(std::string_view key, const Json& object) { return put(key, object.text()); }
  Json& add(std::string_view key, const std::vector<Json>& list);
  Json& add(std::string_view key, const std::vector<std::string>& texts);  // UTF-8

  std::string text() const { return "{" + members_ + "}"; }

 private:
  Json& put(std::string_view key, std::string_view value);
  std::string members_;
};

}  // namespace relmap::terminal
