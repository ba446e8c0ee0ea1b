// Inputs of rpc_request_fuzz: calls, each with its method, the manner in which it is made and its requests. They mean
// something in the fuzzer's small map, in which session 1 has 50 frames, of which the last ten come back to where the
// first were, session 2 has six elsewhere, and session 3 has five where session 1 began.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/ingest.pb.h"
#include "relmap/v1/map.pb.h"
#include "tests/write_corpus.h"

namespace relmap::testing {

// Stands for what an earlier answer of the same input said: a token, and the mark of what an edit would remove.
inline constexpr char kHeard[] = "?";
inline constexpr std::uint64_t kShown = 1;

// The number that the fuzzer gives a method: those of Map, Ingest and Admin, in their order.
inline std::uint8_t number_of(const std::string& name) {
  std::uint8_t number = 0;
  for (const auto* file : {v1::LocaliseRequest::descriptor()->file(), v1::IngestRequest::descriptor()->file(),
                           v1::VerifyRequest::descriptor()->file()})
    for (int s = 0; s < file->service_count(); ++s)
      for (int m = 0; m < file->service(s)->method_count(); ++m, ++number)
        if (file->service(s)->method(m)->name() == name) return number;
  throw std::runtime_error("no method " + name);
}

class Calls {
 public:
  template <typename... Messages>
  Calls& call(const std::string& method, const Messages&... messages) {
    return whole_messages(0, method, messages...);
  }
  // The daemon has answered what is streamed before the stream ends; or the caller leaves after the first answer.
  template <typename... Messages>
  Calls& call_otherwise(const std::string& method, const Messages&... messages) {
    return whole_messages(64, method, messages...);
  }
  // Fields are set one by one, as the fuzzer reads them from bytes; it knows keyframes and views of the map.
  // `settled`: the daemon has done what the messages of a stream ask of it before the stream ends.
  Calls& fields(const std::string& method, int messages, std::initializer_list<int> bytes, bool settled = false) {
    constexpr int kSettled = 192;
    w_.put(number_of(method));
    w_.put(static_cast<std::uint8_t>((settled ? kSettled : 0) + 2 * messages));
    for (const int byte : bytes) w_.put(static_cast<std::uint8_t>(byte));
    return *this;
  }
  const Bytes& bytes() const { return w_.bytes(); }

 private:
  template <typename... Messages>
  Calls& whole_messages(std::size_t manner, const std::string& method, const Messages&... messages) {
    constexpr std::size_t kWholeMessages = 129;
    w_.put(number_of(method));
    w_.put(static_cast<std::uint8_t>(kWholeMessages + manner + 2 * sizeof...(messages)));
    const auto put = [&](const google::protobuf::Message& message) {
      const std::string bytes = message.SerializeAsString();
      w_.put(static_cast<std::uint16_t>(bytes.size()));
      w_.put_bytes(as_bytes(bytes));
    };
    (put(messages), ...);
    return *this;
  }

  ByteWriter w_;
};

template <typename Message>
Message with(auto set) {
  Message message;
  set(message);
  return message;
}

inline v1::FrameId frame(std::uint32_t session, std::uint32_t index) { return to_wire(FrameId{session, index}); }

}  // namespace relmap::testing
