#include "tools/console/console.h"

#include <utility>

#include "proto/base/json.h"
#include "tools/console/forward_route.h"
#include "tools/console/frame_route.h"
#include "tools/console/http/page_files.h"

namespace relmap::console {

namespace {

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
  console->login_ = std::make_unique<Login>(*console->link_, console->server_->port());

  Router router;
  add_page(built_in_page(), router);
  router.add({"GET", "/about", Access::kAnyone,
              TellAbout{Json()
                            .add("version", options.version)
                            .add("login", kind_name(console->login_->kind()))
                            .add("server", options.server)
                            .text()}});
  console->login_->add_routes(router);
  add_frames(*console->link_, router);
  console->map_ = std::make_unique<MapRoutes>(options.server, options.authorities, options.cache, *console->login_,
                                              *console->server_);
  console->map_->add_to(router);
  add_forwarding(*console->link_, router);
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
