#include "server/ops/config.h"

#include <yaml-cpp/yaml.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

#include "proto/wire/lcm_link.h"
#include "proto/wire/lcm_url.h"
#include "server/ops/settings.h"

namespace relmap::ops {

namespace {

Status wrong_at(const std::string& name, const YAML::Mark& mark, const std::string& what) {
  return {Reason::BAD_CONFIG, name + ":" + std::to_string(mark.line + 1) + ": " + what};
}

Status apply(const YAML::Node& map, const std::string& prefix, const std::string& name, Config& config) {
  std::set<std::string> seen;
  for (const auto& entry : map) {
    if (!entry.first.IsScalar()) return wrong_at(name, entry.first.Mark(), "a key must be a word");
    const std::string key = prefix + entry.first.Scalar();
    if (!seen.insert(key).second) return wrong_at(name, entry.first.Mark(), "'" + key + "' is given twice");
    if (entry.second.IsMap() && prefix.empty()) {
      if (Status status = apply(entry.second, key + ".", name, config); !status.ok()) return status;
      continue;
    }
    const Setting* const setting = find_setting(key);
    if (!setting) return wrong_at(name, entry.first.Mark(), "unknown key '" + key + "'");
    if (const std::string wrong = setting->set(entry.second, config); !wrong.empty())
      return wrong_at(name, entry.second.Mark(), "'" + key + "' " + wrong);
  }
  return {};
}

}  // namespace

Status parse_config(std::string_view text, const std::string& name, Config& config) {
  try {
    const YAML::Node root = YAML::Load(std::string(text));
    if (root.IsNull()) return {};
    if (!root.IsMap()) return wrong_at(name, root.Mark(), "needs 'key: value' lines");
    Config changed = config;
    if (Status status = apply(root, "", name, changed); !status.ok()) return status;
    config = std::move(changed);
    return {};
  } catch (const YAML::Exception& error) {
    return wrong_at(name, error.mark, error.msg);
  }
}

Status read_config(const std::string& path, Config& config) {
  std::ifstream file(path);
  if (!file) return {Reason::NO_SUCH_FILE, "cannot read " + path};
  std::ostringstream text;
  text << file.rdbuf();
  return parse_config(text.str(), path, config);
}

namespace {

// What keyframes can come from: a multicast group, or a log that is replayed.
Status check_lcm(const Config& config) {
  const std::string& url = config.lcm;
  if (url.empty()) return {};
  const auto bad = [&](const std::string& what) { return Status(Reason::BAD_CONFIG, "lcm: " + what); };
  const auto complete = complete_lcm_url(url);
  if (!complete.ok()) return bad(complete.status().message());
  const LcmUrl parsed = parse_lcm_url(url).or_throw();
  if (parsed.provider == "memq") return bad("memq:// reaches nobody outside of this process");
  const bool proves = config.lcm_authentication != ingest::LcmAuthentication::Who::kNobody;
  if (parsed.provider != "file") {
    if (proves && (config.lcm_key.empty() || config.access.empty()))
      return bad("anyone who can send to " + url +
                 " could send in the name of any robot; give --credentials FOLDER (relmap-admin credentials makes it), "
                 "by whose "
                 "keys robots are known, or allow that with --lcm-authentication none");
    return {};
  }
  if (proves) return bad("nothing in a log can prove who sent it, so it takes --lcm-authentication none");
  if (!is_replay(url)) return bad("the daemon replays logs and writes none: mode=r");
  if (!std::filesystem::exists(parsed.network)) return bad("there is no log " + parsed.network);
  return {};
}

// A port that only this machine can reach needs neither TLS nor credentials.
Status check_http(const Config& config, bool tls) {
  if (config.http.empty()) return {};
  const auto where = parse_http(config.http);
  if (!where.ok()) return where.status();
  const bool local = where->host == "localhost" || where->host == "::1" || where->host.starts_with("127.");
  if (local || tls || config.insecure) return {};
  return {Reason::BAD_CONFIG, "http at " + config.http +
                                  " could be read by anyone who can reach it; give --credentials FOLDER, an address of "
                                  "this machine (127.0.0.1), or allow that with --insecure"};
}

}  // namespace

std::string unless_none(const std::string& said) { return said == "none" ? std::string() : said; }

void complete_config(Config& config) {
  if (config.credentials.empty()) return;
  const auto complete = [&](std::string& file, const char* name) {
    if (file.empty()) file = config.credentials + "/" + name;
  };
  complete(config.tls.certificate, "server.pem");
  complete(config.tls.key, "server.pem");
  complete(config.tls.client_authority, "ca.crt");
  complete(config.access, "access");
  complete(config.lcm_key, "lcm.key");
}

Status check_config(const Config& config) {
  if (config.data.empty()) return {Reason::BAD_CONFIG, "no data folder: give --data DIR"};
  if (!config.listen.empty())
    if (const auto listen = parse_host_port(config.listen); !listen.ok()) return listen.status();
  const bool tls = !config.tls.certificate.empty();
  if (Status http = check_http(config, tls); !http.ok()) return http;
  if (tls == config.tls.key.empty())
    return {Reason::BAD_CONFIG, "tls.certificate and tls.key belong together: one of them is missing"};
  if (!config.listen.empty() && tls == config.insecure)
    return {Reason::BAD_CONFIG,
            tls ? "TLS and --insecure contradict each other"
                : "listening on " + config.listen +
                      " would let anyone who can reach it edit the map; give --credentials FOLDER (relmap-admin "
                      "credentials makes it), or allow that with --insecure"};
  if (Status lcm = check_lcm(config); !lcm.ok()) return lcm;
  for (const std::string& root : config.backup_roots)
    if (!std::filesystem::path(root).is_absolute())
      return {Reason::BAD_CONFIG, "the folder for backups '" + root + "' is not an absolute path"};
  return {};
}

std::string HostPort::to_string() const {
  const bool v6 = host.find(':') != std::string::npos;
  return (v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

Result<HostPort> parse_host_port(std::string_view text) {
  const auto bad = [&] { return Status(Reason::BAD_CONFIG, "'" + std::string(text) + "' is not HOST:PORT"); };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return bad();
  std::string_view host = text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']'))
    host = host.substr(1, host.size() - 2);
  else if (host.find(':') != std::string_view::npos)
    return bad();
  if (host.empty()) return bad();
  HostPort result;
  result.host = host;
  const std::string_view digits = text.substr(colon + 1);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result.port);
  if (error != std::errc{} || end != digits.data() + digits.size()) return bad();
  return result;
}

Result<HostPort> parse_http(std::string_view text) {
  const bool port_alone = !text.empty() && text.find_first_not_of("0123456789") == text.npos;
  return parse_host_port(port_alone ? "127.0.0.1:" + std::string(text) : std::string(text));
}

}  // namespace relmap::ops
