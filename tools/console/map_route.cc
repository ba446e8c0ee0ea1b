#include "tools/console/map_route.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "client/relmap_client.h"
#include "proto/base/read_number.h"
#include "tools/console/layout/local_layout.h"

namespace relmap::console {

namespace {

using std::chrono::milliseconds;

constexpr double kLongestWait = 25;  // seconds
constexpr milliseconds kConnectWithin{5000}, kSampleWithin{5000};
constexpr milliseconds kSkeletonWithin{60'000};  // of the whole map
constexpr milliseconds kAnswerWithin{10'000};    // while a browser waits
constexpr double kFarthest = 1000;               // metres around a closure

Status no_number(const std::string& name, const std::string& text) {
  return {Reason::INVALID_ARGUMENT, "'" + name + "' is no number that can be: " + text};
}

// The number that a parameter gives, or 0 if it is not there.
std::uint64_t number_of(const Request& request, const std::string& name) {
  const std::string text = request.parameter(name);
  std::uint64_t number = 0;
  if (!text.empty() && !read_number(text, number)) throw StatusError(no_number(name, text));
  return number;
}

// The same with a fraction; `otherwise` if it is not there.
double decimal_of(const Request& request, const std::string& name, double otherwise) {
  const std::string text = request.parameter(name);
  if (text.empty()) return otherwise;
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) throw StatusError(no_number(name, text));
  return number;
}

// With which the console asks for itself.
std::string token_of(const Login& login) {
  const auto caller = login.last_let_in();
  return caller.ok() ? caller->token : std::string();
}

Response json(std::string text) {
  Response response;
  response.body = std::move(text);
  return response;
}

std::vector<EdgeId> edges_in(std::string_view text) {
  std::vector<EdgeId> edges;
  while (!text.empty()) {
    const std::size_t comma = text.find(',');
    const std::string one(text.substr(0, comma));
    const auto edge = EdgeId::parse(one);
    if (!edge) throw StatusError({Reason::INVALID_ARGUMENT, "'" + one + "' is no closure: SESSION:INDEX/ORDINAL"});
    edges.push_back(*edge);
    text = comma == std::string_view::npos ? std::string_view() : text.substr(comma + 1);
  }
  return edges;
}

// Answers with the state of the layout, once it is newer than the one the caller has.
struct TellState {
  LayoutKeeper* keeper;
  Awaitable<Response> operator()(const Request& request) const {
    const std::uint64_t after = number_of(request, "after"), seen = keeper->changes();
    const double seconds = std::clamp(decimal_of(request, "wait", 0), 0.0, kLongestWait);
    const std::shared_ptr<const MapLayout> layout = keeper->state().layout;
    if (!request.parameter("after").empty() && seconds > 0 && (layout ? layout->version : 0) == after) {
      const auto until = std::chrono::steady_clock::now() + milliseconds(static_cast<std::int64_t>(1000 * seconds));
      // Has a name, since GCC 12 destroys what a temporary closure in such an expression holds twice (its bug 99576).
      const std::function<bool()> newer = [kept = keeper, seen] { return kept->changes() != seen; };
      co_await wait_until(newer, until);
    }
    co_return json(keeper->state_json());
  }
};

struct TellSamples {
  const HealthSamples* samples;
  const Login* login;
  Awaitable<Response> operator()(const Request& request) const {
    const auto since = static_cast<std::int64_t>(number_of(request, "since"));
    co_return json(samples->samples_json(since, login->is_operator(request.caller)));
  }
};

TileRequest tile_request(const Request& request) {
  TileRequest wanted;
  if (!read_number(request.parts.at(0), wanted.version) || !read_number(request.parts.at(1), wanted.tile.zoom) ||
      !read_number(request.parts.at(2), wanted.tile.x) || !read_number(request.parts.at(3), wanted.tile.y))
    throw StatusError({Reason::INVALID_ARGUMENT, "a tile is /map/tiles/VERSION/Z/X/Y"});
  wanted.from = number_of(request, "from");
  if (const std::string root = request.parameter("root"); !root.empty()) {
    wanted.root = FrameId::parse(root);
    if (!wanted.root) throw StatusError({Reason::INVALID_ARGUMENT, "'" + root + "' is no frame: SESSION:INDEX"});
  }
  return wanted;
}

LocalRequest local_request(const Request& request) {
  LocalRequest wanted;
  const std::string edge = request.parameter("edge");
  const auto parsed = EdgeId::parse(edge);
  if (!parsed) throw StatusError({Reason::INVALID_ARGUMENT, "'" + edge + "' is no closure: SESSION:INDEX/ORDINAL"});
  wanted.edge = *parsed;
  wanted.metres = std::min(decimal_of(request, "metres", wanted.metres), kFarthest);
  if (request.query.contains("goes")) wanted.goes_with = edges_in(request.parameter("goes"));
  return wanted;
}

}  // namespace

MapRoutes::MapRoutes(std::string server, std::string authorities, std::string cache, const DaemonLink& link,
                     Login& login, Server& http)
    : server_(std::move(server)),
      authorities_(std::move(authorities)),
      link_(link),
      login_(login),
      http_(http),
      keeper_({.connect = [this] { return connect_for_all(kSkeletonWithin); },
               .credentials = [&login] { return token_of(login); },
               .cache_folder = std::move(cache),
               .log =
                   [this](const std::string& line) {
                     if (!stop_.stop_requested()) std::cerr << line << std::endl;
                   }}),
      samples_({.connect = [this] { return connect_for_all(kSampleWithin); },
                .credentials = [&login] { return token_of(login); }}) {}

Result<std::unique_ptr<client::Client>> MapRoutes::connect(const Caller& caller,
                                                           std::chrono::milliseconds deadline) const {
  client::ClientOptions options;
  options.connect_timeout = kConnectWithin;
  options.deadline = deadline;
  options.token = caller.token;
  options.authorities = authorities_;
  options.stop = stop_.get_token();
  auto client = client::Client::connect(server_, std::move(options));
  // What the folder names may have become another kind of address meanwhile.
  if (const auto where = link_.where(); where.reason() == Reason::NEEDS_RESTART) return where.status();
  return client;
}

Result<std::unique_ptr<client::Client>> MapRoutes::connect_for_all(milliseconds deadline) const {
  const auto caller = login_.last_let_in();
  if (!caller.ok()) return caller.status();
  auto client = connect(*caller, deadline);
  if (!client.ok() || caller->token.empty()) return client;
  const Status judged = (*client)->status().status();
  if (judged.ok()) return client;
  if (judged.reason() == Reason::UNAUTHENTICATED || judged.reason() == Reason::NOT_ALLOWED)
    login_.refused(caller->token);
  return judged;
}

void MapRoutes::add_to(Router& router) {
  const auto add = [&](const char* method, const char* pattern, Handler handler,
                       std::size_t body_limit = kMaxUnjudgedBody) {
    Route route{method, pattern, Access::kAuthorised, std::move(handler)};
    route.body_limit = body_limit;
    router.add(std::move(route));
  };
  add("GET", "/map/layout", TellState{&keeper_});
  add("GET", "/map/tiles/*/*/*/*", [this](const Request& request) { return tile(request); });
  add(
      "POST", "/map/places", [this](const Request& request) { return places(request); }, std::size_t{1} << 20);
  add("GET", "/map/local", [this](const Request& request) { return around(request); });
  add("GET", "/health/samples", TellSamples{&samples_, &login_});
}

void MapRoutes::stop() {
  stop_.request_stop();
  keeper_.stop();
  samples_.stop();
}

// Closures in these have names, since GCC 12 destroys what a temporary one in such an expression holds twice (its bug
// 99576).

Awaitable<Response> MapRoutes::tile(const Request& request) {
  const TileRequest wanted = tile_request(request);
  std::optional<TileSource::TileBytes> made;
  const std::function<void()> make = [&] { made = keeper_.tile_at_once(wanted).or_throw(); };
  co_await http_.work(Work::kComputes, request, make);
  if (!made) {
    const std::function<void()> ask = [&] { made = keeper_.tile(wanted).or_throw(); };
    co_await http_.work(Work::kAsksDaemon, request, ask);
  }
  Response response;
  response.type = "application/vnd.relmap.tile";
  if (*made)
    response.body = **made;
  else
    response.status = 204;
  // The layout of a version never changes. What tiles have beyond its points, from the daemon, may.
  response.cache = "private, max-age=600";
  co_return response;
}

Awaitable<Response> MapRoutes::places(const Request& request) {
  std::string found;
  const std::function<void()> find = [&] { found = keeper_.places_json(request.body).or_throw(); };
  co_await http_.work(Work::kComputes, request, find);
  co_return json(std::move(found));
}

Awaitable<Response> MapRoutes::around(const Request& request) {
  const LocalRequest wanted = local_request(request);
  // With the caller's own credentials, since what a removal would do is told to operators only.
  const std::string key = request.caller.token + '\n' + wanted.edge.to_string() + '\n' + request.parameter("metres") +
                          '\n' + (wanted.goes_with ? "goes:" + request.parameter("goes") : "");
  const std::function<Response()> ask = [&] {
    const auto client = connect(request.caller, kAnswerWithin);
    if (!client.ok()) return error_response(client.status());
    const auto laid = local_layout(wanted, **client);
    return laid.ok() ? json(json_of(*laid)) : error_response(laid.status());
  };
  Response response;
  const std::function<void()> make = [&] { response = around_.get(key, ask); };
  co_await http_.work(Work::kAsksDaemon, request, make);
  co_return response;
}

}  // namespace relmap::console
