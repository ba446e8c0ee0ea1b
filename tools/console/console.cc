#include "tools/console/console.h"

#include <utility>

#include "proto/base/json.h"
#include "relmap/v1/status.pb.h"
#include "tools/console/forward_route.h"
#include "tools/console/frame_route.h"
#include "tools/console/http/page_files.h"

namespace relmap::console {

namespace {

constexpr char kGetStatus[] = "/relmap.v1.Map/GetStatus";

// By its socket the daemon takes the console for its operator; over TCP without TLS it lets everyone in.
Login::Kind kind_of(const DaemonLink& link) {
  if (link.is_socket()) return Login::Kind::kKey;
  return link.uses_tls() ? Login::Kind::kToken : Login::Kind::kNone;
}

struct AskRole {
  DaemonLink* link;
  Awaitable<Result<std::string>> operator()(std::string token, std::chrono::milliseconds patience) const {
    CallOptions options;
    options.token = std::move(token);
    options.timeout = patience;
    const Result<std::string> answer = co_await link->ask(kGetStatus, "", std::move(options));
    if (!answer.ok()) co_return answer.status();
    v1::GetStatusReply reply;
    if (!reply.ParseFromString(*answer))
      co_return Status(Reason::CORRUPT, "the daemon's answer cannot be read: is it of another release?");
    co_return reply.caller_role();
  }
};

struct TellAbout {
  std::string about;
  Awaitable<Response> operator()(const Request&) const {
    Response response;
    response.body = about;
    co_return response;
  }
};

}  // namespace

Result<std::unique_ptr<Console>> Console::start(const ConsoleOptions& options) {
  std::unique_ptr<Console> console(new Console);
  auto link = DaemonLink::open(options.server, options.authorities);
  if (!link.ok()) return link.status();
  auto server = Server::listen(options.http);
  if (!server.ok()) return server.status();
  if (!(*server)->is_local() && !(*server)->uses_tls() && !options.insecure)
    return Status(Reason::BAD_CONFIG,
                  "other machines are served over TLS only: give --tls-certificate, or --insecure if nobody who is not "
                  "trusted hears this network");
  console->server_ = std::move(*server);
  console->link_ = std::move(*link);
  console->login_ =
      std::make_unique<Login>(kind_of(*console->link_), AskRole{console->link_.get()}, console->server_->port());
  console->link_->on_refusal([login = console->login_.get()](const std::string& token) { login->refused(token); });

  Router router;
  add_page(built_in_page(), router);
  router.add({"GET", "/about", Access::kAnyone,
              TellAbout{Json()
                            .add("version", options.version)
                            .add("login", kind_name(console->login_->kind()))
                            .add("server", options.server)
                            .text()}});
  console->login_->add_routes(router);
  add_frames(*console->link_, *console->login_, router);
  console->map_ = std::make_unique<MapRoutes>(options.server, options.authorities, options.cache, *console->link_,
                                              *console->login_, *console->server_);
  console->map_->add_to(router);
  add_forwarding(*console->link_, *console->login_, router);
  console->server_->serve(std::move(router), console->login_->gate());
  return console;
}

Console::~Console() {
  if (map_) map_->stop();
  if (server_) server_->stop();  // not there if the start failed
  link_.reset();
  server_.reset();  // with the coroutines that still wait, which use the login
}

}  // namespace relmap::console
