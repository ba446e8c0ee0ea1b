#include "server/rpc/watch_token.h"

#include <gtest/gtest.h>

#include "proto/base/bytes.h"
#include "proto/base/crc32c.h"
#include "proto/base/hex.h"

namespace relmap::rpc {
namespace {

const WatchToken kToken{{*Uuid::parse("00112233-4455-6677-8899-aabbccddeeff"), 1'764'000'000'000'000},
                        {123'456'789'012, storage::kMovedOrdinal}};

std::string with_check(const std::string& text) {
  return text + "." + hex(crc32c(ByteSpan(reinterpret_cast<const std::uint8_t*>(text.data()), text.size())));
}

TEST(WatchToken, IsReadAsItWasWritten) {
  EXPECT_EQ(read_watch_token(watch_token_text(kToken)).or_throw(), kToken);
  EXPECT_EQ(read_watch_token(watch_token_text({})).or_throw(), WatchToken());
  EXPECT_EQ(watch_token_text(kToken), with_check("1.00112233-4455-6677-8899-aabbccddeeff.1764000000000000.0."
                                                 "123456789012.4294967295"));
}

TEST(WatchToken, AnyChangeOfAByteIsNoticed) {
  const std::string text = watch_token_text(kToken);
  for (std::size_t i = 0; i < text.size(); ++i) {
    for (const char byte : {'0', '7', '.', 'f', '\0'}) {
      std::string other = text;
      if (std::exchange(other[i], byte) == byte) continue;
      EXPECT_EQ(read_watch_token(other).reason(), Reason::INVALID_ARGUMENT) << other;
    }
    EXPECT_EQ(read_watch_token(text.substr(0, i)).reason(), Reason::INVALID_ARGUMENT) << "cut off at " << i;
  }
  EXPECT_EQ(read_watch_token(text + "0").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(read_watch_token(std::string(100'000, '.')).reason(), Reason::INVALID_ARGUMENT);
}

TEST(WatchToken, OfAnotherVersionOrOwnerSaysSo) {
  for (const char* text :
       {"2.00112233-4455-6677-8899-aabbccddeeff.1.0.2.3", "1.00112233-4455-6677-8899-aabbccddeeff.1.1.2.3"}) {
    const auto read = read_watch_token(with_check(text));
    EXPECT_EQ(read.reason(), Reason::INVALID_ARGUMENT);
    EXPECT_EQ(read.status().message(), "the resume token is of a later version of relmapd");
  }
  EXPECT_FALSE(read_watch_token(with_check("1.00112233-4455-6677-8899-aabbccddeeff.1.0.-2.3")).ok());
  EXPECT_FALSE(read_watch_token(with_check("1.nobody.1.0.2.3")).ok());
}

}  // namespace
}  // namespace relmap::rpc
