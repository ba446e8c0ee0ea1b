// By which names the console may be asked, so that neither a page of somebody else (cross-site requests) nor one whose
// name leads here only for now (DNS rebinding) gets anything.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"

namespace relmap::console {

// The text of a Host header or an --host: NAME, NAME:PORT, ADDRESS, [ADDRESS]:PORT. Lower case.
struct HostName {
  std::string name;  // an IPv6 address without its brackets
  std::string port;  // empty: none
  bool operator==(const HostName&) const = default;
};
// INVALID_ARGUMENT.
Result<HostName> parse_host(std::string_view text);

// Whether a request may come from where Sec-Fetch-Site says, for all but documents of the page: from a page of the
// console, from the browser itself, or from a program that says nothing. (A page at another port of this machine is
// "same-site".) NOT_ALLOWED.
Status check_fetch_site(std::string_view site);

class OwnNames {
 public:
  // `names`: at any port. `proxied`: names of --host, by which browsers know the console, perhaps through a proxy that
  // asks it by another name: with the port that the browser shows, if it shows one.
  OwnNames(std::vector<std::string> names, std::vector<HostName> proxied)
      : names_(std::move(names)), proxied_(std::move(proxied)) {}

  // Whether a request may name this host. `own_address`: the address of the connection's own end, as an address cannot
  // be rebound. NOT_ALLOWED: another name; the message says what to do.
  Status check_host(std::string_view host, std::string_view own_address) const;
  // Whether a request that changes something comes from the console's own page: Origin is the host that was asked, or
  // one of `proxied`; over TLS its scheme is https. NOT_ALLOWED.
  Status check_origin(std::string_view origin, std::string_view host, bool tls) const;

 private:
  const std::vector<std::string> names_;
  const std::vector<HostName> proxied_;
};

}  // namespace relmap::console
