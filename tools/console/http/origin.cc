#include "tools/console/http/origin.h"

#include <algorithm>
#include <cctype>

namespace relmap::console {

namespace {

constexpr std::size_t kMaxHost = 255;

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

bool is_digits(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

// What browsers leave out.
HostName without_default_port(HostName host, std::string_view scheme) {
  if (host.port == (scheme == "https" ? "443" : "80")) host.port.clear();
  return host;
}

}  // namespace

Result<HostName> parse_host(std::string_view text) {
  const auto refused = [&] {
    return Status(Reason::INVALID_ARGUMENT, "'" + std::string(text.substr(0, kMaxHost)) + "' is no HOST or HOST:PORT");
  };
  if (text.empty() || text.size() > kMaxHost) return refused();
  HostName host;
  std::string_view rest;
  if (text.front() == '[') {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos || end == 1) return refused();
    host.name = lower(text.substr(1, end - 1));
    rest = text.substr(end + 1);
    if (host.name.find_first_not_of("0123456789abcdef:.%") != std::string::npos) return refused();
  } else {
    const std::size_t end = std::min(text.find(':'), text.size());
    host.name = lower(text.substr(0, end));
    rest = text.substr(end);
    if (host.name.empty() ||
        host.name.find_first_not_of("0123456789abcdefghijklmnopqrstuvwxyz.-_") != std::string::npos)
      return refused();
    if (host.name.size() > 1 && host.name.back() == '.') host.name.pop_back();
  }
  if (rest.empty()) return host;
  rest.remove_prefix(1);
  if (text[text.size() - rest.size() - 1] != ':' || rest.empty() || rest.size() > 5 || !is_digits(rest))
    return refused();
  host.port = rest;
  return host;
}

Status check_fetch_site(std::string_view site) {
  if (site.empty() || site == "same-origin" || site == "none") return {};
  return {Reason::NOT_ALLOWED, "a page of another site asked for it"};
}

Status OwnNames::check_host(std::string_view text, std::string_view own_address) const {
  const auto host = parse_host(text);
  if (!host.ok()) return host.status();
  const auto is_it = [&](const HostName& one) { return one.name == host->name; };
  if (host->name == own_address || std::find(names_.begin(), names_.end(), host->name) != names_.end() ||
      std::any_of(proxied_.begin(), proxied_.end(), is_it))
    return {};
  return {Reason::NOT_ALLOWED,
          "the console is not known as " + host->name + ": start it with --host " + host->name + " if it is to be"};
}

Status OwnNames::check_origin(std::string_view origin, std::string_view asked, bool tls) const {
  const auto refused = [](const std::string& what) { return Status(Reason::NOT_ALLOWED, what); };
  if (origin.empty()) return refused("a POST without Origin: only the console's own page may ask for it");
  const std::size_t end = origin.find("://");
  const std::string scheme = end == std::string_view::npos ? "" : lower(origin.substr(0, end));
  const auto host = scheme == "http" || scheme == "https" ? parse_host(origin.substr(end + 3))
                                                          : Result<HostName>(Reason::INVALID_ARGUMENT, "no scheme");
  const std::string other = "a page of another origin (" + std::string(origin.substr(0, kMaxHost)) + ") asked for it";
  if (!host.ok() || (tls && scheme != "https")) return refused(other);
  const HostName from = without_default_port(*host, scheme);
  const auto same = [&](const HostName& one) { return without_default_port(one, scheme) == from; };
  const auto named = parse_host(asked);
  if ((named.ok() && same(*named)) || std::any_of(proxied_.begin(), proxied_.end(), same)) return {};
  return refused(other + "; if that is the console's own name, start it with --host " + from.name +
                 (from.port.empty() ? "" : ":" + from.port));
}

}  // namespace relmap::console
