// Any bytes as the body of a request of gRPC-Web, as trailers, and as the texts of its headers.
#include <string>

#include "proto/base/testing/fuzzing.h"
#include "tools/console/forward/grpc_web.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using fuzzing::must;
  const std::string_view text = fuzzing::text_of({data, size});
  constexpr std::size_t kLimit = 1024;
  const auto frames = console::frames_of(text);
  if (frames.ok()) {
    std::string again;
    for (const console::Frame& frame : *frames) {
      const std::string head = console::message_frame(frame.bytes);
      again += frame.trailers ? static_cast<char>(0x80) + head.substr(1) : head;
    }
    must(again == text);
  }
  const auto message = console::request_message(text, kLimit);
  if (message.ok()) must(message->size() <= kLimit && console::message_frame(*message) == text);
  const auto end = console::read_trailers(text);
  if (end.ok()) {
    const std::string written = console::trailers_frame({end->code, end->message, ""});
    const auto read = console::read_trailers(console::frames_of(written)->at(0).bytes);
    must(read.ok() && read->code == end->code && read->message == end->message);
  }
  if (const auto timeout = console::timeout_of(text)) must(timeout->count() >= 0);
  const std::size_t slash = text.find('/');
  if (slash != std::string_view::npos && console::is_forwarded(text.substr(0, slash), text.substr(slash + 1)))
    must(text.find_first_of("\r\n %") == std::string_view::npos && text.rfind('/') == slash);
  return 0;
}
