// What is made of the texts of requests: targets, cookies, accepted encodings.
#include <gtest/gtest.h>
#include <zlib.h>

#include <random>
#include <string>

#include "tools/console/http/cookies.h"
#include "tools/console/http/gzip.h"
#include "tools/console/http/page_files.h"
#include "tools/console/http/router.h"

namespace relmap::console {
namespace {

TEST(Target, IsTakenApart) {
  std::string path;
  std::map<std::string, std::string> query;
  EXPECT_TRUE(parse_target("/map/tiles/7/0?from=6&root=3%3A120&empty", path, query).ok());
  EXPECT_EQ(path, "/map/tiles/7/0");
  EXPECT_EQ(query, (std::map<std::string, std::string>{{"from", "6"}, {"root", "3:120"}, {"empty", ""}}));
  for (const std::string bad : {"", "*", "http://localhost/", "/a?b=%", "/a?b=%zz", "/a b", "/\x01"})
    EXPECT_EQ(parse_target(bad, path, query).reason(), Reason::INVALID_ARGUMENT) << bad;
  std::string many = "/?";
  for (int i = 0; i < 40; ++i) many += "p" + std::to_string(i) + "=1&";
  EXPECT_EQ(parse_target(many, path, query).reason(), Reason::INVALID_ARGUMENT);
}

TEST(Router, FindsRoutesByMethodAndParts) {
  Router router;
  router.add({"GET", "/", Access::kAnyone});
  router.add({"GET", "/frames/*/picture"});
  router.add({"POST", "/*/*"});
  EXPECT_TRUE(router.find("GET", "/").ok());
  EXPECT_EQ(router.find("GET", "/frames/3%3a120/picture")->parts, std::vector<std::string>{"3:120"});
  EXPECT_EQ(router.find("POST", "/relmap.v1.Map/GetStatus")->parts,
            (std::vector<std::string>{"relmap.v1.Map", "GetStatus"}));
  EXPECT_EQ(router.find("GET", "/relmap.v1.Map/GetStatus").reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(router.find("DELETE", "/").reason(), Reason::UNSUPPORTED);
  for (const std::string none :
       {"/frames//picture", "/frames/1:2/picture/", "//", "/../etc/passwd", "/frames/../../etc/passwd"})
    EXPECT_EQ(router.find("GET", none).reason(), Reason::NO_SUCH_FILE) << none;
  EXPECT_EQ(router.find("GET", "/frames/%2/picture").reason(), Reason::INVALID_ARGUMENT);
}

TEST(Cookies, AreFoundByTheirWholeName) {
  using Values = std::vector<std::string_view>;
  EXPECT_EQ(cookies_in("relmap_token_8086=abc", "relmap_token_8086"), Values{"abc"});
  EXPECT_EQ(cookies_in("a=b; relmap_token_8086=abc; c=d", "relmap_token_8086"), Values{"abc"});
  EXPECT_EQ(cookies_in("xrelmap_token_8086=abc; relmap_token_80860=x", "relmap_token_8086"), Values{});
  EXPECT_EQ(cookies_in("t=abc; t=abc", "t"), Values{"abc"});
  EXPECT_EQ(cookies_in("t=abc; t=other", "t"), (Values{"abc", "other"})) << "somebody planted one";
  for (const std::string bad : {"", ";", "t", "t=", "t=\"a\"", "t=a\tb", "t=a\\b"})
    EXPECT_EQ(cookies_in(bad, "t"), Values{}) << bad;
  std::string many;
  for (int i = 0; i < 1000; ++i) many += "t=" + std::to_string(i) + "; ";
  EXPECT_EQ(cookies_in(many, "t").size(), kMaxSameCookies);
}

TEST(Cookies, AreKeptFromScriptsAndOtherSites) {
  EXPECT_EQ(set_cookie("t", "abc", false), "t=abc; Path=/; HttpOnly; SameSite=Strict");
  EXPECT_EQ(set_cookie("t", "abc", true), "t=abc; Path=/; HttpOnly; SameSite=Strict; Secure");
  EXPECT_TRUE(set_cookie("t", "", false).ends_with("; Max-Age=0"));
  EXPECT_TRUE(equal_in_constant_time("abc", "abc"));
  EXPECT_FALSE(equal_in_constant_time("abc", "abd"));
  EXPECT_FALSE(equal_in_constant_time("abc", "ab"));
  EXPECT_FALSE(is_cookie_value(std::string(4097, 'a')));
}

std::string unpacked(const std::string& bytes, std::size_t size) {
  std::string out(size + 1, '\0');
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  return out;
}

TEST(Gzip, GivesTheSameBytesBackAndOnlyWhereItPays) {
  std::mt19937 random(1);
  for (const std::size_t size : {0u, 10u, 1023u, 1024u, 5000u, 300'000u}) {
    std::string text, noise;
    for (std::size_t i = 0; i < size; ++i) {
      text += static_cast<char>('a' + random() % 3);
      noise += static_cast<char>(random());
    }
    const auto packed = gzip(text, Effort::kQuick);
    EXPECT_EQ(packed.has_value(), size >= 1024) << size;
    if (packed) {
      EXPECT_LT(packed->size(), text.size() * 9 / 10);
      EXPECT_EQ(unpacked(*packed, size), text);
    }
    EXPECT_FALSE(gzip(noise, Effort::kBest)) << size;
  }
}

TEST(Gzip, IsUsedForThoseWhoAcceptIt) {
  for (const std::string yes : {"gzip", "deflate, gzip;q=0.5, br", "GZIP", "br,gzip"})
    EXPECT_TRUE(accepts(yes, "gzip")) << yes;
  for (const std::string no : {"", "br", "gzip;q=0", "gzip; q=0.0", "xgzip", "identity"})
    EXPECT_FALSE(accepts(no, "gzip")) << no;
}

TEST(Page, IsPartOfTheProgram) {
  bool index = false;
  for (const PageFile& file : built_in_page()) {
    EXPECT_FALSE(file.bytes.empty()) << file.name;
    index = index || (file.name == "index.html" && file.bytes.find("</html>") != std::string_view::npos);
  }
  EXPECT_TRUE(index);
  Router router;
  add_page(built_in_page(), router);
  for (const char* const document : {"/", "/index.html", "/runbook.html"})
    EXPECT_TRUE(router.find("GET", document)->route->linked) << document;
  EXPECT_FALSE(router.find("GET", "/console.js")->route->linked);
  EXPECT_EQ(type_of("console.js"), "text/javascript; charset=utf-8");
  EXPECT_EQ(type_of("what"), "application/octet-stream");
}

}  // namespace
}  // namespace relmap::console
