#include "tools/console/map_route.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "client/relmap_client.h"
#include "tools/console/layout/local_layout.h"

namespace relmap::console {

namespace {

using std::chrono::milliseconds;

constexpr std::chrono::seconds kLongestWait{25};
constexpr milliseconds kConnectWithin{5000}, kAnswerWithin{60'000}, kSampleWithin{5000};
constexpr double kFarthest = 1000;  // metres around a closure

template <typename Number>
std::optional<Number> number_in(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// The number that a parameter gives, or `otherwise` if it is not there.
template <typename Number>
Number parameter_of(const Request& request, const std::string& name, Number otherwise) {
  const std::string text = request.parameter(name);
  if (text.empty()) return otherwise;
  const auto number = number_in<Number>(text);
  if (!number) throw StatusError({Reason::INVALID_ARGUMENT, "'" + name + "' is no number that can be: " + text});
  return *number;
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

// What a layout says of itself changes when one of these does.
struct Shown {
  std::uint64_t version = 0, done = 0;
  std::string step;
  Reason error = Reason::OK, empty = Reason::OK;
  bool operator==(const Shown&) const = default;
};

Shown shown_of(const KeeperState& state) {
  Shown shown;
  if (state.layout) shown.version = state.layout->version;
  if (state.progress) shown.step = state.progress->step, shown.done = state.progress->done;
  shown.error = state.error.reason();
  shown.empty = state.empty.reason();
  return shown;
}

}  // namespace

MapRoutes::MapRoutes(std::string server, std::string authorities, std::string cache, const Login& login, Server& http)
    : server_(std::move(server)),
      authorities_(std::move(authorities)),
      http_(http),
      keeper_({.connect = [this, &login]() -> Result<std::unique_ptr<client::Client>> {
                 const auto caller = login.last_let_in();
                 if (!caller.ok()) return caller.status();
                 return connect(*caller, kAnswerWithin);
               },
               .cache_folder = std::move(cache),
               .log = [](const std::string& line) { std::cerr << line << std::endl; }}),
      samples_({.client = [this, &login]() -> Result<std::shared_ptr<client::Client>> {
        const auto caller = login.last_let_in();
        if (!caller.ok()) return caller.status();
        auto client = connect(*caller, kSampleWithin);
        if (!client.ok()) return client.status();
        return std::shared_ptr<client::Client>(std::move(*client));
      }}) {}

Result<std::unique_ptr<client::Client>> MapRoutes::connect(const Caller& caller,
                                                           std::chrono::milliseconds deadline) const {
  client::ClientOptions options;
  options.connect_timeout = kConnectWithin;
  options.deadline = deadline;
  options.token = caller.token;
  options.authorities = authorities_;
  return client::Client::connect(server_, std::move(options));
}

void MapRoutes::add_to(Router& router) {
  const auto add = [&](const char* method, const char* pattern,
                       Awaitable<Response> (MapRoutes::*answer)(const Request&),
                       std::size_t body_limit = std::size_t{64} << 10) {
    Route route{method, pattern, Access::kAuthorised,
                [this, answer](const Request& request) { return (this->*answer)(request); }};
    route.body_limit = body_limit;
    router.add(std::move(route));
  };
  add("GET", "/map/layout", &MapRoutes::state);
  add("GET", "/map/tiles/*/*/*/*", &MapRoutes::tile);
  add("POST", "/map/places", &MapRoutes::places, std::size_t{1} << 20);
  add("GET", "/map/local", &MapRoutes::around);
  add("GET", "/health/samples", &MapRoutes::samples);
}

void MapRoutes::stop() {
  keeper_.stop();
  samples_.stop();
}

Awaitable<Response> MapRoutes::state(const Request& request) {
  const auto after = parameter_of<std::uint64_t>(request, "after", 0);
  const auto wait = std::min<milliseconds>(
      milliseconds(static_cast<std::int64_t>(1000 * std::clamp(parameter_of<double>(request, "wait", 0), 0.0, 60.0))),
      kLongestWait);
  if (!request.parameter("after").empty() && wait.count() > 0) {
    const Shown before = shown_of(keeper_.state());
    if (before.version == after)
      co_await wait_until([&] { return shown_of(keeper_.state()) != before; }, std::chrono::steady_clock::now() + wait);
  }
  co_return json(keeper_.state_json());
}

Awaitable<Response> MapRoutes::tile(const Request& request) {
  const auto version = number_in<std::uint64_t>(request.parts.at(0));
  const auto z = number_in<std::uint32_t>(request.parts.at(1)), x = number_in<std::uint32_t>(request.parts.at(2)),
             y = number_in<std::uint32_t>(request.parts.at(3));
  if (!version || !z || !x || !y)
    co_return error_response({Reason::INVALID_ARGUMENT, "a tile is /map/tiles/VERSION/Z/X/Y"});
  TileRequest wanted;
  wanted.version = *version;
  wanted.tile = {*z, *x, *y};
  wanted.from = parameter_of<std::uint64_t>(request, "from", 0);
  if (const std::string root = request.parameter("root"); !root.empty()) {
    wanted.root = FrameId::parse(root);
    if (!wanted.root) co_return error_response({Reason::INVALID_ARGUMENT, "'" + root + "' is no frame: SESSION:INDEX"});
  }
  auto tile = co_await http_.on_worker([&] { return keeper_.tile(wanted); });
  if (!tile.ok()) co_return error_response(tile.status());
  Response response;
  response.type = "application/vnd.relmap.tile";
  if (!*tile)
    response.status = 204;
  else
    response.body = **tile;
  // A layout of a version never changes. What its tiles have beyond their layout's points, from the daemon, may.
  response.cache = "private, max-age=600";
  co_return response;
}

Awaitable<Response> MapRoutes::places(const Request& request) {
  auto places = co_await http_.on_worker([&] { return keeper_.places_json(request.body); });
  co_return places.ok() ? json(std::move(*places)) : error_response(places.status());
}

Awaitable<Response> MapRoutes::around(const Request& request) {
  LocalRequest wanted;
  const auto edge = EdgeId::parse(request.parameter("edge"));
  if (!edge)
    co_return error_response(
        {Reason::INVALID_ARGUMENT, "'" + request.parameter("edge") + "' is no closure: SESSION:INDEX/ORDINAL"});
  wanted.edge = *edge;
  wanted.metres = std::min(parameter_of<double>(request, "metres", wanted.metres), kFarthest);
  if (request.query.contains("goes")) wanted.goes_with = edges_in(request.parameter("goes"));
  // With the caller's own credentials, since what a removal would do is told to operators only.
  auto laid = co_await http_.on_worker([&]() -> Result<LocalLayout> {
    auto client = connect(request.caller, kAnswerWithin);
    if (!client.ok()) return client.status();
    return local_layout(wanted, **client);
  });
  co_return laid.ok() ? json(json_of(*laid)) : error_response(laid.status());
}

Awaitable<Response> MapRoutes::samples(const Request& request) {
  co_return json(samples_.samples_json(parameter_of<std::int64_t>(request, "since", 0)));
}

}  // namespace relmap::console
