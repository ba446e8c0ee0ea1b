#include "tools/console/forward/grpc_web.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace relmap::console {
namespace {

using namespace std::string_literals;

std::string random_bytes(std::mt19937& random, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(random());
  return bytes;
}

TEST(GrpcWeb, FramesAreReadAsTheyWereWritten) {
  std::mt19937 random(1);
  for (int round = 0; round < 200; ++round) {
    std::vector<std::string> messages(random() % 5);
    std::string body;
    for (std::string& message : messages) {
      message = random_bytes(random, random() % 4 == 0 ? 70'000 : random() % 20);
      body += message_frame(message);
    }
    const CallEnd end{static_cast<int>(random() % 17), random_bytes(random, random() % 30),
                      random_bytes(random, random() % 30)};
    body += trailers_frame(end);
    const auto frames = frames_of(body);
    ASSERT_TRUE(frames.ok()) << frames.status().to_string();
    ASSERT_EQ(frames->size(), messages.size() + 1);
    for (std::size_t i = 0; i < messages.size(); ++i) {
      EXPECT_FALSE((*frames)[i].trailers);
      EXPECT_EQ((*frames)[i].bytes, messages[i]);
    }
    EXPECT_TRUE(frames->back().trailers);
    const auto read = read_trailers(frames->back().bytes);
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(read->code, end.code);
    EXPECT_EQ(read->message, end.message);
  }
}

TEST(GrpcWeb, EveryCutBodyIsTruncated) {
  const std::string body = message_frame("abc") + message_frame("defgh");
  for (std::size_t size = 1; size < body.size(); ++size) {
    const auto frames = frames_of(std::string_view(body).substr(0, size));
    if (size == kFrameHead + 3)
      EXPECT_TRUE(frames.ok());
    else
      EXPECT_EQ(frames.reason(), Reason::TRUNCATED) << size;
  }
}

TEST(GrpcWeb, ARequestIsOneMessage) {
  EXPECT_EQ(*request_message(message_frame("abc"), 3), "abc");
  EXPECT_EQ(*request_message(message_frame(""), 3), "");
  EXPECT_EQ(request_message(message_frame("abcd"), 3).reason(), Reason::BAD_SIZE);
  EXPECT_EQ(request_message("", 3).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(request_message(message_frame("a") + message_frame("b"), 3).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(request_message(trailers_frame({}), 100).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(request_message("\x01\0\0\0\x01x"s, 3).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(request_message("\x02\0\0\0\x01x"s, 3).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(request_message("\0\xff\xff\xff\xffx"s, 3).reason(), Reason::TRUNCATED) << "nothing is reserved for it";
}

TEST(GrpcWeb, TrailersKeepTheirLinesApart) {
  const std::string frame = trailers_frame({7, "no\r\ngrpc-status:0", "\x01\x02"});
  const auto frames = frames_of(frame);
  EXPECT_EQ(frames->at(0).bytes,
            "grpc-status:7\r\ngrpc-message:no%0d%0agrpc-status%3a0\r\ngrpc-status-details-bin:AQI=\r\n");
  EXPECT_EQ(read_trailers("grpc-message:x\r\n").reason(), Reason::CORRUPT);
  EXPECT_EQ(read_trailers("grpc-status:x\r\n").reason(), Reason::CORRUPT);
}

TEST(GrpcWeb, TimeoutsHaveUnits) {
  using namespace std::chrono_literals;
  EXPECT_EQ(timeout_of("10S"), 10s);
  EXPECT_EQ(timeout_of("250m"), 250ms);
  EXPECT_EQ(timeout_of("99999999H"), 99999999h);
  EXPECT_EQ(timeout_of("1M"), 1min);
  EXPECT_EQ(timeout_of("7u"), 7us);
  EXPECT_EQ(timeout_of("7n"), 1us);
  for (const std::string bad : {"", "S", "10", "10s", "-1S", "1.5S", "100000000S", " 1S"})
    EXPECT_EQ(timeout_of(bad), std::nullopt) << bad;
}

TEST(GrpcWeb, OnlyMethodsOfTheDaemonAreForwarded) {
  EXPECT_TRUE(is_forwarded("relmap.v1.Map", "GetStatus"));
  EXPECT_TRUE(is_forwarded("grpc.health.v1.Health", "Check"));
  for (const auto& [service, method] :
       {std::pair("relmap.v1.", "GetStatus"), std::pair("relmap.v2.Map", "GetStatus"),
        std::pair("grpc.reflection.v1.ServerReflection", "ServerReflectionInfo"), std::pair("relmap.v1.Map", ""),
        std::pair("relmap.v1.Map", "Get/Status"), std::pair("relmap.v1.Map/x", "GetStatus"),
        std::pair("relmap.v1.Map", "Get\r\n")})
    EXPECT_FALSE(is_forwarded(service, method)) << service << "/" << method;
}

}  // namespace
}  // namespace relmap::console
