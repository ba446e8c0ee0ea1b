#include "proto/wire/lcm_url.h"

#include <sstream>

#include "proto/wire/lcm_link.h"

namespace relmap {

Result<LcmUrl> parse_lcm_url(const std::string& url) {
  const std::size_t scheme = url.find("://");
  if (scheme == std::string::npos)
    return {Reason::INVALID_ARGUMENT, "'" + url + "' is no LCM URL such as udpm://239.255.76.67:7667?ttl=0"};
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
  return parsed.ok() && (parsed->provider != "udpm" || lcm_option(*parsed, "ttl") == "0");
}

}  // namespace relmap
