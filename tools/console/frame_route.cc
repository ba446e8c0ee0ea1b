#include "tools/console/frame_route.h"

#include <utility>

#include "client/map_types.h"
#include "proto/base/bytes.h"
#include "proto/base/crc32c.h"
#include "proto/base/hex.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"

namespace relmap::console {

namespace {

constexpr char kGetFrame[] = "/relmap.v1.Map/GetFrame";
constexpr std::chrono::seconds kAnswerPatience{30};

std::string mark_of(std::uint32_t payload, const std::string& bytes) {
  const ByteSpan span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  return "\"" + hex(payload) + "-" + hex(crc32c(span)) + "\"";
}

Awaitable<Response> picture_of(DaemonLink& link, Login& login, const Request& request, bool whole) {
  const auto id = FrameId::parse(request.parts.at(0));
  if (!id || !id->valid())
    co_return error_response({Reason::INVALID_ARGUMENT, "'" + request.parts.at(0) + "' is no frame: SESSION:INDEX"});
  v1::GetFrameRequest question;
  *question.mutable_frame() = to_wire(*id);
  question.set_thumbnail(!whole);
  question.set_picture(whole);
  if (Status admitted = co_await login.admit(request.caller); !admitted.ok()) co_return error_response(admitted);
  CallOptions options;
  options.token = request.caller.token;
  options.timeout = kAnswerPatience;
  const auto answer = co_await link.ask(kGetFrame, question.SerializeAsString(), std::move(options));
  if (!answer.ok()) co_return error_response(answer.status());
  v1::GetFrameReply reply;
  if (!reply.ParseFromString(*answer))
    co_return error_response({Reason::CORRUPT, "the daemon's answer cannot be read: is it of another release?"});
  const v1::Frame& frame = reply.frame();
  std::string bytes = whole ? frame.picture().data() : frame.thumbnail();
  if (bytes.empty()) {
    Response none = error_response({Reason::UNSUPPORTED, whole && !frame.picture().message().empty()
                                                             ? frame.picture().message()
                                                             : "the map keeps no picture of this frame"});
    none.status = 404;
    co_return none;
  }
  Response response;
  response.type = "image/jpeg";
  response.etag = mark_of(frame.payload_crc32c(), bytes);
  response.cache = "private, no-cache";  // kept, and asked for again each time: another map may be served by then
  response.body = std::move(bytes);
  co_return response;
}

}  // namespace

void add_frames(DaemonLink& link, Login& login, Router& router) {
  for (const bool whole : {false, true})
    router.add({"GET", std::string("/frames/*/") + (whole ? "picture" : "thumbnail"), Access::kCaller,
                [&link, &login, whole](const Request& request) { return picture_of(link, login, request, whole); }});
}

}  // namespace relmap::console
