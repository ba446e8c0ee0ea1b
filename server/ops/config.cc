#include "server/ops/config.h"

#include <yaml-cpp/yaml.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <vector>

#include "proto/base/names.h"
#include "proto/base/number_text.h"
#include "proto/wire/lcm_link.h"
#include "proto/wire/lcm_url.h"

namespace relmap::ops {

namespace {

// Reads one value into the configuration. Returns what is wrong with it; empty if nothing is.
using Setter = std::function<std::string(const YAML::Node&, Config&)>;

template <typename T>
std::string convert(const YAML::Node& node, T& value, const char* kind) {
  if (!node.IsScalar() || !YAML::convert<T>::decode(node, value)) return std::string("needs ") + kind;
  return {};
}

template <typename Get>
Setter text(Get get) {
  return [get](const YAML::Node& node, Config& config) { return convert(node, std::invoke(get, config), "text"); };
}

Setter text_or_none(std::string Config::*member) {
  return [member](const YAML::Node& node, Config& config) {
    std::string said;
    std::string wrong = convert(node, said, "text");
    if (wrong.empty()) config.*member = unless_none(said);
    return wrong;
  };
}

template <typename Get>
Setter flag(Get get) {
  return [get](const YAML::Node& node, Config& config) { return convert(node, get(config), "true or false"); };
}

// A number from low to high, inclusive.
template <typename Get>
Setter number(Get get, double low, double high) {
  return [get, low, high](const YAML::Node& node, Config& config) -> std::string {
    double value = 0;
    if (auto wrong = convert(node, value, "a number"); !wrong.empty()) return wrong;
    using T = std::remove_reference_t<decltype(get(config))>;
    const bool whole = !std::is_integral_v<T> || value == static_cast<double>(static_cast<long long>(value));
    if (!(value >= low && value <= high) || !whole) {
      return std::string("needs a ") + (std::is_integral_v<T> ? "whole " : "") + "number from " + number_text(low) +
             " to " + number_text(high);
    }
    get(config) = static_cast<T>(value);
    return {};
  };
}

// [{metre: 1, driven_second: 0.5}, ...], with the names that RouteWeights have in the protocol.
std::string read_mixes(const YAML::Node& node, Config& config) {
  constexpr std::size_t kMaxMixes = 8;
  if (!node.IsSequence() || node.size() > kMaxMixes) return "needs a list of at most 8 weights";
  std::vector<route::RouteWeights> mixes;
  for (const YAML::Node& given : node) {
    route::RouteWeights weights{0, 0, 0, 0};
    const std::map<std::string, double*> parts{{"metre", &weights.metre},
                                               {"driven_second", &weights.driven_second},
                                               {"standing_second", &weights.standing_second},
                                               {"square_metre_of_variance", &weights.square_metre_of_variance}};
    if (!given.IsMap()) return "needs weights like {metre: 1, driven_second: 0.5}";
    for (const auto& entry : given) {
      const auto part = entry.first.IsScalar() ? parts.find(entry.first.Scalar()) : parts.end();
      if (part == parts.end()) return "needs metre, driven_second, standing_second or square_metre_of_variance";
      if (auto wrong = convert(entry.second, *part->second, "numbers"); !wrong.empty()) return wrong;
    }
    if (!weights.valid()) return "needs weights of 0, or 1e-9 to 1e9, and not all 0";
    mixes.push_back(weights);
  }
  config.route_mixes = std::move(mixes);
  return {};
}

std::string read_names(const YAML::Node& node, std::vector<std::string>& names) {
  if (!node.IsSequence()) return "needs a list of names";
  std::vector<std::string> robots;
  for (const YAML::Node& name : node) {
    if (!name.IsScalar()) return "needs a list of names";
    if (const Status valid = check_name("robot", name.Scalar()); !valid.ok())
      return "has a name that no robot can have: " + valid.message();
    robots.push_back(name.Scalar());
  }
  names = std::move(robots);
  return {};
}

std::string read_backup_roots(const YAML::Node& node, Config& config) {
  std::vector<std::string> roots;
  if (!node.IsSequence()) return "needs a list of folders";
  for (const YAML::Node& root : node) {
    if (!root.IsScalar()) return "needs a list of folders";
    roots.push_back(root.Scalar());
  }
  config.backup_roots = std::move(roots);
  return {};
}

std::string read_lcm_authentication(const YAML::Node& node, Config& config) {
  using Who = ingest::LcmAuthentication::Who;
  if (node.IsSequence()) {
    config.lcm_authentication = Who::kSome;
    return read_names(node, config.lcm_proving);
  }
  if (!node.IsScalar() || (node.Scalar() != "all" && node.Scalar() != "none"))
    return "needs all, none or a list of names";
  config.lcm_authentication = node.Scalar() == "all" ? Who::kAll : Who::kNobody;
  return {};
}

const std::map<std::string, Setter>& settings() {
  static const std::map<std::string, Setter> table{
      {"data", text(&Config::data)},
      {"listen", text_or_none(&Config::listen)},
      {"socket_group", text(&Config::socket_group)},
      {"credentials", text(&Config::credentials)},
      {"access", text(&Config::access)},
      {"audit", text(&Config::audit)},
      {"tls.certificate", text([](Config& c) -> std::string& { return c.tls.certificate; })},
      {"tls.key", text([](Config& c) -> std::string& { return c.tls.key; })},
      {"tls.client_authority", text([](Config& c) -> std::string& { return c.tls.client_authority; })},
      {"rpc.max_connections", number([](Config& c) -> std::size_t& { return c.connections.total; }, 1, 100000)},
      {"rpc.quiet_s", number([](Config& c) -> double& { return c.connections.quiet_s; }, 1, 1e6)},
      {"rpc.max_connections_per_peer",
       number([](Config& c) -> std::size_t& { return c.connections.per_peer; }, 1, 100000)},
      {"insecure", flag([](Config& c) -> bool& { return c.insecure; })},
      {"lcm", text_or_none(&Config::lcm)},
      {"lcm.authentication", read_lcm_authentication},
      {"lcm.key", text(&Config::lcm_key)},
      {"memory_budget_mb", number([](Config& c) -> std::uint64_t& { return c.memory_budget_mb; }, 32, 1 << 20)},
      {"disk_low_water_mb", number([](Config& c) -> std::uint64_t& { return c.disk_low_water_mb; }, 0, 1 << 20)},
      {"backup.roots", read_backup_roots},
      {"vocabulary", text(&Config::vocabulary)},
      {"log_level", text(&Config::log_level)},
      {"deterministic", flag([](Config& c) -> bool& { return c.map.deterministic; })},
      {"closures", flag([](Config& c) -> bool& { return c.map.closures; })},
      {"lookup_threads", number([](Config& c) -> std::size_t& { return c.map.lookup_threads; }, 0, 256)},
      {"commit_interval_ms",
       [](const YAML::Node& node, Config& config) -> std::string {
         long long ms = 0;
         if (auto wrong = convert(node, ms, "a whole number"); !wrong.empty()) return wrong;
         if (ms < 1 || ms > 600000) return "needs 1 to 600000 milliseconds";
         config.map.commit_interval = std::chrono::milliseconds(ms);
         return {};
       }},
      {"rpc.threads", number([](Config& c) -> int& { return c.rpc.threads; }, 1, 256)},
      {"rpc.max_concurrent", number([](Config& c) -> int& { return c.rpc.max_concurrent; }, 1, 100000)},
      {"rpc.max_search_frames", number([](Config& c) -> std::uint64_t& { return c.rpc.max_search_frames; }, 1, 1e9)},
      {"rpc.default_deadline_s", number([](Config& c) -> double& { return c.rpc.default_deadline_s; }, 0.001, 3600)},
      {"ingest.max_keyframes_per_s", number([](Config& c) -> double& { return c.max_keyframes_per_s; }, 0, 1e6)},
      {"ingest.max_new_sessions_per_min",
       number([](Config& c) -> double& { return c.max_new_sessions_per_min; }, 0, 1e6)},
      {"ingest.robots", [](const YAML::Node& node, Config& config) { return read_names(node, config.robots); }},
      {"rpc.max_concurrent_per_caller",
       number([](Config& c) -> int& { return c.rpc.max_concurrent_per_caller; }, 1, 100000)},
      {"rpc.max_ingest_streams_per_caller",
       number([](Config& c) -> int& { return c.rpc.max_ingest_streams_per_caller; }, 1, 100000)},
      {"rpc.max_waiting", number([](Config& c) -> int& { return c.rpc.max_waiting; }, 1, 100000)},
      {"rpc.stalled_s", number([](Config& c) -> double& { return c.rpc.stalled_s; }, 1, 3600)},
      {"rpc.max_ingest_streams", number([](Config& c) -> int& { return c.rpc.max_ingest_streams; }, 1, 100000)},
      {"routes.mixes", read_mixes},
      {"rba.window", number([](Config& c) -> std::uint32_t& { return c.map.rba.window; }, 0, 1000)},
      {"rba.delta_eps", number([](Config& c) -> double& { return c.map.rba.delta_eps; }, 0, 10)},
      {"rba.idle_delta_eps", number([](Config& c) -> double& { return c.map.rba.idle_delta_eps; }, 0, 10)},
      {"rba.budget", number([](Config& c) -> std::uint64_t& { return c.map.rba.budget; }, 1000, 1e9)},
      {"rba.huber_px", number([](Config& c) -> double& { return c.map.rba.huber_px; }, 0.1, 100)},
  };
  return table;
}

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
    const auto setting = settings().find(key);
    if (setting == settings().end()) return wrong_at(name, entry.first.Mark(), "unknown key '" + key + "'");
    if (const std::string wrong = setting->second(entry.second, config); !wrong.empty())
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
  static const std::set<std::string> levels{"trace", "debug", "info", "warning", "error"};
  if (!levels.contains(config.log_level))
    return {Reason::BAD_CONFIG, "log_level '" + config.log_level + "' is none of trace, debug, info, warning, error"};
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

}  // namespace relmap::ops
