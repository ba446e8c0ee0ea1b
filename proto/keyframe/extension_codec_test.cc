#include "proto/keyframe/extension_codec.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

Bytes encoded(const Extensions& extensions) {
  ByteWriter w;
  put_extensions(w, extensions);
  return w.take();
}

std::optional<Extensions> decoded(ByteSpan bytes) {
  ByteReader r(bytes);
  Extensions extensions = get_extensions(r);
  if (!r.at_end()) return std::nullopt;
  return extensions;
}

const Extensions kSome = {{1, {}}, {7, {1, 2, 3}}, {0xffffffff, Bytes(100, 9)}};

TEST(Extensions, DecodeToWhatWasEncoded) {
  EXPECT_EQ(decoded(encoded({})), Extensions());
  EXPECT_EQ(decoded(encoded(kSome)), kSome);
  EXPECT_EQ(encoded(kSome).size(), extension_bytes(kSome));
  const Extensions largest = {{1, Bytes(kMaxExtensionBytes - 10, 5)}};
  EXPECT_TRUE(check_extensions(largest).ok());
  EXPECT_EQ(decoded(encoded(largest)), largest);
}

TEST(Extensions, AreRefusedIfTruncated) {
  const Bytes bytes = encoded(kSome);
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(decoded(ByteSpan(bytes).first(size))) << size;
}

TEST(Extensions, AreLimitedInNumberAndSize) {
  Extensions many;
  for (std::uint32_t tag = 1; tag <= kMaxExtensions + 1; ++tag) many.push_back({tag, {}});
  EXPECT_EQ(check_extensions(many).reason(), Reason::BAD_SIZE);
  EXPECT_FALSE(decoded(encoded(many)));
  const Extensions large = {{1, Bytes(kMaxExtensionBytes - 20, 5)}, {2, {3}}};
  EXPECT_GT(extension_bytes(large), kMaxExtensionBytes - 10);
  const Extensions too_large = {{1, Bytes(kMaxExtensionBytes - 9, 5)}};
  EXPECT_EQ(check_extensions(too_large).reason(), Reason::BAD_SIZE);
  EXPECT_FALSE(decoded(encoded(too_large)));
  ByteWriter w;  // announces more bytes than there are
  w.put(std::uint16_t{1});
  w.put(std::uint32_t{5});
  w.put(std::uint32_t{0xffffffff});
  EXPECT_FALSE(decoded(w.bytes()));
}

TEST(Extensions, MustAscendByTag) {
  for (const Extensions& bad : {Extensions{{0, {}}}, Extensions{{5, {}}, {5, {}}}, Extensions{{6, {}}, {5, {}}}}) {
    EXPECT_EQ(check_extensions(bad).reason(), Reason::CORRUPT);
    EXPECT_FALSE(decoded(encoded(bad)));
  }
}

TEST(Extensions, KnownFieldsAreTakenOutAndAddedAgain) {
  Extensions some = kSome;
  EXPECT_EQ(take_extension(some, 7), (Bytes{1, 2, 3}));
  EXPECT_EQ(take_extension(some, 7), std::nullopt);
  EXPECT_EQ(some.size(), 2U);
  add_extension(some, 7, {1, 2, 3});
  EXPECT_EQ(some, kSome);
  add_extension(some, 7, {4});
  EXPECT_EQ(some.size(), 3U);
  EXPECT_EQ(some[1].bytes, Bytes{4});
}

}  // namespace
}  // namespace relmap
