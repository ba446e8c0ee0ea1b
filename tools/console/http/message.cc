#include "tools/console/http/message.h"

#include "proto/base/json.h"

namespace relmap::console {

unsigned http_status_of(Reason reason) {
  switch (reason) {
    case Reason::OK:
      return 200;
    case Reason::INVALID_ARGUMENT:
    case Reason::CORRUPT:
    case Reason::TRUNCATED:
    case Reason::BAD_NAME:
      return 400;
    case Reason::UNAUTHENTICATED:
      return 401;
    case Reason::NOT_ALLOWED:
      return 403;
    case Reason::NO_SUCH_FILE:
    case Reason::NO_SUCH_SESSION:
    case Reason::NO_SUCH_FRAME:
    case Reason::NO_SUCH_EDGE:
    case Reason::NO_SUCH_LABEL:
    case Reason::EMPTY_MAP:
    case Reason::VIEW_EXPIRED:
      return 404;
    case Reason::UNSUPPORTED:
      return 405;
    case Reason::WRONG_STATE:
    case Reason::WRONG_MAP:
      return 409;
    case Reason::BAD_SIZE:
      return 413;
    case Reason::RATE_LIMITED:
      return 429;
    case Reason::UNIMPLEMENTED:
      return 501;
    case Reason::UNREACHABLE:
      return 502;
    case Reason::BUDGET_EXCEEDED:
    case Reason::SHUTTING_DOWN:
    case Reason::READ_ONLY:
      return 503;
    case Reason::DEADLINE:
      return 504;
    default:
      return 500;
  }
}

Response error_response(const Status& status) {
  Response response;
  response.status = http_status_of(status.reason());
  response.body = Json().add("reason", reason_name(status.reason())).add("message", status.message()).text();
  return response;
}

}  // namespace relmap::console
