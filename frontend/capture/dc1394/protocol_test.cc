#include "frontend/capture/dc1394/protocol.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>

namespace relmap::iidc::dc1394 {
namespace {

TEST(Iidc1394Protocol, MessagesComeAsTheyWereSent) {
  const auto frame = parse_message(bytes_of(Message::frame(3, 614400, -5, 2)));
  ASSERT_TRUE(frame.ok()) << frame.status().to_string();
  EXPECT_EQ(Tell::kFrame, frame->tell);
  EXPECT_EQ(3u, frame->values[0]);
  EXPECT_EQ(614400u, frame->values[1]);
  EXPECT_EQ(-5, static_cast<std::int64_t>(frame->values[2]));
  EXPECT_EQ(2u, frame->values[3]);

  const auto answer = parse_message(bytes_of(Message::answer(7, {Reason::NO_BANDWIDTH, "none is left"})));
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(7u, answer->number);
  EXPECT_EQ("NO_BANDWIDTH: none is left", answer->status().to_string());
  EXPECT_TRUE(Message::answer(8, {}).status().ok());
}

TEST(Iidc1394Protocol, LongTextsAndManyValuesAreCut) {
  const Message message = Message::fault({Reason::IO_ERROR, std::string(1000, 'x')});
  EXPECT_EQ(message.text.size() - 1, message.status().message().size());
  EXPECT_EQ(kMaxValues, Message::answer(1, {}).with(std::vector<std::uint64_t>(100)).count);
}

TEST(Iidc1394Protocol, RubbishIsRefusedByName) {
  const auto refusal = [](const Message& message) { return parse_message(bytes_of(message)).status().message(); };
  Message message = Message::hello();
  message.tell = static_cast<Tell>(9);
  EXPECT_EQ("message 9 is none", refusal(message));
  message = Message::hello();
  message.reason = static_cast<Reason>(60000);
  EXPECT_EQ("reason 60000 is none", refusal(message));
  message = Message::hello();
  message.count = 65;
  EXPECT_EQ("65 values are too many", refusal(message));
  message = Message::frame(0, 1, 0, 0);
  message.count = 3;
  EXPECT_EQ("3 values are too few", refusal(message));
  EXPECT_EQ("a fault without a reason", refusal(Message::fault({})));
  EXPECT_EQ("a packet of 5 bytes instead of " + std::to_string(sizeof(Message)),
            parse_message(bytes_of(message).first(5)).status().message());
  Request request;
  request.ask = static_cast<Ask>(0);
  EXPECT_EQ("request 0 is none", parse_request(bytes_of(request)).status().message());
  EXPECT_EQ(Reason::CORRUPT, parse_request({}).reason());
}

TEST(Iidc1394Protocol, TextsEndAndAreFitForTerminals) {
  Message message = Message::fault({Reason::IO_ERROR, "x"});
  message.text.fill('\x1b');
  const auto parsed = parse_message(bytes_of(message));
  ASSERT_TRUE(parsed.ok());
  EXPECT_EQ(std::string(message.text.size() - 1, '?'), parsed->status().message());
}

TEST(Iidc1394Protocol, AnyBytesAreAMessageOrNone) {
  std::mt19937 random(1);
  for (int i = 0; i < 20000; ++i) {
    Message message = Message::frame(0, 1, 0, 0);
    auto* const bytes = reinterpret_cast<std::uint8_t*>(&message);
    for (int flips = 1 + i % 4; flips > 0; --flips)
      bytes[random() % (i % 2 == 0 ? 16 : sizeof message)] = static_cast<std::uint8_t>(random());
    if (const auto parsed = parse_message(bytes_of(message)); parsed.ok()) {
      EXPECT_LE(parsed->count, kMaxValues);
      EXPECT_LT(parsed->status().message().size(), parsed->text.size());
    }
  }
}

}  // namespace
}  // namespace relmap::iidc::dc1394
