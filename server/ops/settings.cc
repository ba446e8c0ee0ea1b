#include "server/ops/settings.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <type_traits>
#include <utility>

#include "proto/base/json.h"
#include "proto/base/names.h"
#include "proto/base/number_text.h"
#include "server/monitor/log.h"
#include "server/rpc/log_level.h"

namespace relmap::ops {

namespace {

using Set = std::function<std::string(const YAML::Node&, Config&)>;
using Get = std::function<std::string(const Config&)>;
struct Access {
  Set set;
  Get get;
};

template <typename T>
std::string convert(const YAML::Node& node, T& value, const char* kind) {
  if (!node.IsScalar() || !YAML::convert<T>::decode(node, value)) return std::string("needs ") + kind;
  return {};
}

// As YAML reads it back: plain where nothing could be mistaken, or else quoted.
std::string text_value(const std::string& text) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) || c == '/' || c == '_'; };
  const auto inner = [](unsigned char c) { return std::isalnum(c) || (c != 0 && std::strchr("/_.-+@", c)); };
  const bool word = !text.empty() && plain(text.front()) && !std::isdigit(static_cast<unsigned char>(text.front())) &&
                    std::all_of(text.begin(), text.end(), inner);
  static const std::vector<std::string> kMistaken{"true", "false", "yes", "no", "on", "off", "null", "y", "n"};
  std::string lower = text;
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  if (word && std::find(kMistaken.begin(), kMistaken.end(), lower) == kMistaken.end()) return text;
  return Json::quoted(text);
}

// With as few digits as identify it; whole numbers without an exponent.
std::string number_value(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) return std::to_string(static_cast<long long>(value));
  char text[32];
  for (int digits = 1; digits <= 17; ++digits) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    if (std::strtod(text, nullptr) == value) break;
  }
  return text;
}

std::string list_value(const std::vector<std::string>& items) {
  std::string text = "[";
  for (const std::string& item : items) text += (text.size() > 1 ? ", " : "") + text_value(item);
  return text + "]";
}

// `member` is a pointer to a member, or a function from Config& to a reference.
template <typename Member>
Access text(Member member) {
  return {
      [member](const YAML::Node& node, Config& config) { return convert(node, std::invoke(member, config), "text"); },
      [member](const Config& config) {
        Config copy = config;
        return text_value(std::invoke(member, copy));
      }};
}

Access text_or_none(std::string Config::*member) {
  return {[member](const YAML::Node& node, Config& config) {
            std::string said;
            std::string wrong = convert(node, said, "text");
            if (wrong.empty()) config.*member = unless_none(said);
            return wrong;
          },
          [member](const Config& config) { return text_value((config.*member).empty() ? "none" : config.*member); }};
}

// One of a few words.
Access one_of(std::string Config::*member, std::vector<std::string> words) {
  return {[member, words = std::move(words)](const YAML::Node& node, Config& config) -> std::string {
            std::string said;
            if (std::string wrong = convert(node, said, "text"); !wrong.empty()) return wrong;
            if (std::find(words.begin(), words.end(), said) == words.end()) {
              std::string known;
              for (const std::string& word : words) known += (known.empty() ? "" : ", ") + word;
              return "'" + said + "' is none of " + known;
            }
            config.*member = said;
            return {};
          },
          [member](const Config& config) { return text_value(config.*member); }};
}

template <typename Member>
Access flag(Member member) {
  return {[member](const YAML::Node& node, Config& config) {
            return convert(node, std::invoke(member, config), "true or false");
          },
          [member](const Config& config) {
            Config copy = config;
            return std::string(std::invoke(member, copy) ? "true" : "false");
          }};
}

// A number from low to high, inclusive.
template <typename Member>
Access number(Member member, double low, double high) {
  using T = std::remove_reference_t<decltype(std::invoke(member, std::declval<Config&>()))>;
  return {[member, low, high](const YAML::Node& node, Config& config) -> std::string {
            double value = 0;
            if (auto wrong = convert(node, value, "a number"); !wrong.empty()) return wrong;
            const bool whole = !std::is_integral_v<T> || value == static_cast<double>(static_cast<long long>(value));
            if (!(value >= low && value <= high) || !whole) {
              return std::string("needs a ") + (std::is_integral_v<T> ? "whole " : "") + "number from " +
                     number_text(low) + " to " + number_text(high);
            }
            std::invoke(member, config) = static_cast<T>(value);
            return {};
          },
          [member](const Config& config) {
            Config copy = config;
            return number_value(static_cast<double>(std::invoke(member, copy)));
          }};
}

