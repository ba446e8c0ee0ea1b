#include "proto/base/json_object.h"

#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>

namespace relmap {

namespace {

// Takes the members of the outermost object as they come, so that what is nested in it is never built.
class MemberReader : public nlohmann::json_sax<nlohmann::json> {
 public:
  std::map<std::string, std::variant<std::string, double>, std::less<>> members;

  bool start_object(std::size_t) override { return open(true); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(false); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    if (depth_ == 1) key_ = std::move(name);
    return true;
  }
  bool string(string_t& value) override { return take(std::move(value)); }
  bool number_integer(number_integer_t value) override { return take(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return take(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return take(value); }
  bool boolean(bool) override { return depth_ > 0; }
  bool null() override { return depth_ > 0; }
  bool binary(binary_t&) override { return depth_ > 0; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  bool open(bool object) {
    ++depth_;
    return object || depth_ > 1;
  }
  bool close() {
    --depth_;
    return true;
  }
  template <typename Value>
  bool take(Value value) {
    if (depth_ == 1) members[key_] = std::move(value);
    return depth_ > 0;
  }

  int depth_ = 0;
  std::string key_;
};

}  // namespace

std::optional<JsonObject> JsonObject::parse(std::string_view text) {
  MemberReader reader;
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &reader)) return std::nullopt;
  JsonObject object;
  object.members_ = std::move(reader.members);
  return object;
}

const std::string* JsonObject::text(std::string_view key) const {
  const auto found = members_.find(key);
  return found == members_.end() ? nullptr : std::get_if<std::string>(&found->second);
}

std::optional<double> JsonObject::number(std::string_view key) const {
  const auto found = members_.find(key);
  const double* number = found == members_.end() ? nullptr : std::get_if<double>(&found->second);
  return number ? std::optional(*number) : std::nullopt;
}

}  // namespace relmap
