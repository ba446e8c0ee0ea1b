// Reads a JSON object of texts and numbers, as Json writes them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace relmap {

class JsonObject {
 public:
  // nullopt if `text` is not one JSON object in UTF-8. Members of other types (lists, objects, true, null) are left
  // out; of two members with one key the last one holds.
  static std::optional<JsonObject> parse(std::string_view text);

  // nullptr or nullopt if there is no such member, or it is of another type.
  const std::string* text(std::string_view key) const;
  std::optional<double> number(std::string_view key) const;

 private:
  std::map<std::string, std::variant<std::string, double>, std::less<>> members_;
};

}  // namespace relmap
