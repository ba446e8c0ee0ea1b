// A request as handlers see it, and what they answer.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/base/status.h"

namespace relmap::console {

template <typename T>
using Awaitable = boost::asio::awaitable<T>;

// By what a caller's calls to the daemon are made. The console judges nobody: it passes this on.
struct Caller {
  std::string token;  // of "authorization: Bearer TOKEN"; empty: the daemon asks for none
  // The address of who shows this token itself, and has no session: if it is wrong, that counts as a failed login.
  std::string from = {};
};

struct Request {
  std::string method;                                       // "GET" (also for HEAD) or "POST"
  std::string path;                                         // without the query, as it was sent
  std::map<std::string, std::string> query;                 // decoded
  std::vector<std::string> parts;                           // what stands for each "*" of the route's pattern, decoded
  std::map<std::string, std::string, std::less<>> headers;  // names in lower case; repeated ones joined by ", "
  std::string body;
  std::string peer;    // the address that it came from, without a port
  bool tls = false;    // whether this connection is of TLS
  Caller caller = {};  // for routes whose access is not kAnyone
  // Whether the browser has closed the connection. For the handler's own coroutine; empty: nobody knows.
  std::function<bool()> gone = {};

  std::string_view header(std::string_view name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? std::string_view() : std::string_view(found->second);
  }
  // The parameter as it was given; empty: there is none.
  std::string parameter(const std::string& name) const {
    const auto found = query.find(name);
    return found == query.end() ? std::string() : found->second;
  }
};

struct Response {
  unsigned status = 200;
  std::string type = "application/json";
  // Compressed where the caller accepts it and it pays, unless `encoding` says that it is already.
  std::string body = {};
  std::string encoding = {};
  std::string etag = {};  // with its quotes; a caller who has it gets 304. Empty: none
  std::string cache = "no-store";
  std::vector<std::pair<std::string, std::string>> headers = {};
};

// {"reason": "NO_SUCH_FRAME", "message": "..."} with the status that fits the reason.
Response error_response(const Status& status);
unsigned http_status_of(Reason reason);

// An answer of unknown length. Used by the coroutine of one connection only.
class ResponseStream {
 public:
  virtual ~ResponseStream() = default;
  // The head of the answer goes out with the first bytes. The request's body is not counted any more
  // (ServerOptions::max_bodies), so the handler must hold none of it by then.
  virtual void begin(Response head) = 0;
  // The daemon has let the caller in: to be said by handlers of Access::kCaller once they know.
  virtual void let_in() = 0;
  // Returns when the connection has taken the bytes, and so waits for a slow reader. Throws if the reader has gone.
  virtual Awaitable<void> write(std::string bytes) = 0;
  // Whether the reader has closed the connection; to be asked now and then by who waits for something to write.
  virtual bool gone() = 0;
};

// Handlers run on a thread of the server, and must not block it: what takes more than some milliseconds belongs into
// Server::work(). A StatusError that they throw is answered as error_response().
using Handler = std::function<Awaitable<Response>(const Request&)>;
// Answers by the stream, or returns an answer without having begun it. `request` lives until it ends.
using StreamHandler = std::function<Awaitable<std::optional<Response>>(Request& request, ResponseStream& stream)>;

// So much of a body is read of callers whom nobody has let in yet.
inline constexpr std::size_t kMaxUnjudgedBody = std::size_t{64} << 10;

enum class Access : std::uint8_t {
  kAnyone,      // no credentials are looked at
  kCaller,      // they are there; the daemon judges them with the call that the handler makes, so an answer below 400
                // says that it has let the caller in (for streams: ResponseStream::let_in())
  kAuthorised,  // the daemon has let the caller in within the last 15 seconds, for answers from the console's own
                // memory
};

struct Route {
  std::string method;   // GET serves HEAD, too
  std::string pattern;  // "/frames/*/thumbnail": each "*" is one part of the path, which is not empty
  Access access = Access::kCaller;
  Handler handler = {};
  StreamHandler stream = {};  // instead of `handler`
  std::size_t body_limit = kMaxUnjudgedBody;
  bool linked = false;  // a document of the page: links of other sites may lead to it
};

}  // namespace relmap::console