using Part = std::pair<const char*, double route::RouteWeights::*>;
// With the names that RouteWeights have in the protocol.
constexpr std::array kParts{Part{"metre", &route::RouteWeights::metre},
                            Part{"driven_second", &route::RouteWeights::driven_second},
                            Part{"standing_second", &route::RouteWeights::standing_second},
                            Part{"square_metre_of_variance", &route::RouteWeights::square_metre_of_variance}};

// [{metre: 1, driven_second: 0.5}, ...]
std::string read_mixes(const YAML::Node& node, Config& config) {
  constexpr std::size_t kMaxMixes = 8;
  if (!node.IsSequence() || node.size() > kMaxMixes) return "needs a list of at most 8 weights";
  std::vector<route::RouteWeights> mixes;
  for (const YAML::Node& given : node) {
    route::RouteWeights weights{0, 0, 0, 0};
    if (!given.IsMap()) return "needs weights like {metre: 1, driven_second: 0.5}";
    for (const auto& entry : given) {
      const auto part = std::find_if(kParts.begin(), kParts.end(), [&](const Part& known) {
        return entry.first.IsScalar() && entry.first.Scalar() == known.first;
      });
      if (part == kParts.end()) return "needs metre, driven_second, standing_second or square_metre_of_variance";
      if (auto wrong = convert(entry.second, weights.*part->second, "numbers"); !wrong.empty()) return wrong;
    }
    if (!weights.valid()) return "needs weights of 0, or 1e-9 to 1e9, and not all 0";
    mixes.push_back(weights);
  }
  config.route_mixes = std::move(mixes);
  return {};
}

