#include "proto/wire/lcm_url.h"

#include <arpa/inet.h>

#include <charconv>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>

#include "proto/wire/lcm_link.h"

namespace relmap {

namespace {

constexpr const char* kExample = "udpm://239.255.76.67:7667?ttl=0";

Status wrong(const std::string& what) { return {Reason::INVALID_ARGUMENT, what}; }

template <typename Number>
std::optional<Number> number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

template <typename Number>
bool within(std::string_view text, Number low, Number high) {
  const auto value = number<Number>(text);
  return value && *value >= low && *value <= high;
}

// Accepts GROUP:PORT, GROUP (LCM's default port), or nothing (LCM's default group and port).
Status check_group(const std::string& network) {
  if (network.empty()) return {};
  const std::size_t colon = network.find(':');
  const std::string group = network.substr(0, colon);
  in_addr address{};
  if (::inet_pton(AF_INET, group.c_str(), &address) != 1 || !IN_MULTICAST(ntohl(address.s_addr)))
    return wrong("'" + group + "' is no IPv4 multicast group, 224.0.0.0 to 239.255.255.255, as in " + kExample);
  if (colon != std::string::npos && !within<int>(network.substr(colon + 1), 1, 65535))
    return wrong("'" + network.substr(colon + 1) + "' is no port, 1 to 65535, as in " + kExample);
  return {};
}

struct Option {
  bool (*fits)(std::string_view value);
  const char* needs;
};
using Options = std::map<std::string, Option>;

const Options& options_of(const std::string& provider) {
  static const Options udpm{
      {"ttl", {[](std::string_view text) { return within<int>(text, 0, 255); }, "a number from 0 to 255"}},
      {"recv_buf_size",
       {[](std::string_view text) { return within<int>(text, 1, 1 << 30); }, "a number of bytes, at least 1"}}};
  static const Options file{
      {"speed",
       {[](std::string_view text) { return within<double>(text, 0, 1e6); }, "a number, 0: as fast as it goes"}},
      {"mode", {[](std::string_view text) { return text == "r" || text == "w" || text == "a"; }, "r, w or a"}},
      {"start_timestamp",
       {[](std::string_view text) { return number<std::int64_t>(text).has_value(); }, "a number of microseconds"}}};
  static const Options none;
  return provider == "udpm" ? udpm : provider == "file" ? file : none;
}

Status check_options(const LcmUrl& url) {
  if (url.options.ends_with('&')) return wrong("an option is missing behind the last '&'");
  const Options& known = options_of(url.provider);
  std::set<std::string> seen;
  std::istringstream options(url.options);
  for (std::string option; std::getline(options, option, '&');) {
    const std::size_t equals = option.find('=');
    const std::string name = option.substr(0, equals);
    const auto found = known.find(name);
    if (found == known.end()) {
      std::string names;
      for (const auto& [other, what] : known) names += (names.empty() ? "; known: " : ", ") + other;
      return wrong("LCM's " + url.provider + " has no option '" + name + "'" + names);
    }
    if (!seen.insert(name).second) return wrong("option '" + name + "' is given twice");
    if (equals == std::string::npos || !found->second.fits(option.substr(equals + 1)))
      return wrong("option '" + name + "' needs " + found->second.needs);
  }
  return {};
}

}  // namespace

Result<LcmUrl> parse_lcm_url(const std::string& url) {
  const std::size_t scheme = url.find("://");
  if (scheme == std::string::npos) return {Reason::INVALID_ARGUMENT, "'" + url + "' is no LCM URL such as " + kExample};
  LcmUrl parsed;
  parsed.provider = url.substr(0, scheme);
  const std::size_t network = scheme + 3;
  const std::size_t question = url.find('?', network);
  parsed.network = url.substr(network, question == std::string::npos ? question : question - network);
  if (question != std::string::npos) parsed.options = url.substr(question + 1);
  if (parsed.provider != "udpm" && parsed.provider != "file" && parsed.provider != "memq")
    return {Reason::INVALID_ARGUMENT, "LCM provider '" + parsed.provider + "'; known: udpm, file, memq"};
  return parsed;
}

Status check_lcm_url(const LcmUrl& url) {
  if (url.provider == "udpm")
    if (Status group = check_group(url.network); !group.ok()) return group;
  if (url.provider == "file" && url.network.empty()) return wrong("the path of the log is missing: file:///PATH");
  return check_options(url);
}

std::string lcm_option(const LcmUrl& url, const std::string& name) {
  std::istringstream options(url.options);
  for (std::string option; std::getline(options, option, '&');)
    if (option.starts_with(name + "=")) return option.substr(name.size() + 1);
  return {};
}

bool is_replay(const std::string& url) {
  const Result<LcmUrl> parsed = parse_lcm_url(url);
  return parsed.ok() && parsed->provider == "file" && lcm_option(*parsed, "mode") != "w";
}

Result<std::string> complete_lcm_url(const std::string& url) {
  Result<LcmUrl> parsed = parse_lcm_url(url);
  if (!parsed.ok()) return parsed.status();
  if (Status checked = check_lcm_url(*parsed); !checked.ok()) return checked;
  if (parsed->provider != "udpm") return url;
  const auto add = [&](const std::string& name, const std::string& value) {
    if (!lcm_option(*parsed, name).empty()) return;
    parsed->options += (parsed->options.empty() ? "" : "&") + name + "=" + value;
  };
  add("ttl", "0");
  add("recv_buf_size", "4194304");
  return "udpm://" + parsed->network + "?" + parsed->options;
}

bool stays_on_this_machine(const std::string& complete_url) {
  const Result<LcmUrl> parsed = parse_lcm_url(complete_url);
  return parsed.ok() && (parsed->provider != "udpm" || number<int>(lcm_option(*parsed, "ttl")) == 0);
}

}  // namespace relmap
