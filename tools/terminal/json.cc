#include "tools/terminal/json.h"

#include <cstdio>

namespace relmap::terminal {

namespace {

std::string json_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (c == '\n') {
      out += "\\n";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\u%04x", c);
      out += escaped;
    } else {
      out += c;
    }
  }
  return out + '"';
}

}  // namespace

Json& Json::put(std::string_view key, std::string_view value) {
  if (!members_.empty()) members_ += ',';
  members_ += json_string(key) + ':';
  members_ += value;
  return *this;
}

Json& Json::add(std::string_view key, std::string_view text) { return put(key, json_string(text)); }

Json& Json::add(std::string_view key, double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value + 0.0);  // -0 + 0 is 0
  return put(key, text);
}

Json& Json::add(std::string_view key, const std::vector<Json>& list) {
  std::string items;
  for (const Json& item : list) items += (items.empty() ? "" : ",") + item.text();
  return put(key, "[" + items + "]");
}

Json& Json::add(std::string_view key, const std::vector<std::string>& texts) {
  std::string items;
  for (const std::string& text : texts) items += (items.empty() ? "" : ",") + json_string(text);
  return put(key, "[" + items + "]");
}

}  // namespace relmap::terminal