std::string mixes_value(const Config& config) {
  std::string list;
  for (const route::RouteWeights& weights : config.route_mixes) {
    std::string parts;
    for (const Part& part : kParts)
      if (weights.*part.second != 0)
        parts += (parts.empty() ? "" : ", ") + std::string(part.first) + ": " + number_value(weights.*part.second);
    list += (list.empty() ? "{" : ", {") + parts + "}";
  }
  return "[" + list + "]";
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

using Who = ingest::LcmAuthentication::Who;

std::string read_lcm_authentication(const YAML::Node& node, Config& config) {
  if (node.IsSequence()) {
    config.lcm_authentication = Who::kSome;
    return read_names(node, config.lcm_proving);
  }
  if (!node.IsScalar() || (node.Scalar() != "all" && node.Scalar() != "none"))
    return "needs all, none or a list of names";
  config.lcm_authentication = node.Scalar() == "all" ? Who::kAll : Who::kNobody;
  return {};
}

std::string lcm_authentication_value(const Config& config) {
  if (config.lcm_authentication == Who::kSome) return list_value(config.lcm_proving);
  return config.lcm_authentication == Who::kAll ? "all" : "none";
}

std::string read_commit_interval(const YAML::Node& node, Config& config) {
  long long ms = 0;
  if (auto wrong = convert(node, ms, "a whole number"); !wrong.empty()) return wrong;
  if (ms < 1 || ms > 600000) return "needs 1 to 600000 milliseconds";
  config.map.commit_interval = std::chrono::milliseconds(ms);
  return {};
}

constexpr bool kLive = true;

Setting setting(std::string key, Access access, std::string values, std::string meaning, bool live = false,
                std::string default_is = {}) {
  return {std::move(key),        std::move(values),     std::move(meaning),   live,
          std::move(default_is), std::move(access.set), std::move(access.get)};
}

std::vector<Setting> make_settings() {
  using C = Config;
  return {
      setting("data", text(&C::data), "folder", "the folder of the map, which holds nothing else", false, "none"),
      setting("socket", text(&C::socket), "file",
              "the Unix socket at which gRPC is served; a file `endpoint` beside it tells clients that name its folder",
              false, "DIR/socket"),
      setting("socket_group", text(&C::socket_group), "group",
              "whose members may use the socket, besides the user that runs the daemon, and pass through the data "
              "folder to it",
              false, "none"),
      setting("listen", text_or_none(&C::listen), "HOST:PORT, none",
              "serves gRPC over TCP, too; port 0 is any free one"),
      setting("insecure", flag(&C::insecure), "true, false",
              "`listen` and `http` without TLS: everyone who can reach them is an operator"),
      setting("http", text_or_none(&C::http), "HOST:PORT, PORT, none",
              "serves /metrics for Prometheus, /livez and /readyz; a PORT alone is of this machine (127.0.0.1), where "
              "nobody needs credentials; beyond it callers need TLS and any role"),
      setting("credentials", text(&C::credentials), "folder",
              "made by `relmap-admin credentials`; its files are the defaults of the next four, and of `lcm.key`",
              false, "none"),
      setting("tls.certificate", text([](C& c) -> std::string& { return c.tls.certificate; }), "file",
              "the daemon's, in PEM; read again within ten seconds after it changes", false, "FOLDER/server.pem"),
      setting("tls.key", text([](C& c) -> std::string& { return c.tls.key; }), "file",
              "the key of this certificate; it may be in the same file", false, "FOLDER/server.pem"),
      setting("tls.client_authority", text([](C& c) -> std::string& { return c.tls.client_authority; }), "file",
              "whose certificates prove who a caller is; none: only tokens do", false, "FOLDER/ca.crt"),
      setting("access", text(&C::access), "file",
              "tokens, and what was revoked; read again within a second after it changes", false, "FOLDER/access"),
      setting("audit", text(&C::audit), "file, none", "where edits and calls of operators are written down", false,
              "DIR/audit.jsonl"),
      setting("lcm", text_or_none(&C::lcm), "URL, none",
              "where keyframes come from over LCM: udpm://GROUP:PORT?ttl=N, or file://PATH, which is replayed"),
      setting("lcm.authentication", {read_lcm_authentication, lcm_authentication_value}, "all, none, names",
              "whose messages over LCM must be sealed with a robot's key; none: nobody's, and anyone can send as any "
              "robot"),
      setting("lcm.key", text(&C::lcm_key), "file", "the secret that the robots' keys follow from", false,
              "FOLDER/lcm.key"),
      setting("backup.roots", {read_backup_roots, [](const C& config) { return list_value(config.backup_roots); }},
              "folders", "below which operators may have backups made by this daemon"),
      setting("memory_budget_mb", number(&C::memory_budget_mb, 32, 1 << 20), "32 to 1,048,576",
              "memory for everything that grows with the map or the load (docs/architecture.md)"),
      setting("disk_low_water_mb", number(&C::disk_low_water_mb, 0, 1 << 20), "0 to 1,048,576",
              "with less free disk space nothing is taken in until a quarter more is free"),
      setting("vocabulary", text(&C::vocabulary), "file", "the vocabulary of a new map", false, "the shipped one"),
      setting("log_level", one_of(&C::log_level, rpc::log_levels()), "trace, debug, info, warning, error",
              "what the log tells", kLive),
      setting("log_format", one_of(&C::log_format, monitor::log_formats()), "auto, text, json, journal",
              "a line for each event: text for people, JSON, or with the priorities of the systemd journal; auto: the "
              "latter where standard error leads to it, and text elsewhere"),
      setting("hung_after_s", number(&C::hung_after_s, 1, 3600), "1 to 3,600",
              "after so long at one piece of work a thread counts as hung: /livez says so, and systemd is told no more "
              "that the daemon lives",
              kLive),
      setting("deterministic", flag([](C& c) -> bool& { return c.map.deterministic; }), "true, false",
              "maps from the same records are equal, bit for bit; slower"),
      setting("closures", flag([](C& c) -> bool& { return c.map.closures; }), "true, false", "finds loop closures"),
      setting("lookup_threads", number([](C& c) -> std::size_t& { return c.map.lookup_threads; }, 0, 256), "0 to 256",
              "threads that recognise places; 0: one fewer than the machine has cores, but at least one"),
      setting(
          "commit_interval_ms",
          {read_commit_interval, [](const C& config) { return std::to_string(config.map.commit_interval.count()); }},
          "1 to 600,000", "a commit is due after so long"),
      setting(
          "events.max_mb", number(&C::events_max_mb, 1, 1 << 20), "1 to 1,048,576",
          "of the log of what happens to the map, which has the last hour at most, on disk; a watcher who is away for "
          "longer than the log reaches back has to list again"),
      setting("rpc.threads", number([](C& c) -> int& { return c.rpc.threads; }, 1, 256), "1 to 256",
              "threads that run handlers"),
      setting("rpc.max_concurrent", number([](C& c) -> int& { return c.rpc.max_concurrent; }, 1, 100000),
              "1 to 100,000", "RPCs at once; beyond it BUDGET_EXCEEDED"),
      setting("rpc.max_concurrent_per_caller",
              number([](C& c) -> int& { return c.rpc.max_concurrent_per_caller; }, 1, 100000), "1 to 100,000",
              "of these, and again of those in the next line, of one caller: a role and name, or an address of callers "
              "who prove none"),
      setting("rpc.max_waiting", number([](C& c) -> int& { return c.rpc.max_waiting; }, 1, 100000), "1 to 100,000",
              "edits that wait for the disk, and again calls of WaitIdle; not counted above"),
      setting("rpc.stalled_s", number([](C& c) -> double& { return c.rpc.stalled_s; }, 1, 3600), "1 to 3,600",
              "a call is ended whose caller has not taken a message of it for so long"),
      setting("rpc.max_connections", number([](C& c) -> std::size_t& { return c.connections.total; }, 1, 100000),
              "1 to 100,000",
              "connections over TCP at once, and again at the socket; for one more the oldest makes room over which "
              "nobody has proved who he is, or it is closed at once"),
      setting("rpc.quiet_s", number([](C& c) -> double& { return c.connections.quiet_s; }, 1, 1e6), "1 to 1e6",
              "a connection over TCP is closed over which no known caller has had a call for so long"),
      setting("rpc.max_connections_per_peer",
              number([](C& c) -> std::size_t& { return c.connections.per_peer; }, 1, 100000), "1 to 100,000",
              "of these, from one address"),
      setting("rpc.max_ingest_streams", number([](C& c) -> int& { return c.rpc.max_ingest_streams; }, 1, 100000),
              "1 to 100,000", "robots that stream over gRPC at once, not counted above"),
      setting("rpc.max_ingest_streams_per_caller",
              number([](C& c) -> int& { return c.rpc.max_ingest_streams_per_caller; }, 1, 100000), "1 to 100,000",
              "of these, of one caller"),
      setting("rpc.max_watchers", number([](C& c) -> int& { return c.rpc.max_watchers; }, 1, 100000), "1 to 100,000",
              "watches of the map at once, not counted above; half of the memory for replies, a sixteenth of "
              "memory_budget_mb, must hold them, so that 18 MB of the budget allow one more: 56 with 1,024 MB"),
      setting("rpc.max_watchers_per_caller",
              number([](C& c) -> int& { return c.rpc.max_watchers_per_caller; }, 1, 100000), "1 to 100,000",
              "of these, of one caller"),
      setting("rpc.max_search_frames", number([](C& c) -> std::uint64_t& { return c.rpc.max_search_frames; }, 1, 1e9),
              "1 to 1e9", "frames that a search for a route may visit; beyond it OUT_OF_REACH"),
      setting("rpc.default_deadline_s", number([](C& c) -> double& { return c.rpc.default_deadline_s; }, 0.001, 3600),
              "0.001 to 3,600", "the deadline in seconds of callers that set none"),
      setting("ingest.max_keyframes_per_s", number(&C::max_keyframes_per_s, 0, 1e6), "0 to 1e6",
              "mean that one robot may send over LCM; 0 is no limit", kLive),
      setting("ingest.max_new_sessions_per_min", number(&C::max_new_sessions_per_min, 0, 1e6), "0 to 1e6",
              "mean that one robot may begin; who proves nothing may begin ten times as many together with all others "
              "at the same address, or over LCM; beyond it RATE_LIMITED, and the robot tries again; 0 is no limit",
              kLive),
      setting("ingest.robots",
              {[](const YAML::Node& node, Config& config) { return read_names(node, config.robots); },
               [](const C& config) { return list_value(config.robots); }},
              "names", "the robots whose keyframes are taken; an empty list: all", kLive),
      setting("routes.mixes", {read_mixes, mixes_value}, "at most 8 weights",
              "costs with fast routes, beside distance, time and the distance that avoids stops (docs/operations.md)"),
      setting("rba.window", number([](C& c) -> std::uint32_t& { return c.map.rba.window; }, 0, 1000), "0 to 1,000",
              "frames nearest to a new one that it activates; 0 is no relaxation"),
      setting("rba.delta_eps", number([](C& c) -> double& { return c.map.rba.delta_eps; }, 0, 10), "0 to 10 sigmas",
              "a frame whose mean error changes by more is activated"),
      setting("rba.idle_delta_eps", number([](C& c) -> double& { return c.map.rba.idle_delta_eps; }, 0, 10),
              "0 to 10 sigmas", "the same in idle work"),
      setting("rba.budget", number([](C& c) -> std::uint64_t& { return c.map.rba.budget; }, 1000, 1e9), "1,000 to 1e9",
              "observations linearised in an update; the rest is pending"),
      setting("rba.huber_px", number([](C& c) -> double& { return c.map.rba.huber_px; }, 0.1, 100), "0.1 to 100",
              "corner of Huber's loss, pixels of a track at the lowest level"),
  };
}

std::string default_of(const Setting& setting) {
  return setting.default_is.empty() ? setting.get(Config()) : setting.default_is;
}

// The words, with line breaks before `width`; each line begins with `prefix`.
std::string wrapped(const std::string& words, const std::string& prefix, std::size_t width) {
  std::string lines, line = prefix;
  std::istringstream stream(words);
  for (std::string word; stream >> word;) {
    if (line.size() + 1 + word.size() > width && line != prefix) {
      lines += line + "\n";
      line = prefix;
    }
    line += (line.empty() || line == prefix ? "" : " ") + word;
  }
  return lines + line + "\n";
}

}  // namespace

const std::vector<Setting>& settings() {
  static const std::vector<Setting> table = make_settings();
  return table;
}

const Setting* find_setting(const std::string& key) {
  static const std::map<std::string, const Setting*> by_key = [] {
    std::map<std::string, const Setting*> found;
    for (const Setting& one : settings()) found.emplace(one.key, &one);
    return found;
  }();
  const auto found = by_key.find(key);
  return found == by_key.end() ? nullptr : found->second;
}

std::string print_config(const Config& config) {
  std::string text;
  for (const Setting& one : settings()) text += one.key + ": " + one.get(config) + "\n";
  return text;
}

std::string sample_config() {
  std::string text =
      "# The settings of relmapd, with their defaults. Remove the # before those that you change. `relmapd --config "
      "FILE\n"
      "# --check-config` tells whether the daemon could start with the file, and --print-config what would be in "
      "force.\n";
  for (const Setting& one : settings()) {
    std::string meaning = one.key == "data" ? "DIR: " + one.meaning : one.meaning;
    if (meaning.front() >= 'a' && meaning.front() <= 'z') meaning.front() = static_cast<char>(meaning.front() - 32);
    if (!one.values.empty()) meaning += " (" + one.values + ")";
    if (one.live) meaning += ". SIGHUP puts it in force";
    text += "\n" + wrapped(meaning + ".", "# ", 100);
    text += one.default_is.empty() ? "#" + one.key + ": " + one.get(Config()) + "\n"
                                   : "#" + one.key + ":   # " + one.default_is + "\n";
  }
  return text;
}

std::string settings_table() {
  std::string text = "| key | default | values | meaning |\n|---|---|---|---|\n";
  for (const Setting& one : settings())
    text += "| `" + one.key + "` | " + default_of(one) + " | " + one.values + " | " + one.meaning +
            (one.live ? " (SIGHUP)" : "") + " |\n";
  return text;
}

std::vector<Status> adopt_live(const Config& fresh, Config& config) {
  std::vector<Status> refused;
  for (const Setting& one : settings()) {
    const std::string is = one.get(config), will_be = one.get(fresh);
    if (is == will_be) continue;
    if (!one.live)
      refused.emplace_back(Reason::NEEDS_RESTART,
                           one.key + " stays " + is + " until the daemon is started again; " + will_be + " was read");
    else if (const std::string wrong = one.set(YAML::Load(will_be), config); !wrong.empty())
      refused.emplace_back(Reason::BAD_CONFIG, "'" + one.key + "' " + wrong);
  }
  return refused;
}

}  // namespace relmap::ops
